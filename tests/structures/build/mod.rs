//! Wide trees: every primitive is in one leaf, every box contains what is below it, and the
//! bits of a tree depend on its primitives alone. Trees of high quality, too, which cost no
//! more than others.

mod blocks;
mod check;
mod qualities;
mod refit;
mod soups;

use crate::common::property;
use check::{around, build, build_high, check, check_tree, mesh_bits};
use lanecast::internals::accel::{BuildQuality, WIDE, build_boxes, build_mesh};
use lanecast::internals::math::Aabb32;
use lanecast::internals::scene::Meshes;
use proptest::prelude::*;
use soups::{Triangle, cloud, degenerate, numbers, row, sheet, soup};

#[test]
fn every_triangle_stands_in_one_block() {
    for count in [1, 2, WIDE - 1, WIDE, WIDE + 1, 100, 1000, 30_000] {
        let meshes = soup(&cloud(count));
        let tree = build(&meshes);
        check(&tree, &row(&meshes));
        build_high(&meshes);
    }
}

#[test]
fn no_triangles_make_one_node_without_children() {
    let meshes = soup(&[]);
    let tree = build(&meshes);
    assert_eq!(tree.tree.nodes.len(), 1);
    assert_eq!(tree.tree.nodes[0].count, 0);
    assert!(tree.blocks.is_empty());
    assert!(build_high(&meshes).blocks.is_empty());
    let (tree, order) = build_boxes(&[], BuildQuality::default());
    assert_eq!((tree.nodes.len(), order.len()), (1, 0));
}

#[test]
fn bits_do_not_depend_on_threads() {
    let meshes = soup(&cloud(70_000));
    let of = |threads: usize, quality| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let build = || mesh_bits(&build_mesh(&row(&meshes), quality));
        pool.build().unwrap().install(build)
    };
    let [medium, high] = BuildQuality::ALL.map(|quality| {
        let one = of(1, quality);
        for threads in [2, 3, 5] {
            assert!(
                of(threads, quality) == one,
                "{threads} threads, {quality:?}"
            );
        }
        one
    });
    assert!(medium != high);
}

#[test]
fn degenerate_triangles_make_valid_trees() {
    for count in [1, WIDE, WIDE + 1, 300, 20_000] {
        for (what, triangles) in degenerate(count) {
            // As they are: a scene may place them anywhere.
            let meshes = Meshes {
                positions: triangles.concat(),
                ..soup(&triangles)
            };
            let tree = build(&meshes);
            eprintln!("{what}, {count}");
            check(&tree, &row(&meshes));
            build_high(&meshes);
            // Blocks and nodes are filled all the same, but where the least of
            // many sizes is worth a leaf of its own.
            if ["nested", "powers"].contains(&what) {
                continue;
            }
            let blocks = count.div_ceil(WIDE);
            assert!(
                tree.blocks.len() <= 2 * blocks + 1,
                "{what}: {}",
                tree.blocks.len()
            );
            assert!(tree.tree.nodes.len() <= blocks.div_ceil(3), "{what}");
        }
    }
}

#[test]
fn parts_without_area_fill_their_nodes() {
    let mut next = numbers(2);
    let mut triangles: Vec<Triangle> = (0..20_000)
        .map(|_| std::array::from_fn(|_| [next(), 0.0, 0.0]))
        .collect();
    triangles.extend(cloud(100));
    let meshes = soup(&triangles);
    let tree = build(&meshes);
    check(&tree, &row(&meshes));
    let children: u32 = tree.tree.nodes.iter().map(|n| n.count).sum();
    assert!(children as usize > tree.tree.nodes.len() * WIDE / 2);
}

#[test]
fn boxes_stand_in_short_leaves_once() {
    let box_of = |t: &Triangle| around(t.iter().map(|p| Aabb32 { min: *p, max: *p }));
    let mut cases: Vec<Vec<Aabb32>> = [1, 3, 4, 5, 500, 20_000]
        .iter()
        .map(|n| cloud(*n).iter().map(box_of).collect())
        .collect();
    cases.extend(
        degenerate(300)
            .iter()
            .map(|(_, t)| t.iter().map(box_of).collect()),
    );
    for (boxes, quality) in cases
        .iter()
        .flat_map(|boxes| BuildQuality::ALL.map(|quality| (boxes, quality)))
    {
        let (tree, order) = build_boxes(boxes, quality);
        let entries: Vec<Aabb32> = order.iter().map(|i| boxes[*i as usize]).collect();
        let leaves = check_tree(&tree, &entries);
        assert!(leaves.iter().all(|l| l.len() <= 4));
        let mut all: Vec<usize> = leaves.into_iter().flatten().collect();
        all.sort();
        assert!(all.iter().copied().eq(0..boxes.len()));
        let mut sorted = order.clone();
        sorted.sort();
        assert!(sorted.iter().enumerate().all(|(i, o)| i == *o as usize));
    }
}

#[test]
fn boxes_without_bounds_or_content_stand_in_the_tree() {
    let mut boxes: Vec<Aabb32> = vec![Aabb32::EVERYTHING; 20];
    boxes.extend([Aabb32::EMPTY; 20]);
    boxes.extend((0..20).map(|i| Aabb32 {
        min: [i as f32; 3],
        max: [i as f32 + 0.5; 3],
    }));
    for quality in BuildQuality::ALL {
        let (tree, order) = build_boxes(&boxes, quality);
        let entries: Vec<Aabb32> = order.iter().map(|i| boxes[*i as usize]).collect();
        let leaves = check_tree(&tree, &entries);
        assert_eq!(leaves.iter().map(|l| l.len()).sum::<usize>(), 60);
    }
}

#[test]
fn a_tree_beats_chance() {
    // Blocks are patches of the sheet.
    let triangles = sheet();
    let meshes = soup(&triangles);
    let tree = build(&meshes);
    check(&tree, &row(&meshes));
    let fill = triangles.len() as f64 / (tree.blocks.len() * WIDE) as f64;
    assert!(fill > 0.85, "{fill}");
    // One block where the sheet is met, and the levels above it.
    let levels = (tree.blocks.len() as f64).log(WIDE as f64);
    assert!(tree.tree.sah < 2.0 * (1.5 + levels), "{}", tree.tree.sah);
}

proptest! {
    #![proptest_config(property(256))]

    #[test]
    fn any_triangles_make_valid_trees(
        corners in prop::collection::vec(prop::array::uniform3(-8_i32..8), 0..400),
        shift in -60_i32..60,
    ) {
        // Few distinct numbers: many ties, touching and coinciding triangles.
        let scale = 2.0_f32.powi(shift);
        let points: Vec<[f32; 3]> = corners.iter().map(|p| p.map(|x| x as f32 * scale)).collect();
        let triangles: Vec<Triangle> = points.as_chunks().0.to_vec();
        let meshes = soup(&triangles);
        let tree = build(&meshes);
        check(&tree, &row(&meshes));
        let whole = around(triangles.iter().flatten().map(|p| Aabb32 { min: *p, max: *p }));
        prop_assert_eq!(tree.tree.bounds, whole);
        prop_assert_eq!(build_high(&meshes).tree.bounds, whole);
    }

    /// A power of two changes no decision.
    #[test]
    fn trees_scale(seed in any::<u64>(), shift in -100_i32..100) {
        let mut next = numbers(seed);
        let triangles: Vec<Triangle> = (0..500)
            .map(|_| std::array::from_fn(|_| std::array::from_fn(|_| next() + 0.5)))
            .collect();
        let scale = 2.0_f32.powi(shift);
        let scaled: Vec<Triangle> = triangles.iter().map(|t| t.map(|p| p.map(|x| x * scale))).collect();
        let sources = |triangles: &[Triangle]| -> Vec<_> {
            build(&soup(triangles)).blocks.iter().map(|b| *b.sources()).collect()
        };
        prop_assert_eq!(sources(&triangles), sources(&scaled));
    }
}
