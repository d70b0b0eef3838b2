//! Leaves in f32: shared-origin edge functions decide.

use super::block::{Aim, Edges};
use super::bundle::{Bundle, Projection};
use super::mesh::InMesh;
use crate::accel::WideNode;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::trace::query::{HitId, Query};

impl<L: Lanes, const S: usize> InMesh<'_, L, S> {
    #[inline(always)]
    pub fn fast_leaf<P: Projection, Q: Query<L>>(
        &mut self,
        node: &WideNode,
        place: usize,
        first: usize,
        count: usize,
        queries: &mut [Q; S],
    ) {
        let (rays, any) = self.rays_in::<P>(node.child_box(place));
        if any {
            self.fast_blocks::<P, Q>(&rays, first, count, queries);
        }
    }

    #[inline(always)]
    pub fn fast_blocks<P: Projection, Q: Query<L>>(
        &mut self,
        rays: &[u32; S],
        first: usize,
        count: usize,
        queries: &mut [Q; S],
    ) {
        for number in first..first + count {
            let block = self.mesh.blocks.get(number);
            let sources = block.sources();
            let edges = Edges::new::<P, L, S>(
                block,
                self.bundle,
                if Q::ANY { Aim::Any } else { Aim::Closest },
            );
            if edges.live == 0 {
                continue;
            }
            for s in 0..S {
                let Bundle { groups, starts, .. } = &mut *self.bundle;
                let (group, starts) = (&mut groups[s], &starts[s]);
                let nearest = &mut self.nearest[s];
                if rays[s] == 0 || group.deepest < 0.0 {
                    continue;
                }
                let mut slots = edges.may_meet(group, false, 0.0);
                if slots == 0 {
                    continue;
                }
                let mut met = false;
                if rays[s].count_ones() < slots.count_ones() {
                    // Ray by ray, the triangles in lanes.
                    let mut bits = rays[s];
                    while bits != 0 {
                        let lane = bits.trailing_zeros() as usize;
                        bits &= bits - 1;
                        let at = |x: L| x.lane(lane).to_f64() as f32;
                        let limit = at(group.limit);
                        let line = (at(group.u), at(group.v));
                        let start = if P::PARALLEL { at(starts.depth) } else { 0.0 };
                        let (mut hits, depth, det) = edges.triangles::<P>(line, start, limit);
                        if hits == 0 {
                            continue;
                        }
                        met = true;
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
                            edges.depths_of_ray(depth, det, line)
                        };
                        nearest.doubts |= u32::from(hits & !clear != 0) << lane;
                        let depth = depth.to_array();
                        while hits != 0 {
                            let slot = hits.trailing_zeros() as usize;
                            hits &= hits - 1;
                            let z = depth[slot];
                            if nearer(z, limit, sources[slot], source) {
                                (limit, best, found) = (z, slot, true);
                                source = Some(sources[slot]);
                            }
                        }
                        if found {
                            let here = L::Mask::from_bits(1 << lane);
                            group.limit = L::select(here, L::from_f32(limit), group.limit);
                            nearest.take(here, number, best, sources[best]);
                        }
                    }
                } else {
                    // Triangle by triangle, the rays in lanes.
                    while slots != 0 {
                        let slot = slots.trailing_zeros() as usize;
                        slots &= slots - 1;
                        let (hit, depth, det) = edges.rays::<P, L>(slot, group, starts);
                        let bits = hit.bits();
                        if bits == 0 {
                            continue;
                        }
                        met = true;
                        if Q::ANY {
                            let done = -L::from_f32(1.0);
                            group.limit = L::select(hit, done, group.limit);
                            nearest.take(hit, number, slot, sources[slot]);
                            continue;
                        }
                        let (z, clear) = if P::PARALLEL {
                            (depth, L::Mask::splat(false))
                        } else {
                            edges.depths(slot, depth, det, group)
                        };
                        let less = hit & z.lt(group.limit);
                        nearest.doubts |= (hit & !clear).bits();
                        let mut tied = (hit & z.eq(group.limit)).bits();
                        group.limit = L::select(less, z, group.limit);
                        tied &= nearest.met;
                        nearest.take(less, number, slot, sources[slot]);
                        while tied != 0 {
                            let lane = tied.trailing_zeros() as usize;
                            tied &= tied - 1;
                            let source = sources[slot];
                            if nearest.source(lane).is_some_and(|best| source < best) {
                                nearest.take(L::Mask::from_bits(1 << lane), number, slot, source);
                            }
                        }
                    }
                }
                if met {
                    group.set_deepest();
                    if Q::ANY {
                        self.report(s, queries);
                    }
                }
            }
        }
    }

    /// Any-hit: tells the query which rays have been blocked, and by what.
    #[inline(always)]
    pub(super) fn report<Q: Query<L>>(&mut self, s: usize, queries: &mut [Q; S]) {
        let nearest = &mut self.nearest[s];
        if let Some(last) = nearest.met.checked_ilog2() {
            let id = HitId {
                instance: self.entry.appearance,
                primitive: nearest.sources.lane(last as usize).bits() as u32,
            };
            queries[s].block(L::Mask::from_bits(nearest.met), id);
            nearest.met = 0;
        }
    }
}

/// Whether a triangle at depth z replaces the best so far: ties go to the lower
/// id, and a tie with the ray's own end is no hit.
#[inline(always)]
fn nearer(z: f32, limit: f32, id: u32, best: Option<u32>) -> bool {
    z < limit || (z == limit && best.is_some_and(|best| id < best))
}
