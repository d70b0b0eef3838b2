//! One comparison structure of any kind, and room for a walk through it.

use super::bvh4::{Bvh4, Stack};
use super::count::Count;
use super::grid::Grid;
use super::heap::{Boxes, Heap, Queue, Spheres};
use super::index::{Figures, Index, Leaf};
use super::kdtree::{KdScratch, KdTree};
use super::mailbox::Mailbox;
use crate::accel::slabs::Slabs;
use crate::math::Aabb32;
use crate::math::lanes::Lanes;

/// A comparison structure of any kind.
#[derive(Clone, Debug)]
pub enum AnyIndex {
    /// Also the linear scan: a tree without nodes.
    Bvh4(Bvh4),
    Kd(KdTree),
    Grid(Grid),
    Heap(Heap<Boxes>),
    HeapSpheres(Heap<Spheres>),
}

/// Room for one walk of an [`AnyIndex`], reused from packet to packet.
pub enum AnyScratch<L: Lanes> {
    Bvh4(Box<Stack<L>>),
    Kd(Box<KdScratch<L>>),
    Grid(Mailbox),
    Heap(Queue<L>),
}

/// Runs an expression on the structure inside.
macro_rules! any {
    ($index:expr, $inner:ident => $then:expr) => {
        match $index {
            AnyIndex::Bvh4($inner) => $then,
            AnyIndex::Kd($inner) => $then,
            AnyIndex::Grid($inner) => $then,
            AnyIndex::Heap($inner) => $then,
            AnyIndex::HeapSpheres($inner) => $then,
        }
    };
}

impl AnyIndex {
    pub fn bounds(&self) -> Aabb32 {
        any!(self, index => index.bounds())
    }

    pub fn bytes(&self) -> usize {
        any!(self, index => index.bytes())
    }

    pub fn figures(&self) -> Figures {
        any!(self, index => index.figures())
    }

    /// As [`Index::group`].
    pub fn group(&mut self, order: &mut [u32], key: &dyn Fn(u32) -> (u8, u64)) {
        any!(self, index => index.group(order, key));
    }

    pub fn scratch<L: Lanes>(&self) -> AnyScratch<L> {
        match self {
            AnyIndex::Bvh4(_) => AnyScratch::Bvh4(Box::default()),
            AnyIndex::Kd(_) => AnyScratch::Kd(Box::default()),
            AnyIndex::Grid(_) => AnyScratch::Grid(Mailbox::default()),
            AnyIndex::Heap(_) | AnyIndex::HeapSpheres(_) => AnyScratch::Heap(Queue::default()),
        }
    }

    /// Whether scratch is of the kind that this structure is walked with.
    pub fn suits<L: Lanes>(&self, scratch: &AnyScratch<L>) -> bool {
        use AnyScratch as S;
        match self {
            AnyIndex::Bvh4(_) => matches!(scratch, S::Bvh4(_)),
            AnyIndex::Kd(_) => matches!(scratch, S::Kd(_)),
            AnyIndex::Grid(_) => matches!(scratch, S::Grid(_)),
            AnyIndex::Heap(_) | AnyIndex::HeapSpheres(_) => matches!(scratch, S::Heap(_)),
        }
    }

    /// As [`Index::walk`], with the [scratch](AnyIndex::scratch) of a structure of this kind.
    pub fn walk<L: Lanes>(
        &self,
        slabs: &Slabs<L>,
        t_min: L,
        limit: L,
        scratch: &mut AnyScratch<L>,
        count: Count,
        leaf: &mut Leaf<L>,
    ) -> L {
        use AnyScratch as S;
        match (self, scratch) {
            (AnyIndex::Bvh4(tree), S::Bvh4(stack)) => {
                tree.walk(slabs, t_min, limit, stack, count, leaf)
            }
            (AnyIndex::Kd(tree), S::Kd(room)) => tree.walk(slabs, t_min, limit, room, count, leaf),
            (AnyIndex::Grid(grid), S::Grid(mailbox)) => {
                grid.walk(slabs, t_min, limit, mailbox, count, leaf)
            }
            (AnyIndex::Heap(heap), S::Heap(queue)) => {
                heap.walk(slabs, t_min, limit, queue, count, leaf)
            }
            (AnyIndex::HeapSpheres(heap), S::Heap(queue)) => {
                heap.walk(slabs, t_min, limit, queue, count, leaf)
            }
            _ => unreachable!("all structures of a world are of one kind"),
        }
    }
}
