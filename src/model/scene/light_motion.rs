//! Lights that move: keys over the time of a sequence, from 0 to 1.
//!
//! Between two keys every number of a light goes straight: places, directions, edges, colours,
//! angles and radii. Where a direction's mean vanishes, it is that of the key before. Times
//! outside take the nearest key's.

use super::ids::LightId;
use super::lights::Light;
use super::materials::Rgb;
use glam::DVec3;
use std::ops::Range;

/// The keys of all lights that move.
#[derive(Clone, Debug, Default)]
pub struct LightMotions {
    /// The lights that move, rising.
    pub of: Vec<LightId>,
    /// Per row: its range of `keys`, with the first key at time 0.
    pub ranges: Vec<Range<u32>>,
    /// A time, and the light then, which is of one kind at all keys.
    pub keys: Vec<(f64, Light)>,
}

impl LightMotions {
    pub(super) fn push(&mut self, of: LightId, keys: &[(f64, Light)]) {
        let first = self.keys.len() as u32;
        self.keys.extend_from_slice(keys);
        self.of.push(of);
        self.ranges.push(first..self.keys.len() as u32);
    }

    pub fn is_empty(&self) -> bool {
        self.of.is_empty()
    }

    /// Sets the lights that move to a time.
    pub(super) fn set_time(&self, lights: &mut [Light], time: f64) {
        for (of, range) in self.of.iter().zip(&self.ranges) {
            let keys = &self.keys[range.start as usize..range.end as usize];
            let after = keys.partition_point(|(at, _)| *at <= time);
            let (a, b) = (&keys[after.saturating_sub(1)], keys.get(after));
            lights[of.index()] = match b {
                Some(b) if time > a.0 => between(&a.1, &b.1, (time - a.0) / (b.0 - a.0)),
                _ => a.1,
            };
        }
    }

    pub fn bytes(&self) -> usize {
        self.of.len() * (size_of::<LightId>() + size_of::<Range<u32>>())
            + self.keys.len() * size_of::<(f64, Light)>()
    }
}

/// Returns the light at a share `s` of the way from one to another of its kind.
fn between(a: &Light, b: &Light, s: f64) -> Light {
    let number = |a: f64, b: f64| a * (1.0 - s) + b * s;
    let vector = |a: DVec3, b: DVec3| a * (1.0 - s) + b * s;
    let color = |a: Rgb, b: Rgb| -> Rgb {
        std::array::from_fn(|k| number(f64::from(a[k]), f64::from(b[k])) as f32)
    };
    let axis = |a: DVec3, b: DVec3| match vector(a, b) {
        DVec3::ZERO => a,
        mean => mean,
    };
    match (*a, *b) {
        (
            Light::Point {
                position,
                intensity,
                falloff,
                radius,
            },
            Light::Point {
                position: to,
                intensity: bright,
                radius: wide,
                ..
            },
        ) => Light::Point {
            position: vector(position, to),
            intensity: color(intensity, bright),
            falloff,
            radius: number(radius, wide),
        },
        (
            Light::Spot {
                position,
                direction,
                intensity,
                inner,
                outer,
                radius,
            },
            Light::Spot {
                position: to,
                direction: towards,
                intensity: bright,
                inner: inmost,
                outer: outmost,
                radius: wide,
            },
        ) => Light::Spot {
            position: vector(position, to),
            direction: axis(direction, towards),
            intensity: color(intensity, bright),
            inner: number(inner, inmost),
            outer: number(outer, outmost),
            radius: number(radius, wide),
        },
        (
            Light::Directional {
                direction,
                irradiance,
                angle,
            },
            Light::Directional {
                direction: towards,
                irradiance: bright,
                angle: wide,
            },
        ) => Light::Directional {
            direction: axis(direction, towards),
            irradiance: color(irradiance, bright),
            angle: number(angle, wide),
        },
        (
            Light::Rectangle {
                center,
                edges: [u, v],
                radiance,
                two_sided,
            },
            Light::Rectangle {
                center: to,
                edges: [right, up],
                radiance: bright,
                ..
            },
        ) => {
            // The mean of two right angles is none; the second edge is made one again.
            let u = vector(u, right);
            let v = vector(v, up);
            let upright = v - u * (v.dot(u) / u.length_squared());
            Light::Rectangle {
                center: vector(center, to),
                edges: [u, upright],
                radiance: color(radiance, bright),
                two_sided,
            }
        }
        (
            Light::Disc {
                center,
                normal,
                radius,
                radiance,
                two_sided,
            },
            Light::Disc {
                center: to,
                normal: towards,
                radius: wide,
                radiance: bright,
                ..
            },
        ) => Light::Disc {
            center: vector(center, to),
            normal: axis(normal, towards),
            radius: number(radius, wide),
            radiance: color(radiance, bright),
            two_sided,
        },
        // Keys of one light are of one kind.
        _ => *a,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_go_straight_and_are_met_at_keys() {
        let spot = |x: f64| Light::Spot {
            position: DVec3::new(x, 1.0, 0.0),
            direction: DVec3::new(x - 1.0, 0.0, 0.0),
            intensity: [x as f32; 3],
            inner: 0.1 * x,
            outer: 0.2 * x,
            radius: x,
        };
        let still = Light::Directional {
            direction: DVec3::X,
            irradiance: [1.0; 3],
            angle: 0.0,
        };
        let mut motions = LightMotions::default();
        motions.push(LightId(1), &[(0.0, spot(0.5)), (0.5, spot(1.5))]);
        let at = |time| {
            let mut lights = [still, spot(9.0)];
            motions.set_time(&mut lights, time);
            assert_eq!(lights[0], still);
            lights[1]
        };
        for (time, x) in [
            (-1.0, 0.5),
            (0.0, 0.5),
            (0.125, 0.75),
            (0.5, 1.5),
            (2.0, 1.5),
        ] {
            assert_eq!(at(time), spot(x), "{time}");
        }
        // The mean of opposite directions is none.
        let Light::Spot { direction, .. } = at(0.25) else {
            panic!("a spot light stays one");
        };
        assert_eq!(direction, DVec3::new(-0.5, 0.0, 0.0));
    }

    #[test]
    fn edges_of_rectangles_keep_their_right_angle() {
        let rectangle = |u: DVec3, v: DVec3| Light::Rectangle {
            center: DVec3::ZERO,
            edges: [u, v],
            radiance: [1.0; 3],
            two_sided: false,
        };
        let [a, b] = [
            rectangle(DVec3::X, DVec3::Y * 2.0),
            rectangle(DVec3::new(0.6, 0.8, 0.0), DVec3::Z * 3.0),
        ];
        let Light::Rectangle { edges: [u, v], .. } = between(&a, &b, 0.4) else {
            panic!("a rectangle stays one");
        };
        assert!(u.dot(v).abs() < 1e-15);
    }
}
