//! First-order distance of a point from a primitive's surface: it refines a hit's t and
//! bounds the error that remains.
//!
//! A hit names its primitive; its t is as accurate as the lanes' type. In f64, one or
//! two Newton steps along the ray bring the point onto the surface up to the rounding
//! of f64 coordinates, whatever the type of the lanes.

use super::surface::facets;
use crate::accel::World;
use crate::geom::primitive::Height;
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Mask};
use crate::math::{Vec3, units};
use crate::scene::Shape;

/// Maximum number of Newton steps. An accepted step at least halves the function's
/// value, and usually squares the error.
const STEPS: usize = 4;

/// Steps that move the point by less than this relative to the largest coordinate of
/// its terms are not taken: 8 unit roundoffs.
const STILL: f64 = 8.0 * UNIT;

/// Refines `t` of the rays' hits on a shape's primitives, one hit per lane, and returns
/// it with the distance that remains there. A step that does not bring the point closer
/// is rejected, as happens at a silhouette or at the limit of f64.
#[inline(always)]
pub(super) fn refined<D: Lanes<Scalar = f64>>(
    world: &World,
    shape: Shape,
    primitives: &[u32],
    (org, dir): (Vec3<D>, Vec3<D>),
    mut t: D,
) -> (D, Height<D>) {
    let below = Below::of(world, shape, primitives);
    let at = |t: D| below.value(world, org + dir * t);
    let (zero, half) = (D::zero(), D::splat(0.5));
    let mut here = at(t);
    let mut more = !here.0.eq(zero);
    let reach = org.max_abs().max((dir * t).max_abs());
    let still = D::splat(STILL) * reach / dir.max_abs();
    for _ in 0..STEPS {
        let step = here.0 / here.1.dot(dir);
        let next = t - step;
        let met = next.lt(D::splat(f64::INFINITY)) & next.gt(zero);
        more = more & met & step.abs().gt(still);
        if more.none() {
            break;
        }
        let there = at(next);
        more = more & there.0.abs().le(half * here.0.abs());
        t = D::select(more, next, t);
        here.0 = D::select(more, there.0, here.0);
        here.1 = Vec3::select(more, there.1, here.1);
    }
    (t, below.height(world, here))
}

/// Returns the first-order distance of points from a solid.
#[inline(always)]
pub(super) fn height_at<D: Lanes<Scalar = f64>>(
    world: &World,
    solid: Shape,
    at: Vec3<D>,
) -> Height<D> {
    let below = Below::Solid(solid);
    below.height(world, below.value(world, at))
}

/// The surface that the distance is measured from.
enum Below<D> {
    /// Planes through points, with unit normals.
    Planes {
        on: Vec3<D>,
        normal: Vec3<D>,
    },
    Solid(Shape),
}

impl<D: Lanes<Scalar = f64>> Below<D> {
    #[inline(always)]
    fn of(world: &World, shape: Shape, primitives: &[u32]) -> Below<D> {
        let scene = &world.scene;
        match shape {
            Shape::Mesh(id) => {
                let [a, b, c] = facets(&scene.meshes.row(id), primitives);
                Below::Planes {
                    on: a,
                    normal: units((b - a).cross(c - a)),
                }
            }
            solid => Below::Solid(solid),
        }
    }

    /// Evaluates a function that is zero on the surface and positive outside, and its
    /// gradient. For planes, boxes and the like these already are the distance and the
    /// unit normal; [`height`](Self::height) converts the others.
    #[inline(always)]
    fn value(&self, world: &World, p: Vec3<D>) -> (D, Vec3<D>) {
        match self {
            Below::Planes { on, normal } => ((p - *on).dot(*normal), *normal),
            Below::Solid(solid) => world.scene.nearest(*solid, p),
        }
    }

    /// Converts a [`value`](Self::value) and its gradient to a distance.
    #[inline(always)]
    fn height(&self, world: &World, (above, normal): (D, Vec3<D>)) -> Height<D> {
        match self {
            Below::Planes { .. } => Height {
                above,
                normal,
                slope: D::splat(1.0),
            },
            Below::Solid(solid) => world.scene.height(*solid, (above, normal)),
        }
    }
}
