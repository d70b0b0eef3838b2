//! Level sets: one ray at a time in every kernel, for where a ray meets them is what one
//! search says.

use crate::geom::exact::meet_per_lane;
use crate::geom::guarded::ObjectRay;
use crate::geom::{LevelSet, Meet};
use crate::math::lanes::Lanes;

/// Where rays first meet the surface beyond t_min: there is no doubt.
#[inline(never)]
pub fn meet<L: Lanes>(row: &LevelSet, object: &ObjectRay<L>, active: L::Mask) -> Meet<L> {
    meet_per_lane(row, object, active)
}
