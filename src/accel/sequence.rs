//! From one frame's world to the next: what moved is only where shapes are
//! placed, so the structures of meshes stay as they are.
//!
//! The tree over the entries keeps its shape and takes new boxes, as long as its
//! expected cost stays near that of the tree when it was built; else it is built
//! again (Lauterbach et al., RT-DEFORM, 2006). Answers do not depend on which:
//! boxes contain what they stand for, and ties go by id. Checked by
//! tests/frames.rs.

use super::build::refit_boxes;
use super::forest::Forests;
use super::world::{Entry, Structure, World, entries, top_tree};
use crate::math::Aabb32;
use crate::scene::{Appearances, Scene};

/// A tree over entries is built again once a ray's expected cost passes so many
/// times what it was built with. Building costs about ten times as much as
/// fitting, and both are little beside a frame's rays: a tenth more per ray is
/// soon dearer than either.
pub const WORST_REFIT: f64 = 1.1;

/// What a world leaves for the next frame.
#[derive(Clone, Debug)]
pub struct Kept {
    forest: Forests,
    /// Appearances in the order of the top tree's entries.
    order: Vec<u64>,
    /// Expected cost of the top tree when it was built.
    built: f64,
}

/// How a frame came to its top structure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Renewal {
    /// Everything was built.
    Built,
    /// Meshes' trees were kept, the top tree was built.
    Rebuilt,
    /// Meshes' trees were kept, the top tree has new boxes.
    Refitted,
}

impl Renewal {
    pub fn name(self) -> &'static str {
        match self {
            Renewal::Built => "built",
            Renewal::Rebuilt => "rebuilt",
            Renewal::Refitted => "refitted",
        }
    }
}

impl World<'_> {
    /// What the next frame's world can be made from.
    pub fn keep(self) -> Kept {
        Kept {
            order: self.entries.iter().map(|entry| entry.appearance).collect(),
            built: self.top_built,
            forest: self.forest,
        }
    }
}

impl<'a> World<'a> {
    /// The world of the same scene at another time. `worst`: by how much a
    /// refitted tree may be dearer than when it was built ([`WORST_REFIT`]; 0
    /// always builds). Structures but wide trees are built anew.
    pub fn next(
        kept: Kept,
        scene: &'a Scene,
        appearances: &'a Appearances,
        structure: Structure,
        worst: f64,
    ) -> (World<'a>, Renewal) {
        let Kept {
            forest,
            order,
            built,
        } = kept;
        let (Forests::Wide(mut forest), Structure::Bvh) = (forest, structure) else {
            let world = World::build(scene, appearances, structure);
            return (world, Renewal::Built);
        };
        let [bounded, unbounded] = entries(scene, appearances, |mesh| {
            forest.meshes[mesh].as_ref().map(|m| m.tree.bounds)
        });
        let mut rows = vec![0; appearances.count() as usize];
        for (row, entry) in bounded.iter().enumerate() {
            rows[entry.appearance as usize] = row;
        }
        let entries: Vec<Entry> = order.iter().map(|id| bounded[rows[*id as usize]]).collect();
        let boxes: Vec<Aabb32> = entries.iter().map(|entry| entry.bounds).collect();
        let cost = refit_boxes(&mut forest.top, &boxes);
        if cost <= built * worst {
            let mut world = World::of(
                scene,
                appearances,
                Forests::Wide(forest),
                [entries, unbounded],
            );
            world.top_built = built;
            return (world, Renewal::Refitted);
        }
        let entries;
        (forest.top, entries) = top_tree(&bounded);
        let world = World::of(
            scene,
            appearances,
            Forests::Wide(forest),
            [entries, unbounded],
        );
        (world, Renewal::Rebuilt)
    }
}
