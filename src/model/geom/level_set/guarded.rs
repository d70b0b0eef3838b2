//! Meets level sets one ray at a time, because one search defines where a ray meets them.

use crate::geom::exact::meet_per_lane;
use crate::geom::guarded::ObjectRay;
use crate::geom::{LevelSet, Meet, Scratch};
use crate::math::lanes::Lanes;

/// Returns where rays first meet the surface beyond t_min; no lane is undecided.
#[inline(never)]
pub fn meet<L: Lanes>(
    row: &LevelSet,
    object: &ObjectRay<L>,
    active: L::Mask,
    scratch: &mut Scratch,
) -> Meet<L> {
    meet_per_lane(row, object, active, scratch)
}
