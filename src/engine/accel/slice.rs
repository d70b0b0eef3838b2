//! The worlds of one scene at several times, which share what does not move.
//!
//! A shutter is rendered as slices, each an exact static world of its time. The BLASes and the
//! prepared solids are those of the first world; instances, entries and the TLAS are each
//! world's own, and so are the BLASes of meshes that deform. So boxes are those of one time, as tight as in a scene that never moved.

use super::accelerator::{Accelerator, NestedAccelerator, WideAccelerator};
use super::tlas_entry::{TlasEntries, TlasEntry, entries};
use super::two_level::{build_tlas, wide_blases_at_time};
use super::world::World;
use crate::scene::{Instances, Scene};
use std::sync::Arc;

impl World {
    /// Makes the world of the same scene at another time. Comparison structures are built anew.
    pub fn at_time(&self, scene: &Scene, instances: &Instances) -> World {
        let csg = Arc::clone(&self.csg);
        let quality = self.quality;
        match &self.accelerator {
            Accelerator::Wide(WideAccelerator { blases, .. }) => {
                let blases = wide_blases_at_time(blases, quality, scene);
                let all = entries(scene, instances, |mesh| {
                    blases[mesh].as_ref().map(|m| m.tree.bounds)
                });
                let (tlas, bounded) = build_tlas(&all.bounded, quality);
                let accelerator = Accelerator::Wide(WideAccelerator { tlas, blases });
                let entries = TlasEntries { bounded, ..all };
                let mut world = World::from_parts(scene, instances, accelerator, entries, csg);
                world.quality = quality;
                world
            }
            Accelerator::Nested(NestedAccelerator { blases, .. }) => {
                let blases = wide_blases_at_time(blases, quality, scene);
                World::nested_over(quality, scene, instances, blases, csg)
            }
            Accelerator::Baseline(_) => World::build_to(quality, scene, instances, self.structure),
        }
    }

    /// Returns about the bytes that a world of another time does not share with this one.
    pub fn bytes_of_a_time(&self) -> usize {
        let entries = self.entries.len() + self.unbounded.len();
        let structure = match &self.accelerator {
            Accelerator::Wide(wide) => wide.tlas.bytes(),
            Accelerator::Nested(nested) => nested.instance_bvhs.bytes(),
            Accelerator::Baseline(_) => self.accelerator.bytes().iter().map(|(_, n)| n).sum(),
        };
        // Tables that scenes share are counted by the scene's first world; of meshes all are
        // copied if one of them deforms.
        const SHARED: [&str; 4] = ["nodes", "roots", "deformations", "environment"];
        let deforms = !self.scene.deformations.is_empty();
        let tables = self.scene.bytes().into_iter();
        let tables =
            tables.filter(|(name, _)| !SHARED.contains(name) && (*name != "meshes" || deforms));
        let of = self.scene.deformations.of.iter();
        let trees = of.filter_map(|mesh| self.wide_mesh(*mesh));
        let trees = trees.map(|blas| blas.tree.bytes() + blas.blocks.bytes());
        structure
            + trees.sum::<usize>()
            + entries * (size_of::<TlasEntry>() + size_of::<u32>())
            + self.instances.bytes()
            + tables.map(|(_, bytes)| bytes).sum::<usize>()
    }
}
