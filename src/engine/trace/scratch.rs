//! Buffers that tracing reuses from batch to batch, owned by the caller.

use super::beam::BeamScratch;
use super::csg::CsgScratch;
use super::csg::lanes::LaneScratch;
use crate::accel::{AnyScratch, BaselineAccelerator};
use crate::geom::Scratch;
use crate::math::lanes::Lanes;
use std::any::Any;
use std::sync::{Mutex, PoisonError};

/// The buffers of one thread's queries, for worlds and lane widths of any kind.
///
/// All of them start empty and grow to what the queries need, so a caller keeps one value
/// per thread and passes it to every query. No answer depends on what is in it.
#[derive(Default)]
pub struct TraceScratch {
    /// Number of (ray, primitive) pairs decided by exact arithmetic so far.
    pub decided: u64,
    pub(super) csg: CsgScratch,
    pub(super) lanes: LaneScratch,
    /// Of the primitives' kernels.
    pub(super) kernels: Scratch,
    walk: Option<Box<BeamScratch>>,
    baselines: TypedSlots,
}

impl TraceScratch {
    /// Lends the stacks and streams of wide and nested trees beside the rest: making
    /// them anew takes as long as some hundred rays.
    pub(super) fn with_walk(&mut self, run: impl FnOnce(&mut BeamScratch, &mut TraceScratch)) {
        let mut walk = self.walk.take().unwrap_or_default();
        run(&mut walk, self);
        self.walk = Some(walk);
    }

    /// Takes the scratch of packets through comparison structures: that of the top level,
    /// and that of meshes.
    pub(super) fn take_baseline<L: Lanes>(
        &mut self,
        levels: &BaselineAccelerator,
    ) -> [AnyScratch<L>; 2] {
        let kept: &mut Option<[AnyScratch<L>; 2]> = self.baselines.slot();
        match kept.take() {
            Some(pair) if levels.tlas.suits(&pair[0]) => pair,
            _ => [levels.tlas.scratch(), levels.tlas.scratch()],
        }
    }

    /// Returns what [`TraceScratch::take_baseline`] has taken.
    pub(super) fn keep_baseline<L: Lanes>(&mut self, pair: [AnyScratch<L>; 2]) {
        *self.baselines.slot() = Some(pair);
    }
}

/// One value per type, made at its first use: buffers of lanes are of another type for
/// each width.
#[derive(Default)]
pub(super) struct TypedSlots(Vec<Box<dyn Any + Send>>);

impl TypedSlots {
    pub fn slot<T: Any + Send + Default>(&mut self) -> &mut T {
        let found = self.0.iter().position(|value| value.is::<T>());
        let at = found.unwrap_or(self.0.len());
        if found.is_none() {
            self.0.push(Box::<T>::default());
        }
        self.0[at].downcast_mut().expect("it was found by its type")
    }
}

/// Scratch for the jobs of a thread pool: as many values as jobs run at the same time.
#[derive(Default)]
pub struct ScratchPool<T>(Mutex<Vec<T>>);

impl<T: Default> ScratchPool<T> {
    /// Runs a job with a value that no other job uses meanwhile.
    pub fn with<R>(&self, job: impl FnOnce(&mut T) -> R) -> R {
        let idle = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let kept = idle().pop();
        let mut scratch = kept.unwrap_or_default();
        let result = job(&mut scratch);
        idle().push(scratch);
        result
    }

    /// Returns all values once no job runs.
    pub fn into_values(self) -> Vec<T> {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ScratchPool<TraceScratch> {
    /// Sums the pairs that the jobs have decided by exact arithmetic.
    pub fn decided(self) -> u64 {
        let all = self.into_values();
        all.iter().map(|scratch| scratch.decided).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_type_has_a_slot_of_its_own() {
        let mut slots = TypedSlots::default();
        slots.slot::<Vec<u32>>().push(7);
        slots.slot::<Vec<u64>>().push(8);
        slots.slot::<Vec<u32>>().push(9);
        assert_eq!(slots.slot::<Vec<u32>>(), &[7, 9]);
        assert_eq!(slots.slot::<Vec<u64>>(), &[8]);
        assert_eq!(slots.0.len(), 2);
    }

    #[test]
    fn jobs_at_the_same_time_have_values_of_their_own() {
        let pool = ScratchPool::<u32>::default();
        pool.with(|outer| {
            *outer = 1;
            pool.with(|inner| *inner += 2);
        });
        pool.with(|value| *value += 4);
        let mut values = pool.into_values();
        values.sort_unstable();
        assert_eq!(values, [2, 5]);
    }
}
