//! What a world is planted with: a structure for each mesh that appears, once
//! however often it does, and where the world is flat one over its entries.
//!
//! Meshes are built side by side. The entries come out in the order of the structure
//! over them; where that order is free, kinds lie in runs.

use super::baselines::AnyIndex;
use super::baselines::index::Primitives;
use super::builders::{BuildQuality, build_boxes, build_mesh};
use super::levels::{BaselineBlas, BaselineLevels, WideLevels};
use super::wide_bvh::{WideBlas, WideBvh};
use super::world::{TlasEntries, TlasEntry, corner_bounds, entries};
use crate::geom::triangle::{Corners, canonical};
use crate::math::Aabb32;
use crate::scene::{Instances, MeshId, Scene, Shape};
use rayon::prelude::*;

/// A structure over primitives, and where its entries come from.
pub(super) type Build<'b> = dyn Fn(&Primitives) -> (AnyIndex, Vec<u32>) + Sync + 'b;

/// Structures of one kind for all that appears; the bounded entries in the top
/// one's order, and the unbounded ones.
pub(super) fn build_baseline(
    scene: &Scene,
    instances: &Instances,
    build: &Build,
) -> (BaselineLevels, TlasEntries) {
    let meshes = each_mesh(scene, instances, |id| baseline_blas(scene, id, build));
    let all = entries(scene, instances, |mesh| {
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
    (
        BaselineLevels {
            tlas: top,
            blases: meshes,
        },
        TlasEntries { bounded, ..all },
    )
}

pub(super) fn wide_blases(
    quality: BuildQuality,
    scene: &Scene,
    instances: &Instances,
) -> Vec<Option<WideBlas>> {
    each_mesh(scene, instances, |id| {
        build_mesh(&scene.meshes.row(id), quality)
    })
}

pub(super) fn build_wide(
    quality: BuildQuality,
    scene: &Scene,
    instances: &Instances,
) -> (WideLevels, TlasEntries) {
    let meshes = wide_blases(quality, scene, instances);
    let all = entries(scene, instances, |mesh| {
        meshes[mesh].as_ref().map(|m| m.tree.bounds)
    });
    let (top, bounded) = build_tlas(&all.bounded, quality);
    (
        WideLevels {
            tlas: top,
            blases: meshes,
        },
        TlasEntries { bounded, ..all },
    )
}

/// A tree over entries, and these in its order.
pub(super) fn build_tlas(
    bounded: &[TlasEntry],
    quality: BuildQuality,
) -> (WideBvh, Vec<TlasEntry>) {
    let boxes: Vec<Aabb32> = bounded.iter().map(|e| e.bounds).collect();
    let (top, order) = build_boxes(&boxes, quality);
    let mut entries: Vec<TlasEntry> = order.iter().map(|i| bounded[*i as usize]).collect();
    for leaf in top.leaves() {
        entries[leaf].sort_by_key(by_kind);
    }
    (top, entries)
}

/// Kinds in runs: within a leaf the order is free.
fn by_kind(entry: &TlasEntry) -> (u8, u64) {
    (entry.shape.kind(), entry.instance)
}

/// Builds something for each mesh that appears.
fn each_mesh<T: Send>(
    scene: &Scene,
    instances: &Instances,
    build: impl Fn(MeshId) -> T + Sync,
) -> Vec<Option<T>> {
    let mut seen = vec![false; scene.meshes.len()];
    for (shape, count) in scene.shapes.rows.iter().zip(instances.of_shapes(scene)) {
        if let Shape::Mesh(id) = shape {
            seen[id.index()] |= count > 0;
        }
    }
    seen.par_iter()
        .enumerate()
        .map(|(i, seen)| seen.then(|| build(MeshId(i as u32))))
        .collect()
}

fn baseline_blas(scene: &Scene, id: MeshId, build: &Build) -> BaselineBlas {
    let mesh = scene.meshes.row(id);
    let corners: Vec<Corners> = (0..mesh.triangles.len())
        .map(|i| canonical(mesh.corners(i)))
        .collect();
    let boxes: Vec<Aabb32> = corners.iter().map(corner_bounds).collect();
    let (index, source) = build(&Primitives {
        boxes: &boxes,
        corners: Some(&corners),
    });
    BaselineBlas {
        index,
        corners: source.iter().map(|i| corners[*i as usize]).collect(),
        source,
    }
}
