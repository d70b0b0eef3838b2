//! Boxes around placed shapes, as tight as formulas make them.

use glam::DVec3;
use lanecast_model::geom::Cone;
use lanecast_model::geom::implicit::torus;
use lanecast_model::scene::{Scene, Shape, ShapeId, shape_bounds};
use lanecast_numerics::math::{Aabb, Affine};

/// A box around a solid.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    pub bounds: Aabb,
    /// The solid touches all six sides, to roundings.
    pub is_tight: bool,
}

impl Extent {
    pub const NOTHING: Extent = Extent {
        bounds: Aabb::EMPTY,
        is_tight: true,
    };

    pub fn union(&self, other: &Extent) -> Extent {
        Extent {
            bounds: self.bounds.union(&other.bounds),
            is_tight: self.is_tight && other.is_tight,
        }
    }

    pub fn moved(&self, by: DVec3) -> Extent {
        let Aabb { min, max } = self.bounds;
        Extent {
            bounds: Aabb::new(min + by, max + by),
            ..*self
        }
    }
}

/// Returns the box of a bounded shape under a map. `looks_at_vertices`: that of a mesh is
/// made from all its vertices, and not from its own box.
pub fn extent(scene: &Scene, id: ShapeId, map: &Affine, looks_at_vertices: bool) -> Extent {
    let point = |p: DVec3| DVec3::from_array(map.point(p.to_array()));
    let vector = |v: DVec3| DVec3::from_array(map.vector(v.to_array()));
    // An ellipsoid of these semi-axes reaches as far as the roots of its rows' squares.
    let round = |center: DVec3, axes: &[DVec3]| {
        let squares: DVec3 = axes.iter().map(|v| vector(*v) * vector(*v)).sum();
        let reach = DVec3::from_array(squares.to_array().map(f64::sqrt));
        Aabb::new(point(center) - reach, point(center) + reach)
    };
    let discs = |cone: &Cone| {
        let axis = cone.top - cone.base;
        let axis = (axis / axis.abs().max_element()).normalize();
        let (e, f) = axis.any_orthonormal_pair();
        let base = round(cone.base, &[e * cone.base_radius, f * cone.base_radius]);
        base.union(&round(
            cone.top,
            &[e * cone.top_radius, f * cone.top_radius],
        ))
    };
    let tight = match scene.shapes.row(id) {
        Shape::Sphere(id) => {
            let row = scene.spheres.row(id);
            Some(round(
                row.center,
                &DVec3::AXES.map(|axis| axis * row.radius),
            ))
        }
        Shape::Ellipsoid(id) => {
            let row = scene.ellipsoids.row(id);
            let axes = [0, 1, 2].map(|k| DVec3::AXES[k] * row.radii[k]);
            Some(round(row.center, &axes))
        }
        Shape::Cuboid(id) => {
            let corners = scene.cuboids.row(id).bounds().corners();
            Some(Aabb::of_points(corners.map(point)))
        }
        Shape::Cylinder(id) => Some(discs(&scene.cylinders.row(id).as_cone())),
        Shape::Cone(id) => Some(discs(&scene.cones.row(id))),
        Shape::Polyhedron(id) => {
            let points = scene.polyhedra.points(id).iter();
            Some(Aabb::of_points(points.map(|p| point(*p))))
        }
        Shape::Prism(id) => {
            let row = scene.prisms.row(id);
            let corners = row.rings().flatten().flat_map(|p| {
                let [low, high] = [0.0, row.height()].map(|z| p.extend(z));
                [point(low), point(high)]
            });
            Some(Aabb::of_points(corners))
        }
        Shape::Implicit(id) => {
            let radii = torus::radii_of(scene.implicits.row(id).tape);
            // A disc of the middle's radius, and a ball of the tube's around each point.
            radii.map(|[major, minor]| {
                let disc = round(DVec3::ZERO, &[DVec3::X * major, DVec3::Z * major]);
                let ball = round(DVec3::ZERO, &DVec3::AXES.map(|axis| axis * minor));
                disc.grown(ball.extent() * 0.5)
            })
        }
        Shape::Mesh(id) if looks_at_vertices => {
            let mesh = scene.meshes.row(id);
            let place = |p: &[f32; 3]| point(DVec3::from_array(p.map(f64::from)) + mesh.center);
            Some(Aabb::of_points(mesh.positions.iter().map(place)))
        }
        _ => None,
    };
    let placed = |own: Aabb| Aabb::of_points(own.corners().map(point));
    match tight.filter(|bounds| bounds.is_finite()) {
        Some(bounds) => Extent {
            bounds,
            is_tight: true,
        },
        None => Extent {
            bounds: shape_bounds(scene, id).map_or(Aabb::EMPTY, placed),
            is_tight: false,
        },
    }
}
