//! A better binary tree, from a good one: subtrees are taken out and put in
//! where they cost least (Bittner, Hapala, Havran, Fast Insertion-Based
//! Optimization of Bounding Volume Hierarchies, 2013).
//!
//! In rounds, as Meister and Bittner have them (Parallel Reinsertion for Bounding
//! Volume Hierarchy Optimization, 2018): all subtrees look for their places in
//! the tree as it stands, in parallel; then the moves are made. Where they lock
//! nodes and drop moves that meet, here moves are made one by one, most gain
//! first, each weighed again in the tree that it finds. So every move that is
//! made pays, and the tree does not depend on the threads.
//!
//! What is lowered is the summed area of inner nodes: leaves stay as they are,
//! blocks most of which are full. Trees of single primitives that are cut into
//! blocks afterwards have a lower expected cost still, and are slower
//! (docs/BENCHMARKS.md). No move makes the tree deeper than [`MAX_DEPTH`].

use super::binary::Binary;
use super::costs::{MAX_DEPTH, Scale};
use super::record::{Bound, Row};
use rayon::prelude::*;

/// Rounds at most, and the share of the cost that one must save for another to
/// follow. The first saves three quarters of what there is to save.
const ROUNDS: usize = 8;
const LEAST_GAIN: f64 = 2e-3;
/// A move saves at least this share of the area of the subtree's parent, or is
/// rounding.
const LEAST_MOVE: f32 = 1e-4;
/// Searches to a thread at a time.
const CHUNK: usize = 64;

const NONE: u32 = u32::MAX;

/// One cache line.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Node {
    bounds: Row,
    area: f32,
    parent: u32,
    /// Twice [`NONE`] for a leaf.
    child: [u32; 2],
    /// Levels of inner nodes from here down.
    height: u32,
    /// A leaf's range.
    first: u32,
    count: u32,
}

impl Node {
    #[inline(always)]
    fn bound(&self) -> Bound {
        Bound::of(&self.bounds)
    }

    #[inline(always)]
    fn is_leaf(&self) -> bool {
        self.child[0] == NONE
    }
}

/// A subtree, and the node that shall become its sibling.
#[derive(Clone, Copy)]
struct Move {
    node: u32,
    to: u32,
    /// Area that it saves.
    gain: f32,
}

/// The tree and its order with every subtree where it costs least. Not of
/// nothing.
pub(super) fn improve(nodes: &[Binary], order: &[u32]) -> (Vec<Binary>, Vec<u32>) {
    let mut tree = Bvh4::of(nodes);
    // Where areas mean nothing, no place is better than another.
    if tree.node(tree.root).area.is_finite() {
        for _ in 0..ROUNDS {
            let cost = tree.cost();
            if !(tree.round() > LEAST_GAIN * cost) {
                break;
            }
        }
    }
    tree.linear(order)
}

struct Bvh4 {
    nodes: Vec<Node>,
    root: u32,
    scale: Scale,
}

impl Bvh4 {
    fn of(binary: &[Binary]) -> Bvh4 {
        let scale = Scale::of(Bound::around(&binary[0].bounds));
        let mut nodes: Vec<Node> = Vec::with_capacity(binary.len());
        nodes.extend(binary.iter().map(|node| {
            let bound = Bound::around(&node.bounds);
            let child = match node.child {
                0 => [NONE; 2],
                child => [child, child + 1],
            };
            Node {
                bounds: bound.store(),
                area: area(scale, bound),
                parent: NONE,
                child,
                height: 0,
                first: node.first,
                count: node.count,
            }
        }));
        // Children stand behind their parents.
        for i in (0..nodes.len()).rev() {
            let node = nodes[i];
            if node.is_leaf() {
                continue;
            }
            for child in node.child {
                let below = &mut nodes[child as usize];
                below.parent = i as u32;
                let height = below.height + 1;
                nodes[i].height = nodes[i].height.max(height);
            }
        }
        Bvh4 {
            nodes,
            root: 0,
            scale,
        }
    }

    #[inline(always)]
    fn node(&self, index: u32) -> &Node {
        &self.nodes[index as usize]
    }

    /// The other child of a node's parent.
    #[inline(always)]
    fn sibling(&self, index: u32) -> u32 {
        let [a, b] = self.node(self.node(index).parent).child;
        if a == index { b } else { a }
    }

    #[inline(always)]
    fn area(&self, bound: Bound) -> f32 {
        area(self.scale, bound)
    }

    /// Summed area of inner nodes.
    fn cost(&self) -> f64 {
        let inner = self.nodes.iter().filter(|node| !node.is_leaf());
        inner.map(|node| f64::from(node.area)).sum()
    }

    /// Lets every subtree move once; what that saves.
    fn round(&mut self) -> f64 {
        let all = 0..self.nodes.len() as u32;
        let found = all.into_par_iter().with_min_len(CHUNK);
        let found = found.map_init(Vec::new, |open, node| self.search(node, open));
        let mut moves: Vec<Move> = found.flatten_iter().collect();
        // No two are equal.
        moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
        moves.iter().map(|one| f64::from(self.apply(one))).sum()
    }

    /// The best place for a subtree; `None` where it stands well.
    fn search(&self, node: u32, open: &mut Vec<(u32, f32)>) -> Option<Move> {
        let parent = self.node(node).parent;
        if parent == NONE {
            return None;
        }
        let Node { bounds, area, .. } = *self.node(node);
        let bound = Bound::of(&bounds);
        // What the tree is spared above: the parent, and what its ancestors
        // shrink by, up to the one that is common to the old and the new place.
        let mut spared = self.node(parent).area;
        let mut gain = LEAST_MOVE * spared;
        let mut to = NONE;
        let mut below = node;
        let mut rest = Bound::empty();
        loop {
            // Places under the common ancestor, in its other child.
            let other = self.sibling(below);
            open.push((other, 0.0));
            while let Some((place, growth)) = open.pop() {
                if !(spared - growth - area > gain) {
                    continue;
                }
                let here = self.node(place);
                let joined = self.area(bound.union(here.bound()));
                if spared - growth - joined > gain {
                    gain = spared - growth - joined;
                    to = place;
                }
                let growth = growth + (joined - here.area);
                if !here.is_leaf() && spared - growth - area > gain {
                    open.extend(here.child.map(|child| (child, growth)));
                }
            }
            below = self.node(below).parent;
            rest = rest.union(self.node(other).bound());
            if below != parent {
                let whole = self.node(below).area;
                spared += whole - self.area(rest);
                // Beside all that is left of the ancestor.
                if spared - whole > gain {
                    gain = spared - whole;
                    to = below;
                }
            }
            if self.node(below).parent == NONE {
                break;
            }
        }
        (to != NONE).then_some(Move { node, to, gain })
    }

    /// Makes the move if it still pays; what it saves.
    fn apply(&mut self, one: &Move) -> f32 {
        let Move { node, to, .. } = *one;
        let parent = self.node(node).parent;
        // Moves before this one may have left it at the top.
        if parent == NONE {
            return 0.0;
        }
        let beside = self.sibling(node);
        let mut above = to;
        while above != NONE && above != node {
            above = self.node(above).parent;
        }
        if above == node || to == parent || to == beside {
            return 0.0;
        }
        let least = LEAST_MOVE * self.node(parent).area;
        let gain = self.detach(node) - self.attach(node, to);
        if gain > least && self.node(self.root).height <= MAX_DEPTH as u32 {
            return gain;
        }
        self.detach(node);
        self.attach(node, beside);
        0.0
    }

    /// Takes a subtree out, with its parent, which has no place then; the area
    /// that the tree loses.
    fn detach(&mut self, node: u32) -> f32 {
        let parent = self.node(node).parent;
        let beside = self.sibling(node);
        let above = self.node(parent).parent;
        self.replace(above, parent, beside);
        self.node(parent).area - self.fit(above)
    }

    /// Puts it in as a sibling of `beside`; the area that the tree gains.
    fn attach(&mut self, node: u32, beside: u32) -> f32 {
        let parent = self.node(node).parent;
        let above = self.node(beside).parent;
        self.replace(above, beside, parent);
        self.nodes[parent as usize].child = [beside, node];
        self.nodes[beside as usize].parent = parent;
        // It was not in the tree: all above must be fitted.
        self.nodes[parent as usize].area = 0.0;
        self.nodes[parent as usize].height = 0;
        self.fit(parent)
    }

    /// `new` where `old` was below `above`.
    fn replace(&mut self, above: u32, old: u32, new: u32) {
        self.nodes[new as usize].parent = above;
        if above == NONE {
            self.root = new;
            return;
        }
        let child = &mut self.nodes[above as usize].child;
        child[usize::from(child[0] != old)] = new;
    }

    /// Bounds and heights from a node up, as far as they change; the area that
    /// is gained.
    fn fit(&mut self, mut index: u32) -> f32 {
        let mut gained = 0.0;
        while index != NONE {
            let node = *self.node(index);
            let [a, b] = node.child.map(|child| *self.node(child));
            let bound = a.bound().union(b.bound());
            let own = &mut self.nodes[index as usize];
            own.bounds = bound.store();
            own.area = area(self.scale, bound);
            own.height = 1 + a.height.max(b.height);
            gained += own.area - node.area;
            if own.height == node.height && own.bounds == node.bounds {
                break;
            }
            index = node.parent;
        }
        gained
    }

    /// The tree as the builder leaves it, and the order of its leaves.
    fn linear(&self, order: &[u32]) -> (Vec<Binary>, Vec<u32>) {
        let mut nodes = Vec::with_capacity(self.nodes.len());
        let mut ids = Vec::with_capacity(order.len());
        let plain = |index: u32| Binary {
            bounds: self.node(index).bound().aabb(),
            first: 0,
            count: 0,
            child: 0,
        };
        nodes.push(plain(self.root));
        // The first child's subtree comes first, so a node's primitives begin
        // where it is taken up.
        let mut open = vec![(self.root, 0)];
        while let Some((from, to)) = open.pop() {
            let node = self.node(from);
            nodes[to].first = ids.len() as u32;
            if node.is_leaf() {
                nodes[to].count = node.count;
                let range = node.first as usize..(node.first + node.count) as usize;
                ids.extend_from_slice(&order[range]);
                continue;
            }
            let [a, b] = node.child;
            let child = nodes.len();
            nodes[to].child = child as u32;
            nodes.extend([plain(a), plain(b)]);
            open.extend([(b, child + 1), (a, child)]);
        }
        for i in (0..nodes.len()).rev() {
            let child = nodes[i].child as usize;
            if child != 0 {
                nodes[i].count = nodes[child].count + nodes[child + 1].count;
            }
        }
        (nodes, ids)
    }
}

/// Half the surface area; 0 of nothing.
#[inline(always)]
fn area(scale: Scale, bound: Bound) -> f32 {
    let area = scale.area(bound);
    if area > 0.0 && bound.extent()[0] >= 0.0 {
        area
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::super::costs::{Costs, INSTANCES};
    use super::*;
    use crate::math::Aabb32;

    /// The builder's tree over boxes, with leaves of so many at most.
    fn grown(boxes: &[Aabb32], leaf: usize) -> (Vec<Binary>, Vec<u32>) {
        let costs = Costs { leaf, ..INSTANCES };
        super::super::grow(boxes.len(), |i| boxes[i], &costs)
    }

    /// Every row once, boxes around what is below; levels of inner nodes.
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

    /// Thin boxes in all three directions.
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
        let mut tree = Bvh4::of(&nodes);
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

    /// Few boxes on a coarse grid: much coincides, and the root itself moves.
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

    /// A tree as deep as is allowed stays so.
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
}
