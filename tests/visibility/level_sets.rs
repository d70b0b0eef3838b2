//! Level sets of formulas: compared with polynomials that have the same zeros, with the
//! reference, and between all structures and precisions.

use crate::common::{
    ALL_AOVS, Random, RayColumns, Way, gyroid, hash, kernels, picture, ring, spans, structures,
    torus, unit_ball,
};
use glam::{DAffine3, DQuat, DVec3};
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::geom::formula::Builder;
use lanecast::internals::geom::{Binary, Clip, Cuboid, Sphere, Unary};
use lanecast::internals::plan::{Precision, widths};
use lanecast::internals::reference::{Ray, Reference};
use lanecast::internals::render::RenderConfig;
use lanecast::internals::scene::{
    Camera, Edge, Instances, Operand, Operator, Scene, SceneBuilder, SceneError, ShapeId,
};
use lanecast::internals::shade::Surface;
use lanecast::internals::trace::{HitId, ShadowCache};

fn scene(make: impl FnOnce(&mut SceneBuilder) -> Vec<(ShapeId, DAffine3)>) -> Scene {
    let mut to = SceneBuilder::default();
    for (shape, map) in make(&mut to) {
        let edge = Edge::shape(shape).transform(to.transform(map.into()));
        to.instance("", edge);
    }
    to.finish().expect("a good scene")
}

/// Through the middle of a cube of this half width, and about it.
fn rays(seed: u64, reach: f64, count: usize) -> RayColumns {
    let random = &mut Random(seed);
    let mut rays = RayColumns::default();
    for i in 0..count {
        let org = random.vector() * [3.0, 0.9][i % 2] * reach;
        let dir = random.vector() * reach - org;
        rays.push(org, dir.to_array());
    }
    rays
}

const TURNED: DVec3 = DVec3::new(0.3, -0.2, 0.1);

fn turned(scale: f64) -> DAffine3 {
    let turn = DQuat::from_axis_angle(DVec3::new(2.0, 1.0, -1.0).normalize(), 0.7);
    DAffine3::from_scale_rotation_translation(DVec3::splat(scale), turn, TURNED)
}

#[test]
fn what_may_be_written_both_ways_is_met_alike() {
    let tori = [
        scene(|to| vec![(to.level_set("", ring(0.3), false, None), turned(1.5))]),
        scene(|to| {
            let tape = torus(DVec3::ZERO, [1.0, 0.3]);
            vec![(to.implicit("", tape, false, None), turned(1.5))]
        }),
    ];
    let balls = [
        scene(|to| vec![(to.level_set("", unit_ball(), false, None), turned(0.7))]),
        scene(|to| {
            let (center, radius) = (DVec3::ZERO, 1.0);
            vec![(to.sphere("", Sphere { center, radius }), turned(0.7))]
        }),
    ];
    for (name, [ours, theirs]) in [("torus", tori), ("ball", balls)] {
        let rays = rays(7, 2.0, 4000);
        for precision in [Precision::Guarded, Precision::Exact] {
            let of = |scene: &Scene| {
                let instances = Instances::of(scene).expect("one");
                let world = World::build(scene, &instances, Structure::Bvh);
                let ends = vec![f32::INFINITY; rays.len()];
                let cache = &mut ShadowCache::new(Default::default());
                let blocked = rays.any(&world, &kernels(precision), &ends, cache);
                (rays.closest(&world, &kernels(precision)), blocked)
            };
            let ((found, blocked), (expected, _)) = (of(&ours), of(&theirs));
            let hits = found.iter().filter(|a| a.1 != HitId::NONE).count();
            assert!(hits > 500, "{name}: {hits}");
            for (i, ((t, id), (other, known))) in found.iter().zip(&expected).enumerate() {
                let context = format!("{name} {precision:?} ray {i}: {t} {other}");
                assert_eq!(id, known, "{context}");
                assert_eq!(blocked[i], *id != HitId::NONE, "{context}");
                let near = match precision {
                    Precision::Exact => 1e-13,
                    // Of a ball that is grazed.
                    _ => 1e-5,
                };
                let same = (t - other).abs() <= near * other.abs().max(0.1) || *id == HitId::NONE;
                assert!(same, "{context}");
            }
        }
    }
}

/// An open one in a clip, a difference, a clipped solid; two of them placed.
fn all() -> Scene {
    scene(|to| {
        let ball = Sphere {
            center: DVec3::ZERO,
            radius: 6.0,
        };
        let cuboid = Cuboid {
            min: DVec3::splat(-4.0),
            max: DVec3::new(4.0, 3.0, 4.0),
        };
        let sheet = to.level_set("", gyroid(DVec3::ZERO, 1.0), true, Some(Clip::Sphere(ball)));
        let solid = to.level_set(
            "",
            gyroid(DVec3::ZERO, 1.0),
            false,
            Some(Clip::Cuboid(cuboid)),
        );
        let cuboid = to.cuboid("", cuboid);
        let block = [solid, cuboid].map(Operand::shape);
        let block = to.csg("", Operator::Intersection, &block);
        let whole = to.level_set("", ring(0.3), false, None);
        let hole = to.sphere(
            "",
            Sphere {
                center: DVec3::X,
                radius: 0.5,
            },
        );
        let ring = [whole, hole].map(Operand::shape);
        let ring = to.csg("", Operator::Difference, &ring);
        let at = |x: f64, scale: f64| {
            let place = DAffine3::from_translation(DVec3::new(x, 0.0, 0.0));
            place * turned(scale)
        };
        vec![
            (sheet, at(-3.0, 0.3)),
            (block, at(0.0, 0.3)),
            (ring, at(3.0, 1.2)),
        ]
    })
}

#[test]
fn the_reference_finds_the_same() {
    let scene = all();
    let instances = Instances::of(&scene).expect("three");
    let world = World::build(&scene, &instances, Structure::Bvh);
    let reference = Reference::new(&scene, &instances).expect("one");
    let rays = rays(11, 3.0, 600);
    for precision in [Precision::Fast, Precision::Guarded, Precision::Exact] {
        let found = rays.closest(&world, &kernels(precision));
        let mut hits = 0;
        for (i, (t, id)) in found.iter().enumerate() {
            let (org, dir) = rays.ray(i);
            let dir = dir.map(f64::from);
            let truth = reference.nearest(org, dir, f64::INFINITY);
            let context = format!("{precision:?} {org:?} {dir:?}: {t} {id:?} {truth:?}");
            let Some(truth) = truth else {
                assert_eq!(*id, HitId::NONE, "{context}");
                continue;
            };
            hits += 1;
            assert_eq!(id.instance, truth.instance, "{context}");
            let near = match precision {
                Precision::Exact => 1e-13,
                Precision::Fast => 1e-5,
                _ => 1e-6,
            };
            assert!((t - truth.t).abs() <= near * truth.t.max(0.1), "{context}");
        }
        assert!(hits > 150, "{hits}");
    }
}

#[test]
fn a_picture_is_the_same_by_every_way() {
    let scene = all();
    let camera = Camera::perspective(DVec3::new(1.0, 3.0, 9.0), DVec3::ZERO, DVec3::Y, 50.0);
    let instances = Instances::of(&scene).expect("three");
    let (scene, camera) = {
        let (scene, _) = scene.completed(None, &instances, 4.0 / 3.0);
        (scene, camera)
    };
    let config = RenderConfig {
        width: 64,
        height: 48,
        aovs: ALL_AOVS,
        ..RenderConfig::default()
    };
    for precision in [Precision::Guarded, Precision::Exact] {
        let mut expected = None;
        for structure in structures() {
            for lanes in widths() {
                let way = Way {
                    precision,
                    lanes,
                    structure,
                };
                let rendered = picture(&scene, camera, &scene.lights, way, &config);
                let hash = hash(&rendered);
                assert!(rendered.counts.primary_hits > 300, "{:?}", rendered.counts);
                assert_eq!(*expected.get_or_insert(hash), hash, "{way:?}");
            }
        }
    }
}

/// A ray that begins where a surface is: what its function is there, is roundings.
#[test]
fn the_reference_knows_where_it_is_not_certain() {
    let scene = scene(|to| {
        vec![(
            to.level_set("", unit_ball(), false, None),
            DAffine3::IDENTITY,
        )]
    });
    let instances = Instances::of(&scene).expect("one");
    let reference = Reference::new(&scene, &instances).expect("one");
    let of = |org: [f64; 3], dir: [f64; 3]| {
        let at = |level: f64| reference.nearest_of(Ray { org, dir, level }, f64::INFINITY);
        [-1.0, 0.0, 1.0].map(|level| at(level).map(|hit| hit.t > 1e-9))
    };
    // Beside it, at it, and past it by little.
    assert_eq!(of([-2.0, 0.6, 0.0], [1.0, 0.0, 0.0]), [Some(true); 3]);
    let at = of([0.6, 0.8, 0.0], [-0.6, -0.8, 0.0]);
    assert!(at[0] != at[2], "{at:?}");
    assert_eq!(of([-2.0, 1.0 + 1e-12, 0.0], [1.0, 0.0, 0.0]), [None; 3]);
    let touched = of([-2.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
    assert!(touched[0] != touched[2], "{touched:?}");
}

#[test]
fn a_line_has_all_its_spans() {
    let scene = scene(|to| vec![(to.level_set("", ring(0.3), false, None), DAffine3::IDENTITY)]);
    let instances = Instances::of(&scene).expect("one");
    let org = DVec3::new(-5.0, 0.0, 0.0);
    let spans = spans(&scene, &instances, org, DVec3::X).expect("few");
    let found: Vec<[f64; 2]> = spans
        .rows
        .iter()
        .map(|s| [s.t_enter(), s.t_exit()])
        .collect();
    for (found, expected) in found.iter().zip([[3.7, 4.3], [5.7, 6.3]]) {
        for (t, expected) in found.iter().zip(expected) {
            assert!((t - expected).abs() < 1e-14, "{t} {expected}");
        }
    }
    assert_eq!(found.len(), 2);
    let first = spans.rows[0].enter.expect("it comes in");
    assert!(
        (first.normal + DVec3::X).length() < 1e-14,
        "{}",
        first.normal
    );
}

/// √(1 − x² − y² − z²) − 1/2 is below zero in a shell, and has no values beyond it.
#[test]
fn where_a_function_ends_there_is_a_face() {
    let scene = scene(|to| {
        let mut b = Builder::default();
        let mut rest = b.constant(1.0);
        for axis in 0..3 {
            let x = b.coordinate(axis);
            let square = b.power(x, 2);
            rest = b.binary(Binary::Difference, rest, square);
        }
        let (root, half) = (b.unary(Unary::Sqrt, rest), b.constant(0.5));
        let last = b.binary(Binary::Difference, root, half);
        let shell = to.level_set("", b.finish(last), false, None);
        vec![(shell, turned(2.0))]
    });
    let instances = Instances::of(&scene).expect("one");
    let world = World::build(&scene, &instances, Structure::Bvh);
    let reference = Reference::new(&scene, &instances).expect("one");
    let rays = rays(19, 3.0, 600);
    for precision in [Precision::Fast, Precision::Guarded, Precision::Exact] {
        let mut hits = 0;
        for (i, (t, id)) in rays
            .closest(&world, &kernels(precision))
            .into_iter()
            .enumerate()
        {
            let (org, dir) = rays.ray(i);
            if id == HitId::NONE || (DVec3::from(org) - TURNED).length() < 2.0 {
                continue;
            }
            hits += 1;
            let surface = Surface::at(&world, precision, org, dir, t, id);
            let out = (surface.point - TURNED) / 2.0;
            let context = format!("{precision:?} {org:?} {dir:?} {surface:?}");
            assert!((out.length() - 1.0).abs() < 1e-14, "{context}");
            assert!((surface.ng - out).length() < 1e-13, "{context}");
            assert!(surface.front && surface.offset < 1e-4, "{context}");
            let truth = reference
                .nearest(org, dir.map(f64::from), f64::INFINITY)
                .expect("a hit");
            let normal = DVec3::from(truth.normal);
            assert!((normal - out).length() < 1e-12, "{context} {normal}");
        }
        assert!(hits > 100, "{hits}");
    }
    let line = (DVec3::new(-5.0, 0.25, -0.75), DVec3::X);
    let spans = spans(&scene, &instances, line.0, line.1).expect("few").rows;
    for end in [spans[0].enter, spans[spans.len() - 1].exit] {
        let end = end.expect("an end");
        let out = (end.point - TURNED) / 2.0;
        assert!((end.normal - out).length() < 1e-13, "{end:?}");
    }
}

/// All but a ball, in a box: also where a line passes by the ball's bounds.
#[test]
fn a_solid_without_end_is_everywhere_else() {
    let scene = scene(|to| {
        let mut b = Builder::default();
        let square = |b: &mut Builder, axis| {
            let x = b.coordinate(axis);
            b.power(x, 2)
        };
        let [x, y, z] = [0, 1, 2].map(|axis| square(&mut b, axis));
        let sum = b.binary(Binary::Sum, x, y);
        let sum = b.binary(Binary::Sum, sum, z);
        let (root, one) = (b.unary(Unary::Sqrt, sum), b.constant(1.0));
        let last = b.binary(Binary::Difference, one, root);
        let rest = to.level_set("", b.finish(last), false, None);
        let (min, max) = (DVec3::splat(-4.0), DVec3::splat(4.0));
        let operands = [to.cuboid("", Cuboid { min, max }), rest].map(Operand::shape);
        let all = to.csg("", Operator::Intersection, &operands);
        vec![(all, DAffine3::IDENTITY)]
    });
    let instances = Instances::of(&scene).expect("one");
    let of = |y: f64| -> Vec<[f64; 2]> {
        let org = DVec3::new(-9.0, y, 0.0);
        let spans = spans(&scene, &instances, org, DVec3::X).expect("few");
        spans
            .rows
            .iter()
            .map(|s| [s.t_enter(), s.t_exit()])
            .collect()
    };
    assert_eq!(of(3.0), [[5.0, 13.0]]);
    assert_eq!(of(0.0), [[5.0, 8.0], [10.0, 13.0]]);
    let reference = Reference::new(&scene, &instances).expect("one");
    let world = World::build(&scene, &instances, Structure::Bvh);
    let mut rays = RayColumns::default();
    for y in [3.0, 0.0, -1.5, 3.9] {
        rays.push(DVec3::new(-9.0, y, 0.0), [1.0, 0.0, 0.0]);
    }
    for (i, (t, id)) in rays
        .closest(&world, &kernels(Precision::Guarded))
        .iter()
        .enumerate()
    {
        let (org, dir) = rays.ray(i);
        let truth = reference
            .nearest(org, dir.map(f64::from), f64::INFINITY)
            .expect("a hit");
        assert!(
            *id != HitId::NONE && (*t, truth.t) == (5.0, 5.0),
            "{t} {truth:?}"
        );
    }
}

#[test]
fn what_may_be_anywhere_is_refused() {
    let mut to = SceneBuilder::default();
    let shape = to.level_set("", gyroid(DVec3::ZERO, 1.0), true, None);
    to.instance("", Edge::shape(shape));
    match to.finish() {
        Err(SceneError::Degenerate { why, .. }) => {
            assert!(why.ends_with("give it a clip"), "{why}")
        }
        other => panic!("{other:?}"),
    }
}
