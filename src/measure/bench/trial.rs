//! Selects the baseline's settings that deserve a full measurement for a ray set.

use super::{BenchError, Contender, Tracer};
use crate::baseline::{BaselineTests, Embree, Way};
use crate::clock::Clock;
use crate::queries::{Answers, Job};
use lanecast_io::RaySet;
use lanecast_picture::render::Progress;
use rayon::ThreadPool;

/// Number of settings measured at full length.
const KEPT: usize = 3;
/// A trial traces runs of neighbouring rays, spread over the set. A run is as long as
/// the longest stream, so no setting is cut short.
const RUN: usize = 2048;
const RUNS: usize = 48;
/// Number of trials per setting; its best time counts, and the settings take turns.
const TURNS: usize = 3;

/// Returns the settings with these tests that were fastest on a part of the rays,
/// fastest first.
pub fn fastest<'a>(
    embree: &'a Embree,
    tests: BaselineTests,
    pool: &ThreadPool,
    job: &Job,
    clock: Clock,
    progress: &Progress,
) -> Result<Vec<Contender<'a>>, BenchError> {
    let part = Job {
        kind: job.kind.clone(),
        ask: job.ask,
        rays: some_runs(&job.rays),
    };
    let contender = |way: Way| Contender {
        accel: "embree3".into(),
        kernel: embree.name(way, job.ask),
        lanes: way.lanes(),
        precision: tests.name(),
        exact: false,
        isa: embree.isa(way),
        tracer: Tracer::Baseline(embree, way),
    };
    let mut tried: Vec<(f64, Contender)> = embree
        .ways(tests)
        .into_iter()
        .map(|way| (f64::INFINITY, contender(way)))
        .collect();
    let mut answers = Answers::default();
    for _ in 0..TURNS {
        for (best, contender) in &mut tried {
            let run = || clock.time(|| contender.trace(&part, &mut answers, progress));
            let (done, seconds) = pool.install(run);
            done?;
            *best = best.min(seconds);
        }
    }
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    tried.truncate(KEPT);
    Ok(tried.into_iter().map(|(_, contender)| contender).collect())
}

fn some_runs(rays: &RaySet) -> RaySet {
    let runs = rays.len().div_ceil(RUN);
    let step = runs.div_ceil(RUNS).max(1);
    let rows = |run: usize| run * RUN..((run + 1) * RUN).min(rays.len());
    rays.select((0..runs).step_by(step).flat_map(rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_whole_runs_from_all_over() {
        let set = |n: usize| {
            let mut rays = RaySet::default();
            for i in 0..n {
                rays.push([i as f32, 0.0, 0.0], 0.0, [0.0, 0.0, 1.0], 1.0);
            }
            rays
        };
        assert_eq!(some_runs(&set(0)).len(), 0);
        assert_eq!(some_runs(&set(5000)), set(5000));
        let some = some_runs(&set(1 << 20));
        assert!(some.len() <= RUN * RUNS && some.len() > RUN * RUNS / 2);
        assert_eq!(some.org(RUN - 1)[0], (RUN - 1) as f32);
        assert_eq!(some.org(RUN)[0] as usize % RUN, 0);
        assert!(*some.org[0].last().unwrap() > 0.9 * (1 << 20) as f32);
    }
}
