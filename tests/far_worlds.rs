//! Scenes far from the origin: their boxes count from a place of their own, so
//! they are no coarser than at the origin, and rays meet what the scan finds.

mod common;

use common::{EVERYTHING, RayColumns, hard_rays, hard_scene, structures};
use glam::{DAffine3, DVec3};
use lanecast::accel::{Structure, World};
use lanecast::geom::{Cone, Sphere};
use lanecast::math::Aabb;
use lanecast::plan::{Arithmetic, Kernels, native_width};
use lanecast::scene::{Appearances, Edge, Scene, SceneBuilder};
use lanecast::trace::{HitId, ShadowCache};

const RAYS: usize = 512;

fn size(world: &World) -> DVec3 {
    let bounds: Aabb = world.bounds.widened();
    bounds.extent()
}

/// Of well conditioned places: others lose in f64 what the distance costs.
#[test]
fn boxes_of_far_worlds_are_as_fine_as_near_ones() {
    let row = || {
        let mut scene = SceneBuilder::default();
        for i in 0..10 {
            let center = DVec3::new(3.0 * f64::from(i), 0.0, 1.0);
            let sphere = Sphere {
                center,
                radius: 1.0,
            };
            let shape = scene.sphere("", sphere);
            scene.instance("", Edge::shape(shape));
        }
        scene.finish().unwrap()
    };
    let built = |scene: &Scene| {
        let appearances = Appearances::of(scene).unwrap();
        let world = World::build(scene, &appearances, Structure::Bvh);
        let boxes: Vec<f64> = world
            .entries
            .iter()
            .map(|entry| entry.bounds.widened().extent().max_element())
            .collect();
        (world.center, boxes)
    };
    let (center, near) = built(&row());
    assert_eq!(center, DVec3::ZERO);
    for distance in [1e4, 1e6, 1e9] {
        let offset = DVec3::new(0.6, -0.8, 0.3) * distance;
        let (center, far) = built(&row().moved(1.0, offset).unwrap());
        assert!((center - offset).length() < 64.0, "{distance}: {center}");
        for (near, far) in near.iter().zip(&far) {
            assert!((far - near).abs() < 1e-4, "{distance}: {far}");
        }
    }
}

#[test]
fn far_worlds_lose_nothing() {
    let mut hits = 0;
    for seed in 0..12 {
        let near = hard_scene(seed);
        let appearances = Appearances::of(&near).unwrap();
        let near_size = size(&World::build(&near, &appearances, Structure::Bvh));
        let distance = [1e3, 1e6, 1e9][seed as usize % 3] * near_size.max_element();
        let offset = DVec3::new(0.6, -0.8, 0.3) * distance;
        let far = hard_scene(seed).moved(1.0, offset).unwrap();
        let appearances = Appearances::of(&far).unwrap();

        let scan = World::build(&far, &appearances, Structure::Linear);
        assert_ne!(scan.center, DVec3::ZERO, "{seed}");

        let rays = hard_rays(&far, &appearances, seed, RAYS);
        for arithmetic in [Arithmetic::F64, Arithmetic::F32Guarded] {
            let kernels = |lanes| Kernels {
                arithmetic,
                lanes,
                needs: EVERYTHING,
            };
            let answers = |world: &World, lanes| {
                let nearest = rays.closest(world, &kernels(lanes));
                let t_max = vec![1.0; RAYS];
                let cache = &mut ShadowCache::new(Default::default());
                let blocked = rays.any(world, &kernels(lanes), &t_max, cache);
                let met = |(t, id): &(f64, HitId)| (*id != HitId::NONE).then(|| (t.to_bits(), *id));
                let nearest: Vec<_> = nearest.iter().map(met).collect();
                (nearest, blocked)
            };
            let expected = answers(&scan, 1);
            hits += expected.0.iter().flatten().count();
            for structure in structures() {
                let world = World::build(&far, &appearances, structure);
                for lanes in [1, native_width(arithmetic)] {
                    let found = answers(&world, lanes);
                    assert!(found == expected, "{seed}: {structure:?}, {lanes} lanes");
                }
            }
        }
    }
    assert!(hits > RAYS, "{hits}");
}

/// What lies beyond f32 takes nothing else along.
#[test]
fn what_is_near_is_met_beside_what_f32_cannot_reach() {
    let balls = |far: Option<f64>| {
        let mut scene = SceneBuilder::default();
        let ball = scene.sphere(
            "",
            Sphere {
                center: DVec3::ZERO,
                radius: 1.0,
            },
        );
        let places = (0..9).map(|i| DVec3::new(1.5 * f64::from(i), 0.3, 0.0));
        let far = far.map(|x| [DVec3::new(0.0, 0.0, -x), DVec3::new(x, 0.9 * x, 0.0)]);
        for place in places.chain(far.into_iter().flatten()) {
            let map = scene.transform(DAffine3::from_translation(place).into());
            scene.instance("", Edge::shape(ball).transform(map));
        }
        scene.finish().unwrap()
    };
    let near = balls(None);
    let rays = hard_rays(&near, &Appearances::of(&near).unwrap(), 1, RAYS);
    let kernels = Kernels {
        arithmetic: Arithmetic::F32Guarded,
        lanes: native_width(Arithmetic::F32Guarded),
        needs: EVERYTHING,
    };
    for distance in [1e38, 3.5e38, 1e39, 1e300] {
        let scene = balls(Some(distance));
        let appearances = Appearances::of(&scene).unwrap();
        let nearest = |structure| {
            let world = World::build(&scene, &appearances, structure);
            rays.closest(&world, &kernels)
        };
        let expected = nearest(Structure::Linear);
        let hits = expected.iter().filter(|(_, id)| *id != HitId::NONE);
        assert!(hits.count() > RAYS / 8);
        for structure in structures() {
            let found = nearest(structure);
            for (found, expected) in found.iter().zip(&expected) {
                assert_eq!(found.1, expected.1, "{distance}: {structure:?}");
            }
        }
    }
}

/// Rays of one origin that f32 cannot reach, before a cone as large.
#[test]
fn what_is_beyond_f32_is_met_from_one_origin() {
    for size in [1e30, 1e37, 1e38, 1e40, 1e100] {
        let mut scene = SceneBuilder::default();
        let cone = Cone {
            base: DVec3::new(0.0, -size, 0.0),
            top: DVec3::new(0.0, size, 0.0),
            base_radius: size,
            top_radius: 0.0,
            open: false,
        };
        let shape = scene.cone("", cone);
        scene.instance("", Edge::shape(shape));
        let scene = scene.finish().unwrap();
        let appearances = Appearances::of(&scene).unwrap();
        let mut rays = RayColumns::default();
        for i in 0..RAYS {
            let [y, z] = [i / 16, i % 16].map(|x| (x as f32 - 8.0) / 16.0);
            rays.push(DVec3::new(1.7 * size, -0.9 * size, 0.0), [-1.0, y, z]);
        }
        for arithmetic in [Arithmetic::F64, Arithmetic::F32Guarded] {
            let kernels = Kernels {
                arithmetic,
                lanes: native_width(arithmetic),
                needs: EVERYTHING,
            };
            let met = |structure| {
                let world = World::build(&scene, &appearances, structure);
                let nearest = rays.closest(&world, &kernels);
                nearest.iter().map(|(_, id)| *id).collect::<Vec<_>>()
            };
            let expected = met(Structure::Linear);
            let hits = expected.iter().filter(|id| **id != HitId::NONE).count();
            assert!(hits > 64 && hits < RAYS, "{size}: {hits}");
            for structure in structures() {
                assert!(met(structure) == expected, "{size}: {structure:?}");
            }
        }
    }
}
