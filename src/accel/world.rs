//! A scene ready to be traced: two levels of trees.
//!
//! The top tree stands over entries: an appearance each, either a primitive or
//! a mesh with a tree of its own, shared by all of its appearances. Appearances
//! under the identity need no transform and are met in world space. Unbounded
//! shapes stand in a short list outside the tree.

use super::bvh::Tree;
use super::sah::{Quality, build, linear};
use crate::geom::triangle::{Corners, canonical};
use crate::math::{Aabb, Aabb32, Affine};
use crate::scene::{Appearance, Appearances, MeshId, Scene, Shape, shape_bounds};
use glam::DVec3;
use rayon::prelude::*;

/// Which structure finds the primitives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Structure {
    #[default]
    Bvh,
    /// Every primitive is tested.
    Linear,
}

/// One appearance in the top tree's leaves.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    pub shape: Shape,
    /// Id of one of [`Appearances`].
    pub appearance: u64,
    /// Needs a transform: its object space is not world space.
    pub placed: bool,
    /// World space; a hit's t lies inside.
    pub bounds: Aabb32,
    /// Object space; the same as `bounds` where not placed. Of a mesh, its
    /// tree's.
    pub own: Aabb32,
    /// The largest coordinate of `own`; 0 where it is unbounded.
    pub size: f64,
    /// How much `world_from_object` lengthens vectors at most (∞-norm).
    pub stretch: f64,
}

/// A mesh's tree and its triangles in the order of the leaves.
#[derive(Clone, Debug)]
pub struct MeshTree {
    pub tree: Tree,
    /// About the mesh's centre, in canonical order.
    pub corners: Vec<Corners>,
    /// Triangle in source order.
    pub source: Vec<u32>,
}

pub struct World<'a> {
    pub scene: &'a Scene,
    pub appearances: &'a Appearances,
    pub top: Tree,
    /// In the order of the top tree's leaves; each leaf's kinds in runs.
    pub entries: Vec<Entry>,
    pub unbounded: Vec<Entry>,
    /// By appearance: its place in `entries`, or past their end in `unbounded`.
    pub place_of: Vec<u32>,
    /// By mesh; `None` for meshes that never appear.
    pub meshes: Vec<Option<MeshTree>>,
}

impl<'a> World<'a> {
    pub fn build(
        scene: &'a Scene,
        appearances: &'a Appearances,
        structure: Structure,
    ) -> World<'a> {
        let meshes = mesh_trees(scene, appearances, structure);
        let mut bounded = Vec::new();
        let mut unbounded = Vec::new();
        for (i, appearance) in (0_u64..).zip(appearances.iter(scene)) {
            let shape = scene.shapes.row(appearance.shape);
            let own = match shape {
                Shape::Mesh(id) => meshes[id.index()]
                    .as_ref()
                    .map_or(Aabb32::EMPTY, |m| m.tree.bounds),
                _ => shape_bounds(scene, appearance.shape)
                    .map_or(Aabb32::EVERYTHING, |b| b.outward()),
            };
            let placed = appearance.is_placed(scene);
            let bounds = if placed && own != Aabb32::EVERYTHING {
                world_bounds(&own.widened(), &appearance, center_of(scene, shape)).outward()
            } else {
                own
            };
            let entry = Entry {
                shape,
                appearance: i,
                placed,
                bounds,
                own,
                size: match own {
                    Aabb32::EVERYTHING => 0.0,
                    _ => own.widened().max_abs(),
                },
                stretch: appearance.world_from_object.norm(),
            };
            match shape {
                Shape::HalfSpace(_) => unbounded.push(entry),
                _ => bounded.push(entry),
            }
        }
        let (top, entries) = top_tree(bounded, structure);
        let mut place_of = vec![0; entries.len() + unbounded.len()];
        for (place, entry) in entries.iter().chain(&unbounded).enumerate() {
            place_of[entry.appearance as usize] = place as u32;
        }
        World {
            scene,
            appearances,
            top,
            entries,
            unbounded,
            place_of,
            meshes,
        }
    }

    #[inline(always)]
    pub fn entry_of(&self, appearance: u64) -> &Entry {
        let place = self.place_of[appearance as usize] as usize;
        match self.entries.get(place) {
            Some(entry) => entry,
            None => &self.unbounded[place - self.entries.len()],
        }
    }

    /// Of the appearance of this id.
    #[inline(always)]
    pub fn object_from_world(&self, appearance: u64) -> Affine {
        self.appearances.object_from_world(self.scene, appearance)
    }

    /// Bytes of each structure, by name.
    pub fn bytes(&self) -> Vec<(&'static str, usize)> {
        let of_meshes = |f: fn(&MeshTree) -> usize| self.meshes.iter().flatten().map(f).sum();
        [
            ("top tree", self.top.bytes()),
            (
                "top entries",
                (self.entries.len() + self.unbounded.len()) * size_of::<Entry>()
                    + self.place_of.len() * 4,
            ),
            ("mesh trees", of_meshes(|m| m.tree.bytes())),
            (
                "mesh leaves",
                of_meshes(|m| m.corners.len() * (size_of::<Corners>() + 4)),
            ),
            ("appearances", self.appearances.bytes()),
        ]
        .into_iter()
        .filter(|(_, bytes)| *bytes > 0)
        .collect()
    }
}

fn mesh_trees(
    scene: &Scene,
    appearances: &Appearances,
    structure: Structure,
) -> Vec<Option<MeshTree>> {
    let mut seen = vec![false; scene.meshes.len()];
    for (shape, count) in scene.shapes.rows.iter().zip(appearances.of_shapes(scene)) {
        if let Shape::Mesh(id) = shape {
            seen[id.index()] |= count > 0;
        }
    }
    seen.par_iter()
        .enumerate()
        .map(|(i, seen)| seen.then(|| mesh_tree(scene, MeshId(i as u32), structure)))
        .collect()
}

fn mesh_tree(scene: &Scene, id: MeshId, structure: Structure) -> MeshTree {
    let mesh = scene.meshes.row(id);
    let boxes: Vec<Aabb32> = (0..mesh.triangles.len())
        .map(|i| corner_bounds(&mesh.corners(i)))
        .collect();
    let (tree, source) = match structure {
        Structure::Bvh => build(&boxes, &Quality::default()),
        Structure::Linear => (linear(&boxes), (0..boxes.len() as u32).collect()),
    };
    MeshTree {
        tree,
        corners: source
            .iter()
            .map(|i| canonical(mesh.corners(*i as usize)))
            .collect(),
        source,
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

fn center_of(scene: &Scene, shape: Shape) -> DVec3 {
    match shape {
        Shape::Mesh(id) => scene.meshes.center[id.index()],
        _ => DVec3::ZERO,
    }
}

/// The world-space box of an appearance whose geometry lies in `own` (about
/// `center`).
///
/// `object_from_world` is what defines the appearance, and `world_from_object`
/// only nearly its inverse. With E = object_from_world · world_from_object − I,
/// the true world point of b is within world_from_object·(b ± 2|E||b|), so the
/// box grows by that, and by the rounding of the product itself.
fn world_bounds(own: &Aabb, appearance: &Appearance, center: DVec3) -> Aabb {
    if own.is_empty() {
        return Aabb::EMPTY;
    }
    let own = Aabb::new(own.min + center, own.max + center);
    let (inward, outward) = (&appearance.object_from_world, &appearance.world_from_object);
    let around = inward.then_after(outward);
    let identity = Affine::IDENTITY;
    let largest = own.max_abs();
    let slack: [f64; 3] = std::array::from_fn(|r| {
        let linear: f64 = (0..3)
            .map(|c| (around.linear[c][r] - identity.linear[c][r]).abs())
            .sum();
        // Magnitudes of what was summed up, for the rounding of each sum.
        let sums: f64 = (0..3)
            .map(|k| {
                let inner: f64 = (0..3).map(|c| outward.linear[c][k].abs()).sum::<f64>() * largest
                    + outward.translation[k].abs();
                inward.linear[k][r].abs() * inner
            })
            .sum::<f64>()
            + inward.translation[r].abs();
        2.0 * (linear * largest + around.translation[r].abs()) + 16.0 * f64::EPSILON * sums
    });
    let grown = own.grown(DVec3::from_array(slack));
    let corners = grown
        .corners()
        .map(|p| DVec3::from_array(outward.point(p.to_array())));
    let world = Aabb::of_points(corners);
    world.grown(DVec3::splat(world.max_abs() * 4.0 * f64::EPSILON))
}

fn top_tree(bounded: Vec<Entry>, structure: Structure) -> (Tree, Vec<Entry>) {
    let boxes: Vec<Aabb32> = bounded.iter().map(|e| e.bounds).collect();
    let (tree, order) = match structure {
        Structure::Bvh => build(&boxes, &Quality::default()),
        Structure::Linear => (linear(&boxes), (0..boxes.len() as u32).collect()),
    };
    let mut entries: Vec<Entry> = order.iter().map(|i| bounded[*i as usize]).collect();
    // Kinds in runs: within a leaf the order is free.
    let by_kind = |e: &Entry| (e.shape.kind(), e.appearance);
    match tree.leaves() {
        None => entries.sort_by_key(by_kind),
        Some(leaves) => leaves
            .into_iter()
            .for_each(|leaf| entries[leaf].sort_by_key(by_kind)),
    }
    (tree, entries)
}
