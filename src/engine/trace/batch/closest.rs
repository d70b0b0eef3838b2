//! Batches of closest-hit queries.

use super::Batch;
use crate::accel::{BaselineAccelerator, Count, InstanceBvhs, STREAM, World};
use crate::geom::Certainty;
use crate::math::lanes::Lanes;
use crate::trace::beam::{BEAM, BeamBuffers, BeamScratch, BeamTraversal};
use crate::trace::hits::{Depths, Hits};
use crate::trace::item_buffer::ItemBuffer;
use crate::trace::leaf::Tester;
use crate::trace::query::{Closest, HitId};
use crate::trace::rays::{Rays, load_f32};
use crate::trace::scratch::TraceScratch;
use crate::trace::stream::{Stream, StreamScratch, for_each_bit};

/// A batch of closest-hit queries.
pub struct ClosestBatch<'a, 'h> {
    pub world: &'a World,
    pub rays: &'a Rays<'a>,
    pub hits: &'a mut Hits<'h>,
    /// An item buffer, and the number of the first list.
    pub items: Option<(&'a ItemBuffer, usize)>,
}

impl ClosestBatch<'_, '_> {
    /// Stores the answers of a query.
    #[inline(always)]
    fn put<L: Lanes, C: Certainty>(&mut self, first: usize, query: &Closest<L, C>) {
        match &mut self.hits.t {
            Depths::Single(t) => query.store_single(&mut t[first..]),
            Depths::Double(t) => query.store_double(&mut t[first..]),
        }
        query.store_ids(&mut self.hits.id, first);
    }

    /// Stores the answers of a stream.
    #[inline(always)]
    fn put_stream<L: Lanes, C: Certainty>(
        &mut self,
        first: usize,
        queries: &[Closest<L, C>; STREAM],
    ) {
        let rows = first..first + STREAM;
        match &mut self.hits.t {
            Depths::Single(t) => {
                for (t, query) in t[rows.clone()].iter_mut().zip(queries) {
                    *t = query.t(0) as f32;
                }
            }
            Depths::Double(t) => {
                for (t, query) in t[rows.clone()].iter_mut().zip(queries) {
                    *t = query.t(0);
                }
            }
        }
        let id = &mut self.hits.id;
        let columns = id.instance[rows.clone()]
            .iter_mut()
            .zip(&mut id.primitive[rows]);
        for ((instance, primitive), query) in columns.zip(queries) {
            HitId {
                instance: *instance,
                primitive: *primitive,
            } = query.id(0);
        }
    }
}

impl ClosestBatch<'_, '_> {
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
            Closest::<L::Single, C>::new(<L::Single as Lanes>::from_f32(rays.t_max[i]))
        });
        let stream = Stream { world, rays, first };
        stream.trace::<L, S, C, _>(rays.alive(0), &mut queries, streams, scratch);
        for (row, query) in deferred.rows().iter().zip(&queries) {
            self.put(*row as usize, query);
        }
        deferred.clear();
    }
}

impl Batch for ClosestBatch<'_, '_> {
    #[inline(never)]
    fn packets<L: Lanes, C: Certainty>(
        mut self,
        levels: &BaselineAccelerator,
        count: Count,
        scratch: &mut TraceScratch,
    ) {
        let mut baseline = scratch.take_baseline::<L>(levels);
        for first in (0..self.rays.len()).step_by(L::COUNT) {
            let packet = self.rays.packet::<L>(first, self.world);
            let mut query = Closest::<L, C>::new(load_f32(&self.rays.t_max[first..]));
            let mut tester = Tester::<L, C>::new(self.world, &packet, scratch);
            tester.trace(levels, &mut query, &mut baseline, count);
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
        for first in (0..self.rays.len()).step_by(STREAM) {
            let mut queries: [_; STREAM] = std::array::from_fn(|i| {
                let t_max = self.rays.t_max[first + i];
                Closest::<L::Single, C>::new(<L::Single as Lanes>::from_f32(t_max))
            });
            let stream = Stream {
                world: self.world,
                rays: self.rays,
                first,
            };
            let alive = self.rays.alive(first);
            stream.trace_nested::<L, S, C, _>(bvhs, alive, &mut queries, walk, scratch);
            self.put_stream(first, &queries);
        }
    }

    #[inline(never)]
    fn beams<L: Lanes, C: Certainty, const S: usize>(
        mut self,
        walk: &mut BeamScratch,
        scratch: &mut TraceScratch,
    ) {
        let mut buffers = BeamBuffers::default();
        let mut queries: [_; S] = std::array::from_fn(|_| Closest::<L, C>::new(L::zero()));
        for first in (0..self.rays.len()).step_by(BEAM) {
            if let Some(traversal) =
                BeamTraversal::<L, S>::new(self.world, self.rays, first, &mut buffers, scratch)
            {
                for (s, query) in queries.iter_mut().enumerate() {
                    query.restart(load_f32(&self.rays.t_max[first + s * L::COUNT..]));
                }
                let list = self.items.and_then(|(items, number)| {
                    let list = traversal.list(items, number + first / BEAM)?;
                    Some((list, self.world.item_boxes.as_ref()?))
                });
                let deferred = match list {
                    Some((list, boxes)) => {
                        traversal.trace_items::<C, _>(list, boxes, &mut queries, &mut walk.streams)
                    }
                    None => traversal.trace::<C, _>(&mut queries, walk),
                };
                for (s, query) in queries.iter().enumerate() {
                    self.put(first + s * L::COUNT, query);
                }
                for_each_bit(deferred, |i| {
                    walk.deferred.push(self.rays, first + i);
                    if walk.deferred.is_full() {
                        self.trace_again::<L, C, S>(walk, scratch);
                    }
                });
                continue;
            }
            for first in (first..first + BEAM).step_by(STREAM) {
                let mut queries: [_; STREAM] = std::array::from_fn(|i| {
                    let t_max = self.rays.t_max[first + i];
                    Closest::<L::Single, C>::new(<L::Single as Lanes>::from_f32(t_max))
                });
                let stream = Stream {
                    world: self.world,
                    rays: self.rays,
                    first,
                };
                stream.trace::<L, S, C, _>(
                    self.rays.alive(first),
                    &mut queries,
                    &mut walk.streams,
                    scratch,
                );
                self.put_stream(first, &queries);
            }
        }
        if C::GUARDED {
            self.trace_again::<L, C, S>(walk, scratch);
        }
    }
}
