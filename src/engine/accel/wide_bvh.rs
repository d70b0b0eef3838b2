//! The wide BVH. A node has as many boxes, and a block as many triangles, as one register
//! has f32 lanes.
//!
//! A ray is tested against all children of a node, or all triangles of a block, at once; a
//! beam is tested as one volume (Wald, Benthin, Boulos 2008; Benthin et al. 2012). Boxes are
//! f32 and contain their shapes; triangles have the mesh's own coordinates.

use super::baselines::bvh4::Child;
use super::block::Blocks;
use crate::math::Aabb32;

/// The children of a node and the triangles of a block: the f32 lanes of one register, at
/// least eight.
pub const WIDE: usize = if cfg!(target_feature = "avx512f") {
    16
} else {
    8
};

/// A node. Children from `count` on are absent.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct WideNode {
    /// `[axis][lower, upper][child]`.
    pub bounds: [[[f32; WIDE]; 2]; 3],
    /// By child: a node, or a leaf's range of blocks (of a mesh's tree) or of entries.
    pub child: [Child; WIDE],
    pub count: u32,
}

impl WideNode {
    /// Returns the box of a child.
    pub fn bounds_of(&self, child: usize) -> Aabb32 {
        let side = |side: usize| std::array::from_fn(|k| self.bounds[k][side][child]);
        Aabb32 {
            min: side(0),
            max: side(1),
        }
    }

    pub fn set_bounds(&mut self, child: usize, bounds: &Aabb32) {
        for k in 0..3 {
            self.bounds[k][0][child] = bounds.min[k];
            self.bounds[k][1][child] = bounds.max[k];
        }
    }
}

/// A tree of [`WideNode`]s, the root first.
#[derive(Clone, Debug)]
pub struct WideBvh {
    /// At least one node; a tree over nothing is one node without children.
    pub nodes: Vec<WideNode>,
    pub bounds: Aabb32,
    /// The expected cost of a random ray that meets the root, in box tests of one node
    /// (surface area heuristic).
    pub sah: f64,
}

impl WideBvh {
    pub fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<WideNode>()
    }

    /// Returns the range of each leaf.
    pub fn leaves(&self) -> Vec<std::ops::Range<usize>> {
        let children = self.nodes.iter().flat_map(|n| &n.child[..n.count as usize]);
        children.filter_map(|c| c.leaf_range()).collect()
    }
}

/// The wide BVH of one mesh; its leaves are ranges of blocks.
#[derive(Clone, Debug)]
pub struct WideBlas {
    pub tree: WideBvh,
    pub blocks: Blocks,
}

impl WideBlas {
    pub fn bytes(&self) -> usize {
        self.tree.bytes() + self.blocks.bytes()
    }
}
