//! Refit of trees: new boxes for the same tree, from the leaves up.
//!
//! Both functions return the new expected cost. The caller chooses at which multiple of the
//! cost that the tree was built with it is built again (Lauterbach et al., RT-DEFORM, 2006).

use super::blocks;
use super::collapse::expected_cost;
use super::costs::{INSTANCES, TRIANGLES};
use crate::accel::wide_bvh::{WideBlas, WideBvh, WideNode};
use crate::math::Aabb32;
use crate::scene::Mesh;
use rayon::prelude::*;

/// Refits a tree to the mesh's vertices; the triangles must be those that the tree was built
/// over.
pub fn refit(tree: &mut WideBlas, mesh: &Mesh) -> f64 {
    if !blocks::renew(mesh, &mut tree.blocks) {
        let old = &tree.blocks;
        let triangles = |block: usize| *old.get(block).sources();
        tree.blocks = blocks::lay_out(mesh, old.len(), triangles, &mut tree.tree);
    }
    let blocks = 0..tree.blocks.len();
    let bounds = |block: usize| tree.blocks.get(block).bounds();
    let boxes: Vec<Aabb32> = blocks
        .into_par_iter()
        .with_min_len(64)
        .map(bounds)
        .collect();
    from_leaves(&mut tree.tree, &boxes);
    tree.tree.sah = expected_cost(&tree.tree, &TRIANGLES);
    tree.tree.sah
}

/// Refits a tree to new boxes, which are in the order of its leaves.
pub fn refit_boxes(tree: &mut WideBvh, boxes: &[Aabb32]) -> f64 {
    from_leaves(tree, boxes);
    tree.sah = expected_cost(tree, &INSTANCES);
    tree.sah
}

/// Computes all nodes' boxes from those of the blocks or entries in the leaves.
fn from_leaves(tree: &mut WideBvh, boxes: &[Aabb32]) {
    let around = |boxes: &[Aabb32]| boxes.iter().fold(Aabb32::EMPTY, |all, b| all.union(b));
    // Children come behind their parents.
    for i in (0..tree.nodes.len()).rev() {
        let mut node = tree.nodes[i];
        for c in 0..node.count as usize {
            let child = node.child[c];
            let bounds = match child.leaf_range() {
                Some(range) => around(&boxes[range]),
                None => whole(&tree.nodes[child.index()]),
            };
            node.set_bounds(c, &bounds);
        }
        tree.nodes[i] = node;
    }
    tree.bounds = whole(&tree.nodes[0]);
}

/// Returns the box around a node's children.
fn whole(node: &WideNode) -> Aabb32 {
    let children = 0..node.count as usize;
    children.fold(Aabb32::EMPTY, |all, c| all.union(&node.bounds_of(c)))
}
