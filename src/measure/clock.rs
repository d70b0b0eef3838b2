//! Clocks for measurements.

use std::time::{Duration, Instant};

/// The clock read before and after each run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// Processor time of the calling thread: other processes do not count.
    ThreadCpu,
    Wall,
}

impl Clock {
    /// Selects the best clock for work on that many threads.
    pub fn for_threads(threads: usize) -> Clock {
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

    /// Runs `run` and returns its result with the seconds it took.
    pub fn time<T>(self, run: impl FnOnce() -> T) -> (T, f64) {
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

/// Returns the least and the median of the seconds, 0 for an empty slice.
pub fn best_and_median(seconds: &[f64]) -> (f64, f64) {
    let mut sorted = seconds.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |i: usize| sorted.get(i).copied().unwrap_or(0.0);
    (at(0), at(sorted.len() / 2))
}
