//! Many rays: columns in, columns out, packet by packet.

use super::hits::{Depths, Hits};
use super::items::ItemBuffer;
use super::leaf::{Everything, Features, Has, Scratch, Tester};
use super::packet::Packet;
use super::query::{AnyHit, Closest, HitId};
use super::rays::{Rays, load_f32};
use super::shadow_cache::ShadowCache;
use super::stream::{Stream, StreamScratch, each};
use super::tile::{Bundles, TILE, Tile, TileScratch, with_scratch};
use crate::accel::{Count, Counter, Forest, Forests, Groups, Index, STREAM, World};
use crate::geom::{Certainty, DoubtAll, Fast, Guarded};
use crate::math::lanes::{Lanes, Mask, f32x4, f32x8, f32x16, f64x4, f64x8, f64x16};
use crate::plan::{Arithmetic, Kernels, Needs, native_width};

/// The nearest hit of every ray.
pub fn closest(world: &World, kernels: &Kernels, rays: &Rays, hits: &mut Hits) {
    dispatch(
        world,
        kernels,
        &(),
        ClosestBatch {
            world,
            rays,
            hits,
            items: None,
        },
    );
}

/// The same by an item buffer: the first rays are its tile `tile`. Rays that its
/// lists do not stand for are traced.
pub fn closest_listed(
    world: &World,
    kernels: &Kernels,
    rays: &Rays,
    (items, tile): (&ItemBuffer, usize),
    hits: &mut Hits,
) {
    dispatch(
        world,
        kernels,
        &(),
        ClosestBatch {
            world,
            rays,
            hits,
            items: Some((items, tile)),
        },
    );
}

/// The same, and what it took.
pub fn closest_counted(
    world: &World,
    kernels: &Kernels,
    rays: &Rays,
    hits: &mut Hits,
    counter: &Counter,
) {
    dispatch(
        world,
        kernels,
        counter,
        ClosestBatch {
            world,
            rays,
            hits,
            items: None,
        },
    );
}

/// Whether each ray is blocked, as a byte. Rays that follow each other to one
/// light often share their occluder: `cache` remembers it.
pub fn any(
    world: &World,
    kernels: &Kernels,
    rays: &Rays,
    cache: &mut ShadowCache,
    blocked: &mut [bool],
) {
    dispatch(
        world,
        kernels,
        &(),
        AnyBatch {
            world,
            rays,
            cache,
            blocked,
        },
    );
}

/// The same, and what it took.
pub fn any_counted(
    world: &World,
    kernels: &Kernels,
    rays: &Rays,
    cache: &mut ShadowCache,
    blocked: &mut [bool],
    counter: &Counter,
) {
    dispatch(
        world,
        kernels,
        counter,
        AnyBatch {
            world,
            rays,
            cache,
            blocked,
        },
    );
}

/// A batch that runs at any width, certainty and feature set.
trait Batch {
    /// Through wide trees; `S` packets are a tile.
    fn tiles<L: Lanes, C: Certainty, F: Features, const S: usize>(self, scratch: &mut TileScratch);
    /// Through nested trees: streams for all rays, at one lane.
    fn nested<L: Lanes, C: Certainty, const S: usize>(
        self,
        groups: &Groups,
        scratch: &mut StreamScratch,
    );
    /// Packet by packet, through any other kind of structure.
    fn packets<L: Lanes, C: Certainty, F: Features, A: Index, N: Count>(
        self,
        forest: &Forest<A>,
        count: &N,
    );
}

struct ClosestBatch<'a, 'h> {
    world: &'a World<'a>,
    rays: &'a Rays<'a>,
    hits: &'a mut Hits<'h>,
    /// Lists for the rays, and the number of the first tile.
    items: Option<(&'a ItemBuffer, usize)>,
}

impl ClosestBatch<'_, '_> {
    #[inline(always)]
    fn put<L: Lanes, C: Certainty>(&mut self, first: usize, query: &Closest<L, C>) {
        match &mut self.hits.t {
            Depths::Single(t) => query.store_single(&mut t[first..]),
            Depths::Double(t) => query.store_double(&mut t[first..]),
        }
        query.store_ids(&mut self.hits.id, first);
    }

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
    /// The rays that tiles have left in doubt, as a stream.
    #[inline(never)]
    fn trace_again<L: Lanes, C: Certainty, F: Features, const S: usize>(
        &mut self,
        scratch: &mut TileScratch,
    ) {
        let (doubtful, streams) = (&mut scratch.doubtful, &mut scratch.streams);
        if doubtful.rows().is_empty() {
            return;
        }
        let (world, rays, first) = (self.world, &doubtful.rays(), 0);
        let mut queries: [_; STREAM] = std::array::from_fn(|i| {
            Closest::<L::Single, C>::new(<L::Single as Lanes>::from_f32(rays.t_max[i]))
        });
        let stream = Stream { world, rays, first };
        stream.trace::<L, S, C, F, _>(rays.alive(0), &mut queries, streams);
        for (row, query) in doubtful.rows().iter().zip(&queries) {
            self.put(*row as usize, query);
        }
        doubtful.clear();
    }
}

impl Batch for ClosestBatch<'_, '_> {
    fn packets<L: Lanes, C: Certainty, F: Features, A: Index, N: Count>(
        mut self,
        forest: &Forest<A>,
        count: &N,
    ) {
        let mut scratch = Scratch::<L, A>::default();
        for first in (0..self.rays.len()).step_by(L::COUNT) {
            let packet = self.rays.packet::<L>(first, self.world);
            let mut query = Closest::<L, C>::new(load_f32(&self.rays.t_max[first..]));
            let tester = Tester::<L, C, F>::new(self.world, &packet);
            tester.trace(forest, &mut query, &mut scratch, count);
            self.put(first, &query);
        }
    }

    #[inline(never)]
    fn nested<L: Lanes, C: Certainty, const S: usize>(
        mut self,
        groups: &Groups,
        scratch: &mut StreamScratch,
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
            stream.trace_nested::<L, S, C, _>(groups, alive, &mut queries, scratch);
            self.put_stream(first, &queries);
        }
    }

    fn tiles<L: Lanes, C: Certainty, F: Features, const S: usize>(
        mut self,
        scratch: &mut TileScratch,
    ) {
        let mut bundles = Bundles::default();
        let mut queries: [_; S] = std::array::from_fn(|_| Closest::<L, C>::new(L::zero()));
        for first in (0..self.rays.len()).step_by(TILE) {
            if let Some(tile) = Tile::<L, S>::of(self.world, self.rays, first, &mut bundles) {
                for (s, query) in queries.iter_mut().enumerate() {
                    query.restart(load_f32(&self.rays.t_max[first + s * L::COUNT..]));
                }
                let list = self.items.and_then(|(items, number)| {
                    let list = tile.list(items, number + first / TILE)?;
                    Some((list, self.world.item_boxes.as_ref()?))
                });
                let doubtful = match list {
                    Some((list, boxes)) => {
                        tile.trace_items::<C, _>(list, boxes, &mut queries, scratch)
                    }
                    None => tile.trace::<C, F, _>(&mut queries, scratch),
                };
                for (s, query) in queries.iter().enumerate() {
                    self.put(first + s * L::COUNT, query);
                }
                each(doubtful, |i| {
                    scratch.doubtful.push(self.rays, first + i);
                    if scratch.doubtful.is_full() {
                        self.trace_again::<L, C, F, S>(scratch);
                    }
                });
                continue;
            }
            for first in (first..first + TILE).step_by(STREAM) {
                let mut queries: [_; STREAM] = std::array::from_fn(|i| {
                    let t_max = self.rays.t_max[first + i];
                    Closest::<L::Single, C>::new(<L::Single as Lanes>::from_f32(t_max))
                });
                let stream = Stream {
                    world: self.world,
                    rays: self.rays,
                    first,
                };
                stream.trace::<L, S, C, F, _>(
                    self.rays.alive(first),
                    &mut queries,
                    &mut scratch.streams,
                );
                self.put_stream(first, &queries);
            }
        }
        if C::GUARDED {
            self.trace_again::<L, C, F, S>(scratch);
        }
    }
}

struct AnyBatch<'a> {
    world: &'a World<'a>,
    rays: &'a Rays<'a>,
    cache: &'a mut ShadowCache,
    blocked: &'a mut [bool],
}

impl AnyBatch<'_> {
    /// Of a stream's rays, those that the last occluder blocks.
    #[inline(never)]
    fn settled<L: Lanes, C: Certainty>(&mut self, first: usize, alive: u64) -> u64 {
        let Some(occluder) = self.cache.candidate() else {
            return 0;
        };
        let mut settled = 0;
        for lane in (0..STREAM).step_by(L::COUNT) {
            if (alive >> lane) & (u64::MAX >> (64 - L::COUNT)) != 0 {
                let (_, query) = self.tried::<L, C>(first + lane, occluder);
                settled |= u64::from(query.blocked().bits()) << lane;
            }
        }
        self.cache.tried(alive.count_ones(), settled.count_ones());
        settled
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
            Tester::<L, C, Everything>::new(self.world, &packet).single(occluder, &mut query);
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
        let settled = self.settled::<L, C>(first, alive);
        let mut queries: [_; STREAM] = std::array::from_fn(|i| {
            let t_max = self.rays.t_max[first + i];
            AnyHit::<L::Single>::new(<L::Single as Lanes>::from_f32(t_max))
        });
        trace(alive & !settled, &mut queries);
        for (i, query) in queries.iter().enumerate() {
            self.put(first + i, query);
        }
        each(settled, |i| self.blocked[first + i] = true);

        let found = queries.iter().rev().map(|query| query.occluder);
        let last = found.clone().find(|id| *id != HitId::NONE);
        let by_last = last.map_or(0, |last| found.filter(|id| *id == last).count() as u32);
        let (rays, by_cached) = (alive.count_ones(), settled.count_ones());
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
    fn trace_again<L: Lanes, C: Certainty, F: Features, const S: usize>(
        &mut self,
        scratch: &mut TileScratch,
    ) {
        let (doubtful, streams) = (&mut scratch.doubtful, &mut scratch.streams);
        if doubtful.rows().is_empty() {
            return;
        }
        let (world, rays, first) = (self.world, &doubtful.rays(), 0);
        let mut queries: [_; STREAM] = std::array::from_fn(|i| {
            AnyHit::<L::Single>::new(<L::Single as Lanes>::from_f32(rays.t_max[i]))
        });
        let stream = Stream { world, rays, first };
        stream.trace::<L, S, C, F, _>(rays.alive(0), &mut queries, streams);
        for (row, query) in doubtful.rows().iter().zip(&queries) {
            self.put(*row as usize, query);
        }
        doubtful.clear();
    }
}

impl Batch for AnyBatch<'_> {
    fn packets<L: Lanes, C: Certainty, F: Features, A: Index, N: Count>(
        mut self,
        forest: &Forest<A>,
        count: &N,
    ) {
        let world = self.world;
        let mut scratch = Scratch::<L, A>::default();
        for first in (0..self.rays.len()).step_by(L::COUNT) {
            let occluder = self.cache.candidate().unwrap_or(HitId::NONE);
            let (packet, mut query) = self.tried::<L, C>(first, occluder);
            let rays = packet.ray.t_min.lt(load_f32(&self.rays.t_max[first..]));
            let rays = rays.bits().count_ones();
            if occluder != HitId::NONE {
                let settled = query.blocked().bits().count_ones();
                self.cache.tried(rays, settled);
            }
            let tester = Tester::<L, C, F>::new(world, &packet);
            tester.trace(forest, &mut query, &mut scratch, count);
            // The last one stands for all that have blocked a ray.
            let blocked = query.blocked().bits().count_ones();
            self.cache.remember(query.occluder, blocked, rays);
            self.put(first, &query);
        }
    }

    #[inline(never)]
    fn nested<L: Lanes, C: Certainty, const S: usize>(
        mut self,
        groups: &Groups,
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

    fn tiles<L: Lanes, C: Certainty, F: Features, const S: usize>(
        mut self,
        scratch: &mut TileScratch,
    ) {
        let (world, rays) = (self.world, self.rays);
        let mut bundles = Bundles::default();
        let mut queries: [_; S] = std::array::from_fn(|_| AnyHit::<L>::new(L::zero()));
        for first in (0..rays.len()).step_by(TILE) {
            if let Some(tile) = Tile::<L, S>::of(world, rays, first, &mut bundles) {
                for (s, query) in queries.iter_mut().enumerate() {
                    *query = AnyHit::new(load_f32(&rays.t_max[first + s * L::COUNT..]));
                }
                // No try: a tile is through with all of its rays in hardly more
                // time than a try takes (docs/BENCHMARKS.md).
                let doubtful = tile.trace::<C, F, _>(&mut queries, scratch);
                for (s, query) in queries.iter().enumerate() {
                    self.put(first + s * L::COUNT, query);
                }
                each(doubtful, |i| {
                    if self.blocked[first + i] {
                        return;
                    }
                    scratch.doubtful.push(rays, first + i);
                    if scratch.doubtful.is_full() {
                        self.trace_again::<L, C, F, S>(scratch);
                    }
                });
                continue;
            }
            for first in (first..first + TILE).step_by(STREAM) {
                let stream = Stream { world, rays, first };
                self.stream::<L, C>(first, |open, queries| {
                    stream.trace::<L, S, C, F, _>(open, queries, &mut scratch.streams);
                });
            }
        }
        if C::GUARDED {
            self.trace_again::<L, C, F, S>(scratch);
        }
    }
}

/// What a batch is monomorphised over, as values.
struct Choice<'a, N> {
    kernels: &'a Kernels,
    forest: &'a Forests,
    count: &'a N,
}

fn dispatch<N: Count>(world: &World, kernels: &Kernels, count: &N, batch: impl Batch) {
    let choice = Choice {
        kernels,
        forest: &world.forest,
        count,
    };
    match kernels.arithmetic {
        Arithmetic::F32 => by_width_f32::<Fast, N>(&choice, batch),
        // Its answers are those of f64: only tests need the way there, and it is
        // a third of the kernels to build.
        Arithmetic::F32DoubtingAll if cfg!(feature = "all-lanes") => {
            by_width_f32::<DoubtAll, N>(&choice, batch)
        }
        Arithmetic::F32Guarded | Arithmetic::F32DoubtingAll => {
            by_width_f32::<Guarded, N>(&choice, batch)
        }
        Arithmetic::F64 => by_width_f64::<Guarded, N>(&choice, batch),
    }
}

const NATIVE_F32: usize = native_width(Arithmetic::F32);
const NATIVE_F64: usize = native_width(Arithmetic::F64);

fn by_width_f32<C: Certainty, N: Count>(choice: &Choice<N>, batch: impl Batch) {
    match choice.kernels.lanes {
        16 if cfg!(feature = "all-lanes") || NATIVE_F32 == 16 => {
            by_structure::<f32x16, C, N, { TILE / 16 }>(choice, batch)
        }
        8 if cfg!(feature = "all-lanes") || NATIVE_F32 == 8 => {
            by_structure::<f32x8, C, N, { TILE / 8 }>(choice, batch)
        }
        4 if cfg!(feature = "all-lanes") || NATIVE_F32 == 4 => {
            by_structure::<f32x4, C, N, { TILE / 4 }>(choice, batch)
        }
        _ => by_structure::<f32, C, N, TILE>(choice, batch),
    }
}

fn by_width_f64<C: Certainty, N: Count>(choice: &Choice<N>, batch: impl Batch) {
    match choice.kernels.lanes {
        16 if cfg!(feature = "all-lanes") => {
            by_structure::<f64x16, C, N, { TILE / 16 }>(choice, batch)
        }
        8 if cfg!(feature = "all-lanes") || NATIVE_F64 == 8 => {
            by_structure::<f64x8, C, N, { TILE / 8 }>(choice, batch)
        }
        4 if cfg!(feature = "all-lanes") || NATIVE_F64 == 4 => {
            by_structure::<f64x4, C, N, { TILE / 4 }>(choice, batch)
        }
        _ => by_structure::<f64, C, N, TILE>(choice, batch),
    }
}

fn by_structure<L: Lanes, C: Certainty, N: Count, const S: usize>(
    choice: &Choice<N>,
    batch: impl Batch,
) {
    match choice.forest {
        Forests::Wide(_) => by_needs::<L, C, S>(choice.kernels.needs, batch),
        Forests::Nested(forest) => with_scratch(|scratch| {
            batch.nested::<L, C, S>(&forest.groups, &mut scratch.streams);
        }),
        Forests::Narrow(forest) => by_packets::<L, C, _, N>(forest, choice.count, batch),
        Forests::Kd(forest) => by_packets::<L, C, _, N>(forest, choice.count, batch),
        Forests::Grid(forest) => by_packets::<L, C, _, N>(forest, choice.count, batch),
        Forests::Heap(forest) => by_packets::<L, C, _, N>(forest, choice.count, batch),
        Forests::HeapSpheres(forest) => by_packets::<L, C, _, N>(forest, choice.count, batch),
    }
}

/// Structures beside the default one have kernels for every need only: each set
/// costs build time.
fn by_packets<L: Lanes, C: Certainty, A: Index, N: Count>(
    forest: &Forest<A>,
    count: &N,
    batch: impl Batch,
) {
    batch.packets::<L, C, Everything, A, N>(forest, count);
}

/// Few sets, not all eight, and only where the plan takes it by itself: each
/// costs build time.
fn by_needs<L: Lanes, C: Certainty, const S: usize>(needs: Needs, batch: impl Batch) {
    let native = if size_of::<L::Scalar>() == 8 {
        NATIVE_F64
    } else {
        NATIVE_F32
    };
    if C::GUARDED || L::COUNT != native {
        return with_scratch(|scratch| batch.tiles::<L, C, Everything, S>(scratch));
    }
    with_scratch(|scratch| match (needs.solids, needs.transforms) {
        (false, false) => batch.tiles::<L, C, Has<true, false, false>, S>(scratch),
        (false, true) => batch.tiles::<L, C, Has<true, false, true>, S>(scratch),
        _ => batch.tiles::<L, C, Everything, S>(scratch),
    })
}

#[cfg(test)]
mod tests;
