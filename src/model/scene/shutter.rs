//! The shutter of a camera: when it is open within a frame, and how much light it lets in.

/// When a shutter is open, about the time of its frame. The unit is the time from one frame of a
/// sequence to the next; of a single picture, the whole motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shutter {
    /// When it begins to open: 0 is the frame's own time, and negative values are before it.
    pub open: f64,
    /// When it is closed again; not before `open`.
    pub close: f64,
    pub shape: ShutterShape,
}

/// How much light a shutter lets in while it is open.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum ShutterShape {
    /// All light all the time.
    #[default]
    Box,
    /// It opens evenly over the share `rise` of its time, and closes evenly over the share
    /// `fall`; their sum is at most 1.
    Trapezoid { rise: f64, fall: f64 },
}

impl ShutterShape {
    /// Returns a place in the shutter's time, from 0 to 1, with a density that follows the light:
    /// the least place up to which the share `u`, in [0, 1), of all light has come in.
    pub fn place(self, u: f64) -> f64 {
        match self {
            ShutterShape::Box => u,
            ShutterShape::Trapezoid { rise, fall } => {
                let all = 1.0 - 0.5 * (rise + fall);
                let light = u * all;
                let left = all - light;
                if light < 0.5 * rise {
                    (2.0 * rise * light).sqrt()
                } else if left < 0.5 * fall {
                    1.0 - (2.0 * fall * left).sqrt()
                } else {
                    light + 0.5 * rise
                }
            }
        }
    }

    /// Returns the share of the light that has come in up to a place in the shutter's time, the
    /// inverse of [`place`](Self::place).
    pub fn light(self, place: f64) -> f64 {
        let v = place.clamp(0.0, 1.0);
        match self {
            ShutterShape::Box => v,
            ShutterShape::Trapezoid { rise, fall } => {
                let all = 1.0 - 0.5 * (rise + fall);
                let light = if v < rise {
                    0.5 * v * v / rise
                } else if v > 1.0 - fall {
                    all - 0.5 * (1.0 - v) * (1.0 - v) / fall
                } else {
                    v - 0.5 * rise
                };
                light / all
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_follow_the_light() {
        let trapezoid = |rise, fall| ShutterShape::Trapezoid { rise, fall };
        let shapes = [
            ShutterShape::Box,
            trapezoid(0.25, 0.25),
            trapezoid(0.0, 0.5),
            trapezoid(1.0, 0.0),
            trapezoid(0.3, 0.7),
        ];
        for shape in shapes {
            for i in 0..=1000 {
                let u = f64::from(i) / 1000.0;
                let place = shape.place(u);
                assert!((0.0..=1.0).contains(&place), "{shape:?} {u}");
                assert!((shape.light(place) - u).abs() < 1e-12, "{shape:?} {u}");
            }
        }
        // A triangle is half open in its middle.
        assert!((trapezoid(0.5, 0.5).place(0.5) - 0.5).abs() < 1e-15);
        assert!((trapezoid(0.5, 0.5).place(0.125) - 0.25).abs() < 1e-15);
    }
}
