//! How many rays per second do the packets trace?
//!
//! Primary and point-light shadow rays of a 256×256 picture over a displaced
//! sphere of triangles and over a flake of true spheres, f32 and f64, at the
//! machine's width, one thread. Asserted: how many rays hit.

mod common;

use common::{Traced, displaced_sphere, mesh_scene, quick, run, sphere_flake, traced};
use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, Throughput, criterion_group, criterion_main};
use lanecast::measure::kinds::Kind;
use lanecast::measure::queries::Answers;
use lanecast::scene::{Appearances, Scene};
use rayon::{ThreadPool, ThreadPoolBuilder};

const SIDE: u32 = 256;
const KINDS: [Kind; 2] = [Kind::Primary, Kind::Shadow];

/// `hits`: of the primary rays, and of the shadow rays.
fn scene_group(
    group: &mut BenchmarkGroup<WallTime>,
    pool: &ThreadPool,
    name: &str,
    scene: &Scene,
    hits: [usize; 2],
) {
    let appearances = Appearances::of(scene).expect("few appearances");
    let work: Traced = traced(scene, &appearances, &KINDS, SIDE);
    let mut answers = Answers::default();
    for (number, (kind, rays)) in work.rays.iter().enumerate() {
        group.throughput(Throughput::Elements(rays.len() as u64));
        for (precision, kernels) in &work.modes {
            pool.install(|| run(&work, kernels, number, &mut answers));
            let found = answers.hits();
            // In f32 a ray or two may fall on the other side of an edge.
            let slack = if *precision == "exact" { 0 } else { 4 };
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

fn traversal(c: &mut Criterion) {
    let pool = ThreadPoolBuilder::new().num_threads(1).build();
    let pool = pool.expect("one thread can be started");
    let mut group = c.benchmark_group("traversal: how many rays per second?");
    let mesh = mesh_scene(&displaced_sphere(320, 160));
    scene_group(&mut group, &pool, "mesh of 101,760", &mesh, [23_098, 812]);
    let flake = sphere_flake(5);
    scene_group(
        &mut group,
        &pool,
        "flake of 1,555 spheres",
        &flake,
        [46_993, 4_864],
    );
    group.finish();
}

criterion_group! { name = benches; config = quick(); targets = traversal }
criterion_main!(benches);
