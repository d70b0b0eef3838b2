//! Rays from far away at corners and rims of oblique operands, where several faces have
//! nearly one t and error bounds that differ.

use super::asked::{Asked, RIGHT};
use crate::common::{Random, RayColumns, campaign, kernels};
use glam::{DAffine3, DVec3};
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::geom::{Cone, Cuboid, Cylinder, HalfSpace};
use lanecast::internals::math::{Aabb, Affine};
use lanecast::internals::reference::Reference;
use lanecast::internals::scene::{Edge, Operand, Operator, SceneBuilder, ShapeId};
use lanecast::internals::trace::HitId;

const RAYS: usize = 512;

/// A shape within a cube of ±1, and points where its faces come together.
fn shape(b: &mut SceneBuilder, kind: u64) -> (ShapeId, Vec<DVec3>) {
    let (min, max) = (DVec3::splat(-1.0), DVec3::splat(1.0));
    let corners = Aabb::new(min, max).corners();
    let (base, top, open) = (-DVec3::Y, DVec3::Y, false);
    let rims = |at_top: f64| {
        let across = [DVec3::X, DVec3::Z, -DVec3::X, -DVec3::Z];
        let rim = |a: DVec3| [a - DVec3::Y, a * at_top + DVec3::Y];
        across.into_iter().flat_map(rim).collect()
    };
    match kind {
        0 => (b.cuboid("", Cuboid { min, max }), corners.to_vec()),
        1 => {
            let sides = DVec3::AXES.iter().flat_map(|axis| [*axis, -*axis]);
            let planes = sides.map(|normal| HalfSpace {
                normal,
                offset: 1.0,
            });
            let planes: Vec<HalfSpace> = planes.collect();
            (b.polyhedron("", &planes, &corners), corners.to_vec())
        }
        2 => {
            let row = Cylinder {
                base,
                top,
                radius: 1.0,
                open,
            };
            (b.cylinder("", row), rims(1.0))
        }
        _ => {
            let row = Cone {
                base,
                top,
                base_radius: 1.0,
                top_radius: 0.5,
                open,
            };
            (b.cone("", row), rims(0.5))
        }
    }
}

#[test]
fn corners_of_oblique_operands_are_met_as_the_reference_says() {
    let (mut hits, solids) = (0, campaign(160));
    for seed in 0..solids as u64 {
        let random = &mut Random(seed);
        let axis = |r: &mut Random| libm::exp10(r.unit() * 3.0);
        let stretch = DVec3::new(axis(random), axis(random), axis(random));
        let map = random.oblique(stretch);
        let map = DAffine3::from_translation(random.vector() * 2.0) * map;
        let mut points = Vec::new();
        let asked = Asked::new(|b| {
            let operand;
            (operand, points) = shape(b, seed % 4);
            let operand = Operand::shape(operand).transform(b.transform(map.into()));
            let solid = b.csg("", Operator::Union, &[operand]);
            b.instance("", Edge::shape(solid));
        });
        let reference = Reference::brute_force(&asked.scene, &asked.instances).unwrap();
        let mut rays = RayColumns::default();
        let mut expected = Vec::new();
        while rays.len() < RAYS {
            let point = points[random.below(points.len() as u64) as usize];
            let at = map.transform_point3(point);
            let mut dir = random.vector();
            let distance = libm::exp10(1.0 + 12.0 * random.unit().abs());
            dir[random.below(3) as usize] = distance * Affine::from(map).norm();
            let dir = dir.as_vec3();
            let (org, wide) = (at - dir.as_dvec3(), dir.as_dvec3());
            rays.push(org, dir.to_array());
            let hit = reference.nearest(org.to_array(), wide.to_array(), f64::INFINITY);
            expected.push(hit.is_some());
        }
        hits += expected.iter().filter(|hit| **hit).count();
        let world = World::build(&asked.scene, &asked.instances, Structure::Bvh);
        for precision in RIGHT {
            let found = rays.closest(&world, &kernels(precision));
            for (i, ((_, id), expected)) in found.iter().zip(&expected).enumerate() {
                let (ray, met) = (rays.ray(i), *id != HitId::NONE);
                assert_eq!(met, *expected, "{seed}, {precision:?}: {ray:?}");
            }
        }
    }
    assert!(hits * 16 > 1000 * solids, "{hits}");
}
