//! Progress and cancellation of a stage of work, shared by its threads and its
//! observer.
//!
//! The stage (a render, a comparison) adds its counts once per tile and reads `cancel`
//! before every batch of rays. The counters are informative and order nothing, so every
//! access is relaxed; results reach the observer when the threads are joined.

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
}

impl Progress {
    /// Begins a stage of that many tiles.
    pub fn start(&self, tiles: u32) {
        self.rays.store(0, Relaxed);
        self.tiles_done.store(0, Relaxed);
        self.tiles.store(tiles, Relaxed);
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
