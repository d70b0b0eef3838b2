//! Rays per second: from an array of rays to an array of answers.
//!
//! What is timed is what a program pays that has rays in the peers' layout and
//! wants t and id: the conversion into columns, the tracing, the narrowing of
//! the answers. Rays are made before, answers are checked after. All pairs of
//! ray set and contender take turns, so that a machine that slows down slows
//! all of them.
//!
//! A peer's contenders are chosen per ray set, by a short trial of all its ways
//! (`trial.rs`). Answers are compared with exact f64 ones (`compare.rs`).
//!
//! Time is the thread's own processor time where one thread traces and the
//! system tells it (Linux), else wall-clock time:
//! [`Clock`](super::clock::Clock).

mod compare;
mod contender;
mod row;
mod trial;

pub use compare::Differences;
pub use contender::{Contender, Tracer};
pub use row::{Comparison, Row, comparisons};

use super::clock::Clock;
use super::peer::{Embree, PeerTests};
use super::queries::{Answers, Ask, Job};
use crate::render::Progress;
use crate::trace::{Caching, HitId};
use compare::Expected;
use rayon::ThreadPool;
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
        "{kind}, {mode}: {differ} of {checked} rays have another answer than f64 at one lane; \
         they must have the same"
    )]
    Wrong {
        kind: String,
        mode: String,
        differ: usize,
        checked: usize,
    },
}

/// A peer, and how its ids translate.
#[derive(Clone, Copy)]
pub struct Peer<'a> {
    pub tracer: &'a Embree,
    /// What each of its triangles is in the scene.
    pub ids: &'a [HitId],
}

/// What stays the same over a run.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Repetitions of each measurement.
    pub reps: u32,
    /// Rays of each set that are compared with f64 at one lane, at most.
    pub checked: usize,
}

/// Measures every job with every contender on the pool. `judge` answers what is
/// compared; a peer, if there is one, joins with its best ways. Rows by job,
/// then by contender.
pub fn bench<'a>(
    judge: &Contender<'a>,
    own: &[Contender<'a>],
    peer: Option<Peer<'a>>,
    pool: &ThreadPool,
    jobs: &[Job],
    setting: &Setting,
    progress: &Progress,
) -> Result<Vec<Row>, BenchError> {
    let clock = Clock::of(pool.current_num_threads());
    let mut answers = Answers::default();
    let mut rows = Vec::new();
    // Each row's job and contender.
    let mut runs: Vec<(usize, Contender)> = Vec::new();
    let with = |caching| own.iter().any(|own| own.caching() == Some(caching));
    let twice = Caching::ALL.into_iter().all(with);
    // Also warms up.
    for (number, job) in jobs.iter().enumerate() {
        let expected = Expected::of(judge, pool, job, setting.checked, progress)?;
        // Rays that ask for the closest hit have no shadow cache: one of a pair.
        let same =
            |own: &&Contender| job.ask == Ask::Any || !twice || own.caching() == Some(Caching::On);
        let mut contenders: Vec<Contender> = own.iter().filter(same).cloned().collect();
        if let Some(peer) = peer {
            for tests in PeerTests::ALL {
                contenders.extend(trial::best(peer.tracer, tests, pool, job, clock, progress)?);
            }
        }
        for contender in contenders {
            let cached = pool.install(|| contender.trace(job, &mut answers, progress))?;
            let hits = answers.hits();
            if let (Some(peer), Tracer::Peer(..)) = (peer, &contender.tracer) {
                compare::translate(&mut answers, peer.ids);
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
        }
    }

    let mut times = vec![Vec::new(); rows.len()];
    for _ in 0..setting.reps {
        for (row, (number, contender)) in runs.iter().enumerate() {
            let job = &jobs[*number];
            let run = || clock.time(|| contender.trace(job, &mut answers, progress));
            let (done, seconds) = pool.install(run);
            done?;
            times[row].push(seconds);
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
