//! Paths that branch without end: the arena stays bounded, a pixel's sum does not depend on
//! other pixels, and cancelling waits for one batch only.

use bumpalo::Bump;
use glam::DVec3;
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::geom::Cuboid;
use lanecast::internals::plan::{Choices, plan};
use lanecast::internals::scene::*;
use lanecast::internals::shade::{
    BATCH, Integrator, MaterialFlags, RayCounts, Scratch, Statistics,
};
use lanecast::internals::trace::{Caching, RayKind, ShadowCache, TraceScratch};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// A stack of glass panes, of which each face mirrors and transmits nearly
/// everything: rays double at every hit.
fn hall_of_glass() -> Scene {
    let mut scene = SceneBuilder::default();
    let glass = Material {
        transmission: 0.9,
        emission: [0.01, 0.02, 0.03],
        model: Model::Phong {
            diffuse: [0.1; 3],
            specular: [0.0; 3],
            exponent: 1.0,
            mirror: [0.97, 0.89, 0.83],
        },
        ..Material::default()
    };
    let glass = scene.material("glass", glass);
    for pane in 0..8 {
        let y = f64::from(pane);
        let pane = scene.cuboid(
            "",
            Cuboid {
                min: DVec3::new(-50.0, y, -50.0),
                max: DVec3::new(50.0, y + 0.4, 50.0),
            },
        );
        scene.instance("", Edge::shape(pane).material(glass));
    }
    scene.light(Light::Directional {
        direction: -DVec3::Y,
        irradiance: [1.0; 3],
        angle: 0.0,
    });
    scene.finish().unwrap()
}

struct Question {
    /// A camera ray each.
    pixels: Range<u32>,
    samples: u32,
    max_depth: u32,
    /// Wish to stop at the first hit of a camera ray.
    stop: bool,
}

impl Question {
    fn of(pixels: Range<u32>, max_depth: u32) -> Question {
        Question {
            pixels,
            samples: 1,
            max_depth,
            stop: false,
        }
    }
}

struct Traced {
    film: Vec<Rgb>,
    counts: RayCounts,
    arena_bytes: usize,
}

/// Rays down through the panes.
fn trace(question: Question) -> Traced {
    let scene = hall_of_glass();
    let instances = Instances::of(&scene).unwrap();
    let plan = plan(&scene, &instances, &Choices::default()).unwrap();
    let world = World::build(&scene, &instances, Structure::Bvh);
    let cancel = AtomicBool::new(false);
    let integrator = Integrator {
        world: &world,
        kernels: plan.kernels,
        lights: &scene.lights,
        items: None,
        background: [0.3, 0.5, 0.7],
        backdrop: [0.3, 0.5, 0.7],
        max_depth: question.max_depth,
        unnamed: Default::default(),
        material_flags: MaterialFlags::new(&scene.materials.rows),
        cancel: &cancel,
    };
    let arena = Bump::new();
    let mut film = vec![[0.0; 3]; question.pixels.len()];
    let mut caches = vec![ShadowCache::new(Caching::On); scene.lights.len()];
    let mut statistics = Statistics {
        counts: RayCounts::default(),
        record: None,
        sample: 0,
        pixel_of: &|row| row,
        memory: None,
        covered: None,
    };
    let mut trace = TraceScratch::default();
    let mut scratch = Scratch::new(&arena, &mut trace);
    for _ in 0..question.samples {
        for (row, pixel) in question.pixels.clone().enumerate() {
            let x = 0.02 * f64::from(pixel);
            let org = DVec3::new(x, 9.0, 0.1);
            let dir = DVec3::new(0.03 - 1e-3 * x, -1.0, 0.07);
            let queue = scratch.camera_rays();
            let t_max = f32::INFINITY;
            queue.push(org, dir, t_max, row as u32, [1.0; 3], RayKind::Primary);
        }
        integrator.run(
            &mut scratch,
            &mut film,
            &mut caches,
            &mut statistics,
            Some(&mut |_, _, _| cancel.store(question.stop, Relaxed)),
        );
    }
    Traced {
        film,
        counts: statistics.counts,
        arena_bytes: arena.allocated_bytes(),
    }
}

#[test]
fn what_waits_is_bounded_by_depth_times_piece() {
    let depth = 16;
    let traced = trace(Question::of(0..16, depth));
    let rays = traced.counts.reflection + traced.counts.refraction;
    assert!(rays > 200_000, "too few rays to tell: {rays}");
    // A ray takes 68 bytes and waits with at most two pieces at each depth; a
    // piece's hits and shadow rays take less than 1 KB each. Chunks of the arena
    // double: twice what is in use.
    let bound = 2 * BATCH * (2 * 80 * (depth as usize + 1) + 1024);
    assert!(
        traced.arena_bytes <= bound,
        "{} > {bound}",
        traced.arena_bytes
    );

    let again = trace(Question {
        samples: 3,
        ..Question::of(0..16, depth)
    });
    assert_eq!(again.counts.primary, 3 * 16);
    assert_eq!(again.arena_bytes, traced.arena_bytes);
}

#[test]
fn a_pixel_does_not_depend_on_its_neighbours() {
    // Depth 8: a pixel's rays of one depth fit in a piece, so that alone it is
    // traced breadth first, all of it. Depth 16: they do not.
    for depth in [8, 16] {
        let together = trace(Question::of(0..12, depth));
        let rays = (together.counts.reflection + together.counts.refraction) as usize;
        assert_eq!(rays > 12 * 16 * BATCH, depth == 16, "{rays}");
        for pixel in 0..12 {
            let alone = trace(Question::of(pixel..pixel + 1, depth));
            let bits = |rgb: Rgb| rgb.map(f32::to_bits);
            assert_eq!(
                bits(together.film[pixel as usize]),
                bits(alone.film[0]),
                "pixel {pixel}, depth {depth}"
            );
        }
    }
}

#[test]
fn a_piece_is_the_last_that_is_traced() {
    let traced = trace(Question {
        stop: true,
        ..Question::of(0..8, 200)
    });
    assert_eq!(traced.counts.primary, 8);
    assert_eq!(traced.counts.reflection + traced.counts.refraction, 0);
}
