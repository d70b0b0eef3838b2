//! Builds trees over triangles or boxes, and checks what every tree must satisfy.

use super::soups::{Triangle, row};
use lanecast::internals::accel::{
    Block, BuildQuality, Child, MAX_DEPTH, UNUSED, WIDE, WideBlas, WideBvh, WideNode, build_mesh,
};
use lanecast::internals::geom::triangle::canonical;
use lanecast::internals::math::Aabb32;
use lanecast::internals::scene::{Mesh, Meshes};

pub fn build(meshes: &Meshes) -> WideBlas {
    build_mesh(&row(meshes), BuildQuality::default())
}

/// Of high quality, checked, and compared with that of medium quality.
pub fn build_high(meshes: &Meshes) -> WideBlas {
    let high = build_mesh(&row(meshes), BuildQuality::High);
    check(&high, &row(meshes));
    let medium = build(meshes).tree.sah;
    assert!(high.tree.sah <= medium, "{} {medium}", high.tree.sah);
    high
}

pub fn around(boxes: impl IntoIterator<Item = Aabb32>) -> Aabb32 {
    boxes
        .into_iter()
        .fold(Aabb32::EMPTY, |all, b| all.union(&b))
}

/// Inner children stand side by side, and next the first one's subtree.
pub fn check_order(tree: &WideBvh) {
    let inner = |node: &WideNode| -> Vec<usize> {
        let children = node.child[..node.count as usize].iter();
        let inner = children.filter(|c| c.leaf_len().is_none());
        inner.map(|c| c.index()).collect()
    };
    for node in &tree.nodes {
        let children = inner(node);
        assert!(children.windows(2).all(|w| w[1] == w[0] + 1));
        let (Some(first), Some(last)) = (children.first(), children.last()) else {
            continue;
        };
        if let Some(below) = inner(&tree.nodes[*first]).first() {
            assert_eq!(*below, last + 1);
        }
    }
}

/// Walks the tree: each node is reached once, after its parent, and the box of
/// each child is the one around what is below. Leaves, in the tree's order.
pub fn check_tree(tree: &WideBvh, boxes: &[Aabb32]) -> Vec<std::ops::Range<usize>> {
    fn below(
        tree: &WideBvh,
        node: usize,
        depth: usize,
        boxes: &[Aabb32],
        reached: &mut [bool],
        leaves: &mut Vec<std::ops::Range<usize>>,
    ) -> Aabb32 {
        assert!(depth <= MAX_DEPTH, "depth {depth}");
        assert!(!std::mem::replace(&mut reached[node], true));
        let WideNode { child, count, .. } = &tree.nodes[node];
        let mut all = Aabb32::EMPTY;
        for c in 0..*count as usize {
            let bounds = tree.nodes[node].bounds_of(c);
            let inside = match child[c].leaf_range() {
                Some(range) => {
                    assert!(!range.is_empty() && range.len() <= Child::MAX_LEAF);
                    leaves.push(range.clone());
                    around(boxes[range].iter().copied())
                }
                None => {
                    assert!(child[c].index() > node);
                    below(tree, child[c].index(), depth + 1, boxes, reached, leaves)
                }
            };
            assert_eq!(bounds, inside, "child {c} of node {node}");
            all = all.union(&bounds);
        }
        for c in *count as usize..WIDE {
            assert_eq!(tree.nodes[node].bounds_of(c), Aabb32::EMPTY);
        }
        all
    }
    let mut reached = vec![false; tree.nodes.len()];
    let mut leaves = Vec::new();
    let all = below(tree, 0, 1, boxes, &mut reached, &mut leaves);
    assert_eq!(all, tree.bounds);
    check_order(tree);
    assert!(reached.iter().all(|r| *r));
    // Only the root may have a single child, or none.
    assert!(tree.nodes[1..].iter().all(|n| n.count >= 2));
    assert!(tree.sah.is_finite() && tree.sah >= 1.0, "{}", tree.sah);
    leaves
}

fn block_bounds(block: Block) -> Aabb32 {
    let corners = (0..WIDE).flat_map(|slot| block.corners(slot));
    around(corners.map(|c| Aabb32 { min: c, max: c }))
}

pub fn check(tree: &WideBlas, mesh: &Mesh) {
    let boxes: Vec<Aabb32> = tree.blocks.iter().map(block_bounds).collect();
    let leaves = check_tree(&tree.tree, &boxes);
    let mut used = vec![false; tree.blocks.len()];
    for block in leaves.into_iter().flatten() {
        assert!(!std::mem::replace(&mut used[block], true));
    }
    assert!(used.iter().all(|u| *u));
    let mut seen = vec![false; mesh.triangles.len()];
    for block in tree.blocks.iter() {
        assert_eq!(block.bounds(), block_bounds(block));
        let columns = block.columns([2, 0, 1]).map(|v| v.map(|x| x.to_array()));
        let count = block.sources().iter().take_while(|s| **s != UNUSED);
        let count = count.count();
        assert!(count > 0);
        for slot in 0..WIDE {
            for (column, corner) in columns.iter().zip(block.corners(slot)) {
                let lane = [1, 2, 0].map(|axis: usize| column[axis][slot].to_bits());
                assert_eq!(lane, corner.map(f32::to_bits));
            }
            let source = block.source(slot);
            if slot < count {
                assert!(!std::mem::replace(&mut seen[source as usize], true));
                let corners = canonical(mesh.corners(source as usize));
                let bits = |c: &Triangle| c.map(|p| p.map(f32::to_bits));
                assert_eq!(bits(&block.corners(slot)), bits(&corners));
            } else {
                assert_eq!(source, UNUSED);
                assert_eq!(block.corners(slot), [block.corners(0)[0]; 3]);
            }
        }
    }
    assert!(seen.iter().all(|s| *s));
}

pub fn bits(tree: &WideBvh) -> Vec<u32> {
    let mut bits = Vec::new();
    for node in &tree.nodes {
        bits.extend(node.bounds.iter().flatten().flatten().map(|x| x.to_bits()));
        for child in &node.child {
            let leaf = child.leaf_range();
            bits.push(leaf.map_or(child.index() as u32, |r| (r.start * 16 + r.len()) as u32));
        }
        bits.push(node.count);
    }
    let sah = tree.sah.to_bits();
    bits.extend([sah as u32, (sah >> 32) as u32]);
    bits
}

pub fn mesh_bits(tree: &WideBlas) -> Vec<u32> {
    let mut all = bits(&tree.tree);
    for block in &tree.blocks.indexed {
        all.extend(block.vertex.as_flattened().iter().map(|x| x.to_bits()));
        all.extend(block.index.as_flattened().iter().map(|i| u32::from(*i)));
        all.extend(block.source);
    }
    for block in &tree.blocks.unindexed {
        let corners = block.corner.as_flattened().as_flattened();
        all.extend(corners.iter().map(|x| x.to_bits()));
        all.extend(block.source);
    }
    all
}
