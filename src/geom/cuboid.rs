use crate::math::Aabb;
use glam::DVec3;

/// An axis-parallel box (`box` is a word of the language).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    pub min: DVec3,
    /// > `min` on every axis.
    pub max: DVec3,
}

impl Cuboid {
    pub fn bounds(&self) -> Aabb {
        Aabb::new(self.min, self.max)
    }
}
