//! A scene ready to be traced: two levels of structures, or a tree per node.
//!
//! The top one stands over entries: an appearance each, either a primitive or
//! a mesh with a structure of its own, shared by all of its appearances. Appearances
//! under the identity need no transform and are met in world space. Unbounded
//! shapes, and those of placements that [blur](Place::blur), stand in a short list
//! outside the tree.
//!
//! Where there are too many appearances for that, [`Groups`] nest instead, and an
//! entry is made when a ray gets there, by the same function from the same
//! numbers.

use super::boxes::{BoxRows, ItemBoxes};
use super::builders::BuildQuality;
use super::combined::Combined;
use super::forest::{AnyIndex, Forests, NestedForest, WideForest};
use super::grid::{Density, Grid};
use super::groups::Groups;
use super::heap::Heap;
use super::kdtree::{self, KdQuality};
use super::plant::{Build, plant, plant_wide, wide_meshes};
use super::sah::{Quality, build, linear};
use super::sequence::Cost;
use super::wide::WideMesh;
use crate::geom::triangle::Corners;
use crate::math::{Aabb, Aabb32, Affine};
use crate::scene::{
    Appearances, CombinationId, MAX_DEPTH, MeshId, Place, Scene, Shape, ShapeId, Tables,
    far_center, shape_bounds,
};
use glam::DVec3;
use rayon::prelude::*;

/// Which structure finds the primitives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Structure {
    /// A tree over the appearances; where they are not
    /// [laid out](Appearances::are_laid_out), a tree per shared node.
    #[default]
    Bvh,
    /// A tree per shared node, however few appearances there are: the same
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

/// One appearance in the top structure's leaves.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    pub shape: Shape,
    /// Id of one of [`Appearances`].
    pub appearance: u64,
    /// Needs a transform: its object space is not world space.
    pub placed: bool,
    /// World space, about [`World::center`]; a hit's t lies inside. Everything where
    /// the placement [blurs](MAX_BLUR).
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
    pub appearances: Appearances,
    pub forest: Forests,
    /// Around what is bounded, about `center`. It depends on the scene alone: all
    /// structures take the constants of their rays from it.
    pub bounds: Aabb32,
    /// World space: what boxes count from, so that those of a scene far from the
    /// origin are no coarser. Rays and shapes stay where they are. Zero where the
    /// scene is not far off.
    pub center: DVec3,
    /// In the order of the top structure's leaves; kinds lie in runs.
    pub entries: Vec<Entry>,
    /// Those whose bounds are everything.
    pub unbounded: Vec<Entry>,
    /// By [`CombinationId`], of those that appear.
    pub(super) combined: Vec<Option<Combined>>,
    /// By appearance: its place in `entries`, or past their end in `unbounded`.
    /// Like these, empty where groups nest.
    pub place_of: Vec<u32>,
    /// Where item buffers are to be made.
    pub item_boxes: Option<ItemBoxes>,
    /// Of its wide trees, where it has some.
    pub(super) quality: BuildQuality,
    /// Of the top structure when it was built, before it was fitted to entries
    /// that moved. Of groups that nest, 0.
    pub(super) top_built: Cost,
}

impl World {
    /// With trees of [`BuildQuality::Medium`].
    pub fn build(scene: &Scene, appearances: &Appearances, structure: Structure) -> World {
        World::build_to(BuildQuality::default(), scene, appearances, structure)
    }

    /// `quality`: of wide trees; other structures have parameters of their own.
    pub fn build_to(
        quality: BuildQuality,
        scene: &Scene,
        appearances: &Appearances,
        structure: Structure,
    ) -> World {
        let compared = |build: &Build| {
            let (forest, entries) = plant(scene, appearances, build);
            (Forests::Compared(forest), entries)
        };
        let mut item_boxes = None;
        let (forest, entries) = match structure {
            Structure::Bvh if !appearances.are_laid_out() => {
                return World::nested(quality, scene, appearances);
            }
            Structure::Nested if appearances.depth() <= MAX_DEPTH => {
                return World::nested(quality, scene, appearances);
            }
            Structure::Bvh | Structure::Nested => {
                let (forest, entries) = plant_wide(quality, scene, appearances);
                (Forests::Wide(forest), entries)
            }
            Structure::Kd(quality) => compared(&|p| {
                let (tree, order) = kdtree::build(p, &quality);
                (AnyIndex::Kd(tree), order)
            }),
            Structure::Narrow => compared(&|p| {
                let (tree, order) = build(p.boxes, &Quality::default());
                (AnyIndex::Tree(tree), order)
            }),
            Structure::Grid(density) => compared(&|p| {
                let (grid, order) = Grid::build(p, &density);
                (AnyIndex::Grid(grid), order)
            }),
            Structure::Heap => compared(&|p| {
                let (heap, order) = Heap::of_boxes(p, &Quality::default());
                (AnyIndex::Heap(heap), order)
            }),
            Structure::HeapSpheres => compared(&|p| {
                let (heap, order) = Heap::of_spheres(p, &Quality::default());
                (AnyIndex::HeapSpheres(heap), order)
            }),
            Structure::ItemBuffer => {
                let (forest, entries) = plant_wide(quality, scene, appearances);
                let meshes = forest.meshes.par_iter();
                let rows = meshes.map(|mesh| Some(BoxRows::of_blocks(&mesh.as_ref()?.blocks)));
                let boxes = ItemBoxes {
                    entries: BoxRows::of_entries(&entries.bounded),
                    meshes: rows.collect(),
                };
                item_boxes = Some(boxes);
                (Forests::Wide(forest), entries)
            }
            Structure::Linear => compared(&|p| {
                let order = 0..p.boxes.len() as u32;
                (AnyIndex::Tree(linear(p.boxes)), order.collect())
            }),
        };
        let mut world = World::of(scene, appearances, forest, entries);
        world.item_boxes = item_boxes;
        world.quality = quality;
        world
    }

    /// Of a flat forest.
    pub(super) fn of(
        scene: &Scene,
        appearances: &Appearances,
        forest: Forests,
        Entries {
            bounded: entries,
            unbounded,
            center,
        }: Entries,
    ) -> World {
        let mut place_of = vec![0; entries.len() + unbounded.len()];
        for (place, entry) in entries.iter().chain(&unbounded).enumerate() {
            place_of[entry.appearance as usize] = place as u32;
        }
        let bounds = if appearances.are_laid_out() {
            forest.bounds()
        } else {
            let own = own_bounds(scene, |mesh| forest.mesh_bounds(mesh));
            Groups::of(scene, appearances, own).bounds(center)
        };
        World {
            scene: scene.clone(),
            appearances: appearances.clone(),
            bounds,
            center,
            top_built: Cost::new(forest.top_figures().sah, &bounds),
            forest,
            entries,
            unbounded,
            combined: Combined::all(scene, appearances),
            place_of,
            item_boxes: None,
            quality: BuildQuality::default(),
        }
    }

    /// Nothing in it is by appearance. Groups are small: their trees are of
    /// medium quality.
    fn nested(quality: BuildQuality, scene: &Scene, appearances: &Appearances) -> World {
        let meshes = wide_meshes(quality, scene, appearances);
        let own = own_bounds(scene, |mesh| meshes[mesh].as_ref().map(|m| m.tree.bounds));
        let groups = Groups::of(scene, appearances, own);
        // What a flat world would take, where there might be one.
        let (bounds, center) = if appearances.are_laid_out() {
            let all = entries_of(scene, appearances, &groups.own);
            let around = |all: Aabb32, entry: &Entry| all.union(&entry.bounds);
            let bounds = all.bounded.iter().fold(Aabb32::EMPTY, around);
            (bounds, all.center)
        } else {
            let center = groups.center();
            (groups.bounds(center), center)
        };
        World {
            scene: scene.clone(),
            appearances: appearances.clone(),
            forest: Forests::Nested(NestedForest { groups, meshes }),
            bounds,
            center,
            entries: Vec::new(),
            unbounded: Vec::new(),
            combined: Combined::all(scene, appearances),
            place_of: Vec::new(),
            item_boxes: None,
            quality,
            top_built: Cost::default(),
        }
    }

    #[inline(always)]
    pub fn entry_of(&self, appearance: u64) -> Entry {
        let Some(place) = self.place_of.get(appearance as usize) else {
            return self.look_up(appearance);
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
    fn look_up(&self, id: u64) -> Entry {
        let row = self.appearances.get(&self.scene, id);
        let Forests::Nested(NestedForest { groups, .. }) = &self.forest else {
            unreachable!("a flat world has an entry for each of its appearances");
        };
        let own = groups.own[row.shape.index()];
        Entry::of(&self.scene, row.shape, own, id, &row.place(), self.center)
    }

    /// Those of `unbounded` that are no meshes.
    #[inline(always)]
    pub fn unbounded_solids(&self) -> impl Iterator<Item = &Entry> {
        let entries = self.unbounded.iter();
        entries.filter(|entry| !matches!(entry.shape, Shape::Mesh(_)))
    }

    /// Those of `unbounded` that are.
    #[inline(always)]
    pub fn unbounded_meshes(&self) -> impl Iterator<Item = (&Entry, MeshId)> {
        self.unbounded.iter().filter_map(|entry| match entry.shape {
            Shape::Mesh(id) => Some((entry, id)),
            _ => None,
        })
    }

    /// Where this is what was built.
    #[inline(always)]
    pub fn wide(&self) -> Option<&WideForest> {
        match &self.forest {
            Forests::Wide(forest) => Some(forest),
            _ => None,
        }
    }

    #[inline(always)]
    pub fn wide_mesh(&self, id: MeshId) -> Option<&WideMesh> {
        let meshes = match &self.forest {
            Forests::Wide(forest) => &forest.meshes,
            Forests::Nested(forest) => &forest.meshes,
            _ => return None,
        };
        meshes[id.index()].as_ref()
    }

    /// A combination that appears, unfolded.
    #[inline(always)]
    pub fn combined(&self, id: CombinationId) -> &Combined {
        self.combined[id.index()]
            .as_ref()
            .expect("what is met appears")
    }

    /// Of the appearance of this id.
    #[inline(always)]
    pub fn object_from_world(&self, appearance: u64) -> Affine {
        self.appearances.object_from_world(&self.scene, appearance)
    }

    /// Bytes of each structure, by name.
    pub fn bytes(&self) -> Vec<(&'static str, usize)> {
        let entries = self.entries.len() + self.unbounded.len();
        let mut bytes = self.forest.bytes();
        bytes.push((
            "top entries",
            entries * size_of::<Entry>() + self.place_of.len() * 4,
        ));
        let boxes = self.item_boxes.as_ref();
        bytes.push(("item boxes", boxes.map_or(0, ItemBoxes::bytes)));
        bytes.push(("appearances", self.appearances.bytes()));
        let facets = Combined::facet_bytes(self.combined.iter().flatten());
        bytes.push(("meshes in combinations", facets));
        bytes.retain(|(_, bytes)| *bytes > 0);
        bytes
    }
}

/// What [blurs](Place::blur) more has no box in world space: a ray's
/// rounding on its way into the object's, seen from the world, would be more than the
/// pads of structures have room for (docs/NUMERICS.md, "Boxes of structures").
pub(super) const MAX_BLUR: f64 = 4096.0;

/// What a flat world has beside its structures.
pub(super) struct Entries {
    /// In the order of the appearances.
    pub bounded: Vec<Entry>,
    pub unbounded: Vec<Entry>,
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
    appearances: &Appearances,
    bounds: impl Fn(usize) -> Option<Aabb32>,
) -> Entries {
    entries_of(scene, appearances, &own_bounds(scene, bounds))
}

fn entries_of(scene: &Scene, appearances: &Appearances, own: &[Aabb32]) -> Entries {
    if !appearances.are_laid_out() {
        // As where groups nest.
        let center = Groups::of(scene, appearances, own.to_vec()).center();
        return entries_about(scene, appearances, own, center);
    }
    let near = entries_about(scene, appearances, own, DVec3::ZERO);
    let around = near
        .bounded
        .iter()
        .fold(Aabb::EMPTY, |all, entry| all.union(&entry.bounds.widened()));
    let center = far_center(&around, FAR);
    if center == DVec3::ZERO {
        return near;
    }
    entries_about(scene, appearances, own, center)
}

fn entries_about(
    scene: &Scene,
    appearances: &Appearances,
    own: &[Aabb32],
    center: DVec3,
) -> Entries {
    let [mut bounded, mut unbounded] = [Vec::new(), Vec::new()];
    for (id, row) in (0_u64..).zip(appearances.iter(scene)) {
        let own = own[row.shape.index()];
        let entry = Entry::of(scene, row.shape, own, id, &row.place(), center);
        if entry.is_unbounded() {
            unbounded.push(entry);
        } else {
            bounded.push(entry);
        }
    }
    Entries {
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
            // A combination's operands are met in spaces of their own, too.
            let bounds = bounds.filter(|_| scene.blur_of(shape).norm() <= MAX_BLUR);
            // What f32 cannot reach is not cut off: it is to be placed.
            let bounds = bounds.filter(|b| b.max_abs() < f64::from(f32::MAX));
            bounds.map_or(Aabb32::EVERYTHING, |b| b.outward())
        }
    });
    own.collect()
}

impl Entry {
    /// Of the appearance `id`: `shape`, whose own box is `own`, at `place`, in a
    /// world about `center`.
    pub fn of(
        scene: &Tables,
        shape: ShapeId,
        own: Aabb32,
        id: u64,
        place: &Place,
        center: DVec3,
    ) -> Entry {
        let placed = place.is_placed(scene, shape) || center != DVec3::ZERO;
        let (row, shape) = (shape, scene.shapes.row(shape));
        let bounds = if !placed || own == Aabb32::EVERYTHING {
            own
        } else if place.blur(scene, row).norm() <= MAX_BLUR {
            let world = world_bounds(&own.widened(), place, center_of(scene, shape));
            world.map_or(Aabb32::EVERYTHING, |world| {
                Aabb::new(world.min - center, world.max - center).outward()
            })
        } else {
            Aabb32::EVERYTHING
        };
        Entry {
            shape,
            appearance: id,
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
pub(super) fn world_bounds(own: &Aabb, place: &Place, center: DVec3) -> Option<Aabb> {
    let own = Aabb::new(own.min + center, own.max + center);
    let world = own.placed(&place.object_from_world, &place.world_from_object)?;
    // The rest is for what is counted from another place.
    Some(world.grown(DVec3::splat(world.max_abs() * 5.0 * f64::EPSILON)))
}
