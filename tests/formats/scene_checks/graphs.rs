//! Scene graphs that would exhaust a careless check, and the instances that they unfold into.

use super::*;
use crate::common::{property, within_seconds};
use lanecast::internals::plan::{Accel, Choices, plan};
use lanecast::internals::reference::Reference;
use lanecast::internals::scene::{Camera, Instance};
use proptest::prelude::*;

/// Nodes that each hold the next one twice; gives the first.
fn doubling(b: &mut SceneBuilder, levels: usize, last: &[Edge]) -> NodeId {
    (0..levels).fold(b.node("", last), |below, _| {
        b.node("", &[Edge::node(below), Edge::node(below)])
    })
}

#[test]
fn deep_sharing_costs_nothing() {
    let mut b = SceneBuilder::default();
    let shape = ball(&mut b);
    let top = doubling(&mut b, 40, &[Edge::shape(shape)]);
    b.instance("", Edge::node(top));
    b.instance("", Edge::shape(shape));
    let scene = within_seconds(10, || b.finish()).expect("40 levels are fine");
    let all = Instances::of(&scene).unwrap();
    assert_eq!(all.count(), (1 << 40) + 1);
    assert_eq!(all.depth(), 42);
    assert!(all.rows.is_empty() && all.bytes() < 4096);
    assert_eq!(all.of_shapes(&scene), [(1 << 40) + 1]);
    assert_eq!(all.placed(&scene), 0);
    // What looks at each of them refuses.
    let laid_out = all.laid_out(&scene).unwrap_err().to_string();
    for part in ["1099511627777", "2097152"] {
        assert!(laid_out.contains(part), "{laid_out}");
    }
    assert!(Reference::new(&scene, &all).is_err());
    let bvh =
        within_seconds(10, || plan(&scene, &all, &Choices::default())).expect("its trees nest");
    assert_eq!(bvh.accel, Accel::Bvh);
    let grid = Choices {
        accel: Some(Accel::Grid),
        ..Choices::default()
    };
    let error = plan(&scene, &all, &grid).unwrap_err().to_string();
    for part in ["--accel grid", "1099511627777", "bvh"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn sharing_beyond_all_bounds_is_refused_quickly() {
    // More than a u64 can count.
    let endless = within_seconds(10, || {
        refused(|b| {
            let top = doubling(b, 200, &[Edge::shape(ShapeId(0))]);
            b.instance("", Edge::node(top));
        })
    });
    assert_is!(endless, TooManyInstances, "18446744073709551615");
    // As many ways to nothing at all: nothing to unfold.
    let hollow = within_seconds(10, || {
        check(|b| {
            let top = doubling(b, 60, &[]);
            b.instance("", Edge::node(top));
        })
    });
    assert!(hollow.is_ok());
    // Each instance at the end of a long way: 2^20 · 10^5 steps.
    let winding = within_seconds(10, || {
        refused(|b| {
            let mut chain = b.node("", &[Edge::shape(ShapeId(0))]);
            for _ in 0..100_000 {
                chain = b.node("", &[Edge::node(chain)]);
            }
            let top = doubling(b, 20, &[Edge::node(chain)]);
            b.instance("", Edge::node(top));
        })
    });
    assert_is!(winding, TooDeep, "100023", "256");
    // Products that overflow somewhere among 2^40.
    let flattened = within_seconds(10, || {
        refused(|b| {
            let tiny = b.transform(DAffine3::from_scale(DVec3::splat(1e-10)).into());
            let step = Edge::shape(ShapeId(0)).transform(tiny);
            let top = (0..40).fold(b.node("", &[step]), |below, _| {
                b.node("", &[Edge::node(below), Edge::node(below).transform(tiny)])
            });
            b.instance("", Edge::node(top));
        })
    });
    assert_is!(flattened, SingularPath, "sphere");
}

#[test]
fn a_chain_of_a_million_nodes() {
    let mut b = SceneBuilder::default();
    let shape = ball(&mut b);
    let step = b.transform(DAffine3::from_translation(DVec3::X).into());
    let mut node = b.node("", &[Edge::shape(shape)]);
    for _ in 0..1_000_000 {
        node = b.node("", &[Edge::node(node).transform(step)]);
    }
    b.instance("", Edge::node(node));
    let scene = within_seconds(10, || b.finish()).expect("deep, but sound");
    let all = Instances::of(&scene).unwrap();
    assert_eq!(all.count(), 1);
    assert_eq!(all.rows[0].world_from_object.translation, [1e6, 0.0, 0.0]);
    assert_eq!(all.rows[0].object_from_world.translation, [-1e6, 0.0, 0.0]);
}

/// 3×4 matrices as rows, multiplied as the definition says: the product with the column
/// that stands out is added last.
fn times(a: [[f64; 4]; 3], b: [[f64; 4]; 3]) -> [[f64; 4]; 3] {
    let size = [0, 1, 2].map(|c| a.iter().fold(0.0, |s, row| f64::max(s, row[c].abs())));
    let others_equal = (0..3).find(|c| {
        let others = size[(c + 1) % 3] == size[(c + 2) % 3];
        others && size[*c] != size[(c + 1) % 3]
    });
    let is_largest = |c: &usize| (0..3).all(|o| o == *c || size[*c] > size[o]);
    let two_equal = size[0] == size[1] || size[1] == size[2] || size[2] == size[0];
    let largest = (0..3).find(is_largest).filter(|_| !two_equal);
    let last = others_equal.or(largest).unwrap_or(2);
    std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            let product = |k: usize| a[r][k % 3] * b[k % 3][c];
            let sum = (product(last + 1) + product(last + 2)) + product(last);
            if c == 3 { sum + a[r][3] } else { sum }
        })
    })
}

fn rows(m: &Affine) -> [[f64; 4]; 3] {
    std::array::from_fn(|r| {
        [
            m.linear()[0][r],
            m.linear()[1][r],
            m.linear()[2][r],
            m.translation[r],
        ]
    })
}

#[test]
fn instances_in_the_order_of_the_file() {
    let mut b = SceneBuilder::default();
    let ball = ball(&mut b);
    let block = b.cuboid(
        "",
        Cuboid {
            min: DVec3::ZERO,
            max: DVec3::ONE,
        },
    );
    let locals = [
        DAffine3::from_rotation_y(0.3) * DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0)),
        DAffine3::from_scale(DVec3::new(2.0, -0.5, 3.0)),
        DAffine3::from_rotation_x(-1.1) * DAffine3::from_translation(DVec3::new(-4.0, 0.1, 0.7)),
    ]
    .map(Affine::from);
    let t = locals.map(|m| b.transform(m));
    let paint: Vec<MaterialId> = (0..3)
        .map(|_| b.material("", Material::default()))
        .collect();
    let inner = b.node(
        "",
        &[
            Edge::shape(ball).transform(t[2]),
            Edge::shape(block).material(paint[2]),
        ],
    );
    let outer = b.node(
        "",
        &[
            Edge::node(inner).transform(t[1]).material(paint[1]),
            Edge::shape(ball),
        ],
    );
    b.instance("", Edge::node(outer).transform(t[0]).material(paint[0]));
    b.instance("", Edge::node(inner));
    let scene = b.finish().unwrap();
    let all = Instances::of(&scene).unwrap();

    // Depth first; the nearest edge that sets a material wins.
    let seen: Vec<_> = all
        .rows
        .iter()
        .map(|a| (a.shape, a.material, a.root))
        .collect();
    assert_eq!(
        seen,
        [
            (ball, Some(paint[1]), 0),
            (block, Some(paint[2]), 0),
            (ball, Some(paint[0]), 0),
            (ball, None, 1),
            (block, Some(paint[2]), 1),
        ]
    );
    // To the world by local₀ · local₁ · local₂; back by the inverses, from the
    // root on: inverse₂ · (inverse₁ · inverse₀). The same bits.
    let [m0, m1, m2] = locals.map(|m| rows(&m));
    let [i0, i1, i2] = locals.map(|m| rows(&m.inverse().unwrap()));
    let first = &all.rows[0];
    assert_eq!(rows(&first.world_from_object), times(times(m0, m1), m2));
    assert_eq!(rows(&first.object_from_world), times(i2, times(i1, i0)));
    assert_eq!(rows(&all.rows[2].world_from_object), m0);
    assert_eq!(rows(&all.rows[3].object_from_world), i2);
    assert!(all.rows[4].object_from_world.is_identity());
    // And they undo each other.
    let p = [0.3, -0.2, 0.9];
    let back = first
        .object_from_world
        .point(first.world_from_object.point(p));
    assert!((0..3).all(|k| (back[k] - p[k]).abs() < 1e-14), "{back:?}");
}

/// Levels of nodes, each with edges to shapes and to nodes of lower levels; the
/// numbers pick targets, transforms and materials.
fn tangle(levels: &[Vec<(u8, u8, u8)>]) -> Scene {
    let mut b = SceneBuilder::default();
    let ball = ball(&mut b);
    let block = b.cuboid(
        "",
        Cuboid {
            min: DVec3::ZERO,
            max: DVec3::ONE,
        },
    );
    let transforms = [
        DAffine3::IDENTITY,
        DAffine3::from_rotation_y(0.3) * DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0)),
        DAffine3::from_scale(DVec3::new(0.7, -0.5, 1.1)),
        DAffine3::from_rotation_x(-1.1) * DAffine3::from_translation(DVec3::new(-4.0, 0.1, 0.7)),
    ]
    .map(|m| b.transform(m.into()));
    let paint = [0, 1].map(|_| b.material("", Material::default()));
    let mut nodes = vec![b.node("", &[])];
    let edge = |(target, transform, material): (u8, u8, u8), nodes: &[NodeId]| {
        let edge = match target as usize % (nodes.len() + 2) {
            0 => Edge::shape(ball),
            1 => Edge::shape(block),
            n => Edge::node(nodes[n - 2]),
        };
        let edge = edge.transform(transforms[transform as usize % 4]);
        match material % 3 {
            0 => edge,
            m => edge.material(paint[m as usize - 1]),
        }
    };
    for level in levels {
        let edges: Vec<Edge> = level.iter().map(|e| edge(*e, &nodes)).collect();
        nodes.push(b.node("", &edges));
    }
    b.instance("", Edge::shape(ball));
    for node in nodes.iter().rev().take(3) {
        b.instance("", Edge::node(*node));
    }
    b.finish().expect("sound")
}

proptest! {
    #![proptest_config(property(64))]

    /// Every id's look-up gives the bits of the walk over all.
    #[test]
    fn looked_up_is_laid_out(
        levels in prop::collection::vec(prop::collection::vec(any::<(u8, u8, u8)>(), 0..5), 1..9)
    ) {
        let scene = tangle(&levels);
        let all = Instances::of(&scene).unwrap();
        let one_by_one: Vec<Instance> = all.iter(&scene).collect();
        prop_assert_eq!(one_by_one.len() as u64, all.count());
        let mut of_shapes = vec![0; 2];
        let mut placed = 0;
        let mut bare = InstanceTable::clone(&all);
        bare.rows.clear();
        for (id, row) in (0..).zip(&one_by_one) {
            let found = bare.get(&scene, id);
            prop_assert_eq!(found, *row);
            for (a, b) in [
                (found.object_from_world, row.object_from_world),
                (found.world_from_object, row.world_from_object),
            ] {
                prop_assert_eq!(bits(&a), bits(&b));
            }
            prop_assert_eq!(bits(&bare.object_from_world(&scene, id)), bits(&row.object_from_world));
            let path = bare.path(&scene, id);
            prop_assert!(path.len() as u64 <= all.depth());
            prop_assert_eq!(path[0], row.root);
            prop_assert_eq!(bare.id(&scene, &path), Some(id));
            // A way on from a shape leads nowhere.
            prop_assert_eq!(bare.id(&scene, &[&path[..], &[0]].concat()), None);
            of_shapes[row.shape.index()] += 1;
            placed += u64::from(row.is_placed(&scene));
        }
        prop_assert_eq!(all.of_shapes(&scene), of_shapes);
        prop_assert!(all.placed(&scene) >= placed);
        if all.rows.is_empty() {
            prop_assert!(all.count() > 1 << 16);
        } else {
            prop_assert_eq!(&all.rows, &one_by_one);
        }
    }
}

fn bits(m: &Affine) -> [[u64; 4]; 3] {
    rows(m).map(|row| row.map(f64::to_bits))
}

/// Ten nodes that each hold the next one ten times, in a ring.
fn rings(b: &mut SceneBuilder) -> NodeId {
    let shape = ball(b);
    let around = |k: i32| {
        DAffine3::from_rotation_y(f64::from(k) * std::f64::consts::TAU / 10.0)
            * DAffine3::from_translation(DVec3::X * 10.0)
            * DAffine3::from_scale(DVec3::splat(0.3))
    };
    let places: Vec<TransformId> = (0..10).map(|k| b.transform(around(k).into())).collect();
    let ten = |edge: Edge| -> Vec<Edge> { places.iter().map(|t| edge.transform(*t)).collect() };
    (0..9).fold(b.node("", &ten(Edge::shape(shape))), |below, _| {
        b.node("", &ten(Edge::node(below)))
    })
}

#[test]
fn ten_billion_instances_of_a_dozen_nodes() {
    let mut b = SceneBuilder::default();
    let top = rings(&mut b);
    b.instance("", Edge::node(top));
    let scene = within_seconds(10, || b.finish()).unwrap();
    let all = within_seconds(10, || Instances::of(&scene)).unwrap();
    assert_eq!(all.count(), 10_000_000_000);
    assert!(all.bytes() < 4096);
    // The digits of an id are the path.
    let digits = [0, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0];
    assert_eq!(all.path(&scene, 9_876_543_210), digits);
    assert_eq!(all.id(&scene, &digits), Some(9_876_543_210));
    let row = all.get(&scene, 9_999_999_999);
    let p = row
        .object_from_world
        .point(row.world_from_object.point([0.5; 3]));
    assert!(p.iter().all(|x| (x - 0.5).abs() < 1e-6), "{p:?}");

    // The default view frames it: everything lies within 10 / (1 − 0.3) + 1.
    let camera: Camera = within_seconds(10, || scene.completed(None, &all, 1.0)).1;
    let distance = camera.eye.length();
    assert!((20.0..80.0).contains(&distance), "{distance}");
}
