//! The structures of a world: one over its entries, one for each mesh, all of
//! one kind.

use super::bvh::{Stack, Tree};
use super::count::Count;
use super::grid::Grid;
use super::groups::Groups;
use super::heap::{Boxes, Heap, Queue, Spheres};
use super::index::{Figures, Index, Leaf};
use super::kdtree::{KdScratch, KdTree};
use super::slabs::Slabs;
use super::tags::Tags;
use super::wide::{WideMesh, WideTree};
use crate::geom::triangle::Corners;
use crate::math::Aabb32;
use crate::math::lanes::Lanes;
use glam::DVec3;

/// A comparison structure of any kind.
#[derive(Clone, Debug)]
pub enum AnyIndex {
    /// Also the linear scan: a tree without nodes.
    Tree(Tree),
    Kd(KdTree),
    Grid(Grid),
    Heap(Heap<Boxes>),
    HeapSpheres(Heap<Spheres>),
}

/// Room for one walk of an [`AnyIndex`], reused from packet to packet.
pub enum AnyScratch<L: Lanes> {
    Tree(Box<Stack<L>>),
    Kd(Box<KdScratch<L>>),
    Grid(Tags),
    Heap(Queue<L>),
}

/// Runs an expression on the structure inside.
macro_rules! any {
    ($index:expr, $inner:ident => $then:expr) => {
        match $index {
            AnyIndex::Tree($inner) => $then,
            AnyIndex::Kd($inner) => $then,
            AnyIndex::Grid($inner) => $then,
            AnyIndex::Heap($inner) => $then,
            AnyIndex::HeapSpheres($inner) => $then,
        }
    };
}

impl AnyIndex {
    pub fn bounds(&self) -> Aabb32 {
        any!(self, index => index.bounds())
    }

    pub fn bytes(&self) -> usize {
        any!(self, index => index.bytes())
    }

    pub fn figures(&self) -> Figures {
        any!(self, index => index.figures())
    }

    /// As [`Index::group`].
    pub fn group(&mut self, order: &mut [u32], key: &dyn Fn(u32) -> (u8, u64)) {
        any!(self, index => index.group(order, key));
    }

    pub fn scratch<L: Lanes>(&self) -> AnyScratch<L> {
        match self {
            AnyIndex::Tree(_) => AnyScratch::Tree(Box::default()),
            AnyIndex::Kd(_) => AnyScratch::Kd(Box::default()),
            AnyIndex::Grid(_) => AnyScratch::Grid(Tags::default()),
            AnyIndex::Heap(_) | AnyIndex::HeapSpheres(_) => AnyScratch::Heap(Queue::default()),
        }
    }

    /// As [`Index::walk`], with the [scratch](AnyIndex::scratch) of a structure of this kind.
    pub fn walk<L: Lanes>(
        &self,
        slabs: &Slabs<L>,
        t_min: L,
        limit: L,
        scratch: &mut AnyScratch<L>,
        count: Count,
        leaf: &mut Leaf<L>,
    ) -> L {
        use AnyScratch as S;
        match (self, scratch) {
            (AnyIndex::Tree(tree), S::Tree(stack)) => {
                tree.walk(slabs, t_min, limit, stack, count, leaf)
            }
            (AnyIndex::Kd(tree), S::Kd(room)) => tree.walk(slabs, t_min, limit, room, count, leaf),
            (AnyIndex::Grid(grid), S::Grid(tags)) => {
                grid.walk(slabs, t_min, limit, tags, count, leaf)
            }
            (AnyIndex::Heap(heap), S::Heap(queue)) => {
                heap.walk(slabs, t_min, limit, queue, count, leaf)
            }
            (AnyIndex::HeapSpheres(heap), S::Heap(queue)) => {
                heap.walk(slabs, t_min, limit, queue, count, leaf)
            }
            _ => unreachable!("all structures of a forest are of one kind"),
        }
    }
}

/// A mesh's structure and its triangles in the order of the leaves.
#[derive(Clone, Debug)]
pub struct MeshIndex {
    pub index: AnyIndex,
    /// About the mesh's centre, in canonical order.
    pub corners: Vec<Corners>,
    /// Triangle in source order.
    pub source: Vec<u32>,
}

/// Comparison structures of one kind.
#[derive(Clone, Debug)]
pub struct Forest {
    /// Over the world's entries.
    pub top: AnyIndex,
    /// By mesh; `None` for meshes that never appear.
    pub meshes: Vec<Option<MeshIndex>>,
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
    Compared(Forest),
}

impl Forests {
    pub fn bounds(&self) -> Aabb32 {
        match self {
            Forests::Wide(wide) => wide.top.bounds,
            Forests::Nested(nested) => nested.groups.bounds(DVec3::ZERO),
            Forests::Compared(forest) => forest.top.bounds(),
        }
    }

    /// Of a mesh that appears.
    pub fn mesh_bounds(&self, mesh: usize) -> Option<Aabb32> {
        match self {
            Forests::Wide(wide) => Some(wide.meshes[mesh].as_ref()?.tree.bounds),
            Forests::Nested(nested) => Some(nested.meshes[mesh].as_ref()?.tree.bounds),
            Forests::Compared(forest) => Some(forest.meshes[mesh].as_ref()?.index.bounds()),
        }
    }

    /// Of the structure over the entries.
    pub fn top_figures(&self) -> Figures {
        match self {
            Forests::Wide(wide) => wide_figures(&wide.top),
            Forests::Nested(nested) => wide_figures(&nested.groups.roots.tree),
            Forests::Compared(forest) => forest.top.figures(),
        }
    }

    /// Of all meshes' structures, in the order of the meshes.
    pub fn mesh_figures(&self) -> Vec<Figures> {
        match self {
            Forests::Wide(wide) => wide_meshes_figures(&wide.meshes),
            Forests::Nested(nested) => wide_meshes_figures(&nested.meshes),
            Forests::Compared(forest) => {
                let meshes = forest.meshes.iter().flatten();
                meshes.map(|mesh| mesh.index.figures()).collect()
            }
        }
    }

    /// Bytes by name.
    pub fn bytes(&self) -> Vec<(&'static str, usize)> {
        let [top, trees, leaves] = match self {
            Forests::Wide(wide) => wide_bytes(wide.top.bytes(), &wide.meshes),
            Forests::Nested(nested) => wide_bytes(nested.groups.bytes(), &nested.meshes),
            Forests::Compared(forest) => {
                let meshes = || forest.meshes.iter().flatten();
                let leaves = |mesh: usize| mesh * (size_of::<Corners>() + 4);
                [
                    forest.top.bytes(),
                    meshes().map(|mesh| mesh.index.bytes()).sum(),
                    meshes().map(|mesh| leaves(mesh.corners.len())).sum(),
                ]
            }
        };
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
