//! From one frame's world to the next: what moved is only where shapes are
//! placed, so the structures of meshes stay as they are.
//!
//! The tree over the entries keeps its shape and takes new boxes, as long as its
//! expected cost stays near that of the tree when it was built; else it is built
//! again (Lauterbach et al., RT-DEFORM, 2006). Two costs are watched: of a ray that
//! meets the root, and of a ray anywhere, which is that times the root's area. Where
//! everything flies apart the root grows, and with it the chance to meet nothing;
//! the first alone would not see that neighbours are none any more.
//!
//! Answers do not depend on any of it: boxes contain what they stand for, and ties
//! go by id. Checked by tests/structures/frames.rs.

use super::builders::{BuildQuality, refit_boxes};
use super::levels::Levels;
use super::two_level::build_tlas;
use super::world::{Structure, TlasEntries, TlasEntry, World, entries};
use crate::math::Aabb32;
use crate::scene::{Instances, Scene};

/// A tree over entries is built again once it is expected to cost so many times
/// what it did when it was built. Fitting takes half as long as building, and both
/// are little beside a frame's rays, so the bound is close. Of 1.05, 1.1, 1.25, 1.5,
/// 2 and none, with camera rays alone: 1.05 is best of the bounds where placements
/// are meshes, by 2 to 5 % before 1.1 and by up to 28 % before 2; with 5,000 balls
/// that change places it is 7 % behind 1.25, which is best. Building for every frame
/// is 4 % better with 600 meshes and 12 to 24 % worse with 20,000 (docs/COHERENCE.md). A
/// frame's other rays share the tree, which speaks for the least.
pub const WORST_REFIT: f64 = 1.05;

/// What a world leaves for the next frame.
#[derive(Clone, Debug)]
pub struct KeptTrees {
    levels: Levels,
    /// Instances in the order of the top tree's entries.
    order: Vec<u64>,
    quality: BuildQuality,
    /// Of the top tree when it was built.
    built: Cost,
}

/// What the top tree is expected to cost a ray.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cost {
    /// That meets the root: the surface area heuristic.
    inside: f64,
    /// Of all rays, up to a constant.
    anywhere: f64,
}

impl Cost {
    pub fn new(sah: f64, bounds: &Aabb32) -> Cost {
        Cost {
            inside: sah,
            anywhere: sah * f64::from(bounds.half_area()),
        }
    }

    /// Whether it is at most so many times another.
    fn is_within(&self, times: f64, other: &Cost) -> bool {
        self.inside <= other.inside * times && self.anywhere <= other.anywhere * times
    }
}

/// How a frame came to its top structure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RefitOutcome {
    /// Everything was built.
    Built,
    /// Meshes' trees were kept, the top tree was built.
    Rebuilt,
    /// Meshes' trees were kept, the top tree has new boxes.
    Refitted,
}

impl RefitOutcome {
    pub fn name(self) -> &'static str {
        match self {
            RefitOutcome::Built => "built",
            RefitOutcome::Rebuilt => "rebuilt",
            RefitOutcome::Refitted => "refitted",
        }
    }
}

impl World {
    /// What the next frame's world can be made from.
    pub fn keep(self) -> KeptTrees {
        KeptTrees {
            order: self.entries.iter().map(|entry| entry.instance).collect(),
            quality: self.quality,
            built: self.tlas_built,
            levels: self.levels,
        }
    }
}

impl World {
    /// The world of the same scene at another time. `worst`: by how much a
    /// refitted tree may be dearer than when it was built ([`WORST_REFIT`]; 0
    /// always builds). Structures but wide trees are built anew.
    pub fn next(
        kept: KeptTrees,
        scene: &Scene,
        instances: &Instances,
        structure: Structure,
        worst: f64,
    ) -> (World, RefitOutcome) {
        let KeptTrees {
            levels,
            order,
            quality,
            built,
        } = kept;
        let (Levels::Wide(mut levels), Structure::Bvh) = (levels, structure) else {
            let world = World::build_to(quality, scene, instances, structure);
            return (world, RefitOutcome::Built);
        };
        let all = entries(scene, instances, |mesh| {
            levels.blases[mesh].as_ref().map(|m| m.tree.bounds)
        });
        let bounded = &all.bounded;
        let mut rows = vec![None; instances.count() as usize];
        for (row, entry) in bounded.iter().enumerate() {
            rows[entry.instance as usize] = Some(row);
        }
        let places = order.iter().map(|id| Some(bounded[rows[*id as usize]?]));
        let entries: Option<Vec<TlasEntry>> = places.collect();
        // Others may have bounds than had them before.
        if let Some(bounded) = entries.filter(|entries| entries.len() == bounded.len()) {
            let boxes: Vec<Aabb32> = bounded.iter().map(|entry| entry.bounds).collect();
            let sah = refit_boxes(&mut levels.tlas, &boxes);
            if Cost::new(sah, &levels.tlas.bounds).is_within(worst, &built) {
                let entries = TlasEntries { bounded, ..all };
                let mut world = World::of(scene, instances, Levels::Wide(levels), entries);
                world.tlas_built = built;
                world.quality = quality;
                return (world, RefitOutcome::Refitted);
            }
        }
        let bounded;
        (levels.tlas, bounded) = build_tlas(&all.bounded, quality);
        let entries = TlasEntries { bounded, ..all };
        let mut world = World::of(scene, instances, Levels::Wide(levels), entries);
        world.quality = quality;
        (world, RefitOutcome::Rebuilt)
    }
}
