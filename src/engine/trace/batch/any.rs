//! Batches of any-hit queries.

use super::Batch;
use crate::accel::{BaselineAccelerator, Count, InstanceBvhs, STREAM, World};
use crate::geom::Certainty;
use crate::math::lanes::{Lanes, Mask};
use crate::trace::beam::{BEAM, BeamBuffers, BeamScratch, BeamTraversal};
use crate::trace::leaf::Tester;
use crate::trace::packet::Packet;
use crate::trace::query::{AnyHit, HitId};
use crate::trace::rays::{Rays, load_f32};
use crate::trace::scratch::TraceScratch;
use crate::trace::shadow_cache::ShadowCache;
use crate::trace::stream::{Stream, StreamScratch, for_each_bit};

/// A batch of any-hit queries.
pub struct AnyBatch<'a> {
    pub world: &'a World,
    pub rays: &'a Rays<'a>,
    pub cache: &'a mut ShadowCache,
    pub blocked: &'a mut [bool],
}

impl AnyBatch<'_> {
    /// Returns the rays of a stream that the last occluder blocks.
    #[inline(never)]
    fn certified<L: Lanes, C: Certainty>(
        &mut self,
        first: usize,
        alive: u64,
        scratch: &mut TraceScratch,
    ) -> u64 {
        let Some(occluder) = self.cache.candidate() else {
            return 0;
        };
        let mut certified = 0;
        for lane in (0..STREAM).step_by(L::COUNT) {
            if (alive >> lane) & (u64::MAX >> (64 - L::COUNT)) != 0 {
                let (_, query) = self.tried::<L, C>(first + lane, occluder, scratch);
                certified |= u64::from(query.blocked().bits()) << lane;
            }
        }
        self.cache.tried(alive.count_ones(), certified.count_ones());
        certified
    }

    /// Loads a packet and tests it against an occluder, if there is one.
    #[inline(always)]
    fn tried<L: Lanes, C: Certainty>(
        &self,
        first: usize,
        occluder: HitId,
        scratch: &mut TraceScratch,
    ) -> (Packet<L>, AnyHit<L>) {
        let packet = self.rays.packet::<L>(first, self.world);
        let mut query = AnyHit::<L>::new(load_f32(&self.rays.t_max[first..]));
        if occluder != HitId::NONE {
            Tester::<L, C>::new(self.world, &packet, scratch).single(occluder, &mut query);
        }
        (packet, query)
    }

    /// Stores the answers of a query.
    #[inline(always)]
    fn put<L: Lanes>(&mut self, first: usize, query: &AnyHit<L>) {
        let bits = query.blocked().bits();
        for lane in 0..L::COUNT {
            self.blocked[first + lane] = bits >> lane & 1 != 0;
        }
    }

    /// Answers a stream: `trace` traces the rays that the last occluder does not block.
    #[inline(always)]
    fn stream<L: Lanes, C: Certainty>(
        &mut self,
        first: usize,
        scratch: &mut TraceScratch,
        trace: impl FnOnce(u64, &mut [AnyHit<L::Single>; STREAM], &mut TraceScratch),
    ) {
        let alive = self.rays.alive(first);
        let certified = self.certified::<L, C>(first, alive, scratch);
        let mut queries: [_; STREAM] = std::array::from_fn(|i| {
            let t_max = self.rays.t_max[first + i];
            AnyHit::<L::Single>::new(<L::Single as Lanes>::from_f32(t_max))
        });
        trace(alive & !certified, &mut queries, scratch);
        for (i, query) in queries.iter().enumerate() {
            self.put(first + i, query);
        }
        for_each_bit(certified, |i| self.blocked[first + i] = true);

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
    /// Traces the deferred rays as a stream.
    #[inline(never)]
    fn trace_again<L: Lanes, C: Certainty, const S: usize>(
        &mut self,
        walk: &mut BeamScratch,
        scratch: &mut TraceScratch,
    ) {
        let (deferred, streams) = (&mut walk.deferred, &mut walk.streams);
        if deferred.rows().is_empty() {
            return;
        }
        let (world, rays, first) = (self.world, &deferred.rays(), 0);
        let mut queries: [_; STREAM] = std::array::from_fn(|i| {
            AnyHit::<L::Single>::new(<L::Single as Lanes>::from_f32(rays.t_max[i]))
        });
        let stream = Stream { world, rays, first };
        stream.trace::<L, S, C, _>(rays.alive(0), &mut queries, streams, scratch);
        for (row, query) in deferred.rows().iter().zip(&queries) {
            self.put(*row as usize, query);
        }
        deferred.clear();
    }
}

impl Batch for AnyBatch<'_> {
    #[inline(never)]
    fn packets<L: Lanes, C: Certainty>(
        mut self,
        levels: &BaselineAccelerator,
        count: Count,
        scratch: &mut TraceScratch,
    ) {
        let world = self.world;
        let mut baseline = scratch.take_baseline::<L>(levels);
        for first in (0..self.rays.len()).step_by(L::COUNT) {
            let occluder = self.cache.candidate().unwrap_or(HitId::NONE);
            let (packet, mut query) = self.tried::<L, C>(first, occluder, scratch);
            let rays = packet.ray.t_min.lt(load_f32(&self.rays.t_max[first..]));
            let rays = rays.bits().count_ones();
            if occluder != HitId::NONE {
                let certified = query.blocked().bits().count_ones();
                self.cache.tried(rays, certified);
            }
            let mut tester = Tester::<L, C>::new(world, &packet, scratch);
            tester.trace(levels, &mut query, &mut baseline, count);
            // The last occluder stands for all of them.
            let blocked = query.blocked().bits().count_ones();
            self.cache.remember(query.occluder, blocked, rays);
            self.put(first, &query);
        }
        scratch.keep_baseline(baseline);
    }

    #[inline(never)]
    fn nested<L: Lanes, C: Certainty, const S: usize>(
        mut self,
        bvhs: &InstanceBvhs,
        walk: &mut StreamScratch,
        scratch: &mut TraceScratch,
    ) {
        let (world, rays) = (self.world, self.rays);
        for first in (0..rays.len()).step_by(STREAM) {
            let stream = Stream { world, rays, first };
            self.stream::<L, C>(first, scratch, |open, queries, scratch| {
                stream.trace_nested::<L, S, C, _>(bvhs, open, queries, walk, scratch);
            });
        }
    }

    #[inline(never)]
    fn beams<L: Lanes, C: Certainty, const S: usize>(
        mut self,
        walk: &mut BeamScratch,
        scratch: &mut TraceScratch,
    ) {
        let (world, rays) = (self.world, self.rays);
        let mut buffers = BeamBuffers::default();
        let mut queries: [_; S] = std::array::from_fn(|_| AnyHit::<L>::new(L::zero()));
        for first in (0..rays.len()).step_by(BEAM) {
            if let Some(traversal) =
                BeamTraversal::<L, S>::new(world, rays, first, &mut buffers, scratch)
            {
                for (s, query) in queries.iter_mut().enumerate() {
                    *query = AnyHit::new(load_f32(&rays.t_max[first + s * L::COUNT..]));
                }
                // The last occluder is not tried, since tracing the beam takes little longer
                // than that (docs/BENCHMARKS.md).
                let deferred = traversal.trace::<C, _>(&mut queries, walk);
                for (s, query) in queries.iter().enumerate() {
                    self.put(first + s * L::COUNT, query);
                }
                for_each_bit(deferred, |i| {
                    if self.blocked[first + i] {
                        return;
                    }
                    walk.deferred.push(rays, first + i);
                    if walk.deferred.is_full() {
                        self.trace_again::<L, C, S>(walk, scratch);
                    }
                });
                continue;
            }
            for first in (first..first + BEAM).step_by(STREAM) {
                let stream = Stream { world, rays, first };
                self.stream::<L, C>(first, scratch, |open, queries, scratch| {
                    stream.trace::<L, S, C, _>(open, queries, &mut walk.streams, scratch);
                });
            }
        }
        if C::GUARDED {
            self.trace_again::<L, C, S>(walk, scratch);
        }
    }
}
