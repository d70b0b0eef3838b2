//! Blocks of triangles: corners gathered into columns and put in canonical
//! order, all of a block at once.

use crate::accel::wide::{Block, WIDE};
use crate::geom::triangle::Corners;
use crate::math::Aabb32;
use crate::math::lanes::Lanes;
#[cfg(not(target_feature = "avx512f"))]
use crate::math::lanes::f32x8 as Column;
#[cfg(target_feature = "avx512f")]
use crate::math::lanes::f32x16 as Column;
use crate::scene::Mesh;
use rayon::prelude::*;
use std::ops::Range;

/// One block per range of `order`.
pub(super) fn fill(mesh: &Mesh, order: &[u32], ranges: &[Range<usize>]) -> Vec<Block> {
    let mut blocks = Vec::new();
    ranges
        .par_iter()
        .with_min_len(64)
        .map(|range| {
            let ids = &order[range.clone()];
            let mut source = [u32::MAX; WIDE];
            source[..ids.len()].copy_from_slice(ids);
            block(mesh, source)
        })
        .collect_into_vec(&mut blocks);
    blocks
}

/// The block of these triangles; the first is one.
pub(super) fn block(mesh: &Mesh, source: [u32; WIDE]) -> Block {
    let mut corner = [[[0.0; WIDE]; 3]; 3];
    let mut count = 0;
    for slot in 0..WIDE {
        let used = source[slot] != u32::MAX;
        count += usize::from(used);
        let triangle = source[if used { slot } else { 0 }];
        let corners: Corners = mesh.corners(triangle as usize);
        for v in 0..3 {
            for k in 0..3 {
                corner[v][k][slot] = corners[v][k];
            }
        }
    }
    let mut columns = corner.map(|v| v.map(|k| <Column as Lanes>::load(&k)));
    // Insertion, as `canonical` does it: equal corners keep their order.
    for (a, b) in [(0, 1), (1, 2), (0, 1)] {
        let (low, high) = ordered(columns[a], columns[b]);
        columns[a] = low;
        columns[b] = high;
    }
    let mut corner = columns.map(|v| v.map(Lanes::to_array));
    let first = corner[0];
    for v in &mut corner {
        for k in 0..3 {
            v[k][count..].fill(first[k][0]);
        }
    }
    Block { corner, source }
}

/// The lesser corner first, by x, then y, then z.
#[inline(always)]
fn ordered(a: [Column; 3], b: [Column; 3]) -> ([Column; 3], [Column; 3]) {
    let less = |k: usize| Lanes::lt(b[k], a[k]);
    let same = |k: usize| Lanes::eq(b[k], a[k]);
    let swap = less(0) | same(0) & (less(1) | same(1) & less(2));
    let select = |yes: &[Column; 3], no: &[Column; 3]| {
        std::array::from_fn(|k| <Column as Lanes>::select(swap, yes[k], no[k]))
    };
    (select(&b, &a), select(&a, &b))
}

/// The box around a block's triangles.
pub(super) fn bounds(block: &Block) -> Aabb32 {
    let mut bounds = Aabb32::EMPTY;
    for k in 0..3 {
        let columns = block.corner.map(|v| <Column as Lanes>::load(&v[k]));
        let [a, b, c] = columns;
        let low = Lanes::to_array(a.min(b).min(c));
        let high = Lanes::to_array(a.max(b).max(c));
        bounds.min[k] = low.into_iter().fold(f32::INFINITY, f32::min);
        bounds.max[k] = high.into_iter().fold(f32::NEG_INFINITY, f32::max);
    }
    bounds
}
