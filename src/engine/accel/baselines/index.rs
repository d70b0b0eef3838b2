//! What all comparison structures have in common: they order entries, and packets walk
//! them.
//!
//! An [`Index`] stands over entries `0..len`, of which it knows boxes (and, of
//! triangles, corners) while it is built, and only numbers afterwards. It hands
//! packets of entries to a [`Leaf`] that it does not know, by an indirect call a leaf, so
//! that each structure is compiled once a width, whatever is asked.

use super::count::Count;
use crate::accel::slabs::Slabs;
use crate::geom::triangle::Corners;
use crate::math::Aabb32;
use crate::math::lanes::Lanes;
use serde::Serialize;

/// What a structure is built over.
#[derive(Clone, Copy)]
pub struct Primitives<'a> {
    pub boxes: &'a [Aabb32],
    /// Of triangles; each box is then the smallest around its corners.
    pub corners: Option<&'a [Corners]>,
}

impl Primitives<'_> {
    /// Around all.
    pub fn bounds(&self) -> Aabb32 {
        let boxes = self.boxes.iter();
        boxes.fold(Aabb32::EMPTY, |all, b| all.union(b))
    }
}

/// The size and the expected cost of a structure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Figures {
    /// Inner nodes, or cells of a grid.
    pub nodes: usize,
    /// Leaves, or cells, with something in them.
    pub leaves: usize,
    pub empty_leaves: usize,
    /// Entries that leaves name: more than there are where some stand in
    /// several leaves.
    pub references: usize,
    /// Steps to the deepest leaf.
    pub depth: usize,
    /// Expected cost of a random ray that meets the bounds, in primitive tests
    /// (surface area heuristic).
    pub sah: f64,
}

/// Tests entries, from the first on so many, for the active lanes; returns the lanes' new
/// limits, given the old ones.
pub type Leaf<'l, L> = dyn FnMut(usize, usize, <L as Lanes>::Mask, L) -> L + 'l;

/// A structure over entries, in the order that its builder gave them.
pub trait Index: Send + Sync {
    /// Room for one walk, reused from packet to packet.
    type Scratch<L: Lanes>: Default;

    fn bounds(&self) -> Aabb32;
    fn bytes(&self) -> usize;
    fn figures(&self) -> Figures;

    /// Brings entries of the same key together within each leaf, where leaves
    /// leave a choice. `order[i]` is where entry i came from; it is permuted
    /// along. `key` is asked about what `order` holds.
    fn group(&mut self, order: &mut [u32], key: &dyn Fn(u32) -> (u8, u64));

    /// Visits every entry that some lane's ray may meet between `t_min` and its
    /// limit, roughly nearest first. `leaf(first, count, active, limits)` tests
    /// entries and returns the lanes' new limits; a lane is done where its limit
    /// is −∞, and no new limit may exceed the old one.
    ///
    /// "May meet" means what [`Slabs::interval`] says of the entry's own box:
    /// where that interval contains a t in `t_min..=limit` for a lane, the entry
    /// is visited with this lane active before the limit has sunk below that t.
    /// (A structure may leave out an entry in whose box no hit can lie there;
    /// the k-d tree says when.)
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
