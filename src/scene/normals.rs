//! Normals of solids.

use super::{Shape, Tables};
use crate::geom::half_space;
use glam::DVec3;

/// Outward, any length, object space, of the part of a primitive's surface that is
/// nearest to `p`. Of what is no primitive solid: +y.
pub fn outward_normal(tables: &Tables, shape: Shape, p: DVec3) -> DVec3 {
    match shape {
        Shape::HalfSpace(id) => tables.half_spaces.row(id).normal,
        Shape::Sphere(id) => tables.spheres.row(id).normal_at(p),
        Shape::Ellipsoid(id) => tables.ellipsoids.row(id).normal_at(p),
        Shape::Cylinder(id) => tables.cylinders.row(id).as_cone().normal_at(p),
        Shape::Cone(id) => tables.cones.row(id).normal_at(p),
        Shape::Quadric(id) => match tables.quadrics.row(id).normal_at(p) {
            // An apex has no normal; any is as good.
            DVec3::ZERO => DVec3::Y,
            normal => normal,
        },
        Shape::Cuboid(id) => tables.cuboids.row(id).normal_at(p),
        Shape::Polyhedron(id) => half_space::normal_at(tables.polyhedra.planes(id), p),
        Shape::Polygon(_) | Shape::Mesh(_) | Shape::Combination(_) => DVec3::Y,
    }
}
