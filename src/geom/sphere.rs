use crate::math::Aabb;
use glam::DVec3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    pub center: DVec3,
    /// > 0.
    pub radius: f64,
}

impl Sphere {
    pub fn bounds(&self) -> Aabb {
        Aabb::new(self.center, self.center).grown(DVec3::splat(self.radius))
    }
}
