//! Reinsertion: subtrees of a binary tree are removed and inserted where they cost least
//! (Bittner, Hapala, Havran, Fast Insertion-Based Optimization of Bounding Volume
//! Hierarchies, 2013).
//!
//! It works in rounds, as Meister and Bittner do (Parallel Reinsertion for Bounding Volume
//! Hierarchy Optimization, 2018): all subtrees search for their places in the current tree,
//! in parallel; then the moves are made. They lock nodes and drop moves that conflict. Here
//! moves are made one by one, the greatest gain first, and each is evaluated again in the
//! tree as it is then. So every move that is made pays, and the tree does not depend on the
//! number of threads.
//!
//! The summed area of inner nodes is lowered. Leaves stay as they are: blocks, most of them
//! full. Trees of single primitives that are cut into blocks afterwards have a lower expected
//! cost, but are slower (docs/decisions/012-finer-leaves.md). No move makes the tree deeper
//! than [`MAX_DEPTH`].

use super::binary::Binary;
use super::costs::{MAX_DEPTH, Scale};
use super::record::{Bound, Row};
use rayon::prelude::*;

/// The most rounds. The first makes three quarters of all savings.
const ROUNDS: usize = 8;
/// The share of the cost that a round must save for another to follow.
const LEAST_GAIN: f64 = 2e-3;
/// The share of the area of the subtree's parent that a move must save; less may be
/// rounding.
const LEAST_MOVE: f32 = 1e-4;
/// Searches that a thread makes at a time.
const CHUNK: usize = 64;

const NONE: u32 = u32::MAX;

/// A node, in one cache line.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Node {
    bounds: Row,
    area: f32,
    parent: u32,
    /// Both children; both are [`NONE`] for a leaf.
    child: [u32; 2],
    /// Levels of inner nodes from here down.
    height: u32,
    /// The range of a leaf.
    first: u32,
    count: u32,
}

impl Node {
    #[inline(always)]
    fn bound(&self) -> Bound {
        Bound::load(&self.bounds)
    }

    #[inline(always)]
    fn is_leaf(&self) -> bool {
        self.child[0] == NONE
    }
}

/// A possible move: a subtree, and the node that becomes its sibling.
#[derive(Clone, Copy)]
struct Move {
    node: u32,
    to: u32,
    /// The area that the move saves.
    gain: f32,
}

/// Moves subtrees to where they cost least, and returns the new tree and its order. The tree
/// must have a node.
pub(super) fn improve(nodes: &[Binary], order: &[u32]) -> (Vec<Binary>, Vec<u32>) {
    let mut tree = BinaryTree::link(nodes);
    // Without finite areas no place is better than another.
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

/// The binary tree with links to parents.
struct BinaryTree {
    nodes: Vec<Node>,
    root: u32,
    scale: Scale,
}

impl BinaryTree {
    /// Adds links to parents, areas and heights.
    fn link(binary: &[Binary]) -> BinaryTree {
        let scale = Scale::fit(Bound::around(&binary[0].bounds));
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
        // Children come behind their parents.
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
        BinaryTree {
            nodes,
            root: 0,
            scale,
        }
    }

    #[inline(always)]
    fn node(&self, index: u32) -> &Node {
        &self.nodes[index as usize]
    }

    /// Returns the other child of a node's parent.
    #[inline(always)]
    fn sibling(&self, index: u32) -> u32 {
        let [a, b] = self.node(self.node(index).parent).child;
        if a == index { b } else { a }
    }

    #[inline(always)]
    fn area(&self, bound: Bound) -> f32 {
        area(self.scale, bound)
    }

    /// Returns the summed area of inner nodes.
    fn cost(&self) -> f64 {
        let inner = self.nodes.iter().filter(|node| !node.is_leaf());
        inner.map(|node| f64::from(node.area)).sum()
    }

    /// Lets every subtree move once, and returns the area saved.
    fn round(&mut self) -> f64 {
        let all = 0..self.nodes.len() as u32;
        let found = all.into_par_iter().with_min_len(CHUNK);
        let found = found.map_init(Vec::new, |open, node| self.search(node, open));
        let mut moves: Vec<Move> = found.flatten_iter().collect();
        // No two moves compare equal.
        moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
        moves.iter().map(|one| f64::from(self.apply(one))).sum()
    }

    /// Finds the best place for a subtree; `None` if no move pays.
    fn search(&self, node: u32, open: &mut Vec<(u32, f32)>) -> Option<Move> {
        let parent = self.node(node).parent;
        if parent == NONE {
            return None;
        }
        let Node { bounds, area, .. } = *self.node(node);
        let bound = Bound::load(&bounds);
        // The area saved above: that of the parent, and what its ancestors shrink by, up to the
        // common ancestor of the old and the new place.
        let mut spared = self.node(parent).area;
        let mut gain = LEAST_MOVE * spared;
        let mut to = NONE;
        let mut below = node;
        let mut rest = Bound::empty();
        loop {
            // Search the other child of the common ancestor.
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
                // The place beside all that is left of the ancestor.
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

    /// Makes a move if it still pays, and returns the area saved.
    fn apply(&mut self, one: &Move) -> f32 {
        let Move { node, to, .. } = *one;
        let parent = self.node(node).parent;
        // An earlier move may have made the node the root.
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

    /// Removes a subtree together with its parent node, and returns the area that the tree
    /// loses.
    fn detach(&mut self, node: u32) -> f32 {
        let parent = self.node(node).parent;
        let beside = self.sibling(node);
        let above = self.node(parent).parent;
        self.replace(above, parent, beside);
        self.node(parent).area - self.fit(above)
    }

    /// Inserts a removed subtree as a sibling of `beside`, and returns the area that the tree
    /// gains.
    fn attach(&mut self, node: u32, beside: u32) -> f32 {
        let parent = self.node(node).parent;
        let above = self.node(beside).parent;
        self.replace(above, beside, parent);
        self.nodes[parent as usize].child = [beside, node];
        self.nodes[beside as usize].parent = parent;
        // The parent was not in the tree, so all nodes above it must be updated.
        self.nodes[parent as usize].area = 0.0;
        self.nodes[parent as usize].height = 0;
        self.fit(parent)
    }

    /// Puts `new` in the place of `old`, a child of `above`.
    fn replace(&mut self, above: u32, old: u32, new: u32) {
        self.nodes[new as usize].parent = above;
        if above == NONE {
            self.root = new;
            return;
        }
        let child = &mut self.nodes[above as usize].child;
        child[usize::from(child[0] != old)] = new;
    }

    /// Updates bounds and heights from a node up, as far as they change, and returns the area
    /// gained.
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

    /// Returns the tree in the builder's layout, and the order of its leaves.
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
        // The first child's subtree comes first, so a node's primitives begin where the order
        // ends when the node is visited.
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

/// Returns half the surface area, or 0 for an empty box.
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
mod tests;
