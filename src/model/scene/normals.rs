//! Outward normals of solids.

use super::{Shape, Tables};
use crate::geom::{formula, half_space, implicit};
use crate::math::Vec3;
use crate::math::lanes::Lanes;
use glam::DVec3;

/// Returns the outward normal of the part of a primitive's surface that is nearest to each
/// `p`, of any length and in object space; +y for shapes that are no primitive solids.
#[inline(always)]
pub fn outward_normals<D: Lanes<Scalar = f64>>(
    tables: &Tables,
    shape: Shape,
    p: Vec3<D>,
) -> Vec3<D> {
    let up = Vec3::splat(DVec3::Y.to_array());
    match shape {
        Shape::HalfSpace(id) => Vec3::splat(tables.half_spaces.row(id).normal.to_array()),
        Shape::Sphere(id) => tables.spheres.row(id).normals_at(p),
        Shape::Ellipsoid(id) => tables.ellipsoids.row(id).normals_at(p),
        Shape::Cylinder(id) => tables.cylinders.upright(id).nearest(p).1,
        Shape::Cone(id) => tables.cones.upright(id).nearest(p).1,
        Shape::Quadric(id) => {
            let normals = tables.quadrics.row(id).normals_at(p);
            // An apex has no normal, so any direction serves.
            let zero = D::zero();
            let none = normals.max_abs().eq(zero);
            Vec3::select(none, up, normals)
        }
        Shape::Implicit(id) => {
            let (_, normals) = implicit::values_of(&tables.implicits.row(id), p);
            // A singular point has no normal either.
            let known = normals.max_abs().gt(D::zero());
            Vec3::select(known, normals, up)
        }
        Shape::LevelSet(id) => {
            let (_, normals) = formula::values_at(&tables.level_sets.formula[id.index()], p);
            let known = normals.max_abs().gt(D::zero());
            Vec3::select(known, normals, up)
        }
        Shape::Cuboid(id) => tables.cuboids.row(id).nearest(p).1,
        Shape::Polyhedron(id) => half_space::nearest(tables.polyhedra.planes(id), p).1,
        Shape::Polygon(_) | Shape::Mesh(_) | Shape::Combination(_) => up,
    }
}
