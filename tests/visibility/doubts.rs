//! How many ordinary rays need exact arithmetic. The count is that of the whole process,
//! so the test runs in a process of its own.

use crate::common::{Random, RayColumns, in_own_process, kernels};
use glam::{DAffine3, DVec3};
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::geom::{Cuboid, Cylinder, HalfSpace, Quadric};
use lanecast::internals::plan::Precision;
use lanecast::internals::scene::{Edge, Instances, Operand, Operator, SceneBuilder, ShapeId};
use lanecast::internals::trace::decided;

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
    b.csg("", Operator::Intersection, &[Operand::shape(block), other])
}

/// Exact decisions, and hits.
fn asked(precision: Precision, make: &dyn Fn(&mut SceneBuilder) -> ShapeId) -> (u64, usize) {
    let mut b = SceneBuilder::default();
    let shape = make(&mut b);
    b.instance("", Edge::shape(shape));
    let scene = b.finish().expect("the test's own scene is sound");
    let instances = Instances::of(&scene).expect("and small");
    let world = World::build(&scene, &instances, Structure::Bvh);
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
    let kernels = kernels(precision);
    let before = decided();
    let met = rays.closest(&world, &kernels);
    let hits = met.iter().filter(|(t, _)| t.is_finite()).count();
    (decided() - before, hits)
}

fn upright(b: &mut SceneBuilder, y: [f64; 2], radius: f64) -> ShapeId {
    let [base, top] = y.map(|y| DVec3::Y * y);
    b.cylinder(
        "",
        Cylinder {
            base,
            top,
            radius,
            open: false,
        },
    )
}

fn slab(b: &mut SceneBuilder) -> Operand {
    let (min, max) = (DVec3::new(-1.0, -0.3, -1.0), DVec3::new(1.0, 0.3, 1.0));
    Operand::shape(b.cuboid("", Cuboid { min, max }))
}

/// Holes that end in a slab's faces: in its own space, and each in one of its own.
fn plate(b: &mut SceneBuilder) -> ShapeId {
    let drill = upright(b, [-0.3, 0.3], 0.2);
    let mut operands = vec![slab(b), Operand::shape(drill)];
    for (x, z) in [(-0.6, 0.1), (0.6, -0.3), (0.1, 0.7)] {
        let moved = b.transform(DAffine3::from_translation(DVec3::new(x, 0.0, z)).into());
        operands.push(Operand::shape(drill).transform(moved));
    }
    b.csg("", Operator::Difference, &operands)
}

/// A bore in two pieces, of one radius about one axis, which overlap.
fn bore(b: &mut SceneBuilder) -> ShapeId {
    let pieces = [[-0.4, 0.1], [-0.1, 0.3]].map(|y| Operand::shape(upright(b, y, 0.5)));
    let operands = [slab(b), pieces[0], pieces[1]];
    b.csg("", Operator::Difference, &operands)
}

/// What two slabs side by side are, and nothing of a third without itself.
fn slabs(b: &mut SceneBuilder) -> ShapeId {
    let (min, max) = (DVec3::new(-1.0, 0.3, -1.0), DVec3::new(1.0, 0.5, 1.0));
    let above = Operand::shape(b.cuboid("", Cuboid { min, max }));
    let slabs = [slab(b), slab(b)];
    let nothing = b.csg("", Operator::Difference, &slabs);
    let operands = [slab(b), above, Operand::shape(nothing)];
    b.csg("", Operator::Union, &operands)
}

#[test]
fn ordinary_rays_are_hardly_ever_in_doubt() {
    in_own_process(
        "doubts::ordinary_rays_are_hardly_ever_in_doubt",
        count_doubts,
    );
}

fn count_doubts() {
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
    for precision in [Precision::Guarded, Precision::Exact] {
        let most = if precision == Precision::Exact {
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
                let (doubts, hits) = asked(precision, make);
                println!("{precision:?}, {name} {way}: {doubts} doubts, {hits} hits");
                assert!(hits > RAYS / 4, "{name} {way}: {hits}");
                assert!(doubts <= most, "{precision:?}, {name} {way}: {doubts}");
            }
        }
        let (doubts, _) = asked(precision, &|b| {
            let (normal, offset) = (DVec3::new(0.3, 1.0, 0.1), 0.25);
            let other = b.half_space("", HalfSpace { normal, offset });
            block_with(b, other, false)
        });
        println!("{precision:?}, half-space in a box: {doubts} doubts");
        assert!(
            doubts <= most,
            "{precision:?}, half-space in a box: {doubts}"
        );
        type Make = fn(&mut SceneBuilder) -> ShapeId;
        let shared: [(&str, Make); 3] = [("plate", plate), ("bore", bore), ("slabs", slabs)];
        for (name, make) in shared {
            let (doubts, hits) = asked(precision, &make);
            println!("{precision:?}, {name}: {doubts} doubts, {hits} hits");
            assert!(hits > RAYS / 8, "{name}: {hits}");
            // Beside rims it is not certain which face a ray meets; of all rays that come
            // through a shared face it is a small part.
            let most = RAYS as u64 / 100;
            assert!(doubts <= most, "{precision:?}, {name}: {doubts}");
        }
    }
}
