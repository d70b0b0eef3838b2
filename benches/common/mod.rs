//! Shared by the benches: what they trace, made from formulas, and the rays.
#![allow(dead_code)]

use glam::DVec3;
use lanecast::internals::accel::{Density, KdQuality, Structure, World};
use lanecast::internals::geom::{Cuboid, Sphere};
use lanecast::internals::math::lanes::*;
use lanecast::internals::measure::queries::{Answers, Ask, trace};
use lanecast::internals::measure::ray_kinds::{Kind, Order};
use lanecast::internals::measure::rays::{Source, direction_of, ray_sets};
use lanecast::internals::plan::{Choices, Kernels, Precision, plan};
use lanecast::internals::render::{Grid, Progress};
use lanecast::internals::scene::{Camera, Edge, Instances, MeshData, Scene, SceneBuilder};
use lanecast::internals::trace::Caching;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// One register of each.
#[cfg(target_feature = "avx512f")]
pub type Native32 = f32x16;
#[cfg(target_feature = "avx512f")]
pub type Native64 = f64x8;
#[cfg(all(target_feature = "avx", not(target_feature = "avx512f")))]
pub type Native32 = f32x8;
#[cfg(all(target_feature = "avx", not(target_feature = "avx512f")))]
pub type Native64 = f64x4;
#[cfg(not(target_feature = "avx"))]
pub type Native32 = f32x4;
#[cfg(not(target_feature = "avx"))]
pub type Native64 = f64x4;

/// Few and short samples: a group takes well under a minute.
pub fn quick() -> criterion::Criterion {
    criterion::Criterion::default()
        .sample_size(10)
        .warm_up_time(std::time::Duration::from_millis(300))
        .measurement_time(std::time::Duration::from_millis(1200))
}

pub fn one_thread() -> ThreadPool {
    let pool = ThreadPoolBuilder::new().num_threads(1).build();
    pool.expect("one thread can be started")
}

/// All but the linear scan, the default first.
pub fn structures() -> [(&'static str, Structure); 8] {
    [
        ("bvh", Structure::Bvh),
        ("nested", Structure::Nested),
        ("narrow", Structure::Narrow),
        ("kd", Structure::Kd(KdQuality::default())),
        ("grid", Structure::Grid(Density::default())),
        ("heap", Structure::Heap),
        ("heap-spheres", Structure::HeapSpheres),
        ("item-buffer", Structure::ItemBuffer),
    ]
}

/// A sphere of `2·across·(down − 1)` triangles, its radius waved by three sines.
pub fn displaced_sphere(across: u32, down: u32) -> MeshData {
    let mut positions = vec![[0.0, 1.0, 0.0]];
    for j in 1..down {
        let (sin, cos) = libm::sincos(std::f64::consts::PI * f64::from(j) / f64::from(down));
        for i in 0..across {
            let around = std::f64::consts::TAU * f64::from(i) / f64::from(across);
            let (y, x) = libm::sincos(around);
            positions.push([sin * x, cos, sin * y]);
        }
    }
    positions.push([0.0, -1.0, 0.0]);
    let wave = |p: [f64; 3]| {
        let wide = libm::sin(7.0 * p[0]) * libm::sin(6.0 * p[1] + 1.0) * libm::sin(8.0 * p[2]);
        let fine = libm::sin(27.0 * p[0] + 2.0) * libm::sin(25.0 * p[1]) * libm::sin(29.0 * p[2]);
        let radius = 1.0 + 0.06 * wide + 0.02 * fine;
        p.map(|x| x * radius)
    };
    let last = positions.len() as u32 - 1;
    let ring = |j: u32, i: u32| 1 + (j - 1) * across + i % across;
    let mut triangles = Vec::new();
    for i in 0..across {
        triangles.push([0, ring(1, i + 1), ring(1, i)]);
        for j in 1..down - 1 {
            let (a, b) = (ring(j, i), ring(j, i + 1));
            let (c, d) = (ring(j + 1, i), ring(j + 1, i + 1));
            triangles.push([a, b, c]);
            triangles.push([b, d, c]);
        }
        triangles.push([last, ring(down - 1, i), ring(down - 1, i + 1)]);
    }
    MeshData {
        positions: positions.into_iter().map(wave).collect(),
        triangles,
        ..MeshData::default()
    }
}

pub fn mesh_scene(mesh: &MeshData) -> Scene {
    let mut scene = SceneBuilder::default();
    let shape = scene.mesh("", mesh);
    scene.instance("", Edge::shape(shape));
    scene.finish().expect("the formula gives a valid mesh")
}

/// A ball with six smaller ones on it, and so on: (6^levels − 1) / 5 spheres.
pub fn sphere_flake(levels: u32) -> Scene {
    let mut scene = SceneBuilder::default();
    let mut ring = vec![(DVec3::ZERO, 1.0)];
    for _ in 0..levels {
        let mut next = Vec::new();
        for (center, radius) in ring {
            let ball = scene.sphere("", Sphere { center, radius });
            scene.instance("", Edge::shape(ball));
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                for side in [axis, -axis] {
                    next.push((center + side * (radius * 1.4), radius * 0.4));
                }
            }
        }
        ring = next;
    }
    scene.finish().expect("the formula gives valid spheres")
}

/// `side²` boxes on a square, their heights by a formula: occluders of many rays.
pub fn city(side: u32) -> Scene {
    let mut scene = SceneBuilder::default();
    let corners = [[-1.2, -1.2], [-1.2, 1.2], [1.2, 1.2], [1.2, -1.2]];
    let corners = corners.map(|[x, z]| DVec3::new(x, 0.0, z));
    let ground = scene.polygon("", &corners, &[]);
    scene.instance("", Edge::shape(ground));
    let step = 2.0 / f64::from(side);
    for i in 0..side * side {
        let corner = [i % side, i / side].map(|k| f64::from(k) * step - 1.0);
        let height = 0.3 + 0.9 * f64::from(i * 7 % 11) / 11.0;
        let min = DVec3::new(corner[0], 0.0, corner[1]);
        let max = min + DVec3::new(0.5 * step, height, 0.5 * step);
        let block = scene.cuboid("", Cuboid { min, max });
        scene.instance("", Edge::shape(block));
    }
    scene.finish().expect("the formula gives valid boxes")
}

/// What a traversal bench needs of a scene.
pub struct Traced {
    pub world: World,
    pub rays: Vec<(Kind, lanecast::internals::io::RaySet)>,
    pub modes: Vec<(&'static str, Kernels)>,
}

pub fn traced<'a>(scene: &'a Scene, instances: &'a Instances, kinds: &[Kind], side: u32) -> Traced {
    // Beside and above the camera.
    traced_by(DVec3::new(4.0, 6.0, 5.0), scene, instances, kinds, side)
}

/// With a light at this place.
pub fn traced_by<'a>(
    light: DVec3,
    scene: &'a Scene,
    instances: &'a Instances,
    kinds: &[Kind],
    side: u32,
) -> Traced {
    let world = World::build(scene, instances, Structure::Bvh);
    let kernels = |precision| {
        let choices = Choices {
            precision,
            ..Choices::default()
        };
        let plan = plan(scene, instances, &choices).expect("the plan's own choice is built");
        plan.kernels
    };
    let eye = DVec3::new(1.4, 1.8, 3.6);
    let camera = Camera::perspective(eye, DVec3::ZERO, DVec3::Y, 40.0);
    let source = Source {
        world: &world,
        kernels: kernels(Precision::Exact),
        camera,
        grid: Grid::Centers,
        size: [side, side],
        order: Order::Tile,
        light,
        direction: direction_of(&world, light),
    };
    let sets = ray_sets(&source, kinds, &Progress::default()).expect("nobody cancels");
    Traced {
        rays: kinds.iter().copied().zip(sets).collect(),
        modes: vec![
            ("fast", kernels(Precision::Fast)),
            ("exact", kernels(Precision::Exact)),
        ],
        world,
    }
}

/// Traces one of the sets.
pub fn run(traced: &Traced, kernels: &Kernels, number: usize, answers: &mut Answers) {
    let way = (&traced.world, kernels, Caching::On);
    run_in(way, &traced.rays[number], answers);
}

/// The same in any structure over the scene, with or without a shadow cache.
pub fn run_in(
    (world, kernels, caching): (&World, &Kernels, Caching),
    (kind, rays): &(Kind, lanecast::internals::io::RaySet),
    answers: &mut Answers,
) {
    let ask: Ask = kind.ask();
    let progress = &Progress::default();
    trace(world, kernels, rays, (ask, caching), answers, progress);
}
