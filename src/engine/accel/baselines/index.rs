//! The interface of comparison structures: an order of entries, and a traversal by packets.
//!
//! An [`Index`] is over entries `0..len`. While it is built it knows their boxes, and of
//! triangles the corners; afterwards it knows only their numbers. It passes entries to a
//! [`Leaf`] by one indirect call per leaf, so that each structure is compiled once per lane
//! width, whatever the query (docs/decisions/022-indirect-leaves.md).

use super::count::Count;
use crate::accel::slabs::Slabs;
use crate::geom::triangle::Corners;
use crate::math::Aabb32;
use crate::math::lanes::Lanes;
use serde::Serialize;

/// The primitives that a structure is built over.
#[derive(Clone, Copy)]
pub struct Primitives<'a> {
    pub boxes: &'a [Aabb32],
    /// The corners of triangles; each box is then the smallest around its corners.
    pub corners: Option<&'a [Corners]>,
}

impl Primitives<'_> {
    /// Returns the box around all primitives.
    pub fn bounds(&self) -> Aabb32 {
        let boxes = self.boxes.iter();
        boxes.fold(Aabb32::EMPTY, |all, b| all.union(b))
    }
}

/// The size and the expected cost of a structure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Figures {
    /// The number of inner nodes, or of cells of a grid.
    pub nodes: usize,
    /// The number of leaves or cells that have entries.
    pub leaves: usize,
    pub empty_leaves: usize,
    /// The entries of all leaves, counted as often as leaves have them.
    pub references: usize,
    /// The number of steps to the deepest leaf.
    pub depth: usize,
    /// The expected cost of a random ray that meets the bounds, in primitive tests (surface
    /// area heuristic).
    pub sah: f64,
}

/// A function `leaf(first, count, active, limits)` that tests `count` entries from `first` on
/// for the active lanes, and returns the lanes' new limits.
pub type Leaf<'l, L> = dyn FnMut(usize, usize, <L as Lanes>::Mask, L) -> L + 'l;

/// A comparison structure over entries, in the builder's order.
pub trait Index: Send + Sync {
    /// The scratch memory of one traversal, reused from packet to packet.
    type Scratch<L: Lanes>: Default;

    fn bounds(&self) -> Aabb32;
    fn bytes(&self) -> usize;
    fn figures(&self) -> Figures;

    /// Sorts the entries of each leaf by key, as far as the order in a leaf is free.
    /// `order[i]` is the primitive of entry i; it is permuted alike. `key` takes a primitive.
    fn group(&mut self, order: &mut [u32], key: &dyn Fn(u32) -> (u8, u64));

    /// Visits every entry that some lane's ray may meet between `t_min` and its limit,
    /// roughly nearest first, and returns the final limits. A lane is done when its limit is
    /// −∞, and no new limit may exceed the old one.
    ///
    /// A ray may meet an entry if [`Slabs::interval`] of the entry's own box contains a t in
    /// `t_min..=limit`; then the entry is visited with this lane active before the limit has
    /// sunk below that t. A structure may leave out an entry if no hit can lie there; the k-d
    /// tree does.
    fn walk<L: Lanes>(
        &self,
        slabs: &Slabs<L>,
        t_min: L,
        limit: L,
        scratch: &mut Self::Scratch<L>,
        count: Count,
        leaf: &mut Leaf<L>,
    ) -> L;
}
