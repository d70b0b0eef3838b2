//! Leaves in f64: edge functions in f32 sort out, and the guarded test of one ray
//! and one triangle decides.

use super::block::{Aim, Edges};
use super::bundle::Projection;
use super::mesh::InMesh;
use crate::accel::WideNode;
use crate::geom::Certainty;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::trace::leaf::{Everything, Tester};
use crate::trace::packet::Packet;
use crate::trace::query::{HitId, Query};

impl<L: Lanes, const S: usize> InMesh<'_, L, S> {
    #[inline(always)]
    #[expect(clippy::too_many_arguments)]
    pub fn exact_leaf<P: Projection, C: Certainty, Q: Query<L>>(
        &mut self,
        node: &WideNode,
        place: usize,
        first: usize,
        count: usize,
        testers: &[Tester<L, C, Everything>; S],
        objects: &[Packet<L>; S],
        queries: &mut [Q; S],
    ) {
        let (rays, any) = self.rays_in::<P>(node.child_box(place));
        if any {
            self.exact_blocks::<P, C, Q>(&rays, first, count, testers, objects, queries);
        }
    }

    #[inline(always)]
    pub fn exact_blocks<P: Projection, C: Certainty, Q: Query<L>>(
        &mut self,
        rays: &[u32; S],
        first: usize,
        count: usize,
        testers: &[Tester<L, C, Everything>; S],
        objects: &[Packet<L>; S],
        queries: &mut [Q; S],
    ) {
        for number in first..first + count {
            let block = self.mesh.blocks.get(number);
            let edges = Edges::new::<P, L, S>(block, self.bundle, Aim::Exact);
            if edges.live == 0 {
                continue;
            }
            for s in 0..S {
                if rays[s] == 0 || self.bundle.groups[s].deepest < 0.0 {
                    continue;
                }
                let mut slots = edges.may_meet(&self.bundle.groups[s], true, self.bundle.reach);
                slots &= block.used();
                let mut met = false;
                let active = L::Mask::from_bits(rays[s]);
                // The watertight test takes as long as a few rays here.
                if slots.count_ones() > 2 {
                    let group = &self.bundle.groups[s];
                    let (u, v) = (group.u.to_array(), group.v.to_array());
                    let (mut bits, mut some) = (rays[s], 0);
                    while bits != 0 {
                        let lane = bits.trailing_zeros() as usize;
                        bits &= bits - 1;
                        let at = |x: &L::Array| x.as_ref()[lane].to_f64() as f32;
                        some |= edges.may_meet_ray(at(&u), at(&v));
                    }
                    slots &= some;
                }
                while slots != 0 {
                    let slot = slots.trailing_zeros() as usize;
                    slots &= slots - 1;
                    let id = HitId {
                        instance: self.entry.appearance,
                        primitive: block.source(slot),
                    };
                    let query = &mut queries[s];
                    let (window, _) = testers[s].window(self.entry, active, query.limit());
                    let corners = block.corners(slot);
                    met |= testers[s].triangle(&objects[s], &window, &corners, id, active, query);
                }
                if met {
                    let asleep = self.bundle.groups[s].limit.lt(L::zero());
                    let limit = L::select(asleep, -L::from_f32(1.0), queries[s].limit());
                    self.bundle.limit_t::<C, Q>(s, limit);
                }
            }
        }
    }
}
