//! What ordinary rays leave to exact arithmetic, by the process' own count: so one test,
//! in a binary of its own.

mod common;

use common::{EVERYTHING, Random, RayColumns};
use glam::{DAffine3, DVec3};
use lanecast::accel::{Structure, World};
use lanecast::geom::{Cuboid, HalfSpace, Quadric};
use lanecast::plan::{Arithmetic, Kernels, native_width};
use lanecast::scene::{Appearances, Edge, Operand, Operator, SceneBuilder, ShapeId};
use lanecast::trace::decided;

const RAYS: usize = 8000;

/// A box, and another solid that is placed or not.
fn block_with(b: &mut SceneBuilder, other: ShapeId, placed: bool) -> ShapeId {
    let (min, max) = (DVec3::splat(-1.0), DVec3::splat(1.0));
    let block = b.cuboid("", Cuboid { min, max });
    let turn = DAffine3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.3);
    let mut other = Operand::shape(other);
    if placed {
        other = other.transform(b.transform(turn.into()));
    }
    b.combination("", Operator::Intersection, &[Operand::shape(block), other])
}

/// Exact decisions, and hits.
fn asked(arithmetic: Arithmetic, make: &dyn Fn(&mut SceneBuilder) -> ShapeId) -> (u64, usize) {
    let mut b = SceneBuilder::default();
    let shape = make(&mut b);
    b.instance("", Edge::shape(shape));
    let scene = b.finish().expect("the test's own scene is sound");
    let appearances = Appearances::of(&scene).expect("and small");
    let world = World::build(&scene, &appearances, Structure::Bvh);
    let random = &mut Random(5);
    let mut rays = RayColumns::default();
    for i in 0..RAYS {
        // Every second from inside.
        let org = if i % 2 == 0 {
            DVec3::new(3.0, 2.5, 4.0)
        } else {
            random.vector() * 0.5
        };
        let dir = random.vector() * 0.9 - org;
        rays.push(org, dir.to_array().map(|x| x as f32));
    }
    let kernels = Kernels {
        arithmetic,
        lanes: native_width(arithmetic),
        needs: EVERYTHING,
    };
    let before = decided();
    let met = rays.closest(&world, &kernels);
    let hits = met.iter().filter(|(t, _)| t.is_finite()).count();
    (decided() - before, hits)
}

#[test]
fn ordinary_rays_at_quadrics_and_half_spaces_are_hardly_ever_in_doubt() {
    let quadrics = [
        (
            "saddle",
            [1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        ),
        (
            "one sheet",
            [1.0, -0.5, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.25],
        ),
        ("cone", [1.0, -0.5, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        (
            "outside of a ball",
            [-1.0, -1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.1],
        ),
    ];
    for arithmetic in [Arithmetic::F32Guarded, Arithmetic::F64] {
        let most = if arithmetic == Arithmetic::F64 {
            1
        } else {
            RAYS as u64 / 500
        };
        for (name, coefficients) in quadrics {
            let row = Quadric { coefficients };
            let alone = |b: &mut SceneBuilder| b.quadric("", row);
            let cut = |placed: bool| {
                move |b: &mut SceneBuilder| {
                    let other = b.quadric("", row);
                    block_with(b, other, placed)
                }
            };
            let ways: [&dyn Fn(&mut SceneBuilder) -> ShapeId; 3] =
                [&alone, &cut(false), &cut(true)];
            for (way, make) in ["alone", "in a box", "placed in a box"].iter().zip(ways) {
                let (doubts, hits) = asked(arithmetic, make);
                println!("{arithmetic:?}, {name} {way}: {doubts} doubts, {hits} hits");
                assert!(hits > RAYS / 4, "{name} {way}: {hits}");
                assert!(doubts <= most, "{arithmetic:?}, {name} {way}: {doubts}");
            }
        }
        let (doubts, _) = asked(arithmetic, &|b| {
            let (normal, offset) = (DVec3::new(0.3, 1.0, 0.1), 0.25);
            let other = b.half_space("", HalfSpace { normal, offset });
            block_with(b, other, false)
        });
        println!("{arithmetic:?}, half-space in a box: {doubts} doubts");
        assert!(
            doubts <= most,
            "{arithmetic:?}, half-space in a box: {doubts}"
        );
    }
}
