//! Counts of a query's work: steps through a structure, leaves, primitive tests.
//!
//! Comparison structures are given a [`Count`], which counts into a [`Counter`] if it has
//! one and costs a branch a step if not. Its methods take `&self`, because a traversal and
//! the leaf that it calls count into the same counter.

use crate::math::lanes::Mask;
use std::cell::Cell;

/// Sums over packets. At one lane they are the counts per ray of the literature.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    pub nodes: u64,
    pub leaves: u64,
    pub tests: u64,
    /// Tests that mailboxes saved.
    pub spared: u64,
    /// Steps, each counted once for each of its lanes; likewise leaves and tests.
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

/// The counts of one thread.
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

/// Returns the number of lanes that are set.
#[inline(always)]
fn on<M: Mask>(lanes: M) -> u64 {
    u64::from(lanes.bits().count_ones())
}

/// The counter of a traversal, if it has one.
#[derive(Clone, Copy, Debug, Default)]
pub struct Count<'a>(pub Option<&'a Counter>);

impl Count<'_> {
    /// Returns whether anything is counted.
    #[inline(always)]
    pub fn is_on(self) -> bool {
        self.0.is_some()
    }

    /// Counts a step for `lanes`: the boxes of a node, a plane, a cell, or an element of a
    /// queue.
    #[inline(always)]
    pub fn node<M: Mask>(self, lanes: M) {
        if let Some(counter) = self.0 {
            counter.change(|c| {
                c.nodes += 1;
                c.node_lanes += on(lanes);
            });
        }
    }

    /// Counts a leaf, or a cell that is not empty.
    #[inline(always)]
    pub fn leaf<M: Mask>(self, lanes: M) {
        if let Some(counter) = self.0 {
            counter.change(|c| {
                c.leaves += 1;
                c.leaf_lanes += on(lanes);
            });
        }
    }

    /// Counts tests of `primitives` against the packet.
    #[inline(always)]
    pub fn test<M: Mask>(self, lanes: M, primitives: usize) {
        if let Some(counter) = self.0 {
            counter.change(|c| {
                c.tests += primitives as u64;
                c.test_lanes += on(lanes) * primitives as u64;
            });
        }
    }

    /// Counts tests that were not made, because the packet had tested the primitives before.
    #[inline(always)]
    pub fn spared(self, primitives: usize) {
        if let Some(counter) = self.0 {
            counter.change(|c| c.spared += primitives as u64);
        }
    }
}
