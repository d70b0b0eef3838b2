//! How many rays per second are traced?
//!
//! 256×256 pixels, one thread, the machine's width. First every kind of ray over
//! a displaced sphere of triangles and over a flake of true spheres, in f32 and
//! f64: tiles of one origin (primary, and without a shadow cache in their way
//! lightshadow), tiles of one direction (ortho, directional), streams (shadow,
//! diffuse). Then the structures beside each other, and the shadow cache.
//! Asserted: how many rays hit.

mod common;

use common::{
    Traced, city, displaced_sphere, mesh_scene, one_thread, quick, run, run_in, sphere_flake,
    traced, traced_by,
};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::measure::queries::Answers;
use lanecast::internals::measure::ray_kinds::Kind;
use lanecast::internals::scene::{Instances, MeshData, Scene};
use lanecast::internals::trace::Caching;
use rayon::ThreadPool;

const SIDE: u32 = 256;
const KINDS: [Kind; 6] = [
    Kind::Primary,
    Kind::Ortho,
    Kind::Shadow,
    Kind::LightShadow,
    Kind::Directional,
    Kind::Diffuse,
];
/// In f32 a ray or two may fall on the other side of an edge.
const SLACK: usize = 4;

fn mesh() -> MeshData {
    displaced_sphere(320, 160)
}

/// `hits`: of each kind of rays.
fn scene_group(
    group: &mut BenchmarkGroup<WallTime>,
    pool: &ThreadPool,
    name: &str,
    scene: &Scene,
    hits: [usize; KINDS.len()],
) {
    let instances = Instances::of(scene).expect("few instances");
    let work: Traced = traced(scene, &instances, &KINDS, SIDE);
    let mut answers = Answers::default();
    for (number, (kind, rays)) in work.rays.iter().enumerate() {
        group.throughput(Throughput::Elements(rays.len() as u64));
        for (precision, kernels) in &work.modes {
            pool.install(|| run(&work, kernels, number, &mut answers));
            let found = answers.hits();
            let slack = if *precision == "exact" { 0 } else { SLACK };
            assert!(
                found.abs_diff(hits[number]) <= slack,
                "{name}, {}, {precision}: {found} hits",
                kind.name()
            );
            let id = format!("{name}/{}/{precision}", kind.name());
            group.bench_function(id, |b| {
                b.iter(|| pool.install(|| run(&work, kernels, number, &mut answers)));
            });
        }
    }
}

fn kinds(c: &mut Criterion) {
    let pool = one_thread();
    let mut group = c.benchmark_group("traversal: how many rays per second?");
    let hits = [23_098, 22_095, 812, 809, 276, 484];
    scene_group(
        &mut group,
        &pool,
        "mesh of 101,760",
        &mesh_scene(&mesh()),
        hits,
    );
    let hits = [46_993, 44_214, 4_864, 4_864, 4_297, 13_994];
    let flake = sphere_flake(5);
    scene_group(&mut group, &pool, "flake of 1,555 spheres", &flake, hits);
    group.finish();
}

fn structures(c: &mut Criterion) {
    let pool = one_thread();
    let scene = mesh_scene(&mesh());
    let instances = Instances::of(&scene).expect("few instances");
    let work: Traced = traced(&scene, &instances, &[Kind::Primary, Kind::Diffuse], SIDE);
    let (_, fast) = &work.modes[0];
    let mut expected = [0; 2];
    let mut group = c.benchmark_group("traversal: how do the structures compare?");
    for (name, structure) in common::structures() {
        let world = World::build(&scene, &instances, structure);
        let way = (&world, fast, Caching::On);
        let mut answers = Answers::default();
        for (rays, expected) in work.rays.iter().zip(&mut expected) {
            let (kind, set) = rays;
            // Its lists are made each time, and only for camera rays.
            if structure == Structure::ItemBuffer && *kind != Kind::Primary {
                continue;
            }
            pool.install(|| run_in(way, rays, &mut answers));
            let found = answers.hits();
            if structure == Structure::Bvh {
                *expected = found;
            }
            assert!(found.abs_diff(*expected) <= SLACK, "{name}: {found} hits");
            group.throughput(Throughput::Elements(set.len() as u64));
            group.bench_function(format!("{}/{name}", kind.name()), |b| {
                b.iter(|| pool.install(|| run_in(way, rays, &mut answers)));
            });
        }
    }
    group.finish();
}

fn shadow_cache(c: &mut Criterion) {
    let pool = one_thread();
    let scene = city(4);
    let instances = Instances::of(&scene).expect("few instances");
    // Beside the boxes, which stand in each other's light.
    let light = DVec3::new(-5.0, 3.0, 1.5);
    let kinds = [Kind::Shadow, Kind::AreaShadow];
    let work: Traced = traced_by(light, &scene, &instances, &kinds, SIDE);
    let mut group = c.benchmark_group("traversal: does a shadow cache pay?");
    for (rays, expected) in work.rays.iter().zip([9_716, 9_793]) {
        let (kind, set) = rays;
        group.throughput(Throughput::Elements(set.len() as u64));
        for (precision, kernels) in &work.modes {
            for caching in Caching::ALL {
                let way = (&work.world, kernels, caching);
                let mut answers = Answers::default();
                pool.install(|| run_in(way, rays, &mut answers));
                let found = answers.hits();
                assert!(found.abs_diff(expected) <= SLACK, "{precision}: {found}");
                let id = format!("{}/{precision}/{}", kind.name(), caching.name());
                group.bench_function(id, |b| {
                    b.iter(|| pool.install(|| run_in(way, rays, &mut answers)));
                });
            }
        }
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = quick();
    targets = kinds, structures, shadow_cache
}
criterion_main!(benches);
