//! Reuse of one frame's structures for the next. Between frames only placements change, and
//! meshes that deform, so the BLASes of the others stay as they are.
//!
//! The TLAS keeps its shape and gets new boxes while its expected cost stays near the cost
//! that it was built with; else it is built again (Lauterbach et al., RT-DEFORM, 2006). Two
//! costs are compared: that of a ray that meets the root, and that of any ray, which is the
//! first times the root's area. When everything flies apart, the root grows, and with it the
//! share of rays that meet nothing below it; the first cost alone would hide that former
//! neighbours are far apart.
//!
//! No answer depends on this: boxes contain their instances, and ties are broken by id.
//! Checked by tests/structures/frames.rs.

use super::accelerator::Accelerator;
use super::builders::{BuildQuality, refit_boxes};
use super::csg::PreparedCsg;
use super::tlas_cost::TlasCost;
use super::tlas_entry::{TlasEntries, TlasEntry, entries};
use super::two_level::{build_tlas, wide_blases_at_time};
use super::world::{Structure, World};
use crate::math::Aabb32;
use crate::scene::{Instances, Scene};
use std::sync::Arc;

/// The factor of the expected cost at which a refitted TLAS is built again. A refit takes
/// half as long as a build, and both take little time beside a frame's rays, so the factor
/// is small. The measurements are in docs/decisions/019-refit-to-1-05.md.
pub const WORST_REFIT: f64 = 1.05;

/// The structures that a world leaves for the next frame.
#[derive(Clone, Debug)]
pub struct KeptTrees {
    accelerator: Accelerator,
    /// The instances in the order of the TLAS's leaves.
    order: Vec<u64>,
    quality: BuildQuality,
    /// The cost of the TLAS as it was built.
    built: TlasCost,
    /// The prepared solids, of which none changes.
    csg: Arc<[Option<PreparedCsg>]>,
}

/// What was done to make a frame's structures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RefitOutcome {
    /// All structures were built.
    Built,
    /// The BLASes were kept, and the TLAS was built.
    Rebuilt,
    /// The BLASes were kept, and the TLAS got new boxes.
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
    /// Returns the structures that the next frame's world can be made from.
    pub fn keep(self) -> KeptTrees {
        KeptTrees {
            order: self.entries.iter().map(|entry| entry.instance).collect(),
            quality: self.quality,
            built: self.tlas_built,
            accelerator: self.accelerator,
            csg: self.csg,
        }
    }
}

impl World {
    /// Makes the world of the same scene at another time. `worst` is the factor of the
    /// expected cost up to which the TLAS is refitted ([`WORST_REFIT`]); 0 always builds it.
    /// Structures other than wide BVHs are built anew.
    pub fn next(
        kept: KeptTrees,
        scene: &Scene,
        instances: &Instances,
        structure: Structure,
        worst: f64,
    ) -> (World, RefitOutcome) {
        let KeptTrees {
            accelerator,
            order,
            quality,
            built,
            csg,
        } = kept;
        let (Accelerator::Wide(mut accelerator), Structure::Bvh) = (accelerator, structure) else {
            let world = World::build_to(quality, scene, instances, structure);
            return (world, RefitOutcome::Built);
        };
        accelerator.blases = wide_blases_at_time(&accelerator.blases, quality, scene);
        let all = entries(scene, instances, |mesh| {
            accelerator.blases[mesh].as_ref().map(|m| m.tree.bounds)
        });
        let bounded = &all.bounded;
        let mut rows = vec![None; instances.count() as usize];
        for (row, entry) in bounded.iter().enumerate() {
            rows[entry.instance as usize] = Some(row);
        }
        let places = order.iter().map(|id| Some(bounded[rows[*id as usize]?]));
        let entries: Option<Vec<TlasEntry>> = places.collect();
        // Other instances than before may be bounded now.
        if let Some(bounded) = entries.filter(|entries| entries.len() == bounded.len()) {
            let boxes: Vec<Aabb32> = bounded.iter().map(|entry| entry.bounds).collect();
            let sah = refit_boxes(&mut accelerator.tlas, &boxes);
            if TlasCost::new(sah, &accelerator.tlas.bounds).is_within(worst, &built) {
                let entries = TlasEntries { bounded, ..all };
                let accelerator = Accelerator::Wide(accelerator);
                let mut world = World::from_parts(scene, instances, accelerator, entries, csg);
                world.tlas_built = built;
                world.quality = quality;
                return (world, RefitOutcome::Refitted);
            }
        }
        let bounded;
        (accelerator.tlas, bounded) = build_tlas(&all.bounded, quality);
        let entries = TlasEntries { bounded, ..all };
        let accelerator = Accelerator::Wide(accelerator);
        let mut world = World::from_parts(scene, instances, accelerator, entries, csg);
        world.quality = quality;
        (world, RefitOutcome::Rebuilt)
    }
}
