//! Trees that are refitted: the same shape, new boxes.

use super::check::{build, check, check_tree, mesh_bits};
use super::soups::{cloud, numbers, row, soup};
use lanecast::internals::accel::{BuildQuality, build_boxes, refit, refit_boxes};
use lanecast::internals::math::Aabb32;

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
