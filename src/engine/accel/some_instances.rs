//! The world of some instances of a scene: what rays meet of these as if the others were not there.

use super::accelerator::{Accelerator, WideAccelerator};
use super::tlas_cost::TlasCost;
use super::tlas_entry::TlasEntry;
use super::two_level::build_tlas;
use super::world::{Structure, World};
use std::sync::Arc;

/// The row of instances that a world leaves out.
const ABSENT: u32 = u32::MAX;

impl World {
    /// Makes a world of some instances, which must be among those of this one. It shares BLASes and
    /// prepared solids and has a TLAS of its own; ids, matrices and the box that rays are prepared
    /// for are those of the whole. Returns `None` for comparison structures and nested worlds.
    pub fn of_some(&self, ids: &[u64]) -> Option<World> {
        let blases = Arc::clone(&self.wide()?.blases);
        let entries = ids.iter().map(|id| self.entry_of(*id));
        let is_bounded = |entry: &TlasEntry| self.place_of[entry.instance as usize] < self.split();
        let (bounded, unbounded): (Vec<_>, Vec<_>) = entries.partition(is_bounded);
        let (tlas, entries) = build_tlas(&bounded, self.quality);
        let mut place_of = vec![ABSENT; self.place_of.len()];
        for (place, entry) in (0..).zip(entries.iter().chain(&unbounded)) {
            place_of[entry.instance as usize] = place;
        }
        let accelerator = Accelerator::Wide(WideAccelerator { tlas, blases });
        Some(World {
            scene: self.scene.clone(),
            instances: self.instances.clone(),
            tlas_built: TlasCost::new(accelerator.tlas_figures().sah, &self.bounds),
            accelerator,
            bounds: self.bounds,
            center: self.center,
            entries,
            unbounded,
            csg: Arc::clone(&self.csg),
            place_of,
            item_boxes: None,
            structure: Structure::default(),
            quality: self.quality,
        })
    }

    /// Returns the first place of unbounded entries.
    fn split(&self) -> u32 {
        self.entries.len() as u32
    }
}
