//! One way of tracing, ours or a peer's.

use super::BenchError;
use crate::accel::{Counts, World};
use crate::measure::peer::{Embree, Way};
use crate::measure::queries::{Answers, Job, count, trace};
use crate::plan::Kernels;
use crate::render::Progress;
use crate::trace::{CacheCounts, Caching, counts};

/// What a row says about who traced, and the tracer.
#[derive(Clone)]
pub struct Contender<'a> {
    pub accel: String,
    /// `tile` or `packet`, or `single` at one lane; a peer's own name.
    pub kernel: String,
    /// Rays per packet.
    pub lanes: usize,
    pub precision: &'static str,
    /// Must answer as f64 at one lane does, in every bit.
    pub exact: bool,
    pub isa: &'static str,
    pub tracer: Tracer<'a>,
}

#[derive(Clone)]
pub enum Tracer<'a> {
    Own {
        world: &'a World,
        kernels: Kernels,
        /// Of rays that ask for any hit.
        caching: Caching,
    },
    Peer(&'a Embree, Way),
}

impl Contender<'_> {
    /// For messages.
    pub fn name(&self) -> String {
        let Contender {
            accel,
            kernel,
            lanes,
            precision,
            ..
        } = self;
        match self.tracer {
            Tracer::Peer(..) => kernel.clone(),
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
            Tracer::Peer(..) => None,
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
            Tracer::Peer(peer, way) => peer
                .trace(*way, &job.rays, job.ask, answers, progress)
                .map(|()| CacheCounts::default()),
        };
        done.ok_or(BenchError::Interrupted)
    }

    /// What a job takes, where that is counted.
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
