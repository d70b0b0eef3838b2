//! Rays of one direction, as orthographic cameras and directional lights send them: the tree
//! has the hits of the linear scan, at every width.

use crate::common::{Random, RayColumns, campaign, hard_scene, random_scene};
use glam::DVec3;
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::plan::{Kernels, Precision, native_width};
use lanecast::internals::scene::{Instances, Scene};
use lanecast::internals::trace::{Caching, HitId, ShadowCache};

const RAYS: usize = 320;

/// Along an axis, nearly so, or anyhow; from a plane or from all over the place.
fn parallel_rays(world: &World, random: &mut Random) -> RayColumns {
    let bounds = world.bounds.widened();
    let (center, size) = if bounds.is_empty() {
        (DVec3::ZERO, 1.0)
    } else {
        (bounds.center(), (bounds.max - bounds.min).max_element())
    };
    let mut dir = random.vector();
    let axis = random.below(3) as usize;
    match random.below(4) {
        0 => dir = DVec3::AXES[axis] * dir[axis].signum(),
        1 => dir = DVec3::AXES[axis] * dir[axis].signum() + dir * 1e-9,
        _ => {}
    }
    let dir = dir.to_array().map(|x| x as f32);
    let wide = DVec3::from_array(dir.map(f64::from)).normalize();
    let inside = random.below(2) == 0;
    let mut rays = RayColumns::default();
    for _ in 0..RAYS {
        let org = center + random.vector() * size * 0.7;
        let back = if inside { 0.0 } else { 2.0 * size };
        // Now and then on a grid, where edges are met exactly.
        let org = org - wide * back;
        let org = if random.below(4) == 0 {
            org.round()
        } else {
            org
        };
        rays.push(org, dir);
    }
    rays
}

fn met(answers: &[(f64, HitId)]) -> Vec<Option<(u64, HitId)>> {
    let hit = |a: &(f64, HitId)| (a.1 != HitId::NONE).then_some((a.0.to_bits(), a.1));
    answers.iter().map(hit).collect()
}

fn kernels(precision: Precision, lanes: usize) -> Kernels {
    Kernels { precision, lanes }
}

/// (rays, hits, fast differences from the scan).
fn compare(scene: &Scene, seed: u64) -> [usize; 3] {
    let instances = Instances::of(scene).unwrap();
    let [tree, scan] =
        [Structure::Bvh, Structure::Linear].map(|s| World::build(scene, &instances, s));
    let random = &mut Random(seed ^ 0x5eed);
    let mut counts = [0; 3];
    for round in 0..4 {
        let rays = parallel_rays(&tree, random);
        for precision in [Precision::Exact, Precision::Guarded, Precision::Fast] {
            let expected = met(&rays.closest(&scan, &kernels(precision, 1)));
            let alone = met(&rays.closest(&tree, &kernels(precision, 1)));
            let mut widths = vec![native_width()];
            if cfg!(feature = "all-lanes") {
                widths = vec![4, 8, 16];
            }
            for lanes in widths {
                let got = met(&rays.closest(&tree, &kernels(precision, lanes)));
                assert_eq!(got, alone, "seed {seed} {round}: {precision:?} {lanes}");
            }
            if precision != Precision::Fast {
                assert_eq!(alone, expected, "seed {seed} {round}");
            }
            if precision == Precision::Exact {
                counts[0] += alone.len();
                counts[1] += alone.iter().flatten().count();
            } else if precision == Precision::Fast {
                counts[2] += alone.iter().zip(&expected).filter(|(a, b)| a != b).count();
            }
        }
    }
    counts
}

fn total(name: &str, scenes: impl Iterator<Item = (u64, Scene)>) -> [usize; 3] {
    let mut sum = [0; 3];
    for (seed, scene) in scenes {
        for (sum, count) in sum.iter_mut().zip(compare(&scene, seed)) {
            *sum += count;
        }
    }
    let [rays, hits, differences] = sum;
    println!("{name}: {rays} rays, {hits} hits, {differences} fast differences");
    sum
}

/// Which rays are traced together changes nothing, in f32 neither: not where they
/// start, nor what they meet.
#[test]
fn parallel_rays_do_not_depend_on_their_neighbours() {
    let (mut hits, pairs) = (0, campaign(60));
    let scenes = (0..pairs as u64).flat_map(|seed| [random_scene(seed), hard_scene(seed)]);
    for (number, scene) in scenes.enumerate() {
        let instances = Instances::of(&scene).unwrap();
        let tree = World::build(&scene, &instances, Structure::Bvh);
        let random = &mut Random(number as u64);
        let rays = parallel_rays(&tree, random);
        let mut order: Vec<usize> = (0..RAYS).collect();
        order.sort_by_cached_key(|_| random.bits());
        // Tiles of fewer rays, too.
        order.truncate(RAYS - 40);
        let mut shuffled = RayColumns::default();
        for i in &order {
            let (org, dir) = rays.ray(*i);
            shuffled.push(org.into(), dir);
        }
        for precision in [Precision::Exact, Precision::Fast] {
            let kernels = kernels(precision, native_width());
            let ordered = met(&rays.closest(&tree, &kernels));
            let got = met(&shuffled.closest(&tree, &kernels));
            let expected: Vec<_> = order.iter().map(|i| ordered[*i]).collect();
            assert_eq!(got, expected, "scene {number}: {precision:?}");
            hits += got.iter().flatten().count();
        }
    }
    assert!(hits * 60 > 5000 * pairs);
}

/// Rays that end where they meet something, a little before, a little behind: in
/// f64 they are blocked as by the scan.
#[test]
fn parallel_rays_that_end_at_what_they_meet() {
    let (mut blocked, mut free) = (0, 0);
    let pairs = campaign(100);
    let scenes = (0..pairs as u64).flat_map(|seed| [random_scene(seed), hard_scene(seed)]);
    for (number, scene) in scenes.enumerate() {
        let instances = Instances::of(&scene).unwrap();
        let [tree, scan] =
            [Structure::Bvh, Structure::Linear].map(|s| World::build(&scene, &instances, s));
        let random = &mut Random(number as u64);
        let rays = parallel_rays(&tree, random);
        let kernels = kernels(Precision::Exact, native_width());
        let ends = rays.closest(&scan, &kernels).into_iter().map(|(t, id)| {
            let t = if id == HitId::NONE { 10.0 } else { t as f32 };
            [t, t.next_up(), t.next_down(), 2.0 * t][random.below(4) as usize]
        });
        let ends: Vec<f32> = ends.collect();
        let expected = rays.any(&scan, &kernels, &ends, &mut ShadowCache::new(Caching::Off));
        assert_eq!(
            rays.any(&tree, &kernels, &ends, &mut ShadowCache::new(Caching::Off)),
            expected,
            "{number}"
        );
        let count = expected.iter().filter(|b| **b).count();
        (blocked, free) = (blocked + count, free + RAYS - count);
    }
    println!("{blocked} blocked, {free} free");
    assert!(blocked > 20 * pairs && free > 20 * pairs);
}

#[test]
fn parallel_rays_meet_what_the_scan_finds() {
    let scenes = (0..campaign(150) as u64).map(|seed| (seed, random_scene(seed)));
    let [rays, hits, differences] = total("random", scenes);
    assert!(hits > rays / 10);
    assert!(differences * 10_000 <= rays);
}

#[test]
fn parallel_rays_through_hard_scenes() {
    let scenes = (0..campaign(100) as u64).map(|seed| (seed, hard_scene(seed)));
    let [rays, hits, _] = total("hard", scenes);
    assert!(hits > rays / 50);
}
