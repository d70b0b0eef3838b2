//! How far a stage of the work is, and the wish that it stop: shared by its
//! threads and by whoever watches.
//!
//! The stage (a render, a comparison) adds its counts once a tile and reads
//! `cancel` before every batch of rays.
//! The counters are for people and order nothing, so every access is relaxed;
//! results reach the watcher by the join of the threads.

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering::Relaxed};

#[derive(Debug, Default)]
pub struct Progress {
    /// Rays of all kinds, traced so far in this stage.
    pub rays: AtomicU64,
    pub tiles_done: AtomicU32,
    /// Set by the stage, when it knows; 0 before.
    pub tiles: AtomicU32,
    /// Set by the watcher; once set it stays.
    pub cancel: AtomicBool,
}

impl Progress {
    /// A stage begins, of so many tiles.
    pub fn start(&self, tiles: u32) {
        self.rays.store(0, Relaxed);
        self.tiles_done.store(0, Relaxed);
        self.tiles.store(tiles, Relaxed);
    }

    /// A tile is done and traced so many rays.
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
