//! A scene with the structures that rays are traced through.
//!
//! A flat world has two levels: a TLAS over one entry per instance, and a BLAS per mesh,
//! which all instances of the mesh share. Instances under the identity need no transform
//! and are tested in world space. Entries without a box in world space, because their shape
//! is unbounded or their placement is badly conditioned, stand in a short list outside the
//! tree.
//!
//! Where the instances are too many for that, [`InstanceBvhs`] nest instead, and an entry
//! is made when a ray reaches it, by the same function from the same numbers.

use super::accelerator::{Accelerator, NestedAccelerator, WideAccelerator};
use super::baselines::AnyIndex;
use super::baselines::bvh4_build::{Bvh4Quality, build, linear};
use super::baselines::grid::{Density, Grid};
use super::baselines::heap::Heap;
use super::baselines::item_boxes::{BoxRows, ItemBoxes};
use super::baselines::kdtree::{self, KdQuality};
use super::builders::BuildQuality;
use super::csg::PreparedCsg;
use super::instance_bvh::InstanceBvhs;
use super::tlas_cost::TlasCost;
use super::tlas_entry::{TlasEntries, TlasEntry, entries_of, own_bounds};
use super::two_level::{Build, build_baseline, build_wide, wide_blases};
use super::wide_bvh::WideBlas;
use crate::math::{Aabb32, Affine};
use crate::scene::{CsgId, Instances, MAX_DEPTH, MeshId, Scene, Shape};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;

/// The structure by which rays find primitives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Structure {
    /// A wide BVH over the instances and one per mesh. If the instances are not [laid
    /// out](Instances::are_laid_out), instance BVHs.
    #[default]
    Bvh,
    /// Instance BVHs, however few instances there are; the hits are the same. Scenes with
    /// paths longer than [`MAX_DEPTH`] get `Bvh`.
    Nested,
    /// The four-wide tree, walked by packets.
    Narrow,
    Kd(KdQuality),
    /// Uniform grids, two levels deep.
    Grid(Density),
    /// Best-first traversal of boxes.
    Heap,
    /// Best-first traversal of spheres.
    HeapSpheres,
    /// A list, of which every ray tests every primitive.
    Linear,
    /// Wide BVHs, and boxes in columns that item buffers project for camera rays.
    ItemBuffer,
}

/// A scene, its instances and the structures over them.
pub struct World {
    pub scene: Scene,
    pub instances: Instances,
    pub accelerator: Accelerator,
    /// The box around all bounded instances, about `center`. It depends on the scene alone,
    /// so that all structures make the constants of their rays from the same box.
    pub bounds: Aabb32,
    /// The point that boxes count from, in world space, so that boxes of a scene far from
    /// the origin are no coarser than others. Rays and shapes keep their coordinates. Zero
    /// unless the scene is far from the origin (docs/numerics/boxes.md, X10).
    pub center: DVec3,
    /// Bounded entries in the order of the TLAS's leaves; kinds lie in runs.
    pub entries: Vec<TlasEntry>,
    /// Entries without a box in world space.
    pub unbounded: Vec<TlasEntry>,
    /// By [`CsgId`]: the prepared solid, if some instance places it.
    pub(super) csg: Arc<[Option<PreparedCsg>]>,
    /// By instance: its row in `entries`, or past their end in `unbounded`. All three are
    /// empty in a nested world.
    pub place_of: Vec<u32>,
    /// The boxes that item buffers project, if the structure is [`Structure::ItemBuffer`].
    pub item_boxes: Option<ItemBoxes>,
    /// The structure that was asked for, of comparison structures.
    pub(super) structure: Structure,
    /// The quality of wide BVHs.
    pub(super) quality: BuildQuality,
    /// The cost of the TLAS as it was built, before any refit; 0 in a nested world.
    pub(super) tlas_built: TlasCost,
}

impl World {
    /// Builds a world with trees of [`BuildQuality::Medium`].
    pub fn build(scene: &Scene, instances: &Instances, structure: Structure) -> World {
        World::build_to(BuildQuality::default(), scene, instances, structure)
    }

    /// Builds a world. `quality` applies to wide BVHs; other structures have parameters of
    /// their own.
    pub fn build_to(
        quality: BuildQuality,
        scene: &Scene,
        instances: &Instances,
        structure: Structure,
    ) -> World {
        let compared = |build: &Build| {
            let (accelerator, entries) = build_baseline(scene, instances, build);
            (Accelerator::Baseline(accelerator), entries)
        };
        let mut item_boxes = None;
        let (accelerator, entries) = match structure {
            Structure::Bvh if !instances.are_laid_out() => {
                return World::nested(quality, scene, instances);
            }
            Structure::Nested if instances.depth() <= MAX_DEPTH => {
                return World::nested(quality, scene, instances);
            }
            Structure::Bvh | Structure::Nested => {
                let (accelerator, entries) = build_wide(quality, scene, instances);
                (Accelerator::Wide(accelerator), entries)
            }
            Structure::Kd(quality) => compared(&|p| {
                let (tree, order) = kdtree::build(p, &quality);
                (AnyIndex::Kd(tree), order)
            }),
            Structure::Narrow => compared(&|p| {
                let (tree, order) = build(p.boxes, &Bvh4Quality::default());
                (AnyIndex::Bvh4(tree), order)
            }),
            Structure::Grid(density) => compared(&|p| {
                let (grid, order) = Grid::build(p, &density);
                (AnyIndex::Grid(grid), order)
            }),
            Structure::Heap => compared(&|p| {
                let (heap, order) = Heap::of_boxes(p, &Bvh4Quality::default());
                (AnyIndex::Heap(heap), order)
            }),
            Structure::HeapSpheres => compared(&|p| {
                let (heap, order) = Heap::of_spheres(p, &Bvh4Quality::default());
                (AnyIndex::HeapSpheres(heap), order)
            }),
            Structure::ItemBuffer => {
                let (accelerator, entries) = build_wide(quality, scene, instances);
                let meshes = accelerator.blases.par_iter();
                let rows = meshes.map(|mesh| Some(BoxRows::of_blocks(&mesh.as_ref()?.blocks)));
                let boxes = ItemBoxes {
                    entries: BoxRows::of_entries(&entries.bounded),
                    meshes: rows.collect(),
                };
                item_boxes = Some(boxes);
                (Accelerator::Wide(accelerator), entries)
            }
            Structure::Linear => compared(&|p| {
                let order = 0..p.boxes.len() as u32;
                (AnyIndex::Bvh4(linear(p.boxes)), order.collect())
            }),
        };
        let csg = PreparedCsg::placed(scene, instances).into();
        let mut world = World::from_parts(scene, instances, accelerator, entries, csg);
        world.item_boxes = item_boxes;
        world.quality = quality;
        world.structure = structure;
        world
    }

    /// Makes a flat world of its structures and entries.
    pub(super) fn from_parts(
        scene: &Scene,
        instances: &Instances,
        accelerator: Accelerator,
        TlasEntries {
            bounded: entries,
            unbounded,
            center,
        }: TlasEntries,
        csg: Arc<[Option<PreparedCsg>]>,
    ) -> World {
        let mut place_of = vec![0; entries.len() + unbounded.len()];
        for (place, entry) in entries.iter().chain(&unbounded).enumerate() {
            place_of[entry.instance as usize] = place as u32;
        }
        let bounds = if instances.are_laid_out() {
            accelerator.bounds()
        } else {
            let own = own_bounds(scene, |mesh| accelerator.mesh_bounds(mesh));
            InstanceBvhs::build(scene, instances, own).bounds(center)
        };
        World {
            scene: scene.clone(),
            instances: instances.clone(),
            bounds,
            center,
            tlas_built: TlasCost::new(accelerator.tlas_figures().sah, &bounds),
            accelerator,
            entries,
            unbounded,
            csg,
            place_of,
            item_boxes: None,
            structure: Structure::default(),
            quality: BuildQuality::default(),
        }
    }

    /// Builds a nested world, which holds nothing by instance. `quality` applies to meshes;
    /// instance BVHs are small and of medium quality.
    fn nested(quality: BuildQuality, scene: &Scene, instances: &Instances) -> World {
        let blases = wide_blases(quality, scene, instances);
        let csg = PreparedCsg::placed(scene, instances).into();
        World::nested_over(quality, scene, instances, blases, csg)
    }

    /// Builds a nested world over BLASes and prepared solids.
    pub(super) fn nested_over(
        quality: BuildQuality,
        scene: &Scene,
        instances: &Instances,
        blases: Arc<[Option<Arc<WideBlas>>]>,
        csg: Arc<[Option<PreparedCsg>]>,
    ) -> World {
        let own = own_bounds(scene, |mesh| blases[mesh].as_ref().map(|m| m.tree.bounds));
        let instance_bvhs = InstanceBvhs::build(scene, instances, own);
        // The same as those of a flat world, where one is possible.
        let (bounds, center) = if instances.are_laid_out() {
            let all = entries_of(scene, instances, &instance_bvhs.own);
            let around = |all: Aabb32, entry: &TlasEntry| all.union(&entry.bounds);
            let bounds = all.bounded.iter().fold(Aabb32::EMPTY, around);
            (bounds, all.center)
        } else {
            let center = instance_bvhs.center();
            (instance_bvhs.bounds(center), center)
        };
        World {
            scene: scene.clone(),
            instances: instances.clone(),
            accelerator: Accelerator::Nested(NestedAccelerator {
                instance_bvhs,
                blases,
            }),
            bounds,
            center,
            entries: Vec::new(),
            unbounded: Vec::new(),
            csg,
            place_of: Vec::new(),
            item_boxes: None,
            structure: Structure::default(),
            quality,
            tlas_built: TlasCost::default(),
        }
    }

    /// Returns the entry of an instance.
    #[inline(always)]
    pub fn entry_of(&self, instance: u64) -> TlasEntry {
        let Some(place) = self.place_of.get(instance as usize) else {
            return self.look_up(instance);
        };
        let place = *place as usize;
        match self.entries.get(place) {
            Some(entry) => *entry,
            None => self.unbounded[place - self.entries.len()],
        }
    }

    /// Makes the entry of an instance in a nested world.
    #[cold]
    #[inline(never)]
    fn look_up(&self, id: u64) -> TlasEntry {
        let row = self.instances.get(&self.scene, id);
        let Accelerator::Nested(NestedAccelerator { instance_bvhs, .. }) = &self.accelerator else {
            unreachable!("a flat world has an entry for each of its instances");
        };
        let own = instance_bvhs.own[row.shape.index()];
        TlasEntry::place(&self.scene, row.shape, own, id, &row.place(), self.center)
    }

    /// Iterates over the unbounded entries that are no meshes.
    #[inline(always)]
    pub fn unbounded_solids(&self) -> impl Iterator<Item = &TlasEntry> {
        let entries = self.unbounded.iter();
        entries.filter(|entry| !matches!(entry.shape, Shape::Mesh(_)))
    }

    /// Iterates over the unbounded entries that are meshes.
    #[inline(always)]
    pub fn unbounded_meshes(&self) -> impl Iterator<Item = (&TlasEntry, MeshId)> {
        self.unbounded.iter().filter_map(|entry| match entry.shape {
            Shape::Mesh(id) => Some((entry, id)),
            _ => None,
        })
    }

    /// Returns the wide BVHs of a flat world that renders by them.
    #[inline(always)]
    pub fn wide(&self) -> Option<&WideAccelerator> {
        match &self.accelerator {
            Accelerator::Wide(accelerator) => Some(accelerator),
            _ => None,
        }
    }

    /// Returns the wide BVH of a mesh, if the world has wide BVHs and places the mesh.
    #[inline(always)]
    pub fn wide_mesh(&self, id: MeshId) -> Option<&WideBlas> {
        let meshes = match &self.accelerator {
            Accelerator::Wide(accelerator) => &accelerator.blases,
            Accelerator::Nested(accelerator) => &accelerator.blases,
            _ => return None,
        };
        meshes[id.index()].as_deref()
    }

    /// Returns a CSG solid that some instance places, prepared.
    #[inline(always)]
    pub fn csg(&self, id: CsgId) -> &PreparedCsg {
        self.csg[id.index()]
            .as_ref()
            .expect("a solid that a ray meets is placed")
    }

    /// Returns the matrix from the world to an instance.
    #[inline(always)]
    pub fn object_from_world(&self, instance: u64) -> Affine {
        self.instances.object_from_world(&self.scene, instance)
    }

    /// Returns the bytes of each structure, by name.
    pub fn bytes(&self) -> Vec<(&'static str, usize)> {
        let entries = self.entries.len() + self.unbounded.len();
        let mut bytes = self.accelerator.bytes();
        bytes.push((
            "top entries",
            entries * size_of::<TlasEntry>() + self.place_of.len() * 4,
        ));
        let boxes = self.item_boxes.as_ref();
        bytes.push(("item boxes", boxes.map_or(0, ItemBoxes::bytes)));
        bytes.push(("instances", self.instances.bytes()));
        let meshes = PreparedCsg::mesh_bytes(self.csg.iter().flatten());
        bytes.push(("meshes in CSG solids", meshes));
        bytes.retain(|(_, bytes)| *bytes > 0);
        bytes
    }
}
