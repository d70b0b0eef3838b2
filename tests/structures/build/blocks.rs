//! Blocks of triangles that share vertices keep each vertex once, without losing a bit.

use super::check::{build, check, mesh_bits};
use super::soups::{Triangle, cloud, numbers, row, sheet, soup};
use lanecast::internals::accel::{VERTICES, WIDE, refit};

/// Bent, so that square patches cost less than strips.
fn bowl() -> Vec<Triangle> {
    let bent = |[x, y, _]: [f32; 3]| [x, y, 0.004 * (x * x + y * y)];
    sheet().into_iter().map(|t| t.map(bent)).collect()
}

#[test]
fn neighbours_share_their_vertices() {
    let meshes = soup(&bowl());
    let tree = build(&meshes);
    check(&tree, &row(&meshes));
    let (shared, all) = (tree.blocks.indexed.len(), tree.blocks.len());
    assert!(shared as f64 > 0.8 * all as f64, "{shared} of {all}");
    // A block with all corners has 40 bytes for each of its triangles.
    let bytes = tree.blocks.bytes() as f64 / (1 << 15) as f64;
    assert!(bytes < [27.0, 36.0][usize::from(WIDE == 8)], "{bytes}");
}

#[test]
fn triangles_apart_keep_their_corners() {
    let meshes = soup(&cloud(3000));
    let blocks = build(&meshes).blocks;
    let full = |sources: &[u32]| sources.iter().filter(|s| **s != u32::MAX).count() * 3;
    assert!(blocks.indexed.iter().all(|b| full(&b.source) <= VERTICES));
    assert!(blocks.unindexed.iter().all(|b| full(&b.source) > VERTICES));
    assert!(!blocks.unindexed.is_empty());
}

/// Zeros that are equal, and have not the same bits.
#[test]
fn zeros_keep_their_signs() {
    let zero = |i: usize| [0.0, -0.0][i % 2];
    let triangles: Vec<Triangle> = (0..4)
        .map(|i| {
            [
                [zero(i), 0.0, 1.0],
                [1.0, zero(i / 2), 0.0],
                [0.0, 1.0, 0.0],
            ]
        })
        .collect();
    let meshes = soup(&triangles);
    let tree = build(&meshes);
    assert_eq!(tree.blocks.indexed.len(), 1);
    check(&tree, &row(&meshes));
}

/// A leaf's blocks stand side by side, so they are of one kind.
#[test]
fn a_heap_of_triangles_is_one_leaf() {
    let mut next = numbers(4);
    let mut any = || std::array::from_fn(|_| next());
    let one: Triangle = [any(), any(), any()];
    let mut triangles = bowl();
    triangles.extend(vec![one; 3 * WIDE]);
    let meshes = soup(&triangles);
    let tree = build(&meshes);
    check(&tree, &row(&meshes));
    let longest = tree.tree.leaves().iter().map(|leaf| leaf.len()).max();
    assert!(longest >= Some(2), "{longest:?}");
}

#[test]
fn a_refit_may_tear_neighbours_apart() {
    let mut meshes = soup(&bowl());
    let mut tree = build(&meshes);
    let (built, apart) = (mesh_bits(&tree), tree.blocks.unindexed.len());
    refit(&mut tree, &row(&meshes));
    assert!(mesh_bits(&tree) == built);
    // In one corner.
    let torn = |t: &[[f32; 3]]| t[0][0] < 20.0 && t[0][1] < 20.0;
    let mut next = numbers(9);
    for triangle in meshes.positions.chunks_mut(3).filter(|t| torn(t)) {
        triangle.iter_mut().for_each(|p| p[2] = next());
    }
    refit(&mut tree, &row(&meshes));
    check(&tree, &row(&meshes));
    let now = tree.blocks.unindexed.len();
    assert!(
        now > apart + 300 / WIDE && !tree.blocks.indexed.is_empty(),
        "{apart} {now}"
    );
}
