//! The four-wide bounding-volume hierarchy of the comparisons: nodes in one array, leaves as
//! ranges, and one traversal for all queries.
//!
//! Packets lie in lanes. Each box of a node is tested against all rays at once. Children go
//! on the stack farthest first, with every lane's entry t, so that a lane whose limit has
//! shrunk meanwhile stays out. The order of boxes changes no answer, because the query
//! breaks ties by id; so one lane alone chooses it.
//!
//! Checked against the linear scan by tests/structures/accel.rs, bit by bit.

use super::count::Count;
use super::index::{Figures, Index, Leaf};
use crate::accel::slabs::Slabs;
use crate::math::Aabb32;
use crate::math::lanes::{Lanes, Mask, Scalar};

/// The children of a node.
pub const WIDTH: usize = 4;
/// The most levels of a built tree, for which the stack has room.
pub(super) const MAX_DEPTH: usize = 64;
/// The most entries on the stack of one traversal.
const STACK: usize = MAX_DEPTH * (WIDTH - 1) + 1;

/// A node's child: another node, or a leaf's range of entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    /// The most entries in a leaf of a built tree.
    pub const MAX_LEAF: usize = 15;
    /// The most entries of a tree. The scene's check allows a mesh no more triangles.
    pub const MAX_ENTRIES: usize = 1 << 27;

    pub fn node(index: usize) -> Child {
        Child(index as u32)
    }

    pub const fn leaf(first: usize, count: usize) -> Child {
        debug_assert!(count <= Child::MAX_LEAF && first < Child::MAX_ENTRIES);
        Child(Child::LEAF | (count as u32) << 27 | first as u32)
    }

    #[inline(always)]
    fn is_leaf(self) -> bool {
        self.0 & Child::LEAF != 0
    }

    /// Returns the number of entries of a leaf; `None` for a node.
    pub fn leaf_len(self) -> Option<usize> {
        self.is_leaf().then(|| self.range().1)
    }

    /// Returns the range of entries of a leaf; `None` for a node.
    #[inline(always)]
    pub fn leaf_range(self) -> Option<std::ops::Range<usize>> {
        let (first, count) = self.range();
        self.is_leaf().then_some(first..first + count)
    }

    /// Returns the index of a node; meaningless for a leaf.
    #[inline(always)]
    pub fn index(self) -> usize {
        self.0 as usize
    }

    #[inline(always)]
    fn range(self) -> (usize, usize) {
        (
            (self.0 & (Child::MAX_ENTRIES as u32 - 1)) as usize,
            (self.0 >> 27 & 15) as usize,
        )
    }
}

/// A node, in two cache lines: the children's boxes by axis, then the children.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Node {
    pub min: [[f32; WIDTH]; 3],
    pub max: [[f32; WIDTH]; 3],
    pub child: [Child; WIDTH],
    pub count: u32,
}

/// A tree over entries `0..len`, in the builder's order.
#[derive(Clone, Debug)]
pub struct Bvh4 {
    /// The nodes, the root first; none if the tree is a plain list.
    pub nodes: Vec<Node>,
    pub bounds: Aabb32,
    pub len: usize,
    /// The expected cost of a random ray that meets the root, in primitive tests (surface
    /// area heuristic).
    pub sah: f64,
}

impl Bvh4 {
    /// Returns the range of entries of each leaf; `None` if the tree is a plain list.
    pub fn leaves(&self) -> Option<Vec<std::ops::Range<usize>>> {
        if self.nodes.is_empty() {
            return None;
        }
        let children = self.nodes.iter().flat_map(|n| &n.child[..n.count as usize]);
        let leaves = children.filter(|c| c.is_leaf()).map(|c| {
            let (first, count) = c.range();
            first..first + count
        });
        Some(leaves.collect())
    }

    /// Returns the number of levels of nodes.
    fn depth(&self) -> usize {
        let mut deepest = 0;
        let mut open = vec![(0, 1)];
        while let Some((node, depth)) = open.pop() {
            deepest = deepest.max(depth);
            let node: &Node = &self.nodes[node];
            let children = node.child[..node.count as usize].iter();
            let inner = children.filter(|c| !c.is_leaf());
            open.extend(inner.map(|c| (c.0 as usize, depth + 1)));
        }
        deepest
    }
}

impl Index for Bvh4 {
    type Scratch<L: Lanes> = Stack<L>;

    fn bounds(&self) -> Aabb32 {
        self.bounds
    }

    fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>()
    }

    fn figures(&self) -> Figures {
        let leaves = self.leaves();
        Figures {
            nodes: self.nodes.len(),
            leaves: leaves.as_ref().map_or(1, Vec::len),
            empty_leaves: 0,
            references: self.len,
            depth: if leaves.is_some() { self.depth() } else { 0 },
            sah: self.sah,
        }
    }

    fn group(&mut self, order: &mut [u32], key: &dyn Fn(u32) -> (u8, u64)) {
        let by_key = |i: &u32| key(*i);
        match self.leaves() {
            None => order.sort_by_key(by_key),
            Some(leaves) => leaves
                .into_iter()
                .for_each(|leaf| order[leaf].sort_by_key(by_key)),
        }
    }

    #[inline(never)]
    fn walk<L: Lanes>(
        &self,
        slabs: &Slabs<L>,
        t_min: L,
        mut limit: L,
        stack: &mut Stack<L>,
        counter: Count,
        leaf: &mut Leaf<L>,
    ) -> L {
        if self.nodes.is_empty() {
            let active = t_min.le(limit);
            counter.leaf(active);
            return leaf(0, self.len, active, limit);
        }
        let mut top = 0;
        let mut node = &self.nodes[0];
        let mut here = t_min.le(limit);
        loop {
            counter.node(here);
            // Test every child's box against every lane.
            let base = top;
            for i in 0..node.count as usize {
                let at = |b: &[[f32; WIDTH]; 3]| [b[0][i], b[1][i], b[2][i]];
                let (enter, exit) = slabs.interval(at(&node.min), at(&node.max));
                let enter = enter.max(t_min);
                let reached = enter.le(exit.min(limit));
                let bits = reached.bits();
                if bits == 0 {
                    continue;
                }
                // Insert by the entry t of the first active lane, the farthest lowest.
                let key = enter.lane(bits.trailing_zeros() as usize);
                let mut place = top;
                while place > base && stack.key[place - 1] < key {
                    stack.copy(place - 1, place);
                    place -= 1;
                }
                stack.child[place] = node.child[i];
                stack.key[place] = key;
                stack.enter[place] = L::select(reached, enter, L::splat(L::Scalar::INFINITY));
                top += 1;
            }
            // Take the nearest child that some lane still reaches.
            loop {
                if top == 0 {
                    return limit;
                }
                top -= 1;
                let active = stack.enter[top].le(limit);
                if active.none() {
                    continue;
                }
                let child = stack.child[top];
                if !child.is_leaf() {
                    node = &self.nodes[child.0 as usize];
                    here = active;
                    break;
                }
                counter.leaf(active);
                let (first, count) = child.range();
                limit = leaf(first, count, active, limit);
            }
        }
    }
}

impl Bvh4 {
    /// Calls `leaf(first, count)` for every leaf that some ray may meet between its `t_min`
    /// and `limit`, in no order.
    #[inline(always)]
    pub fn leaves_along<L: Lanes>(
        &self,
        slabs: &Slabs<L>,
        (t_min, limit): (L, L),
        mut leaf: impl FnMut(usize, usize),
    ) {
        let Some(root) = self.nodes.first() else {
            return leaf(0, self.len);
        };
        let mut stack = [0; STACK];
        let (mut node, mut top) = (root, 0);
        loop {
            for i in 0..node.count as usize {
                let at = |b: &[[f32; WIDTH]; 3]| [b[0][i], b[1][i], b[2][i]];
                let (enter, exit) = slabs.interval(at(&node.min), at(&node.max));
                if enter.max(t_min).le(exit.min(limit)).none() {
                    continue;
                }
                let child = node.child[i];
                if child.is_leaf() {
                    let (first, count) = child.range();
                    leaf(first, count);
                } else {
                    stack[top] = child.0;
                    top += 1;
                }
            }
            if top == 0 {
                return;
            }
            top -= 1;
            node = &self.nodes[stack[top] as usize];
        }
    }
}

/// The stack of one traversal, reused from packet to packet.
pub struct Stack<L: Lanes> {
    child: [Child; STACK],
    key: [L::Scalar; STACK],
    enter: [L; STACK],
}

impl<L: Lanes> Default for Stack<L> {
    fn default() -> Stack<L> {
        Stack {
            child: [Child(0); STACK],
            key: [L::Scalar::from_f32(0.0); STACK],
            enter: [L::zero(); STACK],
        }
    }
}

impl<L: Lanes> Stack<L> {
    #[inline(always)]
    fn copy(&mut self, from: usize, to: usize) {
        self.child[to] = self.child[from];
        self.key[to] = self.key[from];
        self.enter[to] = self.enter[from];
    }
}
