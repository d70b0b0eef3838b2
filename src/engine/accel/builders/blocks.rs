//! Builders of triangle blocks. Corners are gathered into columns and put in canonical
//! order, a block at a time; where few enough distinct vertices remain, the block becomes an
//! indexed one.

use crate::accel::baselines::bvh4::Child;
use crate::accel::block::{Blocks, IndexedBlock, UNUSED, UnindexedBlock, VERTICES};
use crate::accel::wide_bvh::{WIDE, WideBvh};
use crate::geom::triangle::canonical_each;
use crate::math::lanes::{Lanes, Mask, Register};
use crate::scene::Mesh;
use rayon::prelude::*;

/// Blocks that a thread builds at a time.
const CHUNK: usize = 512;

/// Builds the blocks of a tree whose leaves number them from 0 to `count`. Blocks are
/// renumbered by kind, those of one leaf in a row, and the leaves follow. `triangles` returns
/// the triangles of a block, and [`UNUSED`] behind the last.
pub(super) fn lay_out(
    mesh: &Mesh,
    count: usize,
    triangles: impl Fn(usize) -> [u32; WIDE] + Sync,
    tree: &mut WideBvh,
) -> Blocks {
    // The blocks of a leaf must be of one kind to be numbered in a row. A leaf of several
    // blocks holds triangles that lie close together, and none of its blocks is indexed.
    let mut alone = vec![true; count];
    for leaf in tree.leaves() {
        if leaf.len() > 1 {
            alone[leaf].fill(false);
        }
    }
    let chunks: Vec<(Blocks, Vec<bool>)> = (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let mut blocks = Blocks::default();
            let numbers = chunk * CHUNK..((chunk + 1) * CHUNK).min(count);
            let mut is_indexed = Vec::with_capacity(numbers.len());
            blocks.indexed.reserve_exact(numbers.len());
            for number in numbers {
                let block = gather(mesh, triangles(number));
                let made = if alone[number] { indexed(&block) } else { None };
                is_indexed.push(made.is_some());
                match made {
                    Some(block) => blocks.indexed.push(block),
                    None => blocks.unindexed.push(block),
                }
            }
            (blocks, is_indexed)
        })
        .collect();

    let total = chunks.iter().map(|(chunk, _)| chunk.indexed.len()).sum();
    let mut blocks = Blocks::default();
    blocks.indexed.reserve_exact(total);
    blocks.unindexed.reserve_exact(count - total);
    let mut number = Vec::with_capacity(count);
    let mut next = [total, 0];
    for (chunk, is_indexed) in chunks {
        blocks.indexed.extend_from_slice(&chunk.indexed);
        blocks.unindexed.extend_from_slice(&chunk.unindexed);
        for indexed in is_indexed {
            number.push(next[usize::from(indexed)]);
            next[usize::from(indexed)] += 1;
        }
    }
    for child in tree.nodes.iter_mut().flat_map(|node| &mut node.child) {
        if let Some(leaf) = child.leaf_range().filter(|leaf| !leaf.is_empty()) {
            *child = Child::leaf(number[leaf.start], leaf.len());
        }
    }
    blocks
}

/// Updates the blocks to the mesh's vertices. Returns false if an indexed block would have
/// too many distinct vertices now; its contents are then stale.
pub(super) fn renew(mesh: &Mesh, blocks: &mut Blocks) -> bool {
    let fit = blocks
        .indexed
        .par_iter_mut()
        .with_min_len(64)
        .map(|block| {
            let made = indexed(&gather(mesh, block.source));
            made.is_some_and(|made| {
                *block = made;
                true
            })
        })
        .reduce(|| true, |a, b| a & b);
    let others = blocks.unindexed.par_iter_mut().with_min_len(64);
    others.for_each(|block| *block = gather(mesh, block.source));
    fit
}

/// Gathers triangles into a block; the first slot must be used.
fn gather(mesh: &Mesh, source: [u32; WIDE]) -> UnindexedBlock {
    let mut corner = [[[0.0; WIDE]; 3]; 3];
    let mut count = 0;
    for slot in 0..WIDE {
        let used = source[slot] != UNUSED;
        count += usize::from(used);
        let triangle = source[if used { slot } else { 0 }];
        let corners = mesh.corners(triangle as usize);
        for v in 0..3 {
            for k in 0..3 {
                corner[v][k][slot] = corners[v][k];
            }
        }
    }
    let columns = canonical_each(corner.map(|v| v.map(|k| <Register as Lanes>::load(&k))));
    let mut corner = columns.map(|v| v.map(Lanes::to_array));
    let first = corner[0];
    for v in &mut corner {
        for k in 0..3 {
            v[k][count..].fill(first[k][0]);
        }
    }
    UnindexedBlock { corner, source }
}

/// Converts a block to an indexed one, or returns `None` if it has too many vertices.
fn indexed(block: &UnindexedBlock) -> Option<IndexedBlock> {
    let corner = |v: usize, slot: usize| block.corner[v].map(|axis| axis[slot]);
    let mut made = IndexedBlock {
        vertex: corner(0, 0).map(|x| [x; VERTICES]),
        index: [[0; WIDE]; 3],
        source: block.source,
    };
    let mut count = 1;
    let used = block.source.iter().take_while(|s| **s != UNUSED).count();
    for slot in 0..used {
        for v in 0..3 {
            let place = corner(v, slot);
            let at = match find(&made.vertex, count, place) {
                Some(at) => at,
                None if count == VERTICES => return None,
                None => {
                    for k in 0..3 {
                        made.vertex[k][count] = place[k];
                    }
                    count += 1;
                    count - 1
                }
            };
            made.index[v][slot] = at as u8;
        }
    }
    Some(made)
}

/// Finds the vertex among the first `count` that has exactly the bits of `place`.
#[inline(always)]
fn find(vertex: &[[f32; VERTICES]; 3], count: usize, place: [f32; 3]) -> Option<usize> {
    let mut same = 0;
    for first in (0..VERTICES).step_by(WIDE) {
        let equal = |k: usize| {
            let all = <Register as Lanes>::load(&vertex[k][first..]);
            Lanes::eq(all, Register::splat(place[k]))
        };
        same |= (equal(0) & equal(1) & equal(2)).bits() << first;
    }
    same &= ((1_u64 << count) - 1) as u32;
    // Zeros of both signs compare equal but have different bits.
    while same != 0 {
        let at = same.trailing_zeros() as usize;
        if (0..3).all(|k| vertex[k][at].to_bits() == place[k].to_bits()) {
            return Some(at);
        }
        same &= same - 1;
    }
    None
}
