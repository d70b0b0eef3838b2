//! What a query did: steps through a structure, leaves, primitive tests.
//!
//! The walks are generic over [`Count`]. `()` counts nothing and is compiled
//! away; a [`Counter`] says what a packet did, and with how many of its lanes.
//! Methods take `&self`, since a walk and the closure that tests its leaves
//! count into the same one.

use crate::math::lanes::Mask;
use std::cell::Cell;

pub trait Count {
    /// Whether anything is counted at all.
    const ON: bool;
    /// A step: the boxes of a node, a plane, a cell, an element of a queue.
    /// `lanes`: those that it is made for.
    fn node<M: Mask>(&self, lanes: M);
    /// A leaf, or a cell that is not empty.
    fn leaf<M: Mask>(&self, lanes: M);
    /// Tests of `primitives` against the packet.
    fn test<M: Mask>(&self, lanes: M, primitives: usize);
    /// Tests that were not made, since the packet had met the primitives before.
    fn spared(&self, primitives: usize);
}

impl Count for () {
    const ON: bool = false;
    #[inline(always)]
    fn node<M: Mask>(&self, _: M) {}
    #[inline(always)]
    fn leaf<M: Mask>(&self, _: M) {}
    #[inline(always)]
    fn test<M: Mask>(&self, _: M, _: usize) {}
    #[inline(always)]
    fn spared(&self, _: usize) {}
}

/// Sums over packets. At one lane, those of the literature: per ray.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    pub nodes: u64,
    pub leaves: u64,
    pub tests: u64,
    pub spared: u64,
    /// The same in rays: each step counts once for each of its lanes.
    pub node_lanes: u64,
    pub leaf_lanes: u64,
    pub test_lanes: u64,
}

impl std::ops::AddAssign for Counts {
    fn add_assign(&mut self, other: Counts) {
        self.nodes += other.nodes;
        self.leaves += other.leaves;
        self.tests += other.tests;
        self.spared += other.spared;
        self.node_lanes += other.node_lanes;
        self.leaf_lanes += other.leaf_lanes;
        self.test_lanes += other.test_lanes;
    }
}

/// Counts of one thread.
#[derive(Debug, Default)]
pub struct Counter(Cell<Counts>);

impl Counter {
    pub fn counts(&self) -> Counts {
        self.0.get()
    }

    #[inline(always)]
    fn change(&self, change: impl FnOnce(&mut Counts)) {
        let mut counts = self.0.get();
        change(&mut counts);
        self.0.set(counts);
    }
}

#[inline(always)]
fn on<M: Mask>(lanes: M) -> u64 {
    u64::from(lanes.bits().count_ones())
}

impl Count for Counter {
    const ON: bool = true;
    #[inline(always)]
    fn node<M: Mask>(&self, lanes: M) {
        self.change(|c| {
            c.nodes += 1;
            c.node_lanes += on(lanes);
        });
    }
    #[inline(always)]
    fn leaf<M: Mask>(&self, lanes: M) {
        self.change(|c| {
            c.leaves += 1;
            c.leaf_lanes += on(lanes);
        });
    }
    #[inline(always)]
    fn test<M: Mask>(&self, lanes: M, primitives: usize) {
        self.change(|c| {
            c.tests += primitives as u64;
            c.test_lanes += on(lanes) * primitives as u64;
        });
    }
    #[inline(always)]
    fn spared(&self, primitives: usize) {
        self.change(|c| c.spared += primitives as u64);
    }
}
