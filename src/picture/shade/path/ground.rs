//! The ground that a scene was put on: for light it is a plane without end, and in the picture it
//! goes over into the backdrop.

use crate::scene::MaterialId;
use glam::DVec3;

/// A ground under a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// The ground's material, which nothing else has.
    pub material: MaterialId,
    /// The middle of the scene's box, and the radius of a ball about it.
    pub center: DVec3,
    pub radius: f64,
}

/// The ground begins and ends to fade at these multiples of the scene's radius.
const FADE: [f64; 2] = [3.0, 12.0];

impl Ground {
    /// Returns how much of the ground camera rays see at a point: all near the scene, nothing
    /// far away.
    pub fn opacity_at(&self, point: DVec3) -> f32 {
        let [near, far] = FADE;
        let distance = (point - self.center).length() / self.radius;
        let left = ((far - distance) / (far - near)).clamp(0.0, 1.0);
        (left * left * (3.0 - 2.0 * left)) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ground_fades_from_all_to_nothing() {
        let ground = Ground {
            material: MaterialId(0),
            center: DVec3::X,
            radius: 2.0,
        };
        let at = |distance: f64| ground.opacity_at(DVec3::X + DVec3::Z * 2.0 * distance);
        assert_eq!([at(0.0), at(3.0), at(12.0), at(1e9)], [1.0, 1.0, 0.0, 0.0]);
        assert!((at(7.5) - 0.5).abs() < 1e-6);
        assert!((1..100).all(|i| at(f64::from(i) / 8.0) <= at(f64::from(i - 1) / 8.0)));
    }
}
