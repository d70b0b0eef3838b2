//! One way of tracing: one of our kernels, or a baseline's function.

use super::BenchError;
use crate::baseline::{Embree, Way};
use crate::queries::{Answers, Job, count, trace};
use lanecast_engine::accel::{Counts, World};
use lanecast_engine::trace::{CacheCounts, Caching, counts};
use lanecast_model::plan::Kernels;
use lanecast_picture::render::Progress;

/// A tracer, and how a result row describes it.
#[derive(Clone)]
pub struct Contender<'a> {
    pub accel: String,
    /// `tile` or `packet`, or `single` at one lane; the function's own name for a
    /// baseline.
    pub kernel: String,
    /// Number of rays per packet.
    pub lanes: usize,
    pub precision: &'static str,
    /// True if every bit of the answers must equal that of one f64 lane.
    pub exact: bool,
    pub isa: &'static str,
    pub tracer: Tracer<'a>,
}

#[derive(Clone)]
pub enum Tracer<'a> {
    Own {
        world: &'a World,
        kernels: Kernels,
        /// Shadow cache of any-hit rays.
        caching: Caching,
    },
    Baseline(&'a Embree, Way),
}

impl Contender<'_> {
    /// Describes the contender for messages.
    pub fn name(&self) -> String {
        let Contender {
            accel,
            kernel,
            lanes,
            precision,
            ..
        } = self;
        match self.tracer {
            Tracer::Baseline(..) => kernel.clone(),
            Tracer::Own { caching, .. } => {
                let plural = if *lanes == 1 { "" } else { "s" };
                let cache = match caching {
                    Caching::On => "",
                    Caching::Off => ", no shadow cache",
                };
                format!("{accel}, {kernel}, {precision} at {lanes} lane{plural}{cache}")
            }
        }
    }

    pub(super) fn caching(&self) -> Option<Caching> {
        match self.tracer {
            Tracer::Own { caching, .. } => Some(caching),
            Tracer::Baseline(..) => None,
        }
    }

    pub fn trace(
        &self,
        job: &Job,
        answers: &mut Answers,
        progress: &Progress,
    ) -> Result<CacheCounts, BenchError> {
        let done = match &self.tracer {
            Tracer::Own {
                world,
                kernels,
                caching,
            } => {
                let ask = (job.ask, *caching);
                trace(world, kernels, &job.rays, ask, answers, progress)
            }
            Tracer::Baseline(embree, way) => embree
                .trace(*way, &job.rays, job.ask, answers, progress)
                .map(|()| CacheCounts::default()),
        };
        done.ok_or(BenchError::Interrupted)
    }

    /// Counts the traversal steps of a job; `None` where the kernels do not count.
    pub fn count(&self, job: &Job, progress: &Progress) -> Result<Option<Counts>, BenchError> {
        let Tracer::Own {
            world,
            kernels,
            caching,
        } = &self.tracer
        else {
            return Ok(None);
        };
        if !counts(world) {
            return Ok(None);
        }
        let counted = count(world, kernels, &job.rays, (job.ask, *caching), progress);
        counted.map(Some).ok_or(BenchError::Interrupted)
    }
}
