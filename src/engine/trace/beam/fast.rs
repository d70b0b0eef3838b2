//! Block tests in f32 without bounds: edge functions decide.

use super::block::Edges;
use super::leaf::{BlockRef, BlockTest, GroupState};
use super::local_frame::LocalLines;
use super::rays::{Beam, Projection, RayGroup};
use crate::accel::Block;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::trace::query::Query;
use std::marker::PhantomData;

/// The [`BlockTest`] of `fast`.
pub(super) struct Fast<P> {
    edges: Edges,
    projection: PhantomData<P>,
}

impl<L: Lanes, P: Projection> BlockTest<L> for Fast<P> {
    #[inline(always)]
    fn new<const S: usize>(block: Block, beam: &Beam<L, S>, any: bool) -> Fast<P> {
        Fast {
            edges: Edges::new::<P, L, S>(block, beam, any),
            projection: PhantomData,
        }
    }

    #[inline(always)]
    fn live(&self) -> u32 {
        self.edges.live
    }

    #[inline(always)]
    fn may_meet(&self, group: &RayGroup<L>, _lines: &LocalLines<L>) -> u32 {
        self.edges.may_meet(group)
    }

    #[inline(always)]
    fn ray<Q: Query<L>>(&self, lane: usize, block: &BlockRef, state: &mut GroupState<L>) -> bool {
        let GroupState {
            group,
            starts,
            nearest,
            ..
        } = state;
        let at = |x: L| x.lane(lane).to_f64() as f32;
        let limit = at(group.limit);
        let line = (at(group.u), at(group.v));
        let start = if P::PARALLEL { at(starts.depth) } else { 0.0 };
        let (mut hits, depth, det) = self.edges.triangles::<P>(line, start, limit);
        if hits == 0 {
            return false;
        }
        let mut limit = limit;
        let mut best = hits.trailing_zeros() as usize;
        let mut found = Q::ANY;
        if Q::ANY {
            limit = -1.0;
            hits = 0;
        }
        let mut source = nearest.source(lane);
        let (depth, clear) = if P::PARALLEL || Q::ANY {
            (depth, 0)
        } else {
            self.edges.depths_of_ray(depth, det, line)
        };
        nearest.unclear |= u32::from(hits & !clear != 0) << lane;
        let depth = depth.to_array();
        while hits != 0 {
            let slot = hits.trailing_zeros() as usize;
            hits &= hits - 1;
            let z = depth[slot];
            if nearer(z, limit, block.sources[slot], source) {
                (limit, best, found) = (z, slot, true);
                source = Some(block.sources[slot]);
            }
        }
        if found {
            let here = L::Mask::from_bits(1 << lane);
            group.limit = L::select(here, L::from_f32(limit), group.limit);
            nearest.take(here, block.number, best, block.sources[best]);
        }
        true
    }

    #[inline(always)]
    fn triangle<Q: Query<L>>(
        &self,
        slot: usize,
        block: &BlockRef,
        state: &mut GroupState<L>,
    ) -> bool {
        let GroupState {
            group,
            starts,
            nearest,
            ..
        } = state;
        let (hit, depth, det) = self.edges.rays::<P, L>(slot, group, starts);
        if hit.none() {
            return false;
        }
        if Q::ANY {
            let done = -L::from_f32(1.0);
            group.limit = L::select(hit, done, group.limit);
            nearest.take(hit, block.number, slot, block.sources[slot]);
            return true;
        }
        let (z, clear) = if P::PARALLEL {
            (depth, L::Mask::splat(false))
        } else {
            self.edges.depths(slot, depth, det, group)
        };
        let less = hit & z.lt(group.limit);
        nearest.unclear |= (hit & !clear).bits();
        let mut tied = (hit & z.eq(group.limit)).bits();
        group.limit = L::select(less, z, group.limit);
        tied &= nearest.met;
        nearest.take(less, block.number, slot, block.sources[slot]);
        while tied != 0 {
            let lane = tied.trailing_zeros() as usize;
            tied &= tied - 1;
            let source = block.sources[slot];
            if nearest.source(lane).is_some_and(|best| source < best) {
                nearest.take(L::Mask::from_bits(1 << lane), block.number, slot, source);
            }
        }
        true
    }
}

/// Whether a triangle at depth z replaces the closest one so far: ties go to the lower id,
/// and a tie with the ray's end is no hit.
#[inline(always)]
fn nearer(z: f32, limit: f32, id: u32, best: Option<u32>) -> bool {
    z < limit || (z == limit && best.is_some_and(|best| id < best))
}
