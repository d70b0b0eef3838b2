//! Tests of reinsertion: savings, shape and depth of the tree.

use super::super::costs::{Costs, INSTANCES};
use super::*;
use crate::math::Aabb32;

/// Grows the builder's tree over boxes, with at most `leaf` in a leaf.
fn grown(boxes: &[Aabb32], leaf: usize) -> (Vec<Binary>, Vec<u32>) {
    let costs = Costs { leaf, ..INSTANCES };
    super::super::grow(boxes.len(), |i| boxes[i], &costs)
}

/// Checks that every row occurs once and that boxes contain those below, and returns the
/// levels of inner nodes.
fn check(nodes: &[Binary], order: &[u32], boxes: &[Aabb32]) -> usize {
    let mut sorted = order.to_vec();
    sorted.sort();
    assert!(sorted.into_iter().eq(0..boxes.len() as u32));
    let mut depth = vec![0; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        let range = node.first as usize..(node.first + node.count) as usize;
        let ids = order[range].iter();
        let around = ids.fold(Aabb32::EMPTY, |all, id| all.union(&boxes[*id as usize]));
        assert_eq!(node.bounds, around);
        if node.child != 0 {
            let child = node.child as usize;
            assert!(child > i);
            let [a, b] = [nodes[child], nodes[child + 1]];
            assert_eq!((a.first, a.count + b.count), (node.first, node.count));
            let below = depth[i] + 1;
            depth[child..child + 2].fill(below);
        }
    }
    depth.into_iter().max().unwrap()
}

fn numbers() -> impl FnMut() -> f32 {
    let mut state = 5_u64;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 40) as f32 / (1 << 24) as f32
    }
}

/// Makes thin boxes in all three directions.
fn sticks(count: usize) -> Vec<Aabb32> {
    let mut next = numbers();
    let boxes = (0..count).map(|i| {
        let min: [f32; 3] = std::array::from_fn(|_| next());
        let size = |k: usize| if k == i % 3 { 0.5 } else { 0.01 };
        Aabb32 {
            min,
            max: std::array::from_fn(|k| min[k] + size(k)),
        }
    });
    boxes.collect()
}

#[test]
fn every_round_saves_what_it_says() {
    let boxes = sticks(3000);
    let (nodes, order) = grown(&boxes, 4);
    let mut tree = BinaryTree::link(&nodes);
    let first = tree.cost();
    for _ in 0..6 {
        let before = tree.cost();
        let saved = tree.round();
        let after = tree.cost();
        assert!(saved >= 0.0 && (before - saved - after).abs() < 1e-4 * before);
        let (nodes, order) = tree.linear(&order);
        check(&nodes, &order, &boxes);
    }
    assert!(tree.cost() < 0.97 * first, "{first} {}", tree.cost());
    let (nodes, order) = improve(&nodes, &order);
    check(&nodes, &order, &boxes);
}

/// On a coarse grid few boxes often coincide, and the root itself moves.
#[test]
fn small_trees_stay_whole() {
    let mut next = numbers();
    for case in 0..6000 {
        let boxes = (0..2 + case % 120).map(|_| {
            let corners: [[f32; 3]; 3] =
                std::array::from_fn(|_| std::array::from_fn(|_| (next() * 16.0).floor()));
            crate::accel::bounds::corner_bounds(&corners)
        });
        let boxes: Vec<Aabb32> = boxes.collect();
        let (nodes, order) = grown(&boxes, 1 + case % 4);
        let (nodes, order) = improve(&nodes, &order);
        check(&nodes, &order, &boxes);
    }
}

/// A tree of the greatest depth gets no deeper.
#[test]
fn depth_is_bounded() {
    // Each box is twice the size of the one before it, which it holds.
    let boxes: Vec<Aabb32> = (0..400)
        .map(|i| {
            let size = 2.0_f32.powi(i % 240 - 120);
            let shift = if i < 240 { 0.0 } else { size };
            Aabb32 {
                min: [shift, 0.0, 0.0],
                max: [shift + size, size, size],
            }
        })
        .collect();
    let (nodes, order) = grown(&boxes, 1);
    let before = check(&nodes, &order, &boxes);
    let (nodes, order) = improve(&nodes, &order);
    let after = check(&nodes, &order, &boxes);
    assert!(before > 20 && after <= MAX_DEPTH, "{before} {after}");
}
