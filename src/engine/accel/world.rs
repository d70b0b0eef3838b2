//! A scene ready to be traced: two levels of structures, or a tree per node.
//!
//! The top one stands over entries: an instance each, either a primitive or
//! a mesh with a structure of its own, shared by all of its instances. Instances
//! under the identity need no transform and are met in world space. Unbounded
//! shapes, and those of placements that [blur](Placement::conditioning), stand in a short list
//! outside the tree.
//!
//! Where there are too many instances for that, [`InstanceBvhs`] nest instead, and an
//! entry is made when a ray gets there, by the same function from the same
//! numbers.

use super::baselines::AnyIndex;
use super::baselines::bvh4_build::{Bvh4Quality, build, linear};
use super::baselines::grid::{Density, Grid};
use super::baselines::heap::Heap;
use super::baselines::item_boxes::{BoxRows, ItemBoxes};
use super::baselines::kdtree::{self, KdQuality};
use super::builders::BuildQuality;
use super::csg::PreparedCsg;
use super::instance_bvh::InstanceBvhs;
use super::levels::{Levels, NestedLevels, WideLevels};
use super::refit::Cost;
use super::two_level::{Build, build_baseline, build_wide, wide_blases};
use super::wide_bvh::WideBlas;
use crate::geom::triangle::Corners;
use crate::math::{Aabb, Aabb32, Affine};
use crate::scene::{
    CsgId, Instances, MAX_DEPTH, MeshId, Placement, Scene, Shape, ShapeId, Tables, far_center,
    shape_bounds,
};
use glam::DVec3;
use rayon::prelude::*;

/// Which structure finds the primitives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Structure {
    /// A tree over the instances; where they are not
    /// [laid out](Instances::are_laid_out), a tree per shared node.
    #[default]
    Bvh,
    /// A tree per shared node, however few instances there are: the same
    /// hits. Not for paths longer than [`MAX_DEPTH`].
    Nested,
    /// Four-wide nodes, packets without tiles.
    Narrow,
    Kd(KdQuality),
    /// Two levels of uniform grids.
    Grid(Density),
    /// Best first, through boxes.
    Heap,
    /// Best first, through spheres.
    HeapSpheres,
    /// Every primitive is tested.
    Linear,
    /// Wide trees, and boxes in columns for frames of camera rays.
    ItemBuffer,
}

/// One instance in the top structure's leaves.
#[derive(Clone, Copy, Debug)]
pub struct TlasEntry {
    pub shape: Shape,
    /// Id of one of [`Instances`].
    pub instance: u64,
    /// Needs a transform: its object space is not world space.
    pub placed: bool,
    /// World space, about [`World::center`]; a hit's t lies inside. Everything where
    /// the placement [conditions](MAX_CONDITION).
    pub bounds: Aabb32,
    /// Object space; the same as `bounds` where not placed. Of a mesh, its
    /// structure's.
    pub own: Aabb32,
    /// The largest coordinate of `own`; 0 where it is unbounded.
    pub size: f64,
    /// How much `world_from_object` lengthens vectors at most (∞-norm).
    pub stretch: f64,
}

pub struct World {
    pub scene: Scene,
    pub instances: Instances,
    pub levels: Levels,
    /// Around what is bounded, about `center`. It depends on the scene alone: all
    /// structures take the constants of their rays from it.
    pub bounds: Aabb32,
    /// World space: what boxes count from, so that those of a scene far from the
    /// origin are no coarser. Rays and shapes stay where they are. Zero where the
    /// scene is not far off.
    pub center: DVec3,
    /// In the order of the top structure's leaves; kinds lie in runs.
    pub entries: Vec<TlasEntry>,
    /// Those whose bounds are everything.
    pub unbounded: Vec<TlasEntry>,
    /// By [`CsgId`], of those that appear.
    pub(super) csg: Vec<Option<PreparedCsg>>,
    /// By instance: its place in `entries`, or past their end in `unbounded`.
    /// Like these, empty where groups nest.
    pub place_of: Vec<u32>,
    /// Where item buffers are to be made.
    pub item_boxes: Option<ItemBoxes>,
    /// Of its wide trees, where it has some.
    pub(super) quality: BuildQuality,
    /// Of the top structure when it was built, before it was fitted to entries
    /// that moved. Of groups that nest, 0.
    pub(super) tlas_built: Cost,
}

impl World {
    /// With trees of [`BuildQuality::Medium`].
    pub fn build(scene: &Scene, instances: &Instances, structure: Structure) -> World {
        World::build_to(BuildQuality::default(), scene, instances, structure)
    }

    /// `quality`: of wide trees; other structures have parameters of their own.
    pub fn build_to(
        quality: BuildQuality,
        scene: &Scene,
        instances: &Instances,
        structure: Structure,
    ) -> World {
        let compared = |build: &Build| {
            let (levels, entries) = build_baseline(scene, instances, build);
            (Levels::Baseline(levels), entries)
        };
        let mut item_boxes = None;
        let (levels, entries) = match structure {
            Structure::Bvh if !instances.are_laid_out() => {
                return World::nested(quality, scene, instances);
            }
            Structure::Nested if instances.depth() <= MAX_DEPTH => {
                return World::nested(quality, scene, instances);
            }
            Structure::Bvh | Structure::Nested => {
                let (levels, entries) = build_wide(quality, scene, instances);
                (Levels::Wide(levels), entries)
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
                let (levels, entries) = build_wide(quality, scene, instances);
                let meshes = levels.blases.par_iter();
                let rows = meshes.map(|mesh| Some(BoxRows::of_blocks(&mesh.as_ref()?.blocks)));
                let boxes = ItemBoxes {
                    entries: BoxRows::of_entries(&entries.bounded),
                    meshes: rows.collect(),
                };
                item_boxes = Some(boxes);
                (Levels::Wide(levels), entries)
            }
            Structure::Linear => compared(&|p| {
                let order = 0..p.boxes.len() as u32;
                (AnyIndex::Bvh4(linear(p.boxes)), order.collect())
            }),
        };
        let mut world = World::of(scene, instances, levels, entries);
        world.item_boxes = item_boxes;
        world.quality = quality;
        world
    }

    /// Of a flat levels.
    pub(super) fn of(
        scene: &Scene,
        instances: &Instances,
        levels: Levels,
        TlasEntries {
            bounded: entries,
            unbounded,
            center,
        }: TlasEntries,
    ) -> World {
        let mut place_of = vec![0; entries.len() + unbounded.len()];
        for (place, entry) in entries.iter().chain(&unbounded).enumerate() {
            place_of[entry.instance as usize] = place as u32;
        }
        let bounds = if instances.are_laid_out() {
            levels.bounds()
        } else {
            let own = own_bounds(scene, |mesh| levels.mesh_bounds(mesh));
            InstanceBvhs::of(scene, instances, own).bounds(center)
        };
        World {
            scene: scene.clone(),
            instances: instances.clone(),
            bounds,
            center,
            tlas_built: Cost::new(levels.tlas_figures().sah, &bounds),
            levels,
            entries,
            unbounded,
            csg: PreparedCsg::all(scene, instances),
            place_of,
            item_boxes: None,
            quality: BuildQuality::default(),
        }
    }

    /// Nothing in it is by instance. InstanceBvhs are small: their trees are of
    /// medium quality.
    fn nested(quality: BuildQuality, scene: &Scene, instances: &Instances) -> World {
        let meshes = wide_blases(quality, scene, instances);
        let own = own_bounds(scene, |mesh| meshes[mesh].as_ref().map(|m| m.tree.bounds));
        let groups = InstanceBvhs::of(scene, instances, own);
        // What a flat world would take, where there might be one.
        let (bounds, center) = if instances.are_laid_out() {
            let all = entries_of(scene, instances, &groups.own);
            let around = |all: Aabb32, entry: &TlasEntry| all.union(&entry.bounds);
            let bounds = all.bounded.iter().fold(Aabb32::EMPTY, around);
            (bounds, all.center)
        } else {
            let center = groups.center();
            (groups.bounds(center), center)
        };
        World {
            scene: scene.clone(),
            instances: instances.clone(),
            levels: Levels::Nested(NestedLevels {
                groups,
                blases: meshes,
            }),
            bounds,
            center,
            entries: Vec::new(),
            unbounded: Vec::new(),
            csg: PreparedCsg::all(scene, instances),
            place_of: Vec::new(),
            item_boxes: None,
            quality,
            tlas_built: Cost::default(),
        }
    }

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

    /// Of a nested world.
    #[cold]
    #[inline(never)]
    fn look_up(&self, id: u64) -> TlasEntry {
        let row = self.instances.get(&self.scene, id);
        let Levels::Nested(NestedLevels { groups, .. }) = &self.levels else {
            unreachable!("a flat world has an entry for each of its instances");
        };
        let own = groups.own[row.shape.index()];
        TlasEntry::of(&self.scene, row.shape, own, id, &row.place(), self.center)
    }

    /// Those of `unbounded` that are no meshes.
    #[inline(always)]
    pub fn unbounded_solids(&self) -> impl Iterator<Item = &TlasEntry> {
        let entries = self.unbounded.iter();
        entries.filter(|entry| !matches!(entry.shape, Shape::Mesh(_)))
    }

    /// Those of `unbounded` that are.
    #[inline(always)]
    pub fn unbounded_meshes(&self) -> impl Iterator<Item = (&TlasEntry, MeshId)> {
        self.unbounded.iter().filter_map(|entry| match entry.shape {
            Shape::Mesh(id) => Some((entry, id)),
            _ => None,
        })
    }

    /// Where this is what was built.
    #[inline(always)]
    pub fn wide(&self) -> Option<&WideLevels> {
        match &self.levels {
            Levels::Wide(levels) => Some(levels),
            _ => None,
        }
    }

    #[inline(always)]
    pub fn wide_mesh(&self, id: MeshId) -> Option<&WideBlas> {
        let meshes = match &self.levels {
            Levels::Wide(levels) => &levels.blases,
            Levels::Nested(levels) => &levels.blases,
            _ => return None,
        };
        meshes[id.index()].as_ref()
    }

    /// A CSG solid that appears, unfolded.
    #[inline(always)]
    pub fn csg(&self, id: CsgId) -> &PreparedCsg {
        self.csg[id.index()].as_ref().expect("what is met appears")
    }

    /// Of the instance of this id.
    #[inline(always)]
    pub fn object_from_world(&self, instance: u64) -> Affine {
        self.instances.object_from_world(&self.scene, instance)
    }

    /// Bytes of each structure, by name.
    pub fn bytes(&self) -> Vec<(&'static str, usize)> {
        let entries = self.entries.len() + self.unbounded.len();
        let mut bytes = self.levels.bytes();
        bytes.push((
            "top entries",
            entries * size_of::<TlasEntry>() + self.place_of.len() * 4,
        ));
        let boxes = self.item_boxes.as_ref();
        bytes.push(("item boxes", boxes.map_or(0, ItemBoxes::bytes)));
        bytes.push(("instances", self.instances.bytes()));
        let facets = PreparedCsg::facet_bytes(self.csg.iter().flatten());
        bytes.push(("meshes in CSG solids", facets));
        bytes.retain(|(_, bytes)| *bytes > 0);
        bytes
    }
}

/// What [conditions](Placement::conditioning) more has no box in world space: a ray's
/// rounding on its way into the object's, seen from the world, would be more than the
/// pads of structures have room for (docs/NUMERICS.md, "Boxes of structures").
pub(super) const MAX_CONDITION: f64 = 4096.0;

/// What a flat world has beside its structures.
pub(super) struct TlasEntries {
    /// In the order of the instances.
    pub bounded: Vec<TlasEntry>,
    pub unbounded: Vec<TlasEntry>,
    /// See [`World::center`].
    pub center: DVec3,
}

/// A scene whose middle is so many of its sizes away from the origin is far off.
/// What is met in world space (a mesh that is not placed, and so no further than
/// eight of its own sizes) never is.
pub(super) const FAR: f64 = 64.0;

/// `bounds`: of a mesh that has been built.
pub(super) fn entries(
    scene: &Scene,
    instances: &Instances,
    bounds: impl Fn(usize) -> Option<Aabb32>,
) -> TlasEntries {
    entries_of(scene, instances, &own_bounds(scene, bounds))
}

fn entries_of(scene: &Scene, instances: &Instances, own: &[Aabb32]) -> TlasEntries {
    if !instances.are_laid_out() {
        // As where groups nest.
        let center = InstanceBvhs::of(scene, instances, own.to_vec()).center();
        return entries_about(scene, instances, own, center);
    }
    let near = entries_about(scene, instances, own, DVec3::ZERO);
    let around = near
        .bounded
        .iter()
        .fold(Aabb::EMPTY, |all, entry| all.union(&entry.bounds.widened()));
    let center = far_center(&around, FAR);
    if center == DVec3::ZERO {
        return near;
    }
    entries_about(scene, instances, own, center)
}

fn entries_about(
    scene: &Scene,
    instances: &Instances,
    own: &[Aabb32],
    center: DVec3,
) -> TlasEntries {
    let [mut bounded, mut unbounded] = [Vec::new(), Vec::new()];
    for (id, row) in (0_u64..).zip(instances.iter(scene)) {
        let own = own[row.shape.index()];
        let entry = TlasEntry::of(scene, row.shape, own, id, &row.place(), center);
        if entry.is_unbounded() {
            unbounded.push(entry);
        } else {
            bounded.push(entry);
        }
    }
    TlasEntries {
        bounded,
        unbounded,
        center,
    }
}

/// By shape. `bounds`: of a mesh that has been built.
fn own_bounds(scene: &Tables, bounds: impl Fn(usize) -> Option<Aabb32>) -> Vec<Aabb32> {
    let shapes = scene.shapes.rows.iter().enumerate();
    let own = shapes.map(|(i, shape)| match shape {
        Shape::Mesh(id) => bounds(id.index()).unwrap_or(Aabb32::EMPTY),
        _ => {
            let shape = ShapeId(i as u32);
            let bounds = shape_bounds(scene, shape);
            // A CSG solid's operands are met in spaces of their own, too.
            let bounds = bounds.filter(|_| scene.conditioning_of(shape).norm() <= MAX_CONDITION);
            // What f32 cannot reach is not cut off: it is to be placed.
            let bounds = bounds.filter(|b| b.max_abs() < f64::from(f32::MAX));
            bounds.map_or(Aabb32::EVERYTHING, |b| b.outward())
        }
    });
    own.collect()
}

impl TlasEntry {
    /// Of the instance `id`: `shape`, whose own box is `own`, at `place`, in a
    /// world about `center`.
    pub fn of(
        scene: &Tables,
        shape: ShapeId,
        own: Aabb32,
        id: u64,
        place: &Placement,
        center: DVec3,
    ) -> TlasEntry {
        let placed = place.is_placed(scene, shape) || center != DVec3::ZERO;
        let (row, shape) = (shape, scene.shapes.row(shape));
        let bounds = if !placed || own == Aabb32::EVERYTHING {
            own
        } else if place.blur(scene, row).norm() <= MAX_CONDITION {
            let world = world_bounds(&own.widened(), place, center_of(scene, shape));
            world.map_or(Aabb32::EVERYTHING, |world| {
                Aabb::new(world.min - center, world.max - center).outward()
            })
        } else {
            Aabb32::EVERYTHING
        };
        TlasEntry {
            shape,
            instance: id,
            placed,
            bounds,
            own,
            size: match own {
                Aabb32::EVERYTHING => 0.0,
                _ => own.widened().max_abs(),
            },
            stretch: place.world_from_object.norm(),
        }
    }

    fn is_unbounded(&self) -> bool {
        self.bounds == Aabb32::EVERYTHING
    }
}

/// Exact: the corners are f32 already.
#[inline(always)]
pub fn corner_bounds(corners: &Corners) -> Aabb32 {
    let [a, b, c] = corners;
    let lower = |x: f32, y: f32| if x < y { x } else { y };
    let upper = |x: f32, y: f32| if x > y { x } else { y };
    Aabb32 {
        min: std::array::from_fn(|k| lower(lower(a[k], b[k]), c[k])),
        max: std::array::from_fn(|k| upper(upper(a[k], b[k]), c[k])),
    }
}

pub(super) fn center_of(scene: &Tables, shape: Shape) -> DVec3 {
    match shape {
        Shape::Mesh(id) => scene.meshes.center[id.index()],
        _ => DVec3::ZERO,
    }
}

/// The world-space box of what is at a place and whose geometry lies in `own` (about
/// `center`); `None` where the place's roundings leave it anywhere.
pub(super) fn world_bounds(own: &Aabb, place: &Placement, center: DVec3) -> Option<Aabb> {
    let own = Aabb::new(own.min + center, own.max + center);
    let world = own.placed(&place.object_from_world, &place.world_from_object)?;
    // The rest is for what is counted from another place.
    Some(world.grown(DVec3::splat(world.max_abs() * 5.0 * f64::EPSILON)))
}
