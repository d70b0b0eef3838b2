//! Scenes that push at roundings: whatever the structure and the width, the same
//! answers; and in exact precision those of the brute-force reference.

#![cfg(feature = "all-lanes")]

mod common;

use common::{EVERYTHING, hard_rays, hard_scene};
use lanecast::accel::{Structure, World};
use lanecast::plan::{Arithmetic, Kernels};
use lanecast::reference::Reference;
use lanecast::scene::Appearances;
use lanecast::trace::HitId;

const RAYS: usize = 1000;

/// Bits of t and the id, of rays that meet something.
fn bits(answers: Vec<(f64, HitId)>) -> Vec<Option<(u64, HitId)>> {
    let met = |(t, id): (f64, HitId)| (id != HitId::NONE).then(|| (t.to_bits(), id));
    answers.into_iter().map(met).collect()
}

#[test]
fn hard_scenes_do_not_depend_on_structure_or_width() {
    let mut met = [0; 5];
    for seed in 0..300 {
        let scene = hard_scene(seed);
        let appearances = Appearances::of(&scene).unwrap();
        let rays = hard_rays(&scene, &appearances, seed, RAYS);
        let worlds = [Structure::Linear, Structure::Bvh]
            .map(|structure| World::build(&scene, &appearances, structure));
        for arithmetic in [Arithmetic::F32, Arithmetic::F64] {
            let of = |world, lanes| {
                let kernels = Kernels {
                    arithmetic,
                    lanes,
                    needs: EVERYTHING,
                };
                bits(rays.closest(world, &kernels))
            };
            let expected = of(&worlds[0], 1);
            met[seed as usize % 5] += expected.iter().flatten().count();
            for (i, world) in worlds.iter().enumerate() {
                for lanes in [1, 4, 8, 16] {
                    for (ray, (got, expected)) in of(world, lanes).iter().zip(&expected).enumerate()
                    {
                        assert_eq!(
                            got, expected,
                            "seed {seed}, ray {ray}: {arithmetic:?}, structure {i}, {lanes} lanes"
                        );
                    }
                }
            }
        }
    }
    println!("hits of {} rays per kind of scene: {met:?}", 60 * 2 * RAYS);
    assert!(met.iter().all(|hits| *hits > 60 * RAYS / 4));
}

#[test]
fn exact_packets_agree_with_the_reference_on_hard_scenes() {
    // Per kind of scene: certain answers, wrong hits or ids; answers in doubt,
    // those outside what exact arithmetic may say.
    let mut counts = [[0; 4]; 5];
    let mut first = None;
    for seed in 0..300 {
        let scene = hard_scene(seed);
        let appearances = Appearances::of(&scene).unwrap();
        let rays = hard_rays(&scene, &appearances, seed, RAYS / 4);
        let world = World::build(&scene, &appearances, Structure::Bvh);
        let kernels = Kernels {
            arithmetic: Arithmetic::F64,
            lanes: 8,
            needs: EVERYTHING,
        };
        let reference = Reference::brute_force(&scene, &appearances);
        let answers = rays.closest(&world, &kernels);
        for (i, (_, id)) in answers.iter().enumerate() {
            let (org, dir) = rays.ray(i);
            let judged = reference.nearest(org, dir.map(f64::from), f64::INFINITY);
            let ours = (*id != HitId::NONE).then_some(*id);
            let allowed = judged.perhaps.iter().any(|hit| {
                ours == hit.map(|h| HitId {
                    instance: h.instance,
                    primitive: h.primitive,
                })
            });
            let count = &mut counts[seed as usize % 5];
            let column = if judged.doubt { 2 } else { 0 };
            count[column] += 1;
            count[column + 1] += u32::from(!allowed);
            if !allowed && first.is_none() {
                first = Some(format!(
                    "seed {seed}, ray {i}: {ours:?}, reference {judged:?}"
                ));
            }
        }
    }
    println!("[certain, wrong, doubtful, outside] per kind of scene: {counts:?}");
    println!("the first: {first:?}");
    let wrong: u32 = counts.iter().map(|c| c[1]).sum();
    assert_eq!(wrong, 0, "{first:?}");
}
