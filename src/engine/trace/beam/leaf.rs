//! A leaf's blocks before a tile's groups of rays, whatever decides about them.

use super::local_frame::LocalLines;
use super::mesh::{MeshTraversal, Nearest};
use super::parallel::LocalStarts;
use super::rays::{Beam, Projection, RayGroup};
use crate::accel::{Block, WIDE, WideNode};
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::trace::query::{HitId, Query};

/// A block's triangles as a tile's rays meet them.
pub(super) trait BlockTest<L: Lanes>: Sized {
    fn new<const S: usize>(block: Block, beam: &Beam<L, S>, any: bool) -> Self;
    /// Triangles that may be in front of the rays.
    fn live(&self) -> u32;
    /// Triangles that some ray of the group may meet.
    fn may_meet(&self, group: &RayGroup<L>, lines: &LocalLines<L>) -> u32;
    /// One ray, the triangles in lanes. Whether anything has come of it.
    fn ray<Q: Query<L>>(&self, lane: usize, place: &BlockRef, before: &mut GroupState<L>) -> bool;
    /// One triangle, the rays in lanes; the same.
    fn triangle<Q: Query<L>>(
        &self,
        slot: usize,
        place: &BlockRef,
        before: &mut GroupState<L>,
    ) -> bool;
}

/// Which block it is, and its triangles in source order.
pub(super) struct BlockRef<'a> {
    pub number: usize,
    pub sources: &'a [u32; WIDE],
}

/// A group of rays, and what they have met.
pub(super) struct GroupState<'a, L: Lanes> {
    pub group: &'a mut RayGroup<L>,
    pub lines: &'a LocalLines<L>,
    pub starts: &'a LocalStarts<L>,
    pub nearest: &'a mut Nearest<L>,
}

impl<L: Lanes, const S: usize> MeshTraversal<'_, L, S> {
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
            let decider = D::new(block, self.beam, Q::ANY);
            if decider.live() == 0 {
                continue;
            }
            let place = BlockRef {
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
                let mut slots = decider.may_meet(group, lines);
                if slots == 0 {
                    continue;
                }
                let mut before = GroupState {
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
                        met |= decider.ray::<Q>(lane, &place, &mut before);
                    }
                } else {
                    while slots != 0 {
                        let slot = slots.trailing_zeros() as usize;
                        slots &= slots - 1;
                        met |= decider.triangle::<Q>(slot, &place, &mut before);
                    }
                }
                if met {
                    before.group.set_deepest();
                    if Q::ANY {
                        self.report(s, queries);
                    }
                }
            }
        }
    }

    /// Any-hit: tells the query which rays have been blocked, and by what.
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
