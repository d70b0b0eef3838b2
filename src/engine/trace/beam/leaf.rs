//! Leaves: tests of blocks of triangles against a beam's groups of rays.

use super::local_frame::LocalLines;
use super::mesh::{MeshTraversal, Nearest};
use super::parallel::LocalStarts;
use super::rays::{Beam, Projection, RayGroup};
use crate::accel::{Block, WIDE, WideNode};
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::trace::query::{HitId, Query};

/// The test of a block's triangles, without bounds or guarded.
pub(super) trait BlockTest<L: Lanes>: Sized {
    fn new<const S: usize>(block: Block, beam: &Beam<L, S>, any: bool) -> Self;
    /// Returns the triangles that may lie in front of the rays.
    fn live(&self) -> u32;
    /// Returns the triangles that some ray of the group may hit.
    fn may_meet(&self, group: &RayGroup<L>, lines: &LocalLines<L>) -> u32;
    /// Tests one ray with the triangles in lanes. Returns whether the state has changed.
    fn ray<Q: Query<L>>(&self, lane: usize, block: &BlockRef, state: &mut GroupState<L>) -> bool;
    /// Tests one triangle with the rays in lanes. Returns whether the state has changed.
    fn triangle<Q: Query<L>>(
        &self,
        slot: usize,
        block: &BlockRef,
        state: &mut GroupState<L>,
    ) -> bool;
}

/// A block's number, and the ids of its triangles.
pub(super) struct BlockRef<'a> {
    pub number: usize,
    pub sources: &'a [u32; WIDE],
}

/// A group of rays and their closest hits so far.
pub(super) struct GroupState<'a, L: Lanes> {
    pub group: &'a mut RayGroup<L>,
    pub lines: &'a LocalLines<L>,
    pub starts: &'a LocalStarts<L>,
    pub nearest: &'a mut Nearest<L>,
}

impl<L: Lanes, const S: usize> MeshTraversal<'_, L, S> {
    /// Tests a leaf's blocks for the rays that hit its box.
    #[inline(always)]
    pub fn leaf<P: Projection, D: BlockTest<L>, Q: Query<L>>(
        &mut self,
        node: &WideNode,
        place: usize,
        (first, count): (usize, usize),
        queries: &mut [Q; S],
    ) {
        let (rays, any) = self.rays_in::<P>(node.child_box(place));
        if any {
            self.blocks::<D, Q>(&rays, first, count, queries);
        }
    }

    /// Tests `count` blocks from `first` on, for a set of rays of each group.
    #[inline(always)]
    pub fn blocks<D: BlockTest<L>, Q: Query<L>>(
        &mut self,
        rays: &[u32; S],
        first: usize,
        count: usize,
        queries: &mut [Q; S],
    ) {
        for number in first..first + count {
            let block = self.mesh.blocks.get(number);
            let test = D::new(block, self.beam, Q::ANY);
            if test.live() == 0 {
                continue;
            }
            let block_ref = BlockRef {
                number,
                sources: block.sources(),
            };
            for s in 0..S {
                let Beam {
                    groups,
                    lines,
                    starts,
                    ..
                } = &mut *self.beam;
                let (group, lines, starts) = (&mut groups[s], &lines[s], &starts[s]);
                let nearest = &mut self.nearest[s];
                if rays[s] == 0 || group.deepest < 0.0 {
                    continue;
                }
                let mut slots = test.may_meet(group, lines);
                if slots == 0 {
                    continue;
                }
                let mut state = GroupState {
                    group,
                    lines,
                    starts,
                    nearest,
                };
                let mut met = false;
                if rays[s].count_ones() < slots.count_ones() {
                    let mut bits = rays[s];
                    while bits != 0 {
                        let lane = bits.trailing_zeros() as usize;
                        bits &= bits - 1;
                        met |= test.ray::<Q>(lane, &block_ref, &mut state);
                    }
                } else {
                    while slots != 0 {
                        let slot = slots.trailing_zeros() as usize;
                        slots &= slots - 1;
                        met |= test.triangle::<Q>(slot, &block_ref, &mut state);
                    }
                }
                if met {
                    state.group.set_deepest();
                    if Q::ANY {
                        self.report(s, queries);
                    }
                }
            }
        }
    }

    /// Any hit: reports blocked rays and the occluder to the query.
    #[inline(always)]
    fn report<Q: Query<L>>(&mut self, s: usize, queries: &mut [Q; S]) {
        let nearest = &mut self.nearest[s];
        if let Some(last) = nearest.met.checked_ilog2() {
            let id = HitId {
                instance: self.entry.instance,
                primitive: nearest.sources.lane(last as usize).bits() as u32,
            };
            queries[s].block(L::Mask::from_bits(nearest.met), id);
            nearest.met = 0;
        }
    }
}
