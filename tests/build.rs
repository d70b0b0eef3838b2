//! Wide trees: every primitive stands in a leaf once, every box contains what
//! is below it, and the tree's bits depend on the primitives alone. Of trees of
//! high quality too, which cost no more than others.

mod common;

use common::{ALL_AOVS, EVERYTHING, hash};
use glam::DVec3;
use lanecast::accel::{
    Block, BuildQuality, Child, MAX_DEPTH, Structure, WIDE, WideMesh, WideNode, WideTree, World,
    build_boxes, build_mesh, refit, refit_boxes,
};
use lanecast::geom::triangle::canonical;
use lanecast::math::Aabb32;
use lanecast::measure::generate::{Generated, building, needles};
use lanecast::plan::{Arithmetic, Kernels};
use lanecast::render::{Progress, RenderConfig, View, render};
use lanecast::scene::{
    Appearances, Camera, Edge, Falloff, Light, Mesh, MeshData, Meshes, SceneBuilder,
};
use proptest::prelude::*;

type Triangle = [[f32; 3]; 3];

/// A mesh with three vertices of its own per triangle.
fn soup(triangles: &[Triangle]) -> Meshes {
    let mut meshes = Meshes::default();
    let corners = triangles.iter().flatten();
    let count = triangles.len() as u32;
    meshes.push(&MeshData {
        positions: corners.map(|c| c.map(f64::from)).collect(),
        triangles: (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        ..MeshData::default()
    });
    meshes
}

fn row(meshes: &Meshes) -> Mesh<'_> {
    meshes.row(lanecast::scene::MeshId(0))
}

fn build(meshes: &Meshes) -> WideMesh {
    build_mesh(&row(meshes), BuildQuality::default())
}

/// Of high quality, checked, and compared with that of medium quality.
fn build_high(meshes: &Meshes) -> WideMesh {
    let high = build_mesh(&row(meshes), BuildQuality::High);
    check(&high, &row(meshes));
    let medium = build(meshes).tree.sah;
    assert!(high.tree.sah <= medium, "{} {medium}", high.tree.sah);
    high
}

fn generated(mesh: Generated, triangles: u64) -> MeshData {
    let set = mesh.mesh(triangles);
    MeshData {
        positions: set.positions.iter().map(|p| p.map(f64::from)).collect(),
        triangles: set.triangles,
        ..MeshData::default()
    }
}

/// Numbers in 0..1, the same ones every time.
fn numbers(seed: u64) -> impl FnMut() -> f32 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 40) as f32 / (1 << 24) as f32
    }
}

/// Small triangles about points that crowd near the middle.
fn cloud(count: usize) -> Vec<Triangle> {
    let mut next = numbers(7);
    let corner =
        |middle: [f32; 3], next: &mut dyn FnMut() -> f32| middle.map(|x| x + 0.02 * (next() - 0.5));
    (0..count)
        .map(|_| {
            let middle = std::array::from_fn(|_| (next() - 0.5) * next());
            std::array::from_fn(|_| corner(middle, &mut next))
        })
        .collect()
}

fn around(boxes: impl IntoIterator<Item = Aabb32>) -> Aabb32 {
    boxes
        .into_iter()
        .fold(Aabb32::EMPTY, |all, b| all.union(&b))
}

/// Inner children stand side by side, and next the first one's subtree.
fn check_order(tree: &WideTree) {
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
fn check_tree(tree: &WideTree, boxes: &[Aabb32]) -> Vec<std::ops::Range<usize>> {
    fn below(
        tree: &WideTree,
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

fn block_bounds(block: &Block) -> Aabb32 {
    let corners = (0..WIDE).flat_map(|slot| block.corners(slot));
    around(corners.map(|c| Aabb32 { min: c, max: c }))
}

fn check(tree: &WideMesh, mesh: &Mesh) {
    let boxes: Vec<Aabb32> = tree.blocks.iter().map(block_bounds).collect();
    let leaves = check_tree(&tree.tree, &boxes);
    let mut used = vec![false; tree.blocks.len()];
    for block in leaves.into_iter().flatten() {
        assert!(!std::mem::replace(&mut used[block], true));
    }
    assert!(used.iter().all(|u| *u));
    let mut seen = vec![false; mesh.triangles.len()];
    for block in &tree.blocks {
        let count = block.source.iter().take_while(|s| **s != u32::MAX).count();
        assert!(count > 0);
        for slot in 0..WIDE {
            let source = block.source[slot];
            if slot < count {
                assert!(!std::mem::replace(&mut seen[source as usize], true));
                let corners = canonical(mesh.corners(source as usize));
                let bits = |c: &Triangle| c.map(|p| p.map(f32::to_bits));
                assert_eq!(bits(&block.corners(slot)), bits(&corners));
            } else {
                assert_eq!(source, u32::MAX);
                assert_eq!(block.corners(slot), [block.corners(0)[0]; 3]);
            }
        }
    }
    assert!(seen.iter().all(|s| *s));
}

fn bits(tree: &WideTree) -> Vec<u32> {
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

fn mesh_bits(tree: &WideMesh) -> Vec<u32> {
    let mut all = bits(&tree.tree);
    for block in &tree.blocks {
        all.extend(block.corner.iter().flatten().flatten().map(|x| x.to_bits()));
        all.extend(block.source);
    }
    all
}

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
fn subtrees_move_where_that_pays() {
    let mut meshes = Meshes::default();
    meshes.push(&generated(Generated::Building, 50_000));
    let [medium, high] = [build(&meshes), build_high(&meshes)];
    let [a, b] = [&medium, &high].map(|tree| tree.tree.sah);
    assert!(b < 0.99 * a, "{a} {b}");
    // Blocks are as full as before.
    let [a, b] = [&medium, &high].map(|tree| tree.blocks.len());
    assert!(b as f64 <= 1.01 * a as f64, "{a} {b}");
}

/// What is met, and every bit of it, does not depend on where subtrees stand.
#[test]
fn qualities_show_the_same_picture() {
    let mut scene = SceneBuilder::default();
    for (i, mesh) in Generated::ALL.into_iter().enumerate() {
        let mesh = scene.mesh("", &generated(mesh, 8000));
        for k in 0..8 {
            let map = glam::DAffine3::from_scale_rotation_translation(
                DVec3::splat(0.3),
                glam::DQuat::from_rotation_x(f64::from(k)),
                DVec3::new(
                    i as f64 - 1.0,
                    f64::from(k % 3) * 0.6 - 0.6,
                    f64::from(k) * -0.2,
                ),
            );
            let transform = scene.transform(map.into());
            scene.instance("", Edge::shape(mesh).transform(transform));
        }
    }
    let eye = DVec3::new(0.2, 0.5, 4.0);
    let camera = Camera::perspective(eye, DVec3::ZERO, DVec3::Y, 40.0);
    scene.camera("", camera);
    scene.light(Light::Point {
        position: DVec3::new(3.0, 4.0, 5.0),
        intensity: [60.0; 3],
        falloff: Falloff::InverseSquare,
    });
    let scene = scene.finish().unwrap();
    let appearances = Appearances::of(&scene).unwrap();
    let of = |quality, structure| {
        let world = World::build_to(quality, &scene, &appearances, structure);
        let view = View {
            world: &world,
            kernels: Kernels {
                arithmetic: Arithmetic::F64,
                lanes: 1,
                needs: EVERYTHING,
            },
            camera,
            lights: &scene.lights,
        };
        let config = RenderConfig {
            width: 160,
            height: 120,
            aovs: ALL_AOVS,
            ..RenderConfig::default()
        };
        let rendered = render(&view, &config, false, &Progress::default()).unwrap();
        assert!(rendered.counts.primary_hits > 3000);
        let meshes = world.forest.mesh_figures();
        let cost: f64 = meshes.iter().map(|mesh| mesh.sah).sum();
        (hash(&rendered), cost)
    };
    let medium = of(BuildQuality::Medium, Structure::Bvh);
    for structure in [Structure::Bvh, Structure::Nested, Structure::ItemBuffer] {
        let high = of(BuildQuality::High, structure);
        assert_eq!(high.0, medium.0, "{structure:?}");
        // And it was another tree.
        assert!(high.1 < medium.1, "{structure:?}: {} {}", high.1, medium.1);
    }
}

#[test]
fn generated_meshes_are_as_large_as_was_asked_for() {
    for mesh in Generated::ALL {
        for asked in [20_000, 300_000] {
            let set = mesh.mesh(asked);
            let made = set.triangles.len() as f64;
            assert!((made / asked as f64 - 1.0).abs() < 0.05, "{mesh:?}: {made}");
            let inside = |p: &[f32; 3]| p.iter().all(|x| x.abs() < 1.2);
            assert!(set.positions.iter().all(inside), "{mesh:?}");
        }
    }
    // Never none, however few are asked for.
    assert!(!building(0).triangles.is_empty());
    assert_eq!(needles(5).triangles.len(), 5);
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

/// What no split tells apart, or f32 hardly holds.
fn degenerate(count: usize) -> Vec<(&'static str, Vec<Triangle>)> {
    let mut next = numbers(3);
    let mut random = || -> Triangle { std::array::from_fn(|_| std::array::from_fn(|_| next())) };
    let plain: Vec<Triangle> = (0..count).map(|_| random()).collect();
    let mapped = |f: &dyn Fn(usize, [f32; 3]) -> [f32; 3]| -> Vec<Triangle> {
        let each = plain.iter().enumerate();
        each.map(|(i, t)| t.map(|p| f(i, p))).collect()
    };
    vec![
        ("identical", vec![plain[0]; count]),
        ("one point", mapped(&|_, _| [1.0, 2.0, 3.0])),
        (
            "at the origin, signs of zero",
            mapped(&|i, _| [-0.0, 0.0, [-0.0, 0.0][i % 2]]),
        ),
        ("flat", mapped(&|_, [x, y, _]| [x, y, 5.0])),
        ("on a line", mapped(&|_, [x, ..]| [x, 1.0, 1.0])),
        ("on a slanted line", mapped(&|_, [x, ..]| [x, x, x])),
        ("nested", mapped(&|i, p| p.map(|x| (x - 0.5) * i as f32))),
        (
            "powers",
            mapped(&|i, p| p.map(|x| x * 2.0_f32.powi(i as i32 % 250 - 126))),
        ),
        ("tiny", mapped(&|_, p| p.map(|x| x * 1e-30))),
        ("denormal", mapped(&|_, p| p.map(|x| x * 1e-42))),
        ("huge", mapped(&|_, p| p.map(|x| x * 1e30))),
        (
            "largest",
            mapped(&|_, p| p.map(|x| (x - 0.5) * 2.0 * f32::MAX)),
        ),
        (
            "all on one side",
            mapped(&|_, p| p.map(|x| f32::MAX * (0.9 + 0.1 * x))),
        ),
        ("far away", mapped(&|_, [x, y, z]| [x + 1e6, y, z])),
    ]
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
    // A sheet in 128 × 128 cells, shuffled: blocks are patches of it.
    let mut next = numbers(1);
    let mut triangles: Vec<Triangle> = (0..1 << 15)
        .map(|i| {
            let (x, y) = ((i / 2 % 128) as f32, (i / 256) as f32);
            let far = [x + (i % 2) as f32, y + 1.0 - (i % 2) as f32, 0.0];
            [[x, y, 0.0], far, [x + 1.0, y + 1.0, 0.0]]
        })
        .collect();
    for i in (1..triangles.len()).rev() {
        triangles.swap(i, (next() * i as f32) as usize);
    }
    let meshes = soup(&triangles);
    let tree = build(&meshes);
    check(&tree, &row(&meshes));
    let fill = triangles.len() as f64 / (tree.blocks.len() * WIDE) as f64;
    assert!(fill > 0.85, "{fill}");
    // One block where the sheet is met, and the levels above it.
    let levels = (tree.blocks.len() as f64).log(WIDE as f64);
    assert!(tree.tree.sah < 2.0 * (1.5 + levels), "{}", tree.tree.sah);
}

#[test]
fn refit_without_motion_changes_nothing() {
    let meshes = soup(&cloud(5000));
    let mut tree = build(&meshes);
    let before = mesh_bits(&tree);
    let cost = refit(&mut tree, &row(&meshes));
    assert_eq!(cost, tree.tree.sah);
    assert!(mesh_bits(&tree) == before);
}

#[test]
fn refit_follows_the_vertices() {
    let mut meshes = soup(&cloud(5000));
    let mut tree = build(&meshes);
    let built = tree.tree.sah;
    for p in &mut meshes.positions {
        // Corners change their order, and boxes their size.
        *p = [2.0 - p[0], p[1] * 3.0, p[2] + p[0] * p[1]];
    }
    let cost = refit(&mut tree, &row(&meshes));
    check(&tree, &row(&meshes));
    assert!((0.5 * built..2.0 * built).contains(&cost));
    let mut next = numbers(11);
    meshes
        .positions
        .iter_mut()
        .for_each(|p| *p = p.map(|_| next()));
    let cost = refit(&mut tree, &row(&meshes));
    check(&tree, &row(&meshes));
    assert!(cost > 5.0 * built, "{built} {cost}");
}

#[test]
fn refit_boxes_follows_the_entries() {
    let mut next = numbers(5);
    let mut random = || {
        let min = std::array::from_fn(|_| next());
        Aabb32 {
            min,
            max: min.map(|x| x + 0.01),
        }
    };
    let boxes: Vec<Aabb32> = (0..1000).map(|_| random()).collect();
    let (mut tree, order) = build_boxes(&boxes, BuildQuality::default());
    let built = tree.sah;
    let mut entries: Vec<Aabb32> = order.iter().map(|i| boxes[*i as usize]).collect();
    assert_eq!(refit_boxes(&mut tree, &entries), built);
    entries.iter_mut().for_each(|b| *b = random());
    assert!(refit_boxes(&mut tree, &entries) > 2.0 * built);
    check_tree(&tree, &entries);
}

proptest! {
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
            build(&soup(triangles)).blocks.iter().map(|b| b.source).collect()
        };
        prop_assert_eq!(sources(&triangles), sources(&scaled));
    }
}
