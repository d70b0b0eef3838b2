//! Blocks of triangles: corners gathered into columns and put in canonical
//! order, all of a block at once; then each vertex kept once, where few enough
//! are left.

use crate::accel::baselines::bvh4::Child;
use crate::accel::block::{Apart, Blocks, Shared, UNUSED, VERTICES};
use crate::accel::wide_bvh::{WIDE, WideBvh};
use crate::geom::triangle::canonical_each;
use crate::math::lanes::{Lanes, Mask, Register};
use crate::scene::Mesh;
use rayon::prelude::*;

/// Blocks that a thread makes at a time.
const CHUNK: usize = 512;

/// The blocks of a tree whose leaves number them from 0 to `count`: they are
/// numbered anew, by kind, each leaf's in a row. `triangles`: of a block,
/// [`UNUSED`] behind the last.
pub(super) fn lay_out(
    mesh: &Mesh,
    count: usize,
    triangles: impl Fn(usize) -> [u32; WIDE] + Sync,
    tree: &mut WideBvh,
) -> Blocks {
    // A leaf of several blocks is a heap of triangles: of one kind, at least.
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
            let mut is_shared = Vec::with_capacity(numbers.len());
            blocks.shared.reserve_exact(numbers.len());
            for number in numbers {
                let block = apart(mesh, triangles(number));
                let made = if alone[number] { shared(&block) } else { None };
                is_shared.push(made.is_some());
                match made {
                    Some(block) => blocks.shared.push(block),
                    None => blocks.apart.push(block),
                }
            }
            (blocks, is_shared)
        })
        .collect();

    let total = chunks.iter().map(|(chunk, _)| chunk.shared.len()).sum();
    let mut blocks = Blocks::default();
    blocks.shared.reserve_exact(total);
    blocks.apart.reserve_exact(count - total);
    let mut number = Vec::with_capacity(count);
    let mut next = [total, 0];
    for (chunk, is_shared) in chunks {
        blocks.shared.extend_from_slice(&chunk.shared);
        blocks.apart.extend_from_slice(&chunk.apart);
        for shared in is_shared {
            number.push(next[usize::from(shared)]);
            next[usize::from(shared)] += 1;
        }
    }
    for child in tree.nodes.iter_mut().flat_map(|node| &mut node.child) {
        if let Some(leaf) = child.leaf_range().filter(|leaf| !leaf.is_empty()) {
            *child = Child::leaf(number[leaf.start], leaf.len());
        }
    }
    blocks
}

/// Brings the blocks to the mesh's vertices; not, where a block's vertices have
/// become too many for it.
pub(super) fn renew(mesh: &Mesh, blocks: &mut Blocks) -> bool {
    let fit = blocks
        .shared
        .par_iter_mut()
        .with_min_len(64)
        .map(|block| {
            let made = shared(&apart(mesh, block.source));
            made.is_some_and(|made| {
                *block = made;
                true
            })
        })
        .reduce(|| true, |a, b| a & b);
    let others = blocks.apart.par_iter_mut().with_min_len(64);
    others.for_each(|block| *block = apart(mesh, block.source));
    fit
}

/// The block of these triangles; the first is one.
fn apart(mesh: &Mesh, source: [u32; WIDE]) -> Apart {
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
    Apart { corner, source }
}

/// The same block with each vertex once; `None` if they are too many.
fn shared(block: &Apart) -> Option<Shared> {
    let corner = |v: usize, slot: usize| block.corner[v].map(|axis| axis[slot]);
    let mut made = Shared {
        vertex: corner(0, 0).map(|x| [x; VERTICES]),
        at: [[0; WIDE]; 3],
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
            made.at[v][slot] = at as u8;
        }
    }
    Some(made)
}

/// Which of the first `count` vertices has exactly these bits.
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
    // Zeros of both signs are equal.
    while same != 0 {
        let at = same.trailing_zeros() as usize;
        if (0..3).all(|k| vertex[k][at].to_bits() == place[k].to_bits()) {
            return Some(at);
        }
        same &= same - 1;
    }
    None
}
