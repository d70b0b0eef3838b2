//! First-order distance of a point from a primitive's surface: it refines a hit's t and
//! bounds the error that remains.
//!
//! A hit names its primitive; its t is as accurate as the lanes' type. In f64, one or
//! two Newton steps along the ray bring the point onto the surface up to the rounding
//! of f64 coordinates, whatever the type of the lanes.

use super::surface::facets;
use crate::accel::World;
use crate::geom::{formula, half_space, implicit};
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Mask};
use crate::math::{Vec3, unit, units, units_and_lengths};
use crate::scene::Shape;
use glam::DVec3;

/// First-order distance of points from the surface, in object space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Height<D> {
    /// Signed distance to first order, positive outside.
    pub above: D,
    /// Unit outward normal; zero where a polynomial or level set has no gradient.
    pub normal: Vec3<D>,
    /// Length of the gradient for an implicit function; 1 for other shapes.
    pub slope: D,
}

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
    (t, below.height(here))
}

/// Returns the first-order distance of points from a solid.
#[inline(always)]
pub(super) fn height_at<D: Lanes<Scalar = f64>>(
    world: &World,
    solid: Shape,
    at: Vec3<D>,
) -> Height<D> {
    let below = Below::Solid(solid);
    below.height(below.value(world, at))
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
            Shape::Polygon(id) => {
                let polygon = scene.polygons.row(id);
                Below::Planes {
                    on: Vec3::splat(polygon.points[0].to_array()),
                    normal: Vec3::splat(unit(polygon.normal).to_array()),
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
        let scene = &world.scene;
        let solid = match self {
            Below::Planes { on, normal } => return ((p - *on).dot(*normal), *normal),
            Below::Solid(solid) => *solid,
        };
        let two = D::splat(2.0);
        match solid {
            Shape::HalfSpace(id) => scene.half_spaces.row(id).nearest(p),
            Shape::Polyhedron(id) => half_space::nearest(scene.polyhedra.planes(id), p),
            Shape::Cylinder(id) => scene.cylinders.upright(id).nearest(p),
            Shape::Cone(id) => scene.cones.upright(id).nearest(p),
            Shape::Cuboid(id) => scene.cuboids.row(id).nearest(p),
            Shape::Sphere(id) => {
                let sphere = scene.spheres.row(id);
                let out = p - Vec3::splat(sphere.center.to_array());
                let squared = D::splat(sphere.radius * sphere.radius);
                (out.length_squared() - squared, out * two)
            }
            Shape::Ellipsoid(id) => {
                let row = scene.ellipsoids.row(id);
                let shrink = |v: Vec3<D>| {
                    let [x, y, z] = row.radii.to_array().map(|r| D::splat(1.0 / r));
                    Vec3::new(v.x * x, v.y * y, v.z * z)
                };
                let scaled = shrink(p - Vec3::splat(row.center.to_array()));
                let value = scaled.length_squared() - D::splat(1.0);
                (value, shrink(scaled) * two)
            }
            Shape::Implicit(id) => implicit::values_of(&scene.implicits.row(id), p),
            Shape::LevelSet(id) => formula::values_at(&scene.level_sets.formula[id.index()], p),
            Shape::Quadric(id) => {
                let (value, gradient, _) = scene.quadrics.row(id).values_at(p);
                (value, gradient)
            }
            Shape::Mesh(_) | Shape::Polygon(_) | Shape::Combination(_) => {
                (D::zero(), Vec3::splat(DVec3::Y.to_array()))
            }
        }
    }

    /// Converts a [`value`](Self::value) and its gradient to a distance.
    #[inline(always)]
    fn height(&self, (value, gradient): (D, Vec3<D>)) -> Height<D> {
        match self {
            Below::Solid(
                Shape::Sphere(_)
                | Shape::Ellipsoid(_)
                | Shape::Implicit(_)
                | Shape::LevelSet(_)
                | Shape::Quadric(_),
            ) => {
                let (mut normal, slope) = units_and_lengths(gradient);
                if let Below::Solid(Shape::Quadric(_)) = self {
                    // An apex has no normal; any unit vector serves.
                    let none = normal.max_abs().eq(D::zero());
                    normal = Vec3::select(none, Vec3::splat(DVec3::Y.to_array()), normal);
                }
                Height {
                    above: value / slope,
                    normal,
                    slope,
                }
            }
            _ => Height {
                above: value,
                normal: gradient,
                slope: D::splat(1.0),
            },
        }
    }
}
