//! Wide trees: as many boxes to a node as one register has f32 lanes, and
//! triangles in blocks of as many, in columns.
//!
//! One ray meets all children of a node, or all triangles of a block, at once;
//! a tile of rays meets them as one volume (Wald, Benthin, Boulos 2008; Benthin
//! et al. 2012). Trees hold f32 boxes that contain what they stand for; the
//! triangles are the mesh's own numbers.

use super::baselines::bvh4::Child;
use super::block::Blocks;
use crate::math::Aabb32;

/// Children of a node and triangles of a block: f32 lanes of one register, at
/// least eight.
pub const WIDE: usize = if cfg!(target_feature = "avx512f") {
    16
} else {
    8
};

/// Boxes by axis, then lower and upper bounds, then child. Children from
/// `count` on are absent.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct WideNode {
    /// `[axis][lower, upper][child]`.
    pub bounds: [[[f32; WIDE]; 2]; 3],
    /// A node, or a leaf's range: of blocks in a mesh's tree, of entries in a
    /// tree over entries.
    pub child: [Child; WIDE],
    pub count: u32,
}

impl WideNode {
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
    /// Never empty: a tree over nothing is one node without children.
    pub nodes: Vec<WideNode>,
    pub bounds: Aabb32,
    /// Expected cost of a random ray, in box tests of one node (surface area
    /// heuristic).
    pub sah: f64,
}

impl WideBvh {
    pub fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<WideNode>()
    }

    /// The range of each leaf.
    pub fn leaves(&self) -> Vec<std::ops::Range<usize>> {
        let children = self.nodes.iter().flat_map(|n| &n.child[..n.count as usize]);
        children.filter_map(|c| c.leaf_range()).collect()
    }
}

/// A mesh's tree; its leaves are ranges of blocks.
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
