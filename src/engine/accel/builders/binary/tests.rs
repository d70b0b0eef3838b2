//! Test of the binary tree's depth.

use super::super::costs::TRIANGLES;
use super::super::record::{Rows, row};
use super::*;

/// Boxes halve in size and distance, so that every split takes off a few.
#[test]
fn depth_is_bounded() {
    let count = 40_000;
    let (mut rows, mut spare) = (Rows::new(count), Rows::new(count));
    for (i, to) in rows.rows().iter_mut().enumerate() {
        let x = 2.0_f32.powi(120 - (i % 240) as i32);
        let corner = std::array::from_fn(|k| if k == i % 3 { x } else { 0.0 });
        let max = corner.map(|c: f32| c + 0.1 * x);
        *to = row(&Aabb32 { min: corner, max }, i as u32);
    }
    let extents = Extents::measure(rows.rows());
    let plan = Plan {
        costs: TRIANGLES,
        scale: Scale::fit(extents.bounds),
    };
    let (nodes, order) = grow(rows.rows(), spare.rows(), &extents, &plan);
    let mut depth = vec![1; nodes.len()];
    for (i, node) in nodes.iter().enumerate().filter(|(_, n)| n.child != 0) {
        let child = node.child as usize;
        assert!(child > i);
        let below = depth[i] + 1;
        depth[child..child + 2].fill(below);
    }
    let deepest = *depth.iter().max().unwrap();
    assert!((30..=MAX_DEPTH + 1).contains(&deepest), "{deepest}");
    let mut sorted = order;
    sorted.sort();
    assert!(sorted.into_iter().eq(0..count as u32));
}
