//! Per-tile state that one frame of a sequence hands to the next. Each tile has its
//! own, so threads share none.

use crate::shade::Memory;
use crate::trace::{Reuse, TemporalCounts};
use std::sync::{Mutex, MutexGuard};

/// The temporal bounds of every tile. [`crate::trace::TemporalBounds`] states its size.
#[derive(Debug, Default)]
pub struct FrameMemory {
    reuse: Reuse,
    tiles: Vec<Mutex<Memory>>,
}

impl FrameMemory {
    /// Returns the memory of a sequence that has not begun.
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

    /// Locks a tile's memory. Only one thread at a time asks for a given tile.
    pub(super) fn tile(&self, number: u32) -> MutexGuard<'_, Memory> {
        let tile = &self.tiles[number as usize];
        tile.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Returns the counts of the frame rendered last.
    pub fn counts(&mut self) -> TemporalCounts {
        let mut counts = TemporalCounts::default();
        for tile in &mut self.tiles {
            let tile = tile.get_mut().unwrap_or_else(|e| e.into_inner());
            counts.add(&tile.counts);
        }
        counts
    }
}
