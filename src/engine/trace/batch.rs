//! Many rays: columns in, columns out, packet by packet.

mod any;
mod closest;

use super::beam::{BEAM, BeamScratch, with_scratch};
use super::hits::Hits;
use super::item_buffer::ItemBuffer;
use super::rays::Rays;
use super::refine::refine;
use super::shadow_cache::ShadowCache;
use super::stream::StreamScratch;
use crate::accel::{Accelerator, BaselineAccelerator, Count, Counter, InstanceBvhs, World};
use crate::geom::{Certainty, Fast, Guarded};
use crate::math::lanes::{Lanes, f32x4, f32x8, f32x16};
use crate::plan::{ALL_LANES, Kernels, Precision, native_width};
use any::AnyBatch;
use closest::ClosestBatch;

/// Finds the nearest hit of every ray.
pub fn closest(world: &World, kernels: &Kernels, rays: &Rays, hits: &mut Hits) {
    closest_of(world, kernels, rays, None, hits, None);
}

/// The same by an item buffer: the first rays are its tile `tile`. Rays that its
/// lists do not stand for are traced.
pub fn closest_listed(
    world: &World,
    kernels: &Kernels,
    rays: &Rays,
    items: (&ItemBuffer, usize),
    hits: &mut Hits,
) {
    closest_of(world, kernels, rays, Some(items), hits, None);
}

/// The same, and what it took, where that [is counted](counts).
pub fn closest_counted(
    world: &World,
    kernels: &Kernels,
    rays: &Rays,
    hits: &mut Hits,
    counter: &Counter,
) {
    closest_of(world, kernels, rays, None, hits, Some(counter));
}

fn closest_of(
    world: &World,
    kernels: &Kernels,
    rays: &Rays,
    items: Option<(&ItemBuffer, usize)>,
    hits: &mut Hits,
    counter: Option<&Counter>,
) {
    let batch = ClosestBatch {
        world,
        rays,
        hits,
        items,
    };
    dispatch(world, kernels, counter, batch);
    if kernels.precision == Precision::Exact {
        refine(world, rays, hits);
    }
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

/// Whether steps and tests can be counted: in comparison structures.
pub fn counts(world: &World) -> bool {
    matches!(world.accelerator, Accelerator::Baseline(_))
}

/// A batch that runs at any width and certainty. Each instance of each function is a
/// traversal of its own: `.ci/instances` counts them.
trait Batch {
    /// Through wide trees; `S` packets are a tile.
    fn tiles<L: Lanes, C: Certainty, const S: usize>(self, scratch: &mut BeamScratch);
    /// Through nested trees: streams for all rays.
    fn nested<L: Lanes, C: Certainty, const S: usize>(
        self,
        groups: &InstanceBvhs,
        scratch: &mut StreamScratch,
    );
    /// Packet by packet, through comparison structures.
    fn packets<L: Lanes, C: Certainty>(self, levels: &BaselineAccelerator, count: Count);
}

/// Finds the nearest hit of every ray with all decisions made by exact arithmetic, as error
/// bounds that know nothing would have it: what `guarded` is compared with by the tests.
#[cfg(feature = "all-lanes")]
#[doc(hidden)]
pub fn closest_doubting_all(world: &World, rays: &Rays, hits: &mut Hits) {
    #[derive(Clone, Copy)]
    struct DoubtAll;

    impl Certainty for DoubtAll {
        const GUARDED: bool = true;
        const DOUBTS_ALL: bool = true;
    }
    let batch = ClosestBatch {
        world,
        rays,
        hits,
        items: None,
    };
    by_structure_at_one::<DoubtAll>(&world.accelerator, batch);
}

/// [`by_structure`] where no more than one lane is built.
#[cfg(feature = "all-lanes")]
fn by_structure_at_one<C: Certainty>(levels: &Accelerator, batch: impl Batch) {
    match levels {
        Accelerator::Nested(levels) => with_scratch(|scratch| {
            batch.nested::<f32, C, BEAM>(&levels.instance_bvhs, &mut scratch.streams);
        }),
        _ => flat::<f32, C, BEAM>(levels, Count::default(), batch),
    }
}

fn dispatch(world: &World, kernels: &Kernels, counter: Option<&Counter>, batch: impl Batch) {
    let (levels, count) = (&world.accelerator, Count(counter));
    match kernels.precision {
        Precision::Fast => by_structure::<Fast>(kernels.lanes, levels, count, batch),
        Precision::Guarded | Precision::Exact => {
            by_structure::<Guarded>(kernels.lanes, levels, count, batch);
        }
    }
}

/// The lanes of single primitives before streams of nested worlds, whatever is asked for:
/// streams go ray by ray.
#[cfg(not(test))]
type Streamed = crate::math::lanes::Register;
#[cfg(test)]
type Streamed = f32;
const STREAMED: usize = BEAM / <Streamed as Lanes>::COUNT;

/// Whether packets of so many rays are built. The library's own tests trace by one ray:
/// what traces everything is tested from outside, and kernels take long to build.
const fn is_built(lanes: usize) -> bool {
    !cfg!(test) && (ALL_LANES || lanes == native_width())
}

fn by_structure<C: Certainty>(lanes: usize, levels: &Accelerator, count: Count, batch: impl Batch) {
    if let Accelerator::Nested(levels) = levels {
        return with_scratch(|scratch| {
            batch.nested::<Streamed, C, STREAMED>(&levels.instance_bvhs, &mut scratch.streams);
        });
    }
    match lanes {
        16 if const { is_built(16) } => flat::<f32x16, C, { BEAM / 16 }>(levels, count, batch),
        8 if const { is_built(8) } => flat::<f32x8, C, { BEAM / 8 }>(levels, count, batch),
        4 if const { is_built(4) } => flat::<f32x4, C, { BEAM / 4 }>(levels, count, batch),
        _ => flat::<f32, C, BEAM>(levels, count, batch),
    }
}

fn flat<L: Lanes, C: Certainty, const S: usize>(
    levels: &Accelerator,
    count: Count,
    batch: impl Batch,
) {
    match levels {
        Accelerator::Baseline(levels) => batch.packets::<L, C>(levels, count),
        _ => with_scratch(|scratch| batch.tiles::<L, C, S>(scratch)),
    }
}

#[cfg(test)]
mod tests;
