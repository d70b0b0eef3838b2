//! Provisional: wide trees from the binary builder.

use super::bvh::Child;
use super::sah::{Quality, linear, split_all};
use super::wide::{Block, WIDE, WideMesh, WideNode, WideTree};
use crate::geom::triangle::canonical;
use crate::math::Aabb32;
use crate::scene::Mesh;

const EMPTY: WideNode = WideNode {
    bounds: [[[0.0; WIDE]; 2]; 3],
    child: [Child::LEAF_OF_NOTHING; WIDE],
    count: 0,
};

pub fn build_boxes(boxes: &[Aabb32]) -> (WideTree, Vec<u32>) {
    wide(boxes, 4, &mut |range, _| (range.start, range.len()))
}

pub fn build_mesh(mesh: &Mesh) -> WideMesh {
    let boxes: Vec<Aabb32> = (0..mesh.triangles.len())
        .map(|i| super::corner_bounds(&mesh.corners(i)))
        .collect();
    let mut blocks = Vec::new();
    let (tree, _) = wide(&boxes, WIDE, &mut |range, order| {
        let first = blocks.len();
        for chunk in order[range].chunks(WIDE) {
            let all: Vec<_> = chunk
                .iter()
                .map(|i| canonical(mesh.corners(*i as usize)))
                .collect();
            let mut block = Block {
                corner: [[[0.0; WIDE]; 3]; 3],
                source: [u32::MAX; WIDE],
            };
            for slot in 0..WIDE {
                let corners = all.get(slot).copied().unwrap_or([all[0][0]; 3]);
                for v in 0..3 {
                    for k in 0..3 {
                        block.corner[v][k][slot] = corners[v][k];
                    }
                }
                if let Some(i) = chunk.get(slot) {
                    block.source[slot] = *i;
                }
            }
            blocks.push(block);
        }
        (first, blocks.len() - first)
    });
    WideMesh { tree, blocks }
}

fn wide(
    boxes: &[Aabb32],
    max_leaf: usize,
    leaf: &mut dyn FnMut(std::ops::Range<usize>, &[u32]) -> (usize, usize),
) -> (WideTree, Vec<u32>) {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let bounds = linear(boxes).bounds;
    let mut tree = WideTree {
        nodes: vec![EMPTY],
        bounds,
        sah: 0.0,
    };
    if boxes.is_empty() {
        return (tree, order);
    }
    let quality = Quality {
        node_cost: 1.0,
        max_leaf,
        bins: 32,
    };
    let binary = split_all(boxes, &mut order, &quality);
    let mut open = vec![(0_usize, 0_usize)];
    while let Some((from, to)) = open.pop() {
        let mut chosen = vec![from];
        while chosen.len() < WIDE {
            let inner = (0..chosen.len()).filter(|i| binary[chosen[*i]].children != 0);
            let largest = inner.reduce(|a, b| {
                let area = |i: usize| binary[chosen[i]].bounds.half_area();
                if area(b) > area(a) { b } else { a }
            });
            let Some(largest) = largest else { break };
            let children = binary[chosen[largest]].children;
            chosen[largest] = children;
            chosen.insert(largest + 1, children + 1);
        }
        let mut node = EMPTY;
        node.count = chosen.len() as u32;
        for (i, c) in chosen.iter().enumerate() {
            let child = &binary[*c];
            for axis in 0..3 {
                node.bounds[axis][0][i] = child.bounds.min[axis];
                node.bounds[axis][1][i] = child.bounds.max[axis];
            }
            node.child[i] = if child.children == 0 {
                let (first, count) = leaf(child.range.clone(), &order);
                Child::leaf(first, count)
            } else {
                let index = tree.nodes.len();
                tree.nodes.push(EMPTY);
                open.push((*c, index));
                Child::node(index)
            };
        }
        tree.nodes[to] = node;
    }
    (tree, order)
}
