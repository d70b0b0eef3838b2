//! How far a point lies from a primitive's surface, to first order: what a hit's
//! t is refined by, and what is left then.
//!
//! A hit says which primitive; its t is as good as the lanes' type. In f64, one or
//! two of Newton's steps along the ray make the point one of the surface up to the
//! rounding of f64 coordinates, whatever the lanes were.

use super::surface::facets;
use crate::accel::World;
use crate::geom::{formula, half_space, implicit};
use crate::math::lanes::{Lanes, Mask};
use crate::math::{Vec3, units};
use crate::scene::Shape;
use glam::DVec3;

/// Points against the surface below them, in object space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Height<D> {
    /// Outward; to first order in it.
    pub above: D,
    /// Outward, unit.
    pub normal: Vec3<D>,
}

/// Steps, at most: each at least halves the height, as a rule squares it.
const STEPS: usize = 4;

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
    let at = |t: D| below.height(world, org + dir * t);
    let (zero, half) = (D::zero(), D::splat(0.5));
    let mut here = at(t);
    let mut more = !here.above.eq(zero);
    for _ in 0..STEPS {
        if more.none() {
            break;
        }
        let next = t - here.above / here.normal.dot(dir);
        let there = at(next);
        let nearer = there.above.abs().le(half * here.above.abs());
        let met = next.lt(D::splat(f64::INFINITY)) & next.gt(zero);
        more = more & met & nearer;
        t = D::select(more, next, t);
        here = Height {
            above: D::select(more, there.above, here.above),
            normal: Vec3::select(more, there.normal, here.normal),
        };
        more = more & !here.above.eq(zero);
    }
    (t, here)
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
        let scene = world.scene;
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
                    normal: units(Vec3::splat(polygon.normal.to_array())),
                }
            }
            solid => Below::Solid(solid),
        }
    }

    #[inline(always)]
    fn height(&self, world: &World, p: Vec3<D>) -> Height<D> {
        let scene = world.scene;
        let unit = |(above, normal): (D, Vec3<D>)| Height {
            above,
            normal: units(normal),
        };
        let solid = match self {
            Below::Planes { on, normal } => {
                return Height {
                    above: (p - *on).dot(*normal),
                    normal: *normal,
                };
            }
            Below::Solid(solid) => *solid,
        };
        match solid {
            Shape::HalfSpace(id) => {
                let (above, normal) = scene.half_spaces.row(id).nearest(p);
                Height { above, normal }
            }
            Shape::Polyhedron(id) => {
                let (above, normal, _) = half_space::nearest(scene.polyhedra.planes(id), p);
                Height { above, normal }
            }
            Shape::Sphere(id) => {
                let sphere = scene.spheres.row(id);
                let out = p - Vec3::splat(sphere.center.to_array());
                unit((out.length() - D::splat(sphere.radius), out))
            }
            Shape::Ellipsoid(id) => {
                let row = scene.ellipsoids.row(id);
                let radii = row.radii.to_array();
                let scaled = (p - Vec3::splat(row.center.to_array())).by(radii);
                let gradient = scaled.by(radii);
                // Σ(x/r)² − 1 over the length of its gradient.
                let (length, one) = (scaled.length(), D::splat(1.0));
                let over = (length - one) * (length + one);
                unit((over / (D::splat(2.0) * gradient.length()), gradient))
            }
            Shape::Cylinder(id) => unit(scene.cylinders.upright(id).nearest(p)),
            Shape::Cone(id) => unit(scene.cones.upright(id).nearest(p)),
            Shape::Cuboid(id) => {
                let (above, normal) = scene.cuboids.row(id).nearest(p);
                Height { above, normal }
            }
            Shape::Implicit(id) => {
                let (value, gradient) = implicit::values_at(&scene.implicits.tape[id.index()], p);
                let steep = gradient.length();
                Height {
                    above: value / steep,
                    normal: gradient / steep,
                }
            }
            Shape::LevelSet(id) => {
                let formula = &scene.level_sets.formula[id.index()];
                let (value, gradient) = formula::values_at(formula, p);
                let steep = gradient.length();
                Height {
                    above: value / steep,
                    normal: gradient / steep,
                }
            }
            Shape::Quadric(id) => {
                let (value, gradient, _) = scene.quadrics.row(id).values_at(p);
                let steep = gradient.length();
                Height {
                    above: value / steep,
                    normal: gradient / steep,
                }
            }
            Shape::Mesh(_) | Shape::Polygon(_) | Shape::Combination(_) => Height {
                above: D::zero(),
                normal: Vec3::splat(DVec3::Y.to_array()),
            },
        }
    }
}
