//! Normals where primitives are met: gradients of their definitions, in f64
//! (docs/numerics/oracle.md, O6).

use super::meet::Primitive;
use super::ray::{Ray, dot};
use super::{implicit, level_set};
use crate::geom::Cone;
use crate::scene::Shape;

/// Returns the normal at t in object space: outward, of any length; of triangles and
/// polygons by their winding. Zero where the surface has none (a cone's apex, a node), and
/// for CSG solids.
pub fn normal(primitive: &Primitive, ray: &Ray, t: f64, face: usize) -> [f64; 3] {
    let scene = primitive.scene;
    let from =
        |p: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| (ray.org[k] - p[k]) + t * ray.dir[k]) };
    match primitive.shape {
        Shape::HalfSpace(id) => scene.half_spaces.row(id).normal.to_array(),
        Shape::Polyhedron(id) => scene.polyhedra.planes(id)[face].normal.to_array(),
        Shape::Cuboid(_) => std::array::from_fn(|k| {
            if face % 3 != k {
                0.0
            } else if face < 3 {
                -1.0
            } else {
                1.0
            }
        }),
        Shape::Sphere(id) => from(scene.spheres.row(id).center.to_array()),
        Shape::Ellipsoid(id) => {
            let row = scene.ellipsoids.row(id);
            let (w, r) = (from(row.center.to_array()), row.radii.to_array());
            std::array::from_fn(|k| w[k] / r[k] / r[k])
        }
        Shape::Quadric(id) => {
            let [a, b, c, d, e, f, g, h, i, _] = scene.quadrics.row(id).coefficients;
            let [x, y, z] = from([0.0; 3]);
            [
                2.0 * a * x + d * y + e * z + g,
                2.0 * b * y + d * x + f * z + h,
                2.0 * c * z + e * x + f * y + i,
            ]
        }
        Shape::Cone(id) => cone_normal(&scene.cones.row(id), from, face),
        Shape::Cylinder(id) => {
            let row = scene.cylinders.row(id);
            let cone = Cone {
                base: row.base,
                top: row.top,
                base_radius: row.radius,
                top_radius: row.radius,
                open: row.open,
            };
            cone_normal(&cone, from, face)
        }
        Shape::Polygon(id) => scene.polygons.row(id).normal.to_array(),
        Shape::Implicit(id) => implicit::gradient(scene.implicits.row(id).tape, from([0.0; 3])),
        Shape::LevelSet(id) => level_set::normal(&scene.level_sets.row(id), ray, t),
        Shape::Combination(_) => [0.0; 3],
        Shape::Mesh(id) => {
            let corners = scene.meshes.row(id).corners(primitive.triangle as usize);
            let [a, b, c] = corners.map(|p| p.map(f64::from));
            let (u, v) = (less(b, a), less(c, a));
            [
                u[1] * v[2] - u[2] * v[1],
                u[2] * v[0] - u[0] * v[2],
                u[0] * v[1] - u[1] * v[0],
            ]
        }
    }
}

fn cone_normal(cone: &Cone, from: impl Fn([f64; 3]) -> [f64; 3], face: usize) -> [f64; 3] {
    let base = cone.base.to_array();
    let axis = less(cone.top.to_array(), base);
    if face > 0 {
        return axis.map(|x| if face == 1 { -x } else { x });
    }
    // The direction away from the axis, tilted by the rate at which the side widens, in
    // units of the axis. Near the apex it is still a direction, where the gradient of the
    // squared side is only roundings.
    let size = axis.iter().fold(0.0, |m, x| f64::max(m, x.abs()));
    let (a, w) = (axis.map(|x| x / size), from(base).map(|x| x / size));
    let s = dot(w, a) / dot(a, a);
    let radial: [f64; 3] = std::array::from_fn(|k| w[k] - s * a[k]);
    let widening = (cone.top_radius - cone.base_radius) / size / dot(a, a);
    let distance = dot(radial, radial).sqrt();
    if distance == 0.0 {
        return a.map(|x| x * if widening > 0.0 { -1.0 } else { 1.0 });
    }
    std::array::from_fn(|k| radial[k] / distance - widening * a[k])
}

fn less(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}
