//! The stable interface: what it answers is what the engine answers, one ray at a time, in
//! any number of threads.

use crate::common::{ALL_AOVS, hard_rays, in_repository, load, random_scene};
use glam::DVec3;
use lanecast::internals::render::{Adaptive, Grid, IndirectCaching, Window};
use lanecast::internals::scene::Instances;
use lanecast::shapes::Sphere;
use lanecast::{
    Backdrop, Choices, Edge, Exposure, Hits, Precision, Progress, RayBatch, RenderConfig, Scene,
    SceneBuilder, ShutterShape, Tracer, TracerOptions,
};
use std::sync::Mutex;

pub fn tracer(scene: &Scene, precision: Precision) -> Tracer {
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

pub fn config() -> RenderConfig {
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

/// A ball of radius 1 about the origin.
pub fn ball() -> Scene {
    let mut scene = SceneBuilder::default();
    let (center, radius) = (DVec3::ZERO, 1.0);
    let ball = scene.sphere("", Sphere { center, radius });
    scene.instance("", Edge::shape(ball));
    scene.finish().unwrap()
}

#[test]
fn what_no_picture_can_be_made_of_is_refused() {
    let tracer = tracer(&ball(), Precision::Guarded);
    let exposure = Exposure {
        open: 0.0,
        close: 1.0,
        shape: ShutterShape::Box,
        slices: 4,
    };
    let shut = |exposure: Exposure| RenderConfig {
        shutter: Some(exposure),
        ..config()
    };
    let until = |close: f64| shut(Exposure { close, ..exposure });
    let from = |open: f64| shut(Exposure { open, ..exposure });
    let slow = |rise: f64, fall: f64| {
        let shape = ShutterShape::Trapezoid { rise, fall };
        shut(Exposure { shape, ..exposure })
    };
    let sized = |width: u32, height: u32| RenderConfig {
        width,
        height,
        ..config()
    };
    let corners = RenderConfig {
        grid: Grid::Corners,
        ..config()
    };
    let sampled = |spp: u32| RenderConfig { spp, ..config() };
    let adaptive = |noise: f32, most: u32| RenderConfig {
        adaptive: Some(Adaptive { noise, most }),
        ..config()
    };
    let cached = |error: f64| RenderConfig {
        caching: Some(IndirectCaching {
            is_unbiased: false,
            error,
        }),
        ..config()
    };
    let cut = |x: u32, width: u32| RenderConfig {
        window: Some(Window {
            x,
            y: 0,
            width,
            height: 32,
        }),
        ..config()
    };
    let colored = |c: f32| RenderConfig {
        backdrop: Backdrop::Color([0.0, c, 0.0]),
        ..config()
    };
    for (config, said) in [
        (sized(0, 60), "0x60 pixels; give each side 1 to 65535"),
        (sized(80, 0), "80x0 pixels; give"),
        (sized(u32::MAX, u32::MAX), "at most 268435456 pixels"),
        (
            RenderConfig {
                width: 1,
                ..corners.clone()
            },
            "give each side 2",
        ),
        (
            RenderConfig {
                spp: 4,
                ..corners.clone()
            },
            "spp is 4; give it 1",
        ),
        (
            RenderConfig {
                shutter: Some(exposure),
                ..corners
            },
            "leave out the shutter",
        ),
        (sampled(0), "spp is 0; give it 1 to 65536"),
        (sampled(65_537), "spp is 65537; give"),
        (adaptive(f32::NAN, 64), "noise is NaN; give"),
        (adaptive(0.0, 64), "noise is 0; give"),
        (adaptive(0.01, 0), "adaptive.most is 0; give"),
        (cached(f64::NAN), "error is NaN; give"),
        (cached(0.0), "error is 0; give"),
        (
            RenderConfig {
                max_depth: 256,
                ..config()
            },
            "max_depth is 256; give",
        ),
        (
            RenderConfig {
                matte_ranks: 0,
                ..config()
            },
            "matte_ranks is 0; give",
        ),
        (colored(f32::NAN), "[0.0, NaN, 0.0]; give"),
        (colored(-1.0), "[0.0, -1.0, 0.0]; give"),
        (cut(0, 0), "0x32 pixels at 0, 0 of a picture of 80x60; give"),
        (cut(7, 32), "at multiples of 32"),
        (cut(64, 32), "all within the picture"),
        (cut(32, u32::MAX), "all within the picture"),
        (
            RenderConfig {
                adaptive: adaptive(0.1, 4).adaptive,
                ..cut(0, 32)
            },
            "or the window",
        ),
        (from(f64::NAN), "opens at NaN and closes at 1; let"),
        (until(f64::INFINITY), "closes at inf; let"),
        (from(2.0), "opens at 2 and closes at 1; let"),
        (
            shut(Exposure {
                open: -f64::MAX,
                close: f64::MAX,
                ..exposure
            }),
            "both be finite",
        ),
        (
            shut(Exposure {
                slices: 0,
                ..exposure
            }),
            "no slices; give",
        ),
        (slow(f64::NAN, 0.0), "opens over NaN of its time"),
        (slow(0.75, 0.75), "at most 1"),
    ] {
        let refused = tracer.render(&config, &Progress::default(), &|_| ());
        let message = refused.expect_err(said).to_string();
        assert!(
            message.starts_with("RenderConfig: ") && message.contains(said),
            "{message}"
        );
    }
    for config in [
        config(),
        sized(1, 1),
        sampled(2),
        shut(exposure),
        cut(64, 16),
    ] {
        assert!(
            tracer
                .render(&config, &Progress::default(), &|_| ())
                .is_ok()
        );
    }
}

#[test]
fn bounds_of_t_that_are_no_numbers_admit_no_hit() {
    let scene = ball();
    let (org, dir) = (DVec3::new(0.0, 0.0, 4.0), -DVec3::Z);
    let endless = f32::INFINITY;
    let mut rays = RayBatch::default();
    for (start, end) in [
        (0.0, endless),
        (-endless, 5.0),
        (f32::NAN, endless),
        (0.0, f32::NAN),
        (f32::NAN, f32::NAN),
        (4.0, 3.0),
        (3.0, 3.0),
        (-5.0, -1.0),
    ] {
        rays.push_within(org, dir, start..end);
    }
    for precision in [Precision::Fast, Precision::Guarded, Precision::Exact] {
        let tracer = tracer(&scene, precision);
        let hits = tracer.closest(&rays);
        let met: Vec<bool> = (0..rays.len()).map(|row| hits.get(row).is_some()).collect();
        assert_eq!(met, [true, true, false, false, false, false, false, false]);
        assert_eq!(tracer.occluded(&rays), met);
    }
}

#[test]
fn batches_of_any_length_are_padded_alike() {
    let scene = random_scene(11);
    let mut all = rays(&scene, 5);
    let more = rays(&scene, 6);
    all.extend((0..more.len()).map(|row| more.ray(row)));
    let tracer = tracer(&scene, Precision::Guarded);
    let (hits, blocked) = (tracer.closest(&all), tracer.occluded(&all));
    // A beam has 64 rays, and a thread takes 16384 at a time.
    for len in [0, 1, 63, 64, 65, 16_383, 16_384, 16_385] {
        let mut some = RayBatch::with_capacity(len);
        some.extend((0..len).map(|row| all.ray(row)));
        let found = tracer.closest(&some);
        assert_eq!((some.len(), found.len()), (len, len));
        assert!((0..len).all(|row| found.get(row) == hits.get(row)), "{len}");
        assert_eq!(tracer.occluded(&some), blocked[..len]);
        // More rays follow those that were traced.
        some.extend((len..len + 3).map(|row| all.ray(row)));
        let found = tracer.closest(&some);
        assert!(
            (0..len + 3).all(|row| found.get(row) == hits.get(row)),
            "{len}"
        );
    }
}

#[test]
fn columns_are_taken_as_rays() {
    let vectors = [[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]].map(Vec::from);
    let along = [[6.0, 7.0], [8.0, 9.0], [10.0, 11.0]].map(Vec::from);
    let bounds = [vec![-1.0, f32::NAN], vec![2.0, 3.0]];
    let taken = RayBatch::from_columns(vectors.clone(), along.clone(), Some(bounds)).unwrap();
    let mut pushed = RayBatch::default();
    pushed.push_within(
        DVec3::new(0.0, 2.0, 4.0),
        DVec3::new(6.0, 8.0, 10.0),
        -1.0..2.0,
    );
    pushed.push_within(
        DVec3::new(1.0, 3.0, 5.0),
        DVec3::new(7.0, 9.0, 11.0),
        f32::NAN..3.0,
    );
    assert_eq!(taken, pushed);
    let endless = RayBatch::from_columns(vectors.clone(), along.clone(), None).unwrap();
    let mut pushed = RayBatch::default();
    pushed.extend((0..2).map(|row| taken.ray(row)));
    assert_eq!(endless, pushed);
    for (column, change) in ["org[1]", "org[2]", "dir[0]", "dir[1]", "dir[2]"]
        .into_iter()
        .zip(1..)
    {
        let mut all = [vectors.clone(), along.clone()];
        all[change / 3][change % 3].pop();
        let [org, dir] = all;
        let refused = RayBatch::from_columns(org, dir, None).unwrap_err();
        let said = format!("the column {column} has 1 rows and org[0] has 2; give");
        assert!(refused.to_string().starts_with(&said), "{refused}");
    }
    let bounds = [vec![0.0; 2], vec![1.0; 3]];
    let refused = RayBatch::from_columns(vectors, along, Some(bounds)).unwrap_err();
    assert_eq!((refused.column, refused.rows, refused.rays), ("t[1]", 3, 2));
}

#[test]
fn t_is_an_f32_unless_it_is_exact() {
    let org = DVec3::new(0.1, 0.2, 4.0);
    let toward = DVec3::new(0.01, 0.02, -1.0);
    let mut rays = RayBatch::default();
    for scale in [1.0, 3.0, 1e-30, 1e-45] {
        rays.push(org, toward * scale);
    }
    let [single, exact] = [Precision::Guarded, Precision::Exact]
        .map(|precision| tracer(&ball(), precision).closest(&rays).t);
    assert!(
        single.iter().all(|t| f64::from(*t as f32) == *t),
        "{single:?}"
    );
    assert_eq!(single[3], f64::from(f32::MAX));
    assert!(
        exact.iter().all(|t| f64::from(*t as f32) != *t),
        "{exact:?}"
    );
    assert!(exact[3] > 1e45);
}
