//! Scenes far from the origin: their boxes count from a place of their own, so
//! they are no coarser than at the origin, and rays meet what the scan finds.

mod common;

use common::{EVERYTHING, hard_rays, hard_scene, structures};
use glam::DVec3;
use lanecast::accel::{Structure, World};
use lanecast::math::Aabb;
use lanecast::plan::{Arithmetic, Kernels, native_width};
use lanecast::scene::Appearances;
use lanecast::trace::{HitId, ShadowCache};

const RAYS: usize = 512;

fn size(world: &World) -> DVec3 {
    let bounds: Aabb = world.bounds.widened();
    bounds.extent()
}

#[test]
fn far_worlds_are_as_fine_as_near_ones_and_lose_nothing() {
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
        assert!((scan.center - offset).length() < 0.1 * distance, "{seed}");
        // One rounding to f32, and what badly conditioned places lose in f64 at that
        // distance; f32 would lose a thousand times as much.
        let room = near_size * 1.001 + distance * 1e-10;
        let found = size(&scan);
        assert!(found.cmple(room).all(), "{seed}: {found}, {near_size}");

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
