//! Whether anything is in the way of many rays.

use super::Batch;
use crate::accel::{BaselineAccelerator, Count, InstanceBvhs, STREAM, World};
use crate::geom::Certainty;
use crate::math::lanes::{Lanes, Mask};
use crate::trace::beam::{BEAM, BeamScratch, Beams, Tile};
use crate::trace::leaf::Tester;
use crate::trace::packet::Packet;
use crate::trace::query::{AnyHit, HitId};
use crate::trace::rays::{Rays, load_f32};
use crate::trace::shadow_cache::ShadowCache;
use crate::trace::stream::{Stream, StreamScratch, each};

pub struct AnyBatch<'a> {
    pub world: &'a World,
    pub rays: &'a Rays<'a>,
    pub cache: &'a mut ShadowCache,
    pub blocked: &'a mut [bool],
}

impl AnyBatch<'_> {
    /// Of a stream's rays, those that the last occluder blocks.
    #[inline(never)]
    fn certified<L: Lanes, C: Certainty>(&mut self, first: usize, alive: u64) -> u64 {
        let Some(occluder) = self.cache.candidate() else {
            return 0;
        };
        let mut certified = 0;
        for lane in (0..STREAM).step_by(L::COUNT) {
            if (alive >> lane) & (u64::MAX >> (64 - L::COUNT)) != 0 {
                let (_, query) = self.tried::<L, C>(first + lane, occluder);
                certified |= u64::from(query.blocked().bits()) << lane;
            }
        }
        self.cache.tried(alive.count_ones(), certified.count_ones());
        certified
    }

    #[inline(always)]
    fn tried<L: Lanes, C: Certainty>(
        &self,
        first: usize,
        occluder: HitId,
    ) -> (Packet<L>, AnyHit<L>) {
        let packet = self.rays.packet::<L>(first, self.world);
        let mut query = AnyHit::<L>::new(load_f32(&self.rays.t_max[first..]));
        if occluder != HitId::NONE {
            Tester::<L, C>::new(self.world, &packet).single(occluder, &mut query);
        }
        (packet, query)
    }

    #[inline(always)]
    fn put<L: Lanes>(&mut self, first: usize, query: &AnyHit<L>) {
        let bits = query.blocked().bits();
        for lane in 0..L::COUNT {
            self.blocked[first + lane] = bits >> lane & 1 != 0;
        }
    }

    /// A stream's rays: `trace` gets those that the cache leaves open.
    #[inline(always)]
    fn stream<L: Lanes, C: Certainty>(
        &mut self,
        first: usize,
        trace: impl FnOnce(u64, &mut [AnyHit<L::Single>; STREAM]),
    ) {
        let alive = self.rays.alive(first);
        let certified = self.certified::<L, C>(first, alive);
        let mut queries: [_; STREAM] = std::array::from_fn(|i| {
            let t_max = self.rays.t_max[first + i];
            AnyHit::<L::Single>::new(<L::Single as Lanes>::from_f32(t_max))
        });
        trace(alive & !certified, &mut queries);
        for (i, query) in queries.iter().enumerate() {
            self.put(first + i, query);
        }
        each(certified, |i| self.blocked[first + i] = true);

        let found = queries.iter().rev().map(|query| query.occluder);
        let last = found.clone().find(|id| *id != HitId::NONE);
        let by_last = last.map_or(0, |last| found.filter(|id| *id == last).count() as u32);
        let (rays, by_cached) = (alive.count_ones(), certified.count_ones());
        match (last, self.cache.candidate()) {
            (Some(last), _) if by_last > by_cached => self.cache.remember(last, by_last, rays),
            (_, Some(cached)) => self.cache.remember(cached, by_cached, rays),
            _ => (),
        }
    }
}

impl AnyBatch<'_> {
    /// The rays that tiles have left in doubt, as a stream.
    #[inline(never)]
    fn trace_again<L: Lanes, C: Certainty, const S: usize>(&mut self, scratch: &mut BeamScratch) {
        let (deferred, streams) = (&mut scratch.deferred, &mut scratch.streams);
        if deferred.rows().is_empty() {
            return;
        }
        let (world, rays, first) = (self.world, &deferred.rays(), 0);
        let mut queries: [_; STREAM] = std::array::from_fn(|i| {
            AnyHit::<L::Single>::new(<L::Single as Lanes>::from_f32(rays.t_max[i]))
        });
        let stream = Stream { world, rays, first };
        stream.trace::<L, S, C, _>(rays.alive(0), &mut queries, streams);
        for (row, query) in deferred.rows().iter().zip(&queries) {
            self.put(*row as usize, query);
        }
        deferred.clear();
    }
}

impl Batch for AnyBatch<'_> {
    #[inline(never)]
    fn packets<L: Lanes, C: Certainty>(mut self, levels: &BaselineAccelerator, count: Count) {
        let world = self.world;
        let mut scratch = [levels.tlas.scratch::<L>(), levels.tlas.scratch::<L>()];
        for first in (0..self.rays.len()).step_by(L::COUNT) {
            let occluder = self.cache.candidate().unwrap_or(HitId::NONE);
            let (packet, mut query) = self.tried::<L, C>(first, occluder);
            let rays = packet.ray.t_min.lt(load_f32(&self.rays.t_max[first..]));
            let rays = rays.bits().count_ones();
            if occluder != HitId::NONE {
                let certified = query.blocked().bits().count_ones();
                self.cache.tried(rays, certified);
            }
            let tester = Tester::<L, C>::new(world, &packet);
            tester.trace(levels, &mut query, &mut scratch, count);
            // The last one stands for all that have blocked a ray.
            let blocked = query.blocked().bits().count_ones();
            self.cache.remember(query.occluder, blocked, rays);
            self.put(first, &query);
        }
    }

    #[inline(never)]
    fn nested<L: Lanes, C: Certainty, const S: usize>(
        mut self,
        groups: &InstanceBvhs,
        scratch: &mut StreamScratch,
    ) {
        let (world, rays) = (self.world, self.rays);
        for first in (0..rays.len()).step_by(STREAM) {
            let stream = Stream { world, rays, first };
            self.stream::<L, C>(first, |open, queries| {
                stream.trace_nested::<L, S, C, _>(groups, open, queries, scratch);
            });
        }
    }

    #[inline(never)]
    fn tiles<L: Lanes, C: Certainty, const S: usize>(mut self, scratch: &mut BeamScratch) {
        let (world, rays) = (self.world, self.rays);
        let mut beams = Beams::default();
        let mut queries: [_; S] = std::array::from_fn(|_| AnyHit::<L>::new(L::zero()));
        for first in (0..rays.len()).step_by(BEAM) {
            if let Some(tile) = Tile::<L, S>::of(world, rays, first, &mut beams) {
                for (s, query) in queries.iter_mut().enumerate() {
                    *query = AnyHit::new(load_f32(&rays.t_max[first + s * L::COUNT..]));
                }
                // No try: a tile is through with all of its rays in hardly more
                // time than a try takes (docs/BENCHMARKS.md).
                let deferred = tile.trace::<C, _>(&mut queries, scratch);
                for (s, query) in queries.iter().enumerate() {
                    self.put(first + s * L::COUNT, query);
                }
                each(deferred, |i| {
                    if self.blocked[first + i] {
                        return;
                    }
                    scratch.deferred.push(rays, first + i);
                    if scratch.deferred.is_full() {
                        self.trace_again::<L, C, S>(scratch);
                    }
                });
                continue;
            }
            for first in (first..first + BEAM).step_by(STREAM) {
                let stream = Stream { world, rays, first };
                self.stream::<L, C>(first, |open, queries| {
                    stream.trace::<L, S, C, _>(open, queries, &mut scratch.streams);
                });
            }
        }
        if C::GUARDED {
            self.trace_again::<L, C, S>(scratch);
        }
    }
}
