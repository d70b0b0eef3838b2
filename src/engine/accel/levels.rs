//! The structures of a world: one over its entries, one for each mesh, all of
//! one kind.

use super::baselines::{AnyIndex, Figures};
use super::instance_bvh::InstanceBvhs;
use super::wide_bvh::{WideBlas, WideBvh};
use crate::geom::triangle::Corners;
use crate::math::Aabb32;
use glam::DVec3;

/// A mesh's structure and its triangles in the order of the leaves.
#[derive(Clone, Debug)]
pub struct BaselineBlas {
    pub index: AnyIndex,
    /// About the mesh's centre, in canonical order.
    pub corners: Vec<Corners>,
    /// Triangle in source order.
    pub source: Vec<u32>,
}

/// Comparison structures of one kind.
#[derive(Clone, Debug)]
pub struct BaselineLevels {
    /// Over the world's entries.
    pub tlas: AnyIndex,
    /// By mesh; `None` for meshes that never appear.
    pub blases: Vec<Option<BaselineBlas>>,
}

/// Wide trees: for tiles and for single rays.
#[derive(Clone, Debug)]
pub struct WideLevels {
    pub tlas: WideBvh,
    /// By mesh; `None` for meshes that never appear.
    pub blases: Vec<Option<WideBlas>>,
}

/// Wide trees, one for each shared node: nothing is by instance.
#[derive(Clone, Debug)]
pub struct NestedLevels {
    pub groups: InstanceBvhs,
    /// By mesh; `None` for meshes that never appear.
    pub blases: Vec<Option<WideBlas>>,
}

/// A levels of some kind.
#[derive(Clone, Debug)]
pub enum Levels {
    Wide(WideLevels),
    Nested(NestedLevels),
    Baseline(BaselineLevels),
}

impl Levels {
    pub fn bounds(&self) -> Aabb32 {
        match self {
            Levels::Wide(wide) => wide.tlas.bounds,
            Levels::Nested(nested) => nested.groups.bounds(DVec3::ZERO),
            Levels::Baseline(levels) => levels.tlas.bounds(),
        }
    }

    /// Of a mesh that appears.
    pub fn mesh_bounds(&self, mesh: usize) -> Option<Aabb32> {
        match self {
            Levels::Wide(wide) => Some(wide.blases[mesh].as_ref()?.tree.bounds),
            Levels::Nested(nested) => Some(nested.blases[mesh].as_ref()?.tree.bounds),
            Levels::Baseline(levels) => Some(levels.blases[mesh].as_ref()?.index.bounds()),
        }
    }

    /// Of the structure over the entries.
    pub fn tlas_figures(&self) -> Figures {
        match self {
            Levels::Wide(wide) => wide_figures(&wide.tlas),
            Levels::Nested(nested) => wide_figures(&nested.groups.roots.tree),
            Levels::Baseline(levels) => levels.tlas.figures(),
        }
    }

    /// Of all meshes' structures, in the order of the meshes.
    pub fn blas_figures(&self) -> Vec<Figures> {
        match self {
            Levels::Wide(wide) => wide_meshes_figures(&wide.blases),
            Levels::Nested(nested) => wide_meshes_figures(&nested.blases),
            Levels::Baseline(levels) => {
                let meshes = levels.blases.iter().flatten();
                meshes.map(|mesh| mesh.index.figures()).collect()
            }
        }
    }

    /// Bytes by name.
    pub fn bytes(&self) -> Vec<(&'static str, usize)> {
        let [top, trees, leaves] = match self {
            Levels::Wide(wide) => wide_bytes(wide.tlas.bytes(), &wide.blases),
            Levels::Nested(nested) => wide_bytes(nested.groups.bytes(), &nested.blases),
            Levels::Baseline(levels) => {
                let meshes = || levels.blases.iter().flatten();
                let leaves = |mesh: usize| mesh * (size_of::<Corners>() + 4);
                [
                    levels.tlas.bytes(),
                    meshes().map(|mesh| mesh.index.bytes()).sum(),
                    meshes().map(|mesh| leaves(mesh.corners.len())).sum(),
                ]
            }
        };
        let tlas_name = match self {
            Levels::Nested(_) => "node trees",
            _ => "top tree",
        };
        vec![
            (tlas_name, top),
            ("mesh trees", trees),
            ("mesh leaves", leaves),
        ]
    }
}

fn wide_bytes(top: usize, meshes: &[Option<WideBlas>]) -> [usize; 3] {
    let meshes = || meshes.iter().flatten();
    let leaves = |mesh: &WideBlas| mesh.blocks.bytes();
    [
        top,
        meshes().map(|mesh| mesh.tree.bytes()).sum(),
        meshes().map(leaves).sum(),
    ]
}

fn wide_meshes_figures(meshes: &[Option<WideBlas>]) -> Vec<Figures> {
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
