//! Batches of rays: from columns of rays to columns of answers.

mod any;
mod closest;

use super::beam::{BEAM, BeamScratch};
use super::hits::Hits;
use super::item_buffer::ItemBuffer;
use super::rays::Rays;
use super::refine::refine;
use super::scratch::TraceScratch;
use super::shadow_cache::ShadowCache;
use super::stream::StreamScratch;
use crate::accel::{Accelerator, BaselineAccelerator, Count, Counter, InstanceBvhs, World};
use crate::geom::{Certainty, Fast, Guarded};
use crate::math::lanes::{Lanes, f32x4, f32x8, f32x16};
use crate::plan::{ALL_LANES, Kernels, Precision, native_width};
use any::AnyBatch;
use closest::ClosestBatch;

/// Finds the closest hit of every ray.
pub fn closest(
    world: &World,
    kernels: &Kernels,
    rays: &Rays,
    hits: &mut Hits,
    scratch: &mut TraceScratch,
) {
    closest_of((world, kernels), rays, None, hits, None, scratch);
}

/// [`closest`] by the lists of an item buffer, from the list of this number on. Rays that the
/// lists do not cover are traced through the trees.
pub fn closest_listed(
    world: &World,
    kernels: &Kernels,
    rays: &Rays,
    items: (&ItemBuffer, usize),
    hits: &mut Hits,
    scratch: &mut TraceScratch,
) {
    closest_of((world, kernels), rays, Some(items), hits, None, scratch);
}

/// [`closest`], counting steps and tests in worlds that [count](counts) them.
pub fn closest_counted(
    world: &World,
    kernels: &Kernels,
    rays: &Rays,
    hits: &mut Hits,
    counter: &Counter,
    scratch: &mut TraceScratch,
) {
    closest_of((world, kernels), rays, None, hits, Some(counter), scratch);
}

fn closest_of(
    (world, kernels): (&World, &Kernels),
    rays: &Rays,
    items: Option<(&ItemBuffer, usize)>,
    hits: &mut Hits,
    counter: Option<&Counter>,
    scratch: &mut TraceScratch,
) {
    let batch = ClosestBatch {
        world,
        rays,
        hits,
        items,
    };
    dispatch((world, kernels), counter, batch, scratch);
    if kernels.precision == Precision::Exact {
        refine(world, rays, hits, scratch);
    }
}

/// Finds whether each ray is blocked. `cache` keeps the last occluder, which consecutive rays
/// to one light often share.
pub fn any(
    world: &World,
    kernels: &Kernels,
    rays: &Rays,
    cache: &mut ShadowCache,
    blocked: &mut [bool],
    scratch: &mut TraceScratch,
) {
    let batch = AnyBatch {
        world,
        rays,
        cache,
        blocked,
    };
    dispatch((world, kernels), None, batch, scratch);
}

/// [`any`], counting steps and tests in worlds that [count](counts) them.
pub fn any_counted(
    world: &World,
    kernels: &Kernels,
    rays: &Rays,
    cache: &mut ShadowCache,
    blocked: &mut [bool],
    counter: &Counter,
    scratch: &mut TraceScratch,
) {
    let batch = AnyBatch {
        world,
        rays,
        cache,
        blocked,
    };
    dispatch((world, kernels), Some(counter), batch, scratch);
}

/// Whether steps and tests are counted: in comparison structures only.
pub fn counts(world: &World) -> bool {
    matches!(world.accelerator, Accelerator::Baseline(_))
}

/// Unit tests of this crate instantiate the few traversals that they compare, and none of
/// those that [`dispatch`] chooses from: these take longer to build than all else, and
/// integration tests trace by them.
const UNIT_TESTS: bool = cfg!(test);
const IN_UNIT_TESTS: &str = "unit tests call traversals by name";

/// A batch of queries at any width and certainty. Each instantiation of a function is a
/// traversal of its own; `.ci/instances` counts them.
trait Batch {
    /// Traces beams, of `S` packets each, and streams through wide trees.
    fn beams<L: Lanes, C: Certainty, const S: usize>(
        self,
        walk: &mut BeamScratch,
        scratch: &mut TraceScratch,
    );
    /// Traces streams through nested trees.
    fn nested<L: Lanes, C: Certainty, const S: usize>(
        self,
        bvhs: &InstanceBvhs,
        walk: &mut StreamScratch,
        scratch: &mut TraceScratch,
    );
    /// Traces packets through comparison structures.
    fn packets<L: Lanes, C: Certainty>(
        self,
        levels: &BaselineAccelerator,
        count: Count,
        scratch: &mut TraceScratch,
    );
}

/// Finds the closest hit of every ray with all decisions made by exact arithmetic, to compare
/// `guarded` with in tests.
#[cfg(feature = "all-lanes")]
#[doc(hidden)]
pub fn closest_all_exact(world: &World, rays: &Rays, hits: &mut Hits, scratch: &mut TraceScratch) {
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
    by_structure_at_one::<DoubtAll>(&world.accelerator, batch, scratch);
}

/// [`by_structure`] for a certainty that is only built at one lane.
#[cfg(feature = "all-lanes")]
fn by_structure_at_one<C: Certainty>(
    levels: &Accelerator,
    batch: impl Batch,
    scratch: &mut TraceScratch,
) {
    if UNIT_TESTS {
        unreachable!("{IN_UNIT_TESTS}");
    }
    match levels {
        Accelerator::Nested(levels) => scratch.with_walk(|walk, scratch| {
            batch.nested::<f32, C, BEAM>(&levels.instance_bvhs, &mut walk.streams, scratch);
        }),
        _ => flat::<f32, C, BEAM>(levels, Count::default(), batch, scratch),
    }
}

/// Runs a batch at the certainty of a precision.
fn dispatch(
    (world, kernels): (&World, &Kernels),
    counter: Option<&Counter>,
    batch: impl Batch,
    scratch: &mut TraceScratch,
) {
    if UNIT_TESTS {
        unreachable!("{IN_UNIT_TESTS}");
    }
    let (levels, count) = (&world.accelerator, Count(counter));
    match kernels.precision {
        Precision::Fast => by_structure::<Fast>(kernels.lanes, levels, count, batch, scratch),
        Precision::Guarded | Precision::Exact => {
            by_structure::<Guarded>(kernels.lanes, levels, count, batch, scratch);
        }
    }
}

/// Lanes of single primitives in streams of nested worlds, at every requested width: streams
/// test triangles ray by ray.
type Streamed = crate::math::lanes::Register;
const STREAMED: usize = BEAM / <Streamed as Lanes>::COUNT;

/// Whether a width is built.
const fn is_built(lanes: usize) -> bool {
    ALL_LANES || lanes == native_width()
}

/// Runs a batch at the requested width, or at one lane if that is not built.
fn by_structure<C: Certainty>(
    lanes: usize,
    levels: &Accelerator,
    count: Count,
    batch: impl Batch,
    scratch: &mut TraceScratch,
) {
    if let Accelerator::Nested(levels) = levels {
        return scratch.with_walk(|walk, scratch| {
            batch.nested::<Streamed, C, STREAMED>(
                &levels.instance_bvhs,
                &mut walk.streams,
                scratch,
            );
        });
    }
    match lanes {
        16 if const { is_built(16) } => {
            flat::<f32x16, C, { BEAM / 16 }>(levels, count, batch, scratch)
        }
        8 if const { is_built(8) } => flat::<f32x8, C, { BEAM / 8 }>(levels, count, batch, scratch),
        4 if const { is_built(4) } => flat::<f32x4, C, { BEAM / 4 }>(levels, count, batch, scratch),
        _ => flat::<f32, C, BEAM>(levels, count, batch, scratch),
    }
}

/// Runs a batch through the trees of a flat world.
fn flat<L: Lanes, C: Certainty, const S: usize>(
    levels: &Accelerator,
    count: Count,
    batch: impl Batch,
    scratch: &mut TraceScratch,
) {
    match levels {
        Accelerator::Baseline(levels) => batch.packets::<L, C>(levels, count, scratch),
        _ => scratch.with_walk(|walk, scratch| batch.beams::<L, C, S>(walk, scratch)),
    }
}

#[cfg(test)]
mod tests;
