//! Boxes around shapes in object space. They are conservative: no point of a shape lies
//! outside.

use super::ids::ShapeId;
use super::{Shape, Tables};
use crate::geom::polygon::room;
use crate::math::Aabb;
use glam::DVec3;

/// Returns the box around a shape; `None` for shapes without bounds.
pub fn shape_bounds(tables: &Tables, shape: ShapeId) -> Option<Aabb> {
    let of = |points: &[DVec3]| Aabb::of_points(points.iter().copied());
    match tables.shapes.row(shape) {
        Shape::HalfSpace(_) => None,
        Shape::Sphere(id) => Some(outward(tables.spheres.row(id).bounds())),
        Shape::Ellipsoid(id) => Some(outward(tables.ellipsoids.row(id).bounds())),
        // These boxes are already rounded outward.
        Shape::Quadric(id) => tables.quadrics.row(id).bounds(),
        Shape::Implicit(id) => tables.implicits.bounds[id.index()],
        Shape::LevelSet(id) => tables.level_sets.bounds[id.index()],
        Shape::Cylinder(id) => Some(tables.cylinders.row(id).bounds()),
        Shape::Cone(id) => Some(tables.cones.row(id).bounds()),
        Shape::Cuboid(id) => Some(tables.cuboids.row(id).bounds()),
        // The planes define the solid; its corners lie on them to one part in 10¹⁰
        // (`geom::hull` refuses sharper corners).
        Shape::Polyhedron(id) => {
            let bounds = of(tables.polyhedra.points(id));
            let size = bounds.max_abs() + bounds.diagonal();
            Some(bounds.grown(DVec3::splat(size * 2e-10)))
        }
        Shape::Polygon(id) => Some(room(tables.polygons.points(id))),
        Shape::Mesh(id) => Some(outward(tables.meshes.row(id).bounds())),
        Shape::Combination(id) => tables.combinations.bounds.get(id.index()).copied()?,
    }
}

/// Grows a box by one step on every side, because corners are rounded sums.
fn outward(b: Aabb) -> Aabb {
    let step = |v: DVec3, f: fn(f64) -> f64| DVec3::from_array(v.to_array().map(f));
    Aabb::new(step(b.min, f64::next_down), step(b.max, f64::next_up))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{HalfSpace, Sphere};
    use crate::scene::SceneBuilder;

    #[test]
    fn a_box_holds_what_rounding_would_lose() {
        let mut scene = SceneBuilder::default();
        let center = DVec3::splat(1.0);
        let ball = scene.sphere(
            "",
            Sphere {
                center,
                radius: 1e-20,
            },
        );
        let ground = scene.half_space(
            "",
            HalfSpace {
                normal: DVec3::Y,
                offset: 0.0,
            },
        );
        let bounds = shape_bounds(scene.tables(), ball).unwrap();
        assert!(bounds.min.x < 1.0 && bounds.max.x > 1.0);
        assert_eq!(shape_bounds(scene.tables(), ground), None);
    }
}
