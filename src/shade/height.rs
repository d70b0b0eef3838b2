//! How far a point lies from a primitive's surface, to first order: what a hit's
//! t is refined by, and what is left then.
//!
//! A hit says which primitive; its t is as good as the lanes' type. In f64, one or
//! two of Newton's steps along the ray make the point one of the surface up to the
//! rounding of f64 coordinates, whatever the lanes were.

use crate::accel::World;
use crate::geom::HalfSpace;
use crate::math::{length, unit};
use crate::scene::Shape;
use glam::DVec3;

/// A point against the surface below it, in object space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Height {
    /// Outward; to first order in it.
    pub above: f64,
    /// Outward, unit.
    pub normal: DVec3,
}

/// Steps, at most: each at least halves the height, as a rule squares it.
const STEPS: usize = 4;

/// t and the height there, of the ray's hit near `t` on a primitive. A step that
/// does not lead nearer is not taken: at a silhouette, or where f64 ends.
pub(super) fn refined(
    world: &World,
    (shape, primitive): (Shape, u32),
    (org, dir): (DVec3, DVec3),
    mut t: f64,
) -> (f64, Height) {
    let at = |t: f64| height(world, shape, primitive, org + dir * t);
    let mut here = at(t);
    for _ in 0..STEPS {
        let next = t - here.above / here.normal.dot(dir);
        let there = at(next);
        let nearer = there.above.abs() <= 0.5 * here.above.abs();
        if !(next.is_finite() && next > 0.0 && nearer) || here.above == 0.0 {
            break;
        }
        (t, here) = (next, there);
    }
    (t, here)
}

fn height(world: &World, shape: Shape, primitive: u32, p: DVec3) -> Height {
    let scene = world.scene;
    match shape {
        Shape::HalfSpace(id) => over_plane(&scene.half_spaces.row(id), p),
        Shape::Polyhedron(id) => scene
            .polyhedra
            .planes(id)
            .iter()
            .map(|plane| over_plane(plane, p))
            .min_by(|a, b| a.above.abs().total_cmp(&b.above.abs()))
            .unwrap_or(Height {
                above: 0.0,
                normal: DVec3::Y,
            }),
        Shape::Sphere(id) => {
            let sphere = scene.spheres.row(id);
            let out = p - sphere.center;
            Height {
                above: length(out) - sphere.radius,
                normal: unit(out),
            }
        }
        Shape::Ellipsoid(id) => {
            let row = scene.ellipsoids.row(id);
            let scaled = (p - row.center) / row.radii;
            let gradient = scaled / row.radii;
            // Σ(x/r)² − 1 over the length of its gradient.
            let over = (length(scaled) - 1.0) * (length(scaled) + 1.0);
            Height {
                above: over / (2.0 * length(gradient)),
                normal: unit(gradient),
            }
        }
        Shape::Cylinder(id) => over_cone(scene.cylinders.row(id).as_cone().nearest(p)),
        Shape::Cone(id) => over_cone(scene.cones.row(id).nearest(p)),
        Shape::Cuboid(id) => {
            let (above, normal) = scene.cuboids.row(id).nearest(p);
            Height { above, normal }
        }
        Shape::Quadric(id) => {
            let (value, gradient, _) = scene.quadrics.row(id).value_at(p);
            let steep = length(gradient);
            Height {
                above: value / steep,
                normal: gradient / steep,
            }
        }
        Shape::Polygon(id) => {
            let polygon = scene.polygons.row(id);
            over_point(polygon.points[0], polygon.normal, p)
        }
        Shape::Combination(_) => unreachable!("an operand's surface is met"),
        Shape::Mesh(id) => {
            let corners = scene.meshes.row(id).corners(primitive as usize);
            let [a, b, c] = corners.map(|p| DVec3::from_array(p.map(f64::from)));
            over_point(a, (b - a).cross(c - a), p)
        }
    }
}

fn over_plane(plane: &HalfSpace, p: DVec3) -> Height {
    let size = length(plane.normal);
    Height {
        above: (plane.normal.dot(p) - plane.offset) / size,
        normal: plane.normal / size,
    }
}

/// Over the plane through a point, with a normal of any length.
fn over_point(on: DVec3, normal: DVec3, p: DVec3) -> Height {
    let normal = unit(normal);
    Height {
        above: (p - on).dot(normal),
        normal,
    }
}

fn over_cone((above, normal): (f64, DVec3)) -> Height {
    Height {
        above,
        normal: unit(normal),
    }
}
