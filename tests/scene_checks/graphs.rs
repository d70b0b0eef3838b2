//! Graphs made to exhaust the check, and what they unfold into.

use super::*;
use std::time::{Duration, Instant};

/// Nodes that each hold the next one twice; gives the first.
fn doubling(b: &mut SceneBuilder, levels: usize, last: &[Edge]) -> NodeId {
    (0..levels).fold(b.node("", last), |below, _| {
        b.node("", &[Edge::node(below), Edge::node(below)])
    })
}

fn quickly<T>(work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    let took = start.elapsed();
    assert!(took < Duration::from_secs(10), "took {took:?}");
    result
}

#[test]
fn deep_sharing_is_refused_quickly() {
    let trillion = quickly(|| {
        refused(|b| {
            let top = doubling(b, 40, &[Edge::shape(ShapeId(0))]);
            b.instance("", Edge::node(top));
        })
    });
    assert_is!(trillion, TooManyAppearances, "1099511627777", "16777216");
    // More than a u64 can count.
    let endless = quickly(|| {
        refused(|b| {
            let top = doubling(b, 200, &[Edge::shape(ShapeId(0))]);
            b.instance("", Edge::node(top));
        })
    });
    assert_is!(endless, TooManyAppearances, "18446744073709551615");
    // As many ways to nothing at all: nothing to unfold.
    let hollow = quickly(|| {
        check(|b| {
            let top = doubling(b, 60, &[]);
            b.instance("", Edge::node(top));
        })
    });
    assert!(hollow.is_ok());
    // Few appearances, each at the end of a long way: 2^20 · 10^5 steps.
    let winding = quickly(|| {
        refused(|b| {
            let mut chain = b.node("", &[Edge::shape(ShapeId(0))]);
            for _ in 0..100_000 {
                chain = b.node("", &[Edge::node(chain)]);
            }
            let top = doubling(b, 20, &[Edge::node(chain)]);
            b.instance("", Edge::node(top));
        })
    });
    assert_is!(winding, TooManyNodes, "nodes");
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
    let scene = quickly(|| b.finish()).expect("deep, but sound");
    let all = Appearances::of(&scene).unwrap();
    assert_eq!(all.len(), 1);
    assert_eq!(all.rows[0].world_from_object.translation, [1e6, 0.0, 0.0]);
    assert_eq!(all.rows[0].object_from_world.translation, [-1e6, 0.0, 0.0]);
}

/// 3×4 matrices as rows, multiplied as the definition says.
fn times(a: [[f64; 4]; 3], b: [[f64; 4]; 3]) -> [[f64; 4]; 3] {
    std::array::from_fn(|r| {
        std::array::from_fn(|c| {
            let sum = a[r][0] * b[0][c] + a[r][1] * b[1][c] + a[r][2] * b[2][c];
            if c == 3 { sum + a[r][3] } else { sum }
        })
    })
}

fn rows(m: &Affine) -> [[f64; 4]; 3] {
    std::array::from_fn(|r| {
        [
            m.linear[0][r],
            m.linear[1][r],
            m.linear[2][r],
            m.translation[r],
        ]
    })
}

#[test]
fn appearances_in_the_order_of_the_file() {
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
    let all = Appearances::of(&scene).unwrap();

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
