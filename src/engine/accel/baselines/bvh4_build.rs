//! The builder of four-wide trees. A binary tree is built by the binned surface area
//! heuristic (Goldsmith and Salmon 1987; Wald, On fast Construction of SAH-based Bounding
//! Volume Hierarchies, 2007); then its nodes are collapsed into four-wide ones, the largest
//! area first (Wald, Benthin, Boulos 2008).
//!
//! The builder is deterministic: no step depends on threads or hashing, and of equal costs
//! the first split is taken. Depth is bounded, because ranges far down are halved.

use super::bvh4::{Bvh4, Child, MAX_DEPTH, Node, WIDTH};
use crate::math::Aabb32;
use std::ops::Range;

/// The parameters of the builder.
#[derive(Clone, Copy, Debug)]
pub struct Bvh4Quality {
    /// The cost of a node's box tests, in primitive tests.
    pub node_cost: f32,
    /// The most entries of a leaf, 1 to [`Child::MAX_LEAF`].
    pub max_leaf: usize,
    /// The number of bins on each axis, at least 2.
    pub bins: usize,
}

/// The costs are measured on dragon_202k: packets take about as long for four boxes as for
/// one triangle.
impl Default for Bvh4Quality {
    fn default() -> Bvh4Quality {
        Bvh4Quality {
            node_cost: 1.0,
            max_leaf: 8,
            bins: 32,
        }
    }
}

/// Makes a list without nodes, of which every entry is tested.
pub fn linear(boxes: &[Aabb32]) -> Bvh4 {
    Bvh4 {
        nodes: Vec::new(),
        bounds: around(boxes),
        len: boxes.len(),
        sah: boxes.len() as f64,
    }
}

/// Builds a tree over boxes, and returns it with the order of the boxes in its leaves.
pub fn build(boxes: &[Aabb32], quality: &Bvh4Quality) -> (Bvh4, Vec<u32>) {
    assert!(boxes.len() <= Child::MAX_ENTRIES);
    let quality = &Bvh4Quality {
        node_cost: quality.node_cost,
        max_leaf: quality.max_leaf.clamp(1, Child::MAX_LEAF),
        bins: quality.bins.max(2),
    };
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    if boxes.len() <= 1 {
        return (linear(boxes), order);
    }
    let binary = split_all(boxes, &mut order, quality);
    let mut tree = linear(boxes);
    collapse(&binary, &mut tree);
    tree.sah = expected_cost(&tree, quality);
    (tree, order)
}

/// Returns the box around all boxes.
fn around(boxes: &[Aabb32]) -> Aabb32 {
    boxes.iter().fold(Aabb32::EMPTY, |all, b| all.union(b))
}

/// A node of the binary tree that is built first.
struct Binary {
    bounds: Aabb32,
    range: Range<usize>,
    /// The first of two children; 0 for a leaf.
    children: usize,
}

/// Builds the binary tree, and sorts `order` into the order of its leaves.
fn split_all(boxes: &[Aabb32], order: &mut [u32], quality: &Bvh4Quality) -> Vec<Binary> {
    let whole = |range: Range<usize>, order: &[u32]| Binary {
        bounds: order[range.clone()]
            .iter()
            .fold(Aabb32::EMPTY, |all, i| all.union(&boxes[*i as usize])),
        range,
        children: 0,
    };
    let mut nodes = vec![whole(0..order.len(), order)];
    let mut open = vec![(0, 0)];
    while let Some((node, depth)) = open.pop() {
        let range = nodes[node].range.clone();
        if range.len() <= 1 {
            continue;
        }
        let bounds = nodes[node].bounds;
        let split = if depth >= MAX_DEPTH - 32 {
            // Halving takes at most 27 more levels.
            (range.len() > quality.max_leaf).then(|| range.len() / 2)
        } else {
            best_split(boxes, &mut order[range.clone()], &bounds, quality)
        };
        let Some(split) = split else { continue };
        let middle = range.start + split;
        let children = nodes.len();
        nodes.push(whole(range.start..middle, order));
        nodes.push(whole(middle..range.end, order));
        nodes[node].children = children;
        open.push((children + 1, depth + 1));
        open.push((children, depth + 1));
    }
    nodes
}

/// The box and the number of the entries in one bin.
#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb32,
    count: usize,
}

/// Finds the cheapest cut of a range and reorders the range for it; `None` if the range
/// becomes a leaf.
fn best_split(
    boxes: &[Aabb32],
    order: &mut [u32],
    bounds: &Aabb32,
    quality: &Bvh4Quality,
) -> Option<usize> {
    let mut low = [f32::INFINITY; 3];
    let mut high = [f32::NEG_INFINITY; 3];
    for i in order.iter() {
        for axis in 0..3 {
            let c = boxes[*i as usize].center2(axis);
            low[axis] = low[axis].min(c);
            high[axis] = high[axis].max(c);
        }
    }
    let count = order.len();
    let leaf_cost = count as f32;
    let mut best: Option<(f32, usize, usize)> = None;
    let mut bins = vec![
        Bin {
            bounds: Aabb32::EMPTY,
            count: 0,
        };
        quality.bins
    ];
    let mut right_costs = vec![0.0_f32; quality.bins];
    let scale_of = |axis: usize| quality.bins as f32 * 0.9999 / (high[axis] - low[axis]);
    let bin_of = |i: u32, axis: usize, scale: f32| {
        let bin = (boxes[i as usize].center2(axis) - low[axis]) * scale;
        (bin as usize).min(quality.bins - 1)
    };
    for axis in 0..3 {
        let scale = scale_of(axis);
        // An axis without extent, or with one too large or too small for f32, has no bins.
        if !(scale.is_finite() && scale > 0.0) {
            continue;
        }
        bins.fill(Bin {
            bounds: Aabb32::EMPTY,
            count: 0,
        });
        for i in order.iter() {
            let bin = &mut bins[bin_of(*i, axis, scale)];
            bin.bounds = bin.bounds.union(&boxes[*i as usize]);
            bin.count += 1;
        }
        let (mut side, mut n) = (Aabb32::EMPTY, 0);
        for b in (1..bins.len()).rev() {
            side = side.union(&bins[b].bounds);
            n += bins[b].count;
            right_costs[b] = side.half_area() * n as f32;
        }
        (side, n) = (Aabb32::EMPTY, 0);
        for b in 1..bins.len() {
            side = side.union(&bins[b - 1].bounds);
            n += bins[b - 1].count;
            if n == 0 || n == count {
                continue;
            }
            let cost = side.half_area() * n as f32 + right_costs[b];
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, b));
            }
        }
    }
    let Some((cost, axis, bin)) = best else {
        // All centres coincide.
        return (count > quality.max_leaf).then_some(count / 2);
    };
    let relative = quality.node_cost + cost / bounds.half_area();
    if count <= quality.max_leaf && (relative >= leaf_cost || relative.is_nan()) {
        return None;
    }
    let scale = scale_of(axis);
    Some(partition(order, |i| bin_of(i, axis, scale) < bin))
}

/// Moves the entries that go left to the front, and returns their number. It is stable on
/// neither side, but deterministic.
fn partition(order: &mut [u32], left: impl Fn(u32) -> bool) -> usize {
    let mut first = 0;
    let mut last = order.len();
    while first < last {
        if left(order[first]) {
            first += 1;
        } else {
            last -= 1;
            order.swap(first, last);
        }
    }
    first
}

/// Collapses the binary tree into four-wide nodes; each opens inner children of the largest
/// area until it has four.
fn collapse(binary: &[Binary], tree: &mut Bvh4) {
    let empty = Node {
        min: [[0.0; WIDTH]; 3],
        max: [[0.0; WIDTH]; 3],
        child: [Child::node(0); WIDTH],
        count: 0,
    };
    tree.nodes.push(empty);
    let mut open = vec![(0_usize, 0_usize)];
    while let Some((from, to)) = open.pop() {
        let mut chosen = vec![from];
        while chosen.len() < WIDTH {
            let inner = (0..chosen.len()).filter(|i| binary[chosen[*i]].children != 0);
            let largest = inner.reduce(|a, b| {
                let area = |i: usize| binary[chosen[i]].bounds.half_area();
                if area(b) > area(a) { b } else { a }
            });
            let Some(largest) = largest else { break };
            let children = binary[chosen[largest]].children;
            chosen[largest] = children;
            chosen.insert(largest + 1, children + 1);
        }
        let mut node = empty;
        node.count = chosen.len() as u32;
        for (i, c) in chosen.iter().enumerate() {
            let child = &binary[*c];
            for axis in 0..3 {
                node.min[axis][i] = child.bounds.min[axis];
                node.max[axis][i] = child.bounds.max[axis];
            }
            node.child[i] = if child.children == 0 {
                Child::leaf(child.range.start, child.range.len())
            } else {
                let index = tree.nodes.len();
                tree.nodes.push(empty);
                open.push((*c, index));
                Child::node(index)
            };
        }
        tree.nodes[to] = node;
    }
}

/// Returns the expected cost Σ area·cost / root area, over nodes and leaves.
fn expected_cost(tree: &Bvh4, quality: &Bvh4Quality) -> f64 {
    let whole = f64::from(tree.bounds.half_area());
    let mut cost = f64::from(quality.node_cost);
    for node in &tree.nodes {
        for i in 0..node.count as usize {
            let bounds = Aabb32 {
                min: std::array::from_fn(|k| node.min[k][i]),
                max: std::array::from_fn(|k| node.max[k][i]),
            };
            let own = match node.child[i].leaf_len() {
                Some(count) => count as f64,
                None => f64::from(quality.node_cost),
            };
            cost += own * f64::from(bounds.half_area()) / whole;
        }
    }
    cost
}
