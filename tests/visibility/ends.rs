//! The end of a ray changes no hit before it. In `fast` no error bound guarantees that, and
//! packets carry other ends than single rays.

use crate::common::{
    Random, RayColumns, campaign, random_csg, random_shape, random_solid, torus, unit_ball,
};
use glam::{DAffine3, DMat3, DVec3};
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::geom::{Cuboid, Sphere};
use lanecast::internals::plan::{Kernels, Precision, widths};
use lanecast::internals::scene::{
    Edge, Instances, Operand, Operator, Scene, SceneBuilder, ShapeId,
};
use lanecast::internals::trace::{Caching, HitId, ShadowCache};

/// From near by, and from so far away that f32 hardly knows the scene's parts.
fn rays(random: &mut Random, count: usize) -> RayColumns {
    let mut rays = RayColumns::default();
    for _ in 0..count {
        let away = [3.0, 300.0, 3e4, 3e5][random.below(4) as usize];
        let at = random.vector() * 1.5;
        let dir = match random.below(4) {
            0 => DVec3::X,
            _ => random.vector().normalize_or(DVec3::Y),
        };
        let reach = [1.0, away][random.below(2) as usize];
        rays.push(at - dir * away, (dir * reach).to_array().map(|x| x as f32));
    }
    rays
}

/// Shortens rays at what they meet, or nearly there, and asks again.
fn ends_do_not_matter(scene: &Scene, seed: u64) -> usize {
    let random = &mut Random(seed);
    let instances = Instances::of(scene).unwrap();
    let world = World::build(scene, &instances, Structure::Bvh);
    let rays = rays(random, 512);
    let mut met = 0;
    for lanes in widths() {
        let kernels = Kernels {
            precision: Precision::Fast,
            lanes,
        };
        let nearest = rays.closest(&world, &kernels);
        let end = |t: f64| {
            let t = t as f32;
            let near = |ulps: u64| (0..ulps).fold(t, |t, _| t.next_up());
            match random.below(6) {
                0 => t,
                1 => near(1),
                2 => near(2),
                3 => near(32),
                4 => t * 1.01,
                _ => t * 0.99,
            }
        };
        let ends: Vec<f32> = nearest.iter().map(|hit| hit.0).map(end).collect();
        let before = rays.closest_within(&world, &kernels, &ends);
        let blocked = rays.any(&world, &kernels, &ends, &mut ShadowCache::new(Caching::Off));
        for i in 0..rays.len() {
            let ((t, id), end) = (nearest[i], ends[i]);
            if id == HitId::NONE {
                continue;
            }
            let what = || format!("{lanes} lanes, seed {seed}, ray {i}: {:?}", rays.ray(i));
            let is_before = t < f64::from(end);
            let expected = if is_before { id } else { HitId::NONE };
            assert_eq!(before[i].1, expected, "t {t:e}, end {end:e}, {}", what());
            if is_before {
                assert_eq!(before[i].0, t, "{}", what());
            }
            // Of polynomials it is known whether there is a root before the end, and t has
            // been rounded.
            if t != f64::from(end) {
                assert_eq!(blocked[i], is_before, "t {t:e}, end {end:e}, {}", what());
            }
            met += 1;
        }
    }
    met
}

fn scene_of(make: impl FnOnce(&mut SceneBuilder) -> Vec<ShapeId>) -> Scene {
    let mut to = SceneBuilder::default();
    for shape in make(&mut to) {
        to.instance("", Edge::shape(shape));
    }
    to.finish().expect("a good scene")
}

fn block(to: &mut SceneBuilder, min: DVec3, max: DVec3) -> ShapeId {
    to.cuboid("", Cuboid { min, max })
}

#[test]
fn before_random_scenes() {
    let (mut met, scenes) = (0, campaign(1000));
    for seed in 0..scenes as u64 {
        let random = &mut Random(seed);
        let scene = scene_of(|to| {
            let mut shapes = Vec::new();
            for _ in 0..1 + random.below(3) {
                shapes.push(random_csg(to, random, 0));
                shapes.push(random_shape(to, random));
            }
            shapes
        });
        met += ends_do_not_matter(&scene, seed);
    }
    assert!(met > 50 * scenes, "only {met} rays met anything");
}

/// So many that there is a tree over them, at faces that are one.
#[test]
fn before_many_operands() {
    let mut met = 0;
    for seed in 0..20 {
        let random = &mut Random(seed);
        let scene = scene_of(|to| {
            let mut operands = Vec::new();
            for i in 0..24 {
                let x = f64::from(i % 8) * 0.25 - 1.0;
                let min = DVec3::new(x, -0.5, random.unit() * 0.5);
                let side = DVec3::new(0.25, 1.0, 0.5);
                let shape = match i % 3 {
                    0 => to.sphere(
                        "",
                        Sphere {
                            center: min,
                            radius: 0.25,
                        },
                    ),
                    _ => block(to, min, min + side),
                };
                let moved = to.transform(DAffine3::from_translation(random.vector() * 0.1).into());
                operands.push(match i % 4 {
                    0 => Operand::shape(shape).transform(moved),
                    _ => Operand::shape(shape),
                });
            }
            let operator = [Operator::Union, Operator::Xor, Operator::Difference];
            vec![to.csg("", operator[random.below(3) as usize], &operands)]
        });
        met += ends_do_not_matter(&scene, seed);
    }
    assert!(met > 2_000, "only {met} rays met anything");
}

/// Of all kinds, of which f32 knows little from far away.
#[test]
fn before_many_random_operands() {
    let (mut met, scenes) = (0, campaign(300));
    for seed in 0..scenes as u64 {
        let random = &mut Random(seed);
        let scene = scene_of(|to| {
            let operands: Vec<Operand> = (0..30)
                .map(|_| {
                    let shape = random_solid(to, random);
                    let map = DAffine3::from_translation(random.vector() * 0.5);
                    Operand::shape(shape).transform(to.transform(map.into()))
                })
                .collect();
            let operator = [Operator::Union, Operator::Xor][random.below(2) as usize];
            vec![to.csg("", operator, &operands)]
        });
        met += ends_do_not_matter(&scene, seed);
    }
    assert!(met * 6 > 1000 * scenes, "only {met} rays met anything");
}

/// More in one line than lanes have room for.
#[test]
fn before_a_row_of_plates() {
    for (seed, operator) in [(1, Operator::Union), (2, Operator::Xor)] {
        let scene = scene_of(|to| {
            let operands: Vec<Operand> = (0..150)
                .map(|i| {
                    let x = f64::from(i) * 0.02 - 1.5;
                    let (min, max) = (DVec3::new(x, -1.0, -1.0), DVec3::new(x + 0.015, 1.0, 1.0));
                    Operand::shape(block(to, min, max))
                })
                .collect();
            vec![to.csg("", operator, &operands)]
        });
        assert!(ends_do_not_matter(&scene, seed) > 100);
    }
}

/// Operands that lanes do not always know, or never.
#[test]
fn before_operands_in_doubt() {
    let mut met = 0;
    for seed in 0..24 {
        let random = &mut Random(seed);
        let scene = scene_of(|to| {
            let ball = to.level_set("", unit_ball(), false, None);
            let ring = to.implicit("", torus(DVec3::ZERO, [1.0, 0.3]), false, None);
            let operands: Vec<Operand> = (0..32)
                .map(|i| {
                    let at = random.vector() * 0.7;
                    let shape = match i % 8 {
                        0 => ball,
                        1 => ring,
                        _ => block(to, DVec3::splat(-0.3), DVec3::splat(0.6)),
                    };
                    let map = DAffine3::from_mat3_translation(
                        DMat3::from_diagonal(DVec3::splat(0.3)),
                        at,
                    );
                    let moved = to.transform(map.into());
                    Operand::shape(shape).transform(moved)
                })
                .collect();
            vec![to.csg("", Operator::Union, &operands)]
        });
        met += ends_do_not_matter(&scene, seed);
    }
    assert!(met > 5_000, "only {met} rays met anything");
}
