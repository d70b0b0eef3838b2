//! Limits of time.

use std::time::{Duration, Instant};

/// What `work` returns. Panics if it takes so many seconds: limits are far from what the
/// work takes, and near what it would take if it grew with the square of its input.
pub fn within_seconds<T>(seconds: u64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    let took = start.elapsed();
    assert!(took < Duration::from_secs(seconds), "took {took:?}");
    result
}
