//! Builders of the two levels: a BLAS for each mesh that some instance places, and a TLAS
//! over all instances of a flat world.
//!
//! Meshes are built in parallel, each once however often it is placed. Entries are returned
//! in the order of the TLAS's leaves; where that order is free, kinds lie in runs.

use super::accelerator::{BaselineAccelerator, BaselineBlas, WideAccelerator};
use super::baselines::AnyIndex;
use super::baselines::index::Primitives;
use super::bounds::corner_bounds;
use super::builders::{BuildQuality, build_boxes, build_mesh};
use super::tlas_entry::{TlasEntries, TlasEntry, entries};
use super::wide_bvh::{WideBlas, WideBvh};
use crate::geom::triangle::{Corners, canonical};
use crate::math::Aabb32;
use crate::scene::{Instances, MeshId, Scene, Shape};
use rayon::prelude::*;
use std::sync::Arc;

/// Builds a structure over primitives, and returns it with the order of its entries.
pub(super) type Build<'b> = dyn Fn(&Primitives) -> (AnyIndex, Vec<u32>) + Sync + 'b;

/// Builds comparison structures of one kind, and returns them with the entries; bounded
/// entries are in the order of the TLAS.
pub(super) fn build_baseline(
    scene: &Scene,
    instances: &Instances,
    build: &Build,
) -> (BaselineAccelerator, TlasEntries) {
    let blases = each_mesh(scene, instances, |id| baseline_blas(scene, id, build));
    let all = entries(scene, instances, |mesh| {
        blases[mesh].as_ref().map(|m| m.index.bounds())
    });
    let bounded = &all.bounded;
    let boxes: Vec<Aabb32> = bounded.iter().map(|e| e.bounds).collect();
    let (mut tlas, mut order) = build(&Primitives {
        boxes: &boxes,
        corners: None,
    });
    tlas.group(&mut order, &|i| by_kind(&bounded[i as usize]));
    let bounded = order.iter().map(|i| bounded[*i as usize]).collect();
    (
        BaselineAccelerator { tlas, blases },
        TlasEntries { bounded, ..all },
    )
}

/// Builds the wide BVH of each mesh that some instance places.
pub(super) fn wide_blases(
    quality: BuildQuality,
    scene: &Scene,
    instances: &Instances,
) -> Arc<[Option<Arc<WideBlas>>]> {
    each_mesh(scene, instances, |id| {
        Arc::new(build_mesh(&scene.meshes.row(id), quality))
    })
}

/// Builds the wide BVHs of the meshes that deform anew, and shares the others.
pub(super) fn wide_blases_at_time(
    blases: &Arc<[Option<Arc<WideBlas>>]>,
    quality: BuildQuality,
    scene: &Scene,
) -> Arc<[Option<Arc<WideBlas>>]> {
    if scene.deformations.is_empty() {
        return Arc::clone(blases);
    }
    let at_time = |(mesh, blas): (usize, &Option<Arc<WideBlas>>)| {
        let id = MeshId(mesh as u32);
        let blas = blas.as_ref()?;
        Some(match scene.deformations.has(id) {
            true => Arc::new(build_mesh(&scene.meshes.row(id), quality)),
            false => Arc::clone(blas),
        })
    };
    let all = blases.par_iter().enumerate().map(at_time);
    all.collect::<Vec<_>>().into()
}

/// Builds both levels of wide BVHs, and returns them with the entries; bounded entries are
/// in the order of the TLAS.
pub(super) fn build_wide(
    quality: BuildQuality,
    scene: &Scene,
    instances: &Instances,
) -> (WideAccelerator, TlasEntries) {
    let blases = wide_blases(quality, scene, instances);
    let all = entries(scene, instances, |mesh| {
        blases[mesh].as_ref().map(|m| m.tree.bounds)
    });
    let (tlas, bounded) = build_tlas(&all.bounded, quality);
    (
        WideAccelerator { tlas, blases },
        TlasEntries { bounded, ..all },
    )
}

/// Builds the wide TLAS over entries, and returns it with the entries in its order.
pub(super) fn build_tlas(
    bounded: &[TlasEntry],
    quality: BuildQuality,
) -> (WideBvh, Vec<TlasEntry>) {
    let boxes: Vec<Aabb32> = bounded.iter().map(|e| e.bounds).collect();
    let (tlas, order) = build_boxes(&boxes, quality);
    let mut entries: Vec<TlasEntry> = order.iter().map(|i| bounded[*i as usize]).collect();
    for leaf in tlas.leaves() {
        entries[leaf].sort_by_key(by_kind);
    }
    (tlas, entries)
}

/// Returns the key by which entries are sorted within a leaf, so that kinds lie in runs.
fn by_kind(entry: &TlasEntry) -> (u8, u64) {
    (entry.shape.kind(), entry.instance)
}

/// Calls `build` in parallel for each mesh that some instance places.
fn each_mesh<T: Send>(
    scene: &Scene,
    instances: &Instances,
    build: impl Fn(MeshId) -> T + Sync,
) -> Arc<[Option<T>]> {
    let mut seen = vec![false; scene.meshes.len()];
    for (shape, count) in scene.shapes.rows.iter().zip(instances.of_shapes(scene)) {
        if let Shape::Mesh(id) = shape {
            seen[id.index()] |= count > 0;
        }
    }
    let each = seen.par_iter().enumerate();
    let each = each.map(|(i, seen)| seen.then(|| build(MeshId(i as u32))));
    each.collect::<Vec<_>>().into()
}

/// Builds the comparison structure of one mesh.
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
