//! The k-d tree: planes that halve space, by the surface area heuristic (Wald
//! and Havran: On building fast kd-Trees for Ray Tracing, and on doing that in
//! O(N log N), 2006), and packets through it.
//!
//! **Why its hits are those of a linear scan.** A hit has its t inside the
//! padded interval of its own entry's box (see [`crate::accel`]). Let r be the
//! ray's point at that t, and p the same point moved into the box, axis by axis.
//!
//! 1. A lane's interval in a cell is, by max and min of the same expressions,
//!    what [`Slabs::interval`] would give for the cell's box. It contains t for
//!    every closed cell that contains p: where p is r, since planes are padded
//!    by more than the rounding of their t; where p was moved to a side of the
//!    entry's box, since t is inside this side's own padded plane, the cell's
//!    lies further out, and plane expressions are monotone.
//! 2. Going down, take the side on which p lies; in the plane, the one that has
//!    the entry. An entry goes to every child which its region meets on more
//!    than the plane, and its region holds p: the box does by the choice of p,
//!    and of a triangle's plane, r is no further than [`clip`]'s margin. So the
//!    leaf that is reached names the entry, and its interval contains t.
//! 3. A lane stays alive in a cell while the cell's entry t is not beyond its
//!    limit, and the limit never sinks below the least t. So the entry is met
//!    before.
//!
//! A packet tests an entry once, with all of its lanes that are not done: an
//! entry's hit counts wherever it was found. [`KdClip::Triangle`] lacks step 2
//! for rays that run along a triangle's plane to within about 10⁻⁹ of its size.
//!
//! Checked by tests/structures/accel.rs and tests/structures/counts.rs.

mod build;
mod clip;
mod events;
mod quality;
mod walk;

pub use build::build;
pub use quality::{KdClip, KdQuality, KdStop};
pub use walk::KdScratch;

use crate::accel::baselines::count::Count;
use crate::accel::baselines::index::{Figures, Index, Leaf};
use crate::accel::slabs::Slabs;
use crate::math::Aabb32;
use crate::math::lanes::Lanes;

/// Eight bytes: a plane and the upper child, where the lower one is next; or a
/// leaf's range of references.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node {
    /// Bits of the plane's position; a leaf's first reference.
    head: u32,
    /// Axis, or 3 for a leaf, in the two lowest bits; above them the upper
    /// child, or the number of references.
    tail: u32,
}

impl Node {
    const LEAF: u32 = 3;

    fn leaf(first: usize, count: usize) -> Node {
        Node {
            head: first as u32,
            tail: (count as u32) << 2 | Node::LEAF,
        }
    }

    fn inner(axis: usize, position: f32, high: usize) -> Node {
        Node {
            head: position.to_bits(),
            tail: (high as u32) << 2 | axis as u32,
        }
    }

    /// 3 for a leaf.
    #[inline(always)]
    fn axis(self) -> usize {
        (self.tail & 3) as usize
    }

    #[inline(always)]
    fn position(self) -> f32 {
        f32::from_bits(self.head)
    }

    #[inline(always)]
    fn high(self) -> usize {
        (self.tail >> 2) as usize
    }

    #[inline(always)]
    fn references(self) -> std::ops::Range<usize> {
        let first = self.head as usize;
        first..first + (self.tail >> 2) as usize
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct KdTree {
    /// Depth first; the root first.
    nodes: Vec<Node>,
    /// Entries of the leaves, rising within each.
    references: Vec<u32>,
    bounds: Aabb32,
    len: usize,
    depth: usize,
    sah: f64,
}

impl KdTree {
    /// Levels that the builder never exceeds, and the stack allows for.
    pub const MAX_DEPTH: usize = 64;

    fn is_leaf(node: &&Node) -> bool {
        node.axis() == Node::LEAF as usize
    }
}

impl Index for KdTree {
    type Scratch<L: Lanes> = KdScratch<L>;

    fn bounds(&self) -> Aabb32 {
        self.bounds
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.references[..])
    }

    fn figures(&self) -> Figures {
        let leaves = || self.nodes.iter().filter(KdTree::is_leaf);
        let empty = leaves().filter(|leaf| leaf.references().is_empty()).count();
        Figures {
            nodes: self.nodes.len() - leaves().count(),
            leaves: leaves().count() - empty,
            empty_leaves: empty,
            references: self.references.len(),
            depth: self.depth,
            sah: self.sah,
        }
    }

    /// By the first part of the key alone, so that neighbours stay neighbours.
    fn group(&mut self, order: &mut [u32], key: &dyn Fn(u32) -> (u8, u64)) {
        let mut from: Vec<u32> = (0..order.len() as u32).collect();
        from.sort_by_key(|place| key(order[*place as usize]).0);
        let old = order.to_vec();
        let mut to = vec![0_u32; order.len()];
        for (place, from) in (0_u32..).zip(&from) {
            order[place as usize] = old[*from as usize];
            to[*from as usize] = place;
        }
        for reference in &mut self.references {
            *reference = to[*reference as usize];
        }
        for leaf in self.nodes.iter().filter(KdTree::is_leaf) {
            self.references[leaf.references()].sort_unstable();
        }
    }

    #[inline(never)]
    fn walk<L: Lanes>(
        &self,
        slabs: &Slabs<L>,
        t_min: L,
        limit: L,
        scratch: &mut KdScratch<L>,
        count: Count,
        leaf: &mut Leaf<L>,
    ) -> L {
        walk::walk(self, slabs, t_min, limit, scratch, count, leaf)
    }
}
