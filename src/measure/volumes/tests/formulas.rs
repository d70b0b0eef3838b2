//! Formulas and sums over triangles against quadrature, which shares nothing with them but
//! the placement of the solid.

use super::*;
use glam::{DAffine3, DVec2};
use lanecast_model::geom::hull;
use lanecast_model::geom::implicit::torus;
use lanecast_model::geom::{Cone, Ellipsoid, Prism};
use lanecast_model::scene::MeshData;
use lanecast_numerics::math::Aabb;

/// A shear, a rotation and unequal scales, and one that mirrors.
fn maps() -> [Affine; 3] {
    let sheared = [[1.0, 0.2, 0.0], [-0.4, 1.3, 0.3], [0.1, 0.0, 0.8]];
    let mirrored = [[0.6, 0.8, 0.0], [0.8, -0.6, 0.0], [0.0, 0.0, 1.0]];
    let flat = [[2.0, 0.0, 1.0], [0.0, 0.5, 0.0], [0.0, 0.1, 1.0]];
    [sheared, mirrored, flat].map(|linear| Affine::new(linear, [0.0; 3]))
}

fn inverse(map: &Affine) -> Affine {
    let [x, y, z] = map.linear().map(DVec3::from_array);
    let inverse = DAffine3 {
        matrix3: glam::DMat3::from_cols(x, y, z),
        translation: DVec3::ZERO,
    }
    .inverse();
    let columns = [inverse.x_axis, inverse.y_axis, inverse.z_axis];
    Affine::new(columns.map(|c| c.to_array()), [0.0; 3])
}

/// Relative error of quadrature where faces are flat, and where they are curved.
const FLAT: f64 = 3e-6;
const CURVED: f64 = 3e-4;

/// Measures a shape under each map by a formula, and compares with quadrature.
fn agrees(
    name: &str,
    (method, relative): (Method, f64),
    build: impl Fn(&mut SceneBuilder) -> ShapeId,
) {
    let mut scene = SceneBuilder::default();
    let shape = build(&mut scene);
    scene.instance("", Edge::shape(shape));
    let scene = scene.finish().unwrap();
    let goal = Goal {
        relative,
        ..Goal::default()
    };
    for map in maps() {
        let placed = Placed::new(&scene, shape, &map, &inverse(&map)).unwrap();
        let progress = Progress::default();
        let exact = placed.measure(&Goal::default(), &progress).unwrap();
        assert_eq!(exact.own.method, method, "{name}");
        let found = placed.by_quadrature(&goal, 1 << 23, &progress).unwrap();
        let (own, other) = (exact.own, found.body);
        let near = |what: &str, a: f64, b: f64, bound: f64| {
            assert!(
                (a - b).abs() <= bound,
                "{name}: {what} {a} {b}, bound {bound:e}"
            );
        };
        assert!(own.volume_error < 1e-12 * own.volume, "{name}: {own:?}");
        assert!(own.area_error < 1e-12 * own.area, "{name}: {own:?}");
        assert!(other.area_error < relative * own.area, "{name}: {other:?}");
        assert!(
            other.volume_error < relative * own.volume,
            "{name}: {other:?}"
        );
        near("volume", own.volume, other.volume, other.volume_error);
        near("area", own.area, other.area, other.area_error);
        // Own centroids are about different centres.
        let at = |p: DVec3, center: DVec3| center + p * exact.unit;
        let center = placed.bounds.center();
        let off = at(own.centroid, exact.center) - at(other.centroid, center);
        let bound = (other.centroid_error + own.centroid_error) * exact.unit;
        assert!(off.length() <= bound + 1e-15, "{name}: {off} {bound:e}");
        for k in 0..6 {
            near("moment", own.spread[k], other.spread[k], other.spread_error);
        }
    }
}

#[test]
fn formulas_agree_with_quadrature() {
    let [formula, flat] = [CURVED, FLAT].map(|relative| (Method::ClosedForm, relative));
    let center = DVec3::new(0.3, -2.0, 1.0);
    agrees("sphere", formula, |s| s.sphere("", ball(center, 0.7)));
    let radii = DVec3::new(0.5, 1.5, 0.2);
    agrees("ellipsoid", formula, |s| {
        s.ellipsoid("", Ellipsoid { center, radii })
    });
    let max = center + DVec3::new(1.0, 2.0, 0.5);
    agrees("box", flat, |s| s.cuboid("", Cuboid { min: center, max }));
    let cylinder = Cylinder {
        base: center,
        top: center + DVec3::new(0.2, 1.0, 0.4),
        radius: 0.6,
        open: false,
    };
    agrees("cylinder", formula, |s| s.cylinder("", cylinder));
}

#[test]
fn formulas_of_cones_and_what_else_is_curved_agree_with_quadrature() {
    let formula = (Method::ClosedForm, CURVED);
    let base = DVec3::new(0.3, -2.0, 1.0);
    for top_radius in [0.0, 0.25] {
        let cone = Cone {
            base,
            top: base + DVec3::new(0.2, 1.0, 0.4),
            base_radius: 0.75,
            top_radius,
            open: false,
        };
        agrees("cone", formula, |s| s.cone("", cone));
    }
    // 2x² + y² + 3z² + xy − yz + x − 2y ≤ 1.
    let coefficients = [2.0, 1.0, 3.0, 1.0, 0.0, -1.0, 1.0, -2.0, 0.0, -1.0];
    agrees("quadric", formula, |s| {
        s.quadric("", Quadric { coefficients })
    });
    agrees("torus", formula, |s| {
        s.implicit("", torus::tape_of(1.0, 0.3), false, None)
    });
}

#[test]
fn the_formula_of_prisms_agrees_with_quadrature() {
    let flat = (Method::ClosedForm, FLAT);
    let ring = |points: &[[f64; 2]]| points.iter().map(|p| DVec2::from_array(*p)).collect();
    let prism = Prism {
        outline: ring(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 0.6], [0.0, 2.0]]),
        holes: vec![ring(&[[0.25, 0.25], [0.5, 0.25], [0.25, 0.75]])],
        height: 0.75,
    };
    agrees("prism", flat, |s| s.prism("", prism.clone()));
}

/// The corners of a hull, whose faces have three corners to five.
fn corners() -> Vec<DVec3> {
    let mut points = vec![DVec3::new(0.5, 0.5, 2.0)];
    points.extend(Aabb::new(DVec3::ZERO, DVec3::ONE).corners());
    points
}

#[test]
fn polyhedra_and_meshes_agree_with_quadrature() {
    let hull = hull::of_points(&corners()).unwrap();
    agrees("polyhedron", (Method::Divergence, FLAT), |s| {
        s.polyhedron("", &hull.planes, &hull.points)
    });
    agrees("mesh", (Method::Divergence, FLAT), |s| {
        s.mesh("", &cube(DVec3::splat(0.1), false))
    });
}

/// A unit cube of triangles from `min` on, perhaps inside out.
fn cube(min: DVec3, is_turned: bool) -> MeshData {
    let positions = Aabb::new(min, min + DVec3::ONE).corners();
    let at = |p: DVec3| (positions.iter().position(|q| *q == min + p)).unwrap() as u32;
    let mut triangles = Vec::new();
    for k in 0..3 {
        let [w, u, v] = [k, (k + 1) % 3, (k + 2) % 3].map(|k| DVec3::AXES[k]);
        for (base, u, v) in [(w, u, v), (DVec3::ZERO, v, u)] {
            let face = [base, base + u, base + u + v, base + v].map(at);
            triangles.push([face[0], face[1], face[2]]);
            triangles.push([face[0], face[2], face[3]]);
        }
    }
    if is_turned {
        triangles.iter_mut().for_each(|t| t.swap(0, 1));
    }
    MeshData {
        positions: positions.iter().map(|p| p.to_array()).collect(),
        triangles,
        ..MeshData::default()
    }
}

/// A mesh that is inside out has the figures of its interior. Where two shells overlap,
/// the mesh has no inside by parity, and sums over triangles would count it twice.
#[test]
fn shells_count_by_parity() {
    let found = measured(|s| s.mesh("", &cube(DVec3::ZERO, true)));
    assert_eq!(found.method, Method::Divergence);
    assert!(
        (found.volume - 1.0).abs() <= found.volume_error,
        "{found:?}"
    );
    let mut both = cube(DVec3::ZERO, false);
    let other = cube(DVec3::new(0.5, 0.25, 0.25), false);
    both.positions.extend(other.positions);
    let moved = other.triangles.iter().map(|t| t.map(|v| v + 8));
    both.triangles.extend(moved);
    let found = measured_to(&coarse(), |s| s.mesh("", &both));
    assert_eq!(found.method, Method::Sampling);
    let overlap = 0.5 * 0.75 * 0.75;
    holds_to(&coarse(), &found, 2.0 - 2.0 * overlap, 12.0);
}
