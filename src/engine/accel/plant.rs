//! What a world is planted with: a structure for each mesh that appears, once
//! however often it does, and where the world is flat one over its entries.
//!
//! Meshes are built side by side. The entries come out in the order of the structure
//! over them; where that order is free, kinds lie in runs.

use super::builders::{BuildQuality, build_boxes, build_mesh};
use super::forest::{AnyIndex, Forest, MeshIndex, WideForest};
use super::index::Primitives;
use super::wide::{WideMesh, WideTree};
use super::world::{Entries, Entry, corner_bounds, entries};
use crate::geom::triangle::{Corners, canonical};
use crate::math::Aabb32;
use crate::scene::{Appearances, MeshId, Scene, Shape};
use rayon::prelude::*;

/// A structure over primitives, and where its entries come from.
pub(super) type Build<'b> = dyn Fn(&Primitives) -> (AnyIndex, Vec<u32>) + Sync + 'b;

/// Structures of one kind for all that appears; the bounded entries in the top
/// one's order, and the unbounded ones.
pub(super) fn plant(scene: &Scene, appearances: &Appearances, build: &Build) -> (Forest, Entries) {
    let meshes = each_mesh(scene, appearances, |id| mesh_index(scene, id, build));
    let all = entries(scene, appearances, |mesh| {
        meshes[mesh].as_ref().map(|m| m.index.bounds())
    });
    let bounded = &all.bounded;
    let boxes: Vec<Aabb32> = bounded.iter().map(|e| e.bounds).collect();
    let (mut top, mut order) = build(&Primitives {
        boxes: &boxes,
        corners: None,
    });
    top.group(&mut order, &|i| by_kind(&bounded[i as usize]));
    let bounded = order.iter().map(|i| bounded[*i as usize]).collect();
    (Forest { top, meshes }, Entries { bounded, ..all })
}

pub(super) fn wide_meshes(
    quality: BuildQuality,
    scene: &Scene,
    appearances: &Appearances,
) -> Vec<Option<WideMesh>> {
    each_mesh(scene, appearances, |id| {
        build_mesh(&scene.meshes.row(id), quality)
    })
}

pub(super) fn plant_wide(
    quality: BuildQuality,
    scene: &Scene,
    appearances: &Appearances,
) -> (WideForest, Entries) {
    let meshes = wide_meshes(quality, scene, appearances);
    let all = entries(scene, appearances, |mesh| {
        meshes[mesh].as_ref().map(|m| m.tree.bounds)
    });
    let (top, bounded) = top_tree(&all.bounded, quality);
    (WideForest { top, meshes }, Entries { bounded, ..all })
}

/// A tree over entries, and these in its order.
pub(super) fn top_tree(bounded: &[Entry], quality: BuildQuality) -> (WideTree, Vec<Entry>) {
    let boxes: Vec<Aabb32> = bounded.iter().map(|e| e.bounds).collect();
    let (top, order) = build_boxes(&boxes, quality);
    let mut entries: Vec<Entry> = order.iter().map(|i| bounded[*i as usize]).collect();
    for leaf in top.leaves() {
        entries[leaf].sort_by_key(by_kind);
    }
    (top, entries)
}

/// Kinds in runs: within a leaf the order is free.
fn by_kind(entry: &Entry) -> (u8, u64) {
    (entry.shape.kind(), entry.appearance)
}

/// Builds something for each mesh that appears.
fn each_mesh<T: Send>(
    scene: &Scene,
    appearances: &Appearances,
    build: impl Fn(MeshId) -> T + Sync,
) -> Vec<Option<T>> {
    let mut seen = vec![false; scene.meshes.len()];
    for (shape, count) in scene.shapes.rows.iter().zip(appearances.of_shapes(scene)) {
        if let Shape::Mesh(id) = shape {
            seen[id.index()] |= count > 0;
        }
    }
    seen.par_iter()
        .enumerate()
        .map(|(i, seen)| seen.then(|| build(MeshId(i as u32))))
        .collect()
}

fn mesh_index(scene: &Scene, id: MeshId, build: &Build) -> MeshIndex {
    let mesh = scene.meshes.row(id);
    let corners: Vec<Corners> = (0..mesh.triangles.len())
        .map(|i| canonical(mesh.corners(i)))
        .collect();
    let boxes: Vec<Aabb32> = corners.iter().map(corner_bounds).collect();
    let (index, source) = build(&Primitives {
        boxes: &boxes,
        corners: Some(&corners),
    });
    MeshIndex {
        index,
        corners: source.iter().map(|i| corners[*i as usize]).collect(),
        source,
    }
}
