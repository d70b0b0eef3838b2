//! What one frame of a sequence leaves to the next: a tile's memory for each
//! tile, so that threads share none.

use crate::shade::Memory;
use crate::trace::{GuessCounts, Reuse};
use std::sync::{Mutex, MutexGuard};

/// See [`crate::trace::Guesses`] for its size.
#[derive(Debug, Default)]
pub struct FrameMemory {
    reuse: Reuse,
    tiles: Vec<Mutex<Memory>>,
}

impl FrameMemory {
    /// Of a sequence that has not begun.
    pub fn new(reuse: Reuse) -> FrameMemory {
        FrameMemory {
            reuse,
            tiles: Vec::new(),
        }
    }

    pub(super) fn restart(&mut self, tiles: u32) {
        let new = || Mutex::new(Memory::new(self.reuse));
        self.tiles.resize_with(tiles as usize, new);
        for tile in &mut self.tiles {
            tile.get_mut().unwrap_or_else(|e| e.into_inner()).restart();
        }
    }

    /// Asked for by one thread at a time.
    pub(super) fn tile(&self, number: u32) -> MutexGuard<'_, Memory> {
        let tile = &self.tiles[number as usize];
        tile.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Of the frame rendered last.
    pub fn counts(&mut self) -> GuessCounts {
        let mut counts = GuessCounts::default();
        for tile in &mut self.tiles {
            let tile = tile.get_mut().unwrap_or_else(|e| e.into_inner());
            counts.add(&tile.counts);
        }
        counts
    }
}
