//! How far a point lies from a primitive's surface, to first order: what a hit's
//! t is refined by, and what is left then.
//!
//! A hit says which primitive; its t is as good as the lanes' type. In f64, one or
//! two of Newton's steps along the ray make the point one of the surface up to the
//! rounding of f64 coordinates, whatever the lanes were.

use super::surface::facets;
use crate::accel::World;
use crate::geom::primitive::Height;
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Mask};
use crate::math::{Vec3, units};
use crate::scene::Shape;

/// Steps, at most: each at least halves what is zero on the surface, as a rule squares it.
const STEPS: usize = 4;

/// A step is none that moves the point by less than this many roundings of the largest
/// coordinate that it is made of.
const STILL: f64 = 8.0 * UNIT;

/// t and the height there, of the rays' hits near `t` on a shape's primitives, one a
/// lane. A step that does not lead nearer is not taken: at a silhouette, or where f64
/// ends.
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

/// The height of points on a solid.
#[inline(always)]
pub(super) fn height_at<D: Lanes<Scalar = f64>>(
    world: &World,
    solid: Shape,
    at: Vec3<D>,
) -> Height<D> {
    let below = Below::Solid(solid);
    below.height(world, below.value(world, at))
}

/// What the height is measured from.
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

    /// A function that is zero on the surface, and positive outside; and its gradient:
    /// the height and the unit normal themselves, unless [`height`](Self::height) makes
    /// them of these.
    #[inline(always)]
    fn value(&self, world: &World, p: Vec3<D>) -> (D, Vec3<D>) {
        match self {
            Below::Planes { on, normal } => ((p - *on).dot(*normal), *normal),
            Below::Solid(solid) => world.scene.nearest(*solid, p),
        }
    }

    /// Of a [`value`](Self::value).
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
