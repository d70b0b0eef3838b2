//! Rays per second: from an array of rays to an array of answers.
//!
//! What is timed is what a program pays that has rays in the peers' layout and
//! wants t and id: the conversion into columns, the tracing, the narrowing of
//! the answers. Rays are made before, answers are checked after. All pairs of
//! ray set and mode take turns, so that a machine that slows down slows all of
//! them.
//!
//! Time is the thread's own processor time where one thread traces and the
//! system tells it (Linux), else wall-clock time: [`Clock`].

use super::queries::{Answers, Ask, Job, convert, trace};
use crate::accel::World;
use crate::io::RaySet;
use crate::plan::{Arithmetic, Kernels, Precision};
use crate::render::Progress;
use crate::trace::HitId;
use rayon::ThreadPool;
use serde::Serialize;
use std::time::{Duration, Instant};
use thiserror::Error;

/// One way of tracing.
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    pub precision: Precision,
    pub kernels: Kernels,
}

/// The figures of one job in one mode, with the names of `bench --json`.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub kind: String,
    pub accel: &'static str,
    /// `packet`, or `single` where a packet is one ray.
    pub kernel: &'static str,
    pub lanes: usize,
    pub precision: &'static str,
    pub threads: usize,
    pub isa: &'static str,
    pub rays: usize,
    pub hits: usize,
    /// The median over the repetitions; 0 where nothing could be measured.
    pub mrays_per_s: f64,
    pub mrays_per_s_best: f64,
    /// Of the median time: rays into columns.
    pub conversion_share: f64,
    /// Rays compared with f64 at one lane.
    pub checked: usize,
    /// Of these, rays with another primitive or another shadow.
    pub differ: usize,
}

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

/// How the reports name what stays the same over a run.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    pub accel: &'static str,
    pub isa: &'static str,
    pub reps: u32,
}

/// Rays that are compared with f64 at one lane, at most, per set.
const CHECKED: usize = 1 << 14;

/// Measures every job in every mode on the pool. Rows by job, then by mode.
pub fn bench(
    world: &World,
    pool: &ThreadPool,
    jobs: &[Job],
    modes: &[Mode],
    setting: &Setting,
    progress: &Progress,
) -> Result<Vec<Row>, BenchError> {
    let clock = Clock::of(pool.current_num_threads());
    let mut answers = Answers::default();
    let mut rows = Vec::new();
    // Also warms up.
    for job in jobs {
        let expected = Expected::of(world, pool, job, modes, progress)?;
        for mode in modes {
            pool.install(|| mode.trace(world, job, &mut answers, progress))?;
            let differ = expected.differing(job.ask, mode, &answers);
            if mode.precision == Precision::Exact && differ > 0 {
                return Err(BenchError::Wrong {
                    kind: job.kind.clone(),
                    mode: mode.name(),
                    differ,
                    checked: expected.rows.len(),
                });
            }
            rows.push(Row {
                kind: job.kind.clone(),
                accel: setting.accel,
                kernel: if mode.kernels.lanes == 1 {
                    "single"
                } else {
                    "packet"
                },
                lanes: mode.kernels.lanes,
                precision: mode.precision.name(),
                threads: pool.current_num_threads(),
                isa: setting.isa,
                rays: job.rays.len(),
                hits: answers.hits(),
                mrays_per_s: 0.0,
                mrays_per_s_best: 0.0,
                conversion_share: 0.0,
                checked: expected.rows.len(),
                differ,
            });
        }
    }

    let mut times = vec![Vec::new(); rows.len()];
    let mut conversions = vec![Vec::new(); jobs.len()];
    for _ in 0..setting.reps {
        for (j, job) in jobs.iter().enumerate() {
            conversions[j].push(pool.install(|| clock.time(|| convert(&job.rays)).1));
            for (m, mode) in modes.iter().enumerate() {
                let run = || clock.time(|| mode.trace(world, job, &mut answers, progress));
                let (done, seconds) = pool.install(run);
                done?;
                let row = j * modes.len() + m;
                times[row].push(seconds);
                if answers.hits() != rows[row].hits {
                    return Err(BenchError::Unsteady {
                        kind: job.kind.clone(),
                        mode: mode.name(),
                        expected: rows[row].hits,
                        found: answers.hits(),
                    });
                }
            }
        }
    }
    for (i, row) in rows.iter_mut().enumerate() {
        let (best, median) = best_and_median(&mut times[i]);
        let (_, conversion) = best_and_median(&mut conversions[i / modes.len()]);
        if best > 0.0 && row.rays > 0 {
            row.mrays_per_s = row.rays as f64 / median * 1e-6;
            row.mrays_per_s_best = row.rays as f64 / best * 1e-6;
            row.conversion_share = conversion / median;
        }
    }
    Ok(rows)
}

impl Mode {
    /// For messages.
    pub fn name(&self) -> String {
        let plural = if self.kernels.lanes == 1 { "" } else { "s" };
        let (precision, lanes) = (self.precision.name(), self.kernels.lanes);
        format!("{precision} at {lanes} lane{plural}")
    }

    fn trace(
        &self,
        world: &World,
        job: &Job,
        answers: &mut Answers,
        progress: &Progress,
    ) -> Result<(), BenchError> {
        trace(world, &self.kernels, &job.rays, job.ask, answers, progress)
            .ok_or(BenchError::Interrupted)
    }
}

/// What f64 at one lane says, for some rays of a set.
struct Expected {
    /// Rows of the set.
    rows: Vec<usize>,
    answers: Answers,
}

impl Expected {
    fn of(
        world: &World,
        pool: &ThreadPool,
        job: &Job,
        modes: &[Mode],
        progress: &Progress,
    ) -> Result<Expected, BenchError> {
        let step = job.rays.len().div_ceil(CHECKED).max(1);
        let rows: Vec<usize> = (0..job.rays.len()).step_by(step).collect();
        let mut answers = Answers::default();
        if let Some(mode) = modes.first() {
            let kernels = Kernels {
                arithmetic: Arithmetic::F64,
                lanes: 1,
                ..mode.kernels
            };
            let mut some = RaySet::with_capacity(rows.len());
            let rays = &job.rays;
            for i in &rows {
                some.push(rays.org[*i], rays.t_min[*i], rays.dir[*i], rays.t_max[*i]);
            }
            pool.install(|| trace(world, &kernels, &some, job.ask, &mut answers, progress))
                .ok_or(BenchError::Interrupted)?;
        }
        Ok(Expected { rows, answers })
    }

    /// Rays with another answer. Exact modes must have the same t as well.
    fn differing(&self, ask: Ask, mode: &Mode, found: &Answers) -> usize {
        let same = |(own, i): (usize, &usize)| match ask {
            Ask::Any => self.answers.blocked[own] == found.blocked[*i],
            Ask::Closest if self.answers.id[own] != found.id[*i] => false,
            Ask::Closest => {
                let (t, other) = (self.answers.t[own], found.t[*i]);
                let missed = found.id[*i] == HitId::NONE;
                mode.precision != Precision::Exact || missed || t.to_bits() == other.to_bits()
            }
        };
        let rows = self.rows.iter().enumerate();
        rows.filter(|row| !same(*row)).count()
    }
}

/// Seconds; 0 of none.
fn best_and_median(seconds: &mut [f64]) -> (f64, f64) {
    seconds.sort_by(f64::total_cmp);
    let at = |i: usize| seconds.get(i).copied().unwrap_or(0.0);
    (at(0), at(seconds.len() / 2))
}

/// What is read before and after each run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// Processor time of the thread that asks: other processes do not count.
    ThreadCpu,
    Wall,
}

impl Clock {
    /// The fittest for work on so many threads.
    pub fn of(threads: usize) -> Clock {
        if threads == 1 && thread_cpu_time().is_some() {
            Clock::ThreadCpu
        } else {
            Clock::Wall
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Clock::ThreadCpu => "thread cpu",
            Clock::Wall => "wall",
        }
    }

    /// Runs it, and says how many seconds it took.
    fn time<T>(self, run: impl FnOnce() -> T) -> (T, f64) {
        let cpu = || thread_cpu_time().unwrap_or_default();
        let (wall, before) = (Instant::now(), cpu());
        let done = run();
        let spent = match self {
            Clock::ThreadCpu => cpu().saturating_sub(before),
            Clock::Wall => wall.elapsed(),
        };
        (done, spent.as_secs_f64())
    }
}

#[cfg(target_os = "linux")]
fn thread_cpu_time() -> Option<Duration> {
    use nix::time::{ClockId, clock_gettime};
    let now = clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID).ok()?;
    Some(now.into())
}

#[cfg(not(target_os = "linux"))]
fn thread_cpu_time() -> Option<Duration> {
    None
}
