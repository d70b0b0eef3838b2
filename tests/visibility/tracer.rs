//! The stable interface: what it answers is what the engine answers, one ray at a time, in
//! any number of threads.

use crate::common::{ALL_AOVS, hard_rays, in_repository, load, random_scene};
use glam::DVec3;
use lanecast::internals::scene::Instances;
use lanecast::{
    Choices, Hits, Precision, Progress, RayBatch, RenderConfig, Scene, Tracer, TracerOptions,
};
use std::sync::Mutex;

fn tracer(scene: &Scene, precision: Precision) -> Tracer {
    let options = TracerOptions {
        choices: Choices {
            precision,
            ..Choices::default()
        },
        ..TracerOptions::default()
    };
    Tracer::new(scene, &options).unwrap()
}

fn rays(scene: &Scene, seed: u64) -> RayBatch {
    let instances = Instances::of(scene).unwrap();
    let columns = hard_rays(scene, &instances, seed, 20_000);
    let mut rays = RayBatch::default();
    for i in 0..columns.len() {
        let (org, dir) = columns.ray(i);
        let dir = DVec3::from_array(dir);
        rays.push(DVec3::from_array(org), dir);
    }
    rays
}

fn config() -> RenderConfig {
    RenderConfig {
        width: 80,
        height: 60,
        ..RenderConfig::default()
    }
}

/// Everything that a tracer says of a scene.
fn answers(tracer: &Tracer, rays: &RayBatch) -> (Hits, Vec<bool>, Vec<u32>) {
    let picture = tracer.render(&config(), &Progress::default(), &|_| ());
    let color = picture.unwrap().color;
    let bits = color.iter().flatten().map(|x| x.to_bits()).collect();
    (tracer.closest(rays), tracer.occluded(rays), bits)
}

#[test]
fn two_scenes_at_once_are_as_each_alone() {
    let scenes = [5, 6].map(random_scene);
    for precision in [Precision::Guarded, Precision::Exact] {
        let rays = [rays(&scenes[0], 1), rays(&scenes[1], 2)];
        let tracers = [&scenes[0], &scenes[1]].map(|scene| tracer(scene, precision));
        let alone = [0, 1].map(|i| answers(&tracers[i], &rays[i]));
        let together = std::thread::scope(|scope| {
            let (tracers, rays) = (&tracers, &rays);
            let run = |i: usize| scope.spawn(move || answers(&tracers[i], &rays[i]));
            [run(0), run(1)].map(|thread| thread.join().unwrap())
        });
        assert!(alone == together);
        assert!(alone[0] != alone[1]);
    }
}

#[test]
fn a_batch_says_what_single_rays_say() {
    let scene = random_scene(7);
    let rays = rays(&scene, 3);
    let tracer = tracer(&scene, Precision::Guarded);
    let (hits, blocked) = (tracer.closest(&rays), tracer.occluded(&rays));
    for row in (0..rays.len()).step_by(101) {
        let (org, dir) = rays.ray(row);
        assert_eq!(tracer.closest_one(org, dir), hits.get(row));
        assert_eq!(blocked[row], hits.get(row).is_some());
    }
    assert_eq!(tracer.closest(&RayBatch::default()).len(), 0);
}

#[test]
fn tiles_make_up_the_picture() {
    let tracer = tracer(&random_scene(8), Precision::Guarded);
    let seen = Mutex::new(vec![[f32::NAN; 3]; 80 * 60]);
    let picture = tracer.render(&config(), &Progress::default(), &|tile| {
        let mut seen = seen.lock().unwrap();
        for (i, color) in (0..).zip(tile.color) {
            let (x, y) = (tile.x + i % tile.width, tile.y + i / tile.width);
            seen[(y * 80 + x) as usize] = *color;
        }
    });
    assert_eq!(picture.unwrap().color, seen.into_inner().unwrap());
}

#[test]
fn prepared_solids_list_what_each_line_passes_through() {
    let scene = random_scene(9);
    let tracer = tracer(&scene, Precision::Guarded);
    let rays = rays(&scene, 4);
    let solids = tracer.solids().unwrap();
    let all = solids.spans_of(&rays);
    let hits = self::tracer(&scene, Precision::Exact).closest(&rays);
    for row in (0..rays.len()).step_by(7) {
        let (org, dir) = rays.ray(row);
        let one = solids.spans(org, dir);
        assert_eq!(one.rows, all[row].rows);
        // What a ray first hits is where some span begins or ends, or no solid.
        let ends = one
            .rows
            .iter()
            .flat_map(|span| [span.t_enter(), span.t_exit()]);
        let first = ends.filter(|t| *t > 0.0).fold(f64::INFINITY, f64::min);
        if let Some(hit) = hits.get(row) {
            assert!(
                hit.t <= first,
                "ray {row}: hit at {}, span at {first}",
                hit.t
            );
        } else {
            assert_eq!(first, f64::INFINITY, "ray {row}");
        }
    }
}

#[test]
fn outputs_beside_the_colour_are_the_pixel_s_centre_at_any_number_of_samples() {
    for file in ["csg_coplanar.toml", "primitives.toml"] {
        let scene = load(&in_repository("scenes").join(file), 4.0 / 3.0).scene;
        let tracer = tracer(&scene, Precision::Guarded);
        let [one, many] = [1, 4].map(|spp| {
            let config = RenderConfig {
                spp,
                aovs: ALL_AOVS,
                ..config()
            };
            let picture = tracer.render(&config, &Progress::default(), &|_| ());
            picture.unwrap()
        });
        assert!(one.color != many.color, "{file}");
        assert_eq!(one.depth, many.depth, "{file}");
        assert_eq!(one.position, many.position, "{file}");
        assert_eq!(one.normal, many.normal, "{file}");
        assert_eq!(one.albedo, many.albedo, "{file}");
        assert_eq!(one.instance_id, many.instance_id, "{file}");
        assert_eq!(one.primitive_id, many.primitive_id, "{file}");
        // Numbers alone: without what says which way a face of a CSG solid is turned.
        let ids = many.primitive_id.unwrap();
        assert!(
            ids.iter().all(|id| *id == u32::MAX || *id < 1 << 31),
            "{file}"
        );
    }
}
