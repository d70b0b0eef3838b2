use crate::math::Aabb;
use glam::DVec3;

/// A finite circular cylinder from `base` to `top`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    pub base: DVec3,
    pub top: DVec3,
    /// > 0.
    pub radius: f64,
    /// Without caps: a surface, no inside.
    pub open: bool,
}

impl Cylinder {
    pub fn bounds(&self) -> Aabb {
        super::cone::frustum_bounds(self.base, self.radius, self.top, self.radius)
    }
}
