//! Progress and cancellation of a stage of work, shared by its threads and its
//! observer.
//!
//! The stage (a render, a comparison) adds its counts once per tile and reads `cancel`
//! before every batch of rays. The counters are informative and order nothing, so every
//! access is relaxed; results reach the observer when the threads are joined.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering::Relaxed};

#[derive(Debug, Default)]
pub struct Progress {
    /// Rays of all kinds traced so far in this stage.
    pub rays: AtomicU64,
    pub tiles_done: AtomicU32,
    /// Number of tiles; the stage sets it when it knows it, 0 before.
    pub tiles: AtomicU32,
    /// Cancellation request, set by the observer and never reset.
    pub cancel: AtomicBool,
    /// Lines of work: those before the stage, its own, and those of all stages alike; 0 of a stage that
    /// stands alone.
    lines: [AtomicU32; 3],
}

impl Progress {
    /// Says that the next stage has these lines, of `whole` that stages alike have together, which are
    /// counted as one.
    pub fn divide(&self, lines: Range<u32>, whole: u32) {
        let lines = [lines.start, lines.end - lines.start, whole];
        for (kept, new) in self.lines.iter().zip(lines) {
            kept.store(new, Relaxed);
        }
    }

    /// Begins a stage of that many tiles.
    pub fn start(&self, tiles: u32) {
        let [before, own, whole] = [0, 1, 2].map(|k| self.lines[k].load(Relaxed));
        let of = |lines: u32| match own {
            0 => 0,
            _ => (u64::from(tiles) * u64::from(lines) / u64::from(own)) as u32,
        };
        if before == 0 {
            self.rays.store(0, Relaxed);
        }
        self.tiles_done.store(of(before), Relaxed);
        self.tiles.store(tiles.max(of(whole)), Relaxed);
    }

    /// Records a finished tile and the number of rays it traced.
    pub fn add_tile(&self, rays: u64) {
        self.rays.fetch_add(rays, Relaxed);
        self.tiles_done.fetch_add(1, Relaxed);
    }

    pub fn cancel(&self) {
        self.cancel.store(true, Relaxed);
    }

    pub fn is_cancelled(&self) -> bool {
        self.cancel.load(Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_alike_count_as_one() {
        let progress = Progress::default();
        let counts = || [&progress.tiles_done, &progress.tiles].map(|count| count.load(Relaxed));
        progress.start(6);
        (0..6).for_each(|_| progress.add_tile(10));
        assert_eq!(counts(), [6, 6]);
        for first in [0, 32, 64] {
            progress.divide(first..(first + 32).min(80), 80);
            let tiles = if first == 64 { 2 } else { 4 };
            progress.start(tiles);
            (0..tiles).for_each(|_| progress.add_tile(10));
        }
        assert_eq!(counts(), [10, 10]);
        assert_eq!(progress.rays.load(Relaxed), 100);
        progress.divide(0..0, 0);
        progress.start(3);
        assert_eq!(counts(), [0, 3]);
        assert_eq!(progress.rays.load(Relaxed), 0);
    }
}
