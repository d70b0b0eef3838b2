//! Circular cylinders: cones whose radii are equal.

use super::cone::Cone;
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
    #[inline(always)]
    pub fn as_cone(&self) -> Cone {
        Cone {
            base: self.base,
            top: self.top,
            base_radius: self.radius,
            top_radius: self.radius,
            open: self.open,
        }
    }

    pub fn bounds(&self) -> Aabb {
        self.as_cone().bounds()
    }
}
