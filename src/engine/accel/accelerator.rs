//! The structures of a world, all of one kind: a TLAS or instance BVHs, and a BLAS per
//! mesh.

use super::baselines::{AnyIndex, Figures};
use super::instance_bvh::InstanceBvhs;
use super::wide_bvh::{WideBlas, WideBvh};
use crate::geom::triangle::Corners;
use crate::math::Aabb32;
use glam::DVec3;
use std::sync::Arc;

/// The comparison structure of one mesh, and its triangles in the order of the leaves.
#[derive(Clone, Debug)]
pub struct BaselineBlas {
    pub index: AnyIndex,
    /// Corners about the mesh's centre, in canonical order.
    pub corners: Vec<Corners>,
    /// By row of `corners`: the triangle's number in the mesh.
    pub source: Vec<u32>,
}

/// The TLAS and BLASes of one comparison structure.
#[derive(Clone, Debug)]
pub struct BaselineAccelerator {
    /// The structure over the world's entries.
    pub tlas: AnyIndex,
    /// By mesh; `None` for meshes that no instance places.
    pub blases: Arc<[Option<BaselineBlas>]>,
}

/// The wide TLAS and BLASes, for beams, streams and single rays.
#[derive(Clone, Debug)]
pub struct WideAccelerator {
    pub tlas: WideBvh,
    /// By mesh; `None` for meshes that no instance places.
    pub blases: Arc<[Option<Arc<WideBlas>>]>,
}

/// Instance BVHs and wide BLASes. No table has a row per instance.
#[derive(Clone, Debug)]
pub struct NestedAccelerator {
    pub instance_bvhs: InstanceBvhs,
    /// By mesh; `None` for meshes that no instance places.
    pub blases: Arc<[Option<Arc<WideBlas>>]>,
}

/// The structures of a world.
#[derive(Clone, Debug)]
pub enum Accelerator {
    Wide(WideAccelerator),
    Nested(NestedAccelerator),
    Baseline(BaselineAccelerator),
}

impl Accelerator {
    /// Returns the box around all bounded instances.
    pub fn bounds(&self) -> Aabb32 {
        match self {
            Accelerator::Wide(wide) => wide.tlas.bounds,
            Accelerator::Nested(nested) => nested.instance_bvhs.bounds(DVec3::ZERO),
            Accelerator::Baseline(accelerator) => accelerator.tlas.bounds(),
        }
    }

    /// Returns the box of a mesh's BLAS, if some instance places the mesh.
    pub fn mesh_bounds(&self, mesh: usize) -> Option<Aabb32> {
        match self {
            Accelerator::Wide(wide) => Some(wide.blases[mesh].as_ref()?.tree.bounds),
            Accelerator::Nested(nested) => Some(nested.blases[mesh].as_ref()?.tree.bounds),
            Accelerator::Baseline(accelerator) => {
                Some(accelerator.blases[mesh].as_ref()?.index.bounds())
            }
        }
    }

    /// Returns the figures of the TLAS, or of the instance BVHs over the roots.
    pub fn tlas_figures(&self) -> Figures {
        match self {
            Accelerator::Wide(wide) => wide_figures(&wide.tlas),
            Accelerator::Nested(nested) => {
                let trees = nested.instance_bvhs.root_trees().iter();
                let each = trees.map(|tree| wide_figures(&tree.tree));
                each.reduce(|a, b| Figures {
                    nodes: a.nodes + b.nodes,
                    leaves: a.leaves + b.leaves,
                    references: a.references + b.references,
                    sah: a.sah + b.sah,
                    ..a
                })
                .unwrap_or_default()
            }
            Accelerator::Baseline(accelerator) => accelerator.tlas.figures(),
        }
    }

    /// Returns the figures of each BLAS, in the order of the meshes.
    pub fn blas_figures(&self) -> Vec<Figures> {
        match self {
            Accelerator::Wide(wide) => wide_meshes_figures(&wide.blases),
            Accelerator::Nested(nested) => wide_meshes_figures(&nested.blases),
            Accelerator::Baseline(accelerator) => {
                let meshes = accelerator.blases.iter().flatten();
                meshes.map(|mesh| mesh.index.figures()).collect()
            }
        }
    }

    /// Returns the bytes of each level, by name.
    pub fn bytes(&self) -> Vec<(&'static str, usize)> {
        let [top, trees, leaves] = match self {
            Accelerator::Wide(wide) => wide_bytes(wide.tlas.bytes(), &wide.blases),
            Accelerator::Nested(nested) => wide_bytes(nested.instance_bvhs.bytes(), &nested.blases),
            Accelerator::Baseline(accelerator) => {
                let meshes = || accelerator.blases.iter().flatten();
                let leaves = |mesh: usize| mesh * (size_of::<Corners>() + 4);
                [
                    accelerator.tlas.bytes(),
                    meshes().map(|mesh| mesh.index.bytes()).sum(),
                    meshes().map(|mesh| leaves(mesh.corners.len())).sum(),
                ]
            }
        };
        let tlas_name = match self {
            Accelerator::Nested(_) => "node trees",
            _ => "top tree",
        };
        vec![
            (tlas_name, top),
            ("mesh trees", trees),
            ("mesh leaves", leaves),
        ]
    }
}

fn wide_bytes(top: usize, meshes: &[Option<Arc<WideBlas>>]) -> [usize; 3] {
    let meshes = || meshes.iter().flatten();
    let leaves = |mesh: &Arc<WideBlas>| mesh.blocks.bytes();
    [
        top,
        meshes().map(|mesh| mesh.tree.bytes()).sum(),
        meshes().map(leaves).sum(),
    ]
}

fn wide_meshes_figures(meshes: &[Option<Arc<WideBlas>>]) -> Vec<Figures> {
    let meshes = meshes.iter().flatten();
    meshes.map(|mesh| wide_figures(&mesh.tree)).collect()
}

fn wide_figures(tree: &WideBvh) -> Figures {
    let leaves = tree.leaves();
    Figures {
        nodes: tree.nodes.len(),
        leaves: leaves.len(),
        references: leaves.iter().map(|leaf| leaf.len()).sum(),
        sah: tree.sah,
        ..Figures::default()
    }
}
