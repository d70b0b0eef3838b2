//! Boxes of triangles and of placed shapes, and the limits within which a box in world
//! space is used.

use crate::geom::triangle::Corners;
use crate::math::{Aabb, Aabb32};
use crate::scene::Placement;
use glam::DVec3;

/// The largest [condition](Placement::conditioning) of a placement whose shape gets a box in world
/// space. Beyond it the rounding of the object ray, seen from the world, exceeds what
/// [`SKEW`](super::SKEW) has room for (docs/numerics/boxes.md, X7).
pub(super) const MAX_CONDITION: f64 = 4096.0;

/// The distance from the origin, in sizes of the scene, beyond which boxes count from the
/// scene's middle (docs/numerics/boxes.md, X10). A mesh that needs no transform lies within
/// eight of its own sizes and never counts as far.
pub(super) const FAR: f64 = 64.0;

/// Returns the exact box of a triangle; its corners are f32 already.
#[inline(always)]
pub fn corner_bounds(corners: &Corners) -> Aabb32 {
    let [a, b, c] = corners;
    let lower = |x: f32, y: f32| if x < y { x } else { y };
    let upper = |x: f32, y: f32| if x > y { x } else { y };
    Aabb32 {
        min: std::array::from_fn(|k| lower(lower(a[k], b[k]), c[k])),
        max: std::array::from_fn(|k| upper(upper(a[k], b[k]), c[k])),
    }
}

/// Returns the world-space box of a placed shape, given its own box `own` about `center`;
/// `None` if the placement's roundings leave no bound. The box grows by 5 roundings 2⁻⁵²
/// of its largest coordinate, for callers that count from another point (X8).
pub(super) fn world_bounds(own: &Aabb, place: &Placement, center: DVec3) -> Option<Aabb> {
    let own = Aabb::new(own.min + center, own.max + center);
    let world = own.placed(&place.object_from_world, &place.world_from_object)?;
    Some(world.grown(DVec3::splat(world.max_abs() * 5.0 * f64::EPSILON)))
}
