//! Rays per second, from an array of rays to an array of answers.
//!
//! The timed interval covers what a caller with rays in the baseline's layout pays for
//! t and id: conversion to columns, tracing, and narrowing of the answers. Rays are
//! generated before the interval and answers are checked after it. All pairs of ray set
//! and contender take turns, so that a slowdown of the machine affects all of them.
//!
//! A baseline's contenders are chosen per ray set by a short trial of all its functions
//! and settings (`trial.rs`). Answers are compared with exact f64 ones (`compare.rs`).
//!
//! A single tracing thread is timed by its own processor time where the system provides
//! it (Linux), other runs by wall-clock time: [`Clock`](super::clock::Clock).

mod compare;
mod contender;
mod row;
mod trial;

pub use compare::Differences;
pub use contender::{Contender, Tracer};
pub use row::{Comparison, Row, comparisons};

use super::baseline::{BaselineTests, Embree};
use super::clock::Clock;
use super::queries::{Answers, Ask, Job};
use compare::Expected;
use lanecast_engine::trace::{Caching, HitId};
use lanecast_picture::render::Progress;
use rayon::ThreadPool;
use std::sync::atomic::Ordering::Relaxed;
use thiserror::Error;

#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum BenchError {
    #[error("interrupted")]
    Interrupted,
    #[error("{kind}, {mode}: {found} hits in one repetition and {expected} in the first")]
    Unsteady {
        kind: String,
        mode: String,
        expected: usize,
        found: usize,
    },
    #[error(
        "{kind}, {mode}: {differ} of {checked} answers differ from exact tracing at one lane; \
         they must be equal"
    )]
    Wrong {
        kind: String,
        mode: String,
        differ: usize,
        checked: usize,
    },
}

/// A baseline tracer, and the translation of its ids.
#[derive(Clone, Copy)]
pub struct Baseline<'a> {
    pub tracer: &'a Embree,
    /// Scene id of each of the baseline's triangles.
    pub ids: &'a [HitId],
}

/// Parameters of a run.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Repetitions of each measurement.
    pub reps: u32,
    /// Maximum number of rays per set that are compared with one f64 lane.
    pub checked: usize,
}

/// Measures every job with every contender on the pool. `oracle` gives the answers to
/// compare with; a baseline, if there is one, joins with its fastest settings. Returns
/// rows by job, then by contender.
pub fn bench<'a>(
    oracle: &Contender<'a>,
    own: &[Contender<'a>],
    baseline: Option<Baseline<'a>>,
    pool: &ThreadPool,
    jobs: &[Job],
    setting: &Setting,
    progress: &Progress,
) -> Result<Vec<Row>, BenchError> {
    let clock = Clock::for_threads(pool.current_num_threads());
    let mut answers = Answers::default();
    let mut rows = Vec::new();
    // Job and contender of each row.
    let mut runs: Vec<(usize, Contender)> = Vec::new();
    let with = |caching| own.iter().any(|own| own.caching() == Some(caching));
    let twice = Caching::ALL.into_iter().all(with);
    // The first pass also warms up. Of a baseline it is not known yet how many contenders it has.
    let rounds = 1 + setting.reps;
    let pairs = |contenders: usize| (contenders as u32).saturating_mul(rounds);
    progress.start(pairs(jobs.len() * own.len()));
    for (number, job) in jobs.iter().enumerate() {
        let expected = Expected::new(oracle, pool, job, setting.checked, progress)?;
        // Closest-hit rays use no shadow cache: one contender of each cached and
        // uncached pair suffices.
        let same =
            |own: &&Contender| job.ask == Ask::Any || !twice || own.caching() == Some(Caching::On);
        let mut contenders: Vec<Contender> = own.iter().filter(same).cloned().collect();
        if let Some(baseline) = baseline {
            for tests in BaselineTests::ALL {
                contenders.extend(trial::fastest(
                    baseline.tracer,
                    tests,
                    pool,
                    job,
                    clock,
                    progress,
                )?);
            }
        }
        for contender in contenders {
            let cached = pool.install(|| contender.trace(job, &mut answers, progress))?;
            let hits = answers.hits();
            if let (Some(baseline), Tracer::Baseline(..)) = (baseline, &contender.tracer) {
                compare::translate(&mut answers, baseline.ids);
            }
            let found = expected.differences(job.ask, &contender, &answers);
            if contender.exact && found.differ > 0 {
                return Err(BenchError::Wrong {
                    kind: job.kind.clone(),
                    mode: contender.name(),
                    differ: found.differ,
                    checked: found.checked,
                });
            }
            let threads = pool.current_num_threads();
            let mut row = Row::new(job, &contender, threads, hits, found);
            row.cache(&cached);
            if let Some(counts) = contender.count(job, progress)? {
                row.count(&counts);
            }
            rows.push(row);
            runs.push((number, contender));
            progress.add_tile(job.rays.len() as u64);
        }
    }
    progress.tiles.store(pairs(runs.len()), Relaxed);

    let mut times = vec![Vec::new(); rows.len()];
    for _ in 0..setting.reps {
        for (row, (number, contender)) in runs.iter().enumerate() {
            let job = &jobs[*number];
            let run = || clock.time(|| contender.trace(job, &mut answers, progress));
            let (done, seconds) = pool.install(run);
            done?;
            times[row].push(seconds);
            progress.add_tile(job.rays.len() as u64);
            if answers.hits() != rows[row].hits {
                return Err(BenchError::Unsteady {
                    kind: job.kind.clone(),
                    mode: contender.name(),
                    expected: rows[row].hits,
                    found: answers.hits(),
                });
            }
        }
    }
    for (row, times) in rows.iter_mut().zip(&times) {
        row.time(times);
    }
    Ok(rows)
}
