//! The structures of a world: one over its entries, one for each mesh, all of
//! one kind.

use super::bvh::Tree;
use super::grid::Grid;
use super::groups::Groups;
use super::heap::{Boxes, Heap, Spheres};
use super::index::{Figures, Index};
use super::kdtree::KdTree;
use super::wide::{WideMesh, WideTree};
use crate::geom::triangle::Corners;
use crate::math::Aabb32;
use glam::DVec3;

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

/// Wide trees, one for each shared node: nothing is by appearance.
#[derive(Clone, Debug)]
pub struct NestedForest {
    pub groups: Groups,
    /// By mesh; `None` for meshes that never appear.
    pub meshes: Vec<Option<WideMesh>>,
}

/// A forest of some kind.
#[derive(Clone, Debug)]
pub enum Forests {
    Wide(WideForest),
    Nested(NestedForest),
    /// Also the linear scan: a tree without nodes.
    Narrow(Forest<Tree>),
    Kd(Forest<KdTree>),
    Grid(Forest<Grid>),
    Heap(Forest<Heap<Boxes>>),
    HeapSpheres(Forest<Heap<Spheres>>),
}

/// Runs an expression on the forest inside; those of wide trees have their own.
macro_rules! each {
    (
        $forests:expr,
        $wide:ident => $then_wide:expr,
        $nested:ident => $then_nested:expr,
        $forest:ident => $then:expr
    ) => {
        match $forests {
            Forests::Wide($wide) => $then_wide,
            Forests::Nested($nested) => $then_nested,
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
        each!(self,
            wide => wide.top.bounds,
            nested => nested.groups.bounds(DVec3::ZERO),
            forest => forest.top.bounds()
        )
    }

    /// Of a mesh that appears.
    pub fn mesh_bounds(&self, mesh: usize) -> Option<Aabb32> {
        each!(self,
            wide => Some(wide.meshes[mesh].as_ref()?.tree.bounds),
            nested => Some(nested.meshes[mesh].as_ref()?.tree.bounds),
            forest => Some(forest.meshes[mesh].as_ref()?.tree.bounds())
        )
    }

    /// Of the structure over the entries.
    pub fn top_figures(&self) -> Figures {
        each!(self,
            wide => wide_figures(&wide.top),
            nested => wide_figures(&nested.groups.roots.tree),
            forest => forest.top.figures()
        )
    }

    /// Of all meshes' structures, in the order of the meshes.
    pub fn mesh_figures(&self) -> Vec<Figures> {
        each!(self,
            wide => wide_meshes_figures(&wide.meshes),
            nested => wide_meshes_figures(&nested.meshes),
            forest => {
                let meshes = forest.meshes.iter().flatten();
                meshes.map(|mesh| mesh.tree.figures()).collect()
            }
        )
    }

    /// Bytes by name.
    pub fn bytes(&self) -> Vec<(&'static str, usize)> {
        let [top, trees, leaves] = each!(self,
            wide => wide_bytes(wide.top.bytes(), &wide.meshes),
            nested => wide_bytes(nested.groups.bytes(), &nested.meshes),
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
        let top_name = match self {
            Forests::Nested(_) => "node trees",
            _ => "top tree",
        };
        vec![
            (top_name, top),
            ("mesh trees", trees),
            ("mesh leaves", leaves),
        ]
    }
}

fn wide_bytes(top: usize, meshes: &[Option<WideMesh>]) -> [usize; 3] {
    let meshes = || meshes.iter().flatten();
    let leaves = |mesh: &WideMesh| mesh.blocks.bytes();
    [
        top,
        meshes().map(|mesh| mesh.tree.bytes()).sum(),
        meshes().map(leaves).sum(),
    ]
}

fn wide_meshes_figures(meshes: &[Option<WideMesh>]) -> Vec<Figures> {
    let meshes = meshes.iter().flatten();
    meshes.map(|mesh| wide_figures(&mesh.tree)).collect()
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
