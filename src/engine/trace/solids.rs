//! Tests of single primitives and CSG solids for streams: the rays of a stream are gathered
//! into packets.

use super::leaf::Tester;
use super::packet::Packet;
use super::query::{Found, Query, next_up};
use super::rays::Rays;
use super::scratch::TraceScratch;
use super::stream::for_each_bit;
use crate::accel::{STREAM, TlasEntry, World};
use crate::geom::Certainty;
use crate::math::Affine;
use crate::math::lanes::{Lanes, Mask};

/// Consecutive rays as packets. A packet is made at its first test, since many are never
/// tested.
pub(super) struct Packets<L: Lanes, const S: usize>([Option<Packet<L>>; S]);

impl<L: Lanes, const S: usize> Packets<L, S> {
    /// No packets.
    pub fn none() -> Self {
        Packets([const { None }; S])
    }

    /// Removes all packets.
    pub fn clear(&mut self) {
        for packet in &mut self.0 {
            *packet = None;
        }
    }

    /// Returns packet `s` of the rays from row `first` on, which must be the same in all calls.
    #[inline(always)]
    pub fn get(&mut self, s: usize, rays: &Rays, first: usize, world: &World) -> &Packet<L> {
        self.0[s].get_or_insert_with(|| rays.packet(first + s * L::COUNT, world))
    }
}

/// Number of rays of a packet up to which they are tested one by one.
const FEW: u32 = 2;

/// The rays of a stream as packets, for single primitives.
pub(super) struct StreamPackets<'a, L: Lanes, const S: usize> {
    pub world: &'a World,
    pub rays: &'a Rays<'a>,
    pub first: usize,
    pub packets: Packets<L, S>,
    pub scratch: &'a mut TraceScratch,
}

impl<L: Lanes, const S: usize> StreamPackets<'_, L, S> {
    /// Tests one primitive for a set of rays. `map`: its `object_from_world`, where that is
    /// at hand.
    #[inline(never)]
    pub fn meet<C: Certainty, Q: Query<L::Single>>(
        &mut self,
        entry: &TlasEntry,
        map: Option<&Affine>,
        set: u64,
        queries: &mut [Q; STREAM],
    ) {
        const { assert!(S * L::COUNT == STREAM) };
        for s in 0..S {
            let first = s * L::COUNT;
            let some = set >> first & (u64::MAX >> (64 - L::COUNT));
            if some.count_ones() <= FEW {
                for_each_bit(some, |lane| {
                    let row = self.first + first + lane;
                    let packet = self.rays.packet::<L::Single>(row, self.world);
                    let query = &mut queries[first + lane];
                    let active = packet.ray.t_min.lt(query.limit());
                    Tester::<L::Single, C>::new(self.world, &packet, self.scratch)
                        .with_map(map)
                        .solid(entry, active, query);
                });
                continue;
            }
            let mut limits = (-L::from_f32(1.0)).to_array();
            for_each_bit(some, |lane| {
                let limit = queries[first + lane].limit().lane(0);
                // Just beyond the ray's limit, so that its own query settles ties.
                let limit = if Q::ANY { limit } else { next_up(limit) };
                limits.as_mut()[lane] = limit;
            });
            let limit = L::load(limits.as_ref());
            let packet = self.packets.get(s, self.rays, self.first, self.world);
            let active = L::Mask::from_bits(some as u32) & packet.ray.t_min.lt(limit);
            let mut query = Q::together::<L>(limit);
            Tester::<L, C>::new(self.world, packet, self.scratch)
                .with_map(map)
                .solid(entry, active, &mut query);
            for_each_bit(some, |lane| {
                let Some((at, id)) = query.found(lane) else {
                    return;
                };
                let own = &mut queries[first + lane];
                if !own.try_commit(0, at, id) {
                    let row = self.first + first + lane;
                    let packet = self.rays.packet::<L::Single>(row, self.world);
                    let all = <L::Single as Lanes>::Mask::splat(true);
                    Tester::<L::Single, C>::new(self.world, &packet, self.scratch)
                        .decide(all, id, own);
                }
            });
        }
    }
}
