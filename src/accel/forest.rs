//! The structures of a world: one over its entries, one for each mesh, all of
//! one kind.

use super::bvh::Tree;
use super::grid::Grid;
use super::heap::{Boxes, Heap, Spheres};
use super::index::{Figures, Index};
use super::kdtree::KdTree;
use super::wide::{Block, WideMesh, WideTree};
use crate::geom::triangle::Corners;
use crate::math::Aabb32;

/// A mesh's structure and its triangles in the order of the leaves.
#[derive(Clone, Debug)]
pub struct MeshTree<A> {
    pub tree: A,
    /// About the mesh's centre, in canonical order.
    pub corners: Vec<Corners>,
    /// Triangle in source order.
    pub source: Vec<u32>,
}

/// Structures of one kind.
#[derive(Clone, Debug)]
pub struct Forest<A> {
    /// Over the world's entries.
    pub top: A,
    /// By mesh; `None` for meshes that never appear.
    pub meshes: Vec<Option<MeshTree<A>>>,
}

/// Wide trees: for tiles and for single rays.
#[derive(Clone, Debug)]
pub struct WideForest {
    pub top: WideTree,
    /// By mesh; `None` for meshes that never appear.
    pub meshes: Vec<Option<WideMesh>>,
}

/// A forest of some kind.
#[derive(Clone, Debug)]
pub enum Forests {
    Wide(WideForest),
    /// Also the linear scan: a tree without nodes.
    Narrow(Forest<Tree>),
    Kd(Forest<KdTree>),
    Grid(Forest<Grid>),
    Heap(Forest<Heap<Boxes>>),
    HeapSpheres(Forest<Heap<Spheres>>),
}

/// Runs an expression on the forest inside; wide ones have their own.
macro_rules! each {
    ($forests:expr, $wide:ident => $then_wide:expr, $forest:ident => $then:expr) => {
        match $forests {
            Forests::Wide($wide) => $then_wide,
            Forests::Narrow($forest) => $then,
            Forests::Kd($forest) => $then,
            Forests::Grid($forest) => $then,
            Forests::Heap($forest) => $then,
            Forests::HeapSpheres($forest) => $then,
        }
    };
}

impl Forests {
    pub fn bounds(&self) -> Aabb32 {
        each!(self, wide => wide.top.bounds, forest => forest.top.bounds())
    }

    /// Of the structure over the entries.
    pub fn top_figures(&self) -> Figures {
        each!(self, wide => wide_figures(&wide.top), forest => forest.top.figures())
    }

    /// Of all meshes' structures, in the order of the meshes.
    pub fn mesh_figures(&self) -> Vec<Figures> {
        each!(self,
            wide => {
                let meshes = wide.meshes.iter().flatten();
                meshes.map(|mesh| wide_figures(&mesh.tree)).collect()
            },
            forest => {
                let meshes = forest.meshes.iter().flatten();
                meshes.map(|mesh| mesh.tree.figures()).collect()
            }
        )
    }

    /// Bytes by name.
    pub fn bytes(&self) -> Vec<(&'static str, usize)> {
        let [top, trees, leaves] = each!(self,
            wide => {
                let meshes = || wide.meshes.iter().flatten();
                let leaves = |mesh: &WideMesh| mesh.blocks.len() * size_of::<Block>();
                [
                    wide.top.bytes(),
                    meshes().map(|mesh| mesh.tree.bytes()).sum(),
                    meshes().map(leaves).sum(),
                ]
            },
            forest => {
                let meshes = || forest.meshes.iter().flatten();
                let leaves = |mesh: usize| mesh * (size_of::<Corners>() + 4);
                [
                    forest.top.bytes(),
                    meshes().map(|mesh| mesh.tree.bytes()).sum(),
                    meshes().map(|mesh| leaves(mesh.corners.len())).sum(),
                ]
            }
        );
        vec![
            ("top tree", top),
            ("mesh trees", trees),
            ("mesh leaves", leaves),
        ]
    }
}

fn wide_figures(tree: &WideTree) -> Figures {
    let leaves = tree.leaves();
    Figures {
        nodes: tree.nodes.len(),
        leaves: leaves.len(),
        references: leaves.iter().map(|leaf| leaf.len()).sum(),
        sah: tree.sah,
        ..Figures::default()
    }
}
