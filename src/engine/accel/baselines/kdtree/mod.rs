//! The k-d tree: planes divide space by the surface area heuristic (Wald and Havran: On
//! building fast kd-Trees for Ray Tracing, and on doing that in O(N log N), 2006).
//!
//! Its hits are those of a linear scan by docs/numerics/boxes.md, X12: a lane's interval in a
//! cell has the bits that [`Slabs::interval`] gives for the cell's box, so some leaf that
//! lists the entry of a hit has an interval that contains the hit's t. X13 says which cells
//! list a triangle ([`clip`]); [`KdClip::Triangle`] lacks it for rays along a triangle's
//! plane to within about 10⁻⁹ of its size.
//!
//! A packet tests an entry once, for all lanes that are not done; a hit counts wherever the
//! entry was found. Checked by tests/structures/accel.rs and tests/structures/counts.rs.

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

/// A node in eight bytes: a plane and the upper child, while the lower child is the next node;
/// or a leaf's range of references.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node {
    /// The bits of the plane's position, or a leaf's first reference.
    head: u32,
    /// The axis, or 3 for a leaf, in the two lowest bits; above them the upper child, or the
    /// number of references.
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

    /// Returns the axis of the plane; 3 for a leaf.
    #[inline(always)]
    fn axis(self) -> usize {
        (self.tail & 3) as usize
    }

    #[inline(always)]
    fn position(self) -> f32 {
        f32::from_bits(self.head)
    }

    /// Returns the upper child.
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

/// A k-d tree over entries `0..len`.
#[derive(Clone, Debug, PartialEq)]
pub struct KdTree {
    /// The nodes, depth first.
    nodes: Vec<Node>,
    /// The entries of the leaves, ascending within each.
    references: Vec<u32>,
    bounds: Aabb32,
    len: usize,
    depth: usize,
    sah: f64,
}

impl KdTree {
    /// The most levels of a built tree, for which the stack has room.
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

    /// Sorts entries by the first part of the key alone, so that neighbours stay neighbours.
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
