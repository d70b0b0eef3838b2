use crate::math::Aabb;
use glam::DVec3;

/// Axis-parallel; turn it with a transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    pub center: DVec3,
    /// Each > 0.
    pub radii: DVec3,
}

impl Ellipsoid {
    pub fn bounds(&self) -> Aabb {
        Aabb::new(self.center, self.center).grown(self.radii)
    }
}
