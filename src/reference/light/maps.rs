//! Maps from random numbers to directions, and frames, in f64.

use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

/// An orthonormal frame about a unit vector.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    pub x: DVec3,
    pub y: DVec3,
    pub z: DVec3,
}

/// Which of the two formulas of a frame is used where the axis lies in the plane between them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Half {
    /// That of the axis's own half space.
    #[default]
    Own,
    /// The other.
    Other,
}

impl Frame {
    /// Makes a frame (Duff et al. 2017, listing 3). The formula jumps where z changes its sign.
    pub fn about(z: DVec3) -> Frame {
        Frame::of_half(z, Half::Own)
    }

    /// Makes a frame by the formula of one half space.
    pub fn of_half(z: DVec3, half: Half) -> Frame {
        let own = if z.z < 0.0 { -1.0 } else { 1.0 };
        let sign = match half {
            Half::Own => own,
            Half::Other => -own,
        };
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Frame {
            x: DVec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: DVec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    pub fn to_world(self, v: DVec3) -> DVec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    pub fn to_local(self, v: DVec3) -> DVec3 {
        DVec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }
}

/// Maps the square to the unit disc (Shirley and Chiu 1997): radius and angle of a point.
fn concentric([u, v]: [f64; 2]) -> (f64, f64) {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return (0.0, 0.0);
    }
    match a.abs() > b.abs() {
        true => (a, FRAC_PI_4 * (b / a)),
        false => (b, FRAC_PI_2 - FRAC_PI_4 * (a / b)),
    }
}

/// Returns a direction of density cos θ/π: the disc, projected upwards (Malley).
pub fn cosine_hemisphere(u: [f64; 2]) -> DVec3 {
    let (r, angle) = concentric(u);
    let (s, c) = libm::sincos(angle);
    // f32 keeps z above 0 where r rounds to 1.
    let z2 = ((1.0 - r) * (1.0 + r)).max(f64::from(f32::EPSILON) * 0.5);
    DVec3::new(r * c, r * s, z2.sqrt())
}

/// Returns the direction with 1 − cos θ = `versine` and the azimuth 2πv.
pub fn cap(versine: f64, v: f64) -> DVec3 {
    let sin = (versine * (2.0 - versine)).max(0.0).sqrt();
    let (s, c) = libm::sincos(TAU * v);
    DVec3::new(sin * c, sin * s, 1.0 - versine)
}
