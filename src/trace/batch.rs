//! Many rays: columns in, columns out, packet by packet.

mod any;
mod closest;

use super::hits::Hits;
use super::items::ItemBuffer;
use super::leaf::{Everything, Features, Has};
use super::rays::Rays;
use super::shadow_cache::ShadowCache;
use super::stream::StreamScratch;
use super::tile::{TILE, TileScratch, with_scratch};
use crate::accel::{Count, Counter, Forest, Forests, Groups, Index, World};
use crate::geom::{Certainty, DoubtAll, Fast, Guarded};
use crate::math::lanes::{Lanes, Register, f32x4, f32x8, f32x16, f64x4, f64x8, f64x16};
use crate::plan::{ALL_LANES, Arithmetic, Kernels, Needs, native_width};
use any::AnyBatch;
use closest::ClosestBatch;

/// The nearest hit of every ray.
pub fn closest(world: &World, kernels: &Kernels, rays: &Rays, hits: &mut Hits) {
    dispatch(
        world,
        kernels,
        None,
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
        None,
        ClosestBatch {
            world,
            rays,
            hits,
            items: Some((items, tile)),
        },
    );
}

/// The same, and what it took, where that [is counted](counts).
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
        Some(counter),
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
        None,
        AnyBatch {
            world,
            rays,
            cache,
            blocked,
        },
    );
}

/// The same, and what it took, where that [is counted](counts).
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
        Some(counter),
        AnyBatch {
            world,
            rays,
            cache,
            blocked,
        },
    );
}

/// Whether steps and tests can be counted: by packets, of one ray or of the machine's own
/// width. What counts is built beside what does not, and kernels take long to build.
pub fn counts(world: &World, kernels: &Kernels) -> bool {
    let packets = !matches!(world.forest, Forests::Wide(_) | Forests::Nested(_));
    packets && [1, native_width(kernels.arithmetic)].contains(&kernels.lanes)
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

/// What a batch is monomorphised over, as values.
struct Choice<'a> {
    kernels: &'a Kernels,
    forest: &'a Forests,
    counter: Option<&'a Counter>,
}

fn dispatch(world: &World, kernels: &Kernels, counter: Option<&Counter>, batch: impl Batch) {
    let choice = Choice {
        kernels,
        forest: &world.forest,
        counter,
    };
    match kernels.arithmetic {
        Arithmetic::F32 => by_width_f32::<Fast>(&choice, batch),
        // Its answers are those of f64: only tests need the way there, at two widths
        // and uncounted; kernels take long to build.
        Arithmetic::F32DoubtingAll if ALL_LANES => match kernels.lanes {
            1 => by_structure::<f32, DoubtAll, TILE, false>(&choice, batch),
            _ => {
                by_structure::<Register, DoubtAll, { TILE / Register::COUNT }, false>(
                    &choice, batch,
                );
            }
        },
        Arithmetic::F32Guarded | Arithmetic::F32DoubtingAll => {
            by_width_f32::<Guarded>(&choice, batch)
        }
        Arithmetic::F64 => by_width_f64::<Guarded>(&choice, batch),
    }
}

const NATIVE_F32: usize = native_width(Arithmetic::F32);
const NATIVE_F64: usize = native_width(Arithmetic::F64);

/// Whether packets of so many rays are built. The library's own tests trace by one ray:
/// what traces everything is tested from outside, and kernels take long to build.
const fn is_built(lanes: usize, native: usize) -> bool {
    !cfg!(test) && (ALL_LANES || lanes == native)
}

const F32X16: bool = is_built(16, NATIVE_F32);
const F32X8: bool = is_built(8, NATIVE_F32);
const F32X4: bool = is_built(4, NATIVE_F32);
const F64X16: bool = is_built(16, NATIVE_F64);
const F64X8: bool = is_built(8, NATIVE_F64);
const F64X4: bool = is_built(4, NATIVE_F64);

fn by_width_f32<C: Certainty>(choice: &Choice, batch: impl Batch) {
    const OWN: usize = NATIVE_F32;
    match choice.kernels.lanes {
        16 if F32X16 => by_structure::<f32x16, C, { TILE / 16 }, { OWN == 16 }>(choice, batch),
        8 if F32X8 => by_structure::<f32x8, C, { TILE / 8 }, { OWN == 8 }>(choice, batch),
        4 if F32X4 => by_structure::<f32x4, C, { TILE / 4 }, { OWN == 4 }>(choice, batch),
        _ => by_structure::<f32, C, TILE, true>(choice, batch),
    }
}

fn by_width_f64<C: Certainty>(choice: &Choice, batch: impl Batch) {
    const OWN: usize = NATIVE_F64;
    match choice.kernels.lanes {
        16 if F64X16 => by_structure::<f64x16, C, { TILE / 16 }, { OWN == 16 }>(choice, batch),
        8 if F64X8 => by_structure::<f64x8, C, { TILE / 8 }, { OWN == 8 }>(choice, batch),
        4 if F64X4 => by_structure::<f64x4, C, { TILE / 4 }, { OWN == 4 }>(choice, batch),
        _ => by_structure::<f64, C, TILE, true>(choice, batch),
    }
}

/// `COUNTED`: whether packets are built that count, too.
fn by_structure<L: Lanes, C: Certainty, const S: usize, const COUNTED: bool>(
    choice: &Choice,
    batch: impl Batch,
) {
    match choice.forest {
        Forests::Wide(_) => by_needs::<L, C, S>(choice.kernels.needs, batch),
        Forests::Nested(forest) => with_scratch(|scratch| {
            batch.nested::<L, C, S>(&forest.groups, &mut scratch.streams);
        }),
        Forests::Narrow(forest) => by_packets::<L, C, _, COUNTED>(forest, choice, batch),
        Forests::Kd(forest) => by_packets::<L, C, _, COUNTED>(forest, choice, batch),
        Forests::Grid(forest) => by_packets::<L, C, _, COUNTED>(forest, choice, batch),
        Forests::Heap(forest) => by_packets::<L, C, _, COUNTED>(forest, choice, batch),
        Forests::HeapSpheres(forest) => by_packets::<L, C, _, COUNTED>(forest, choice, batch),
    }
}

/// Structures beside the default one have kernels for every need only: each set
/// costs build time.
fn by_packets<L: Lanes, C: Certainty, A: Index, const COUNTED: bool>(
    forest: &Forest<A>,
    choice: &Choice,
    batch: impl Batch,
) {
    if COUNTED && let Some(counter) = choice.counter {
        return batch.packets::<L, C, Everything, A, Counter>(forest, counter);
    }
    batch.packets::<L, C, Everything, A, ()>(forest, &());
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
