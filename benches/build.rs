//! How fast is a structure built, and how fast brought up to date?
//!
//! First SAH trees over a displaced sphere of 101,760 triangles, and over its
//! triangles' boxes as entries, one thread. Asserted: every triangle once, the
//! expected cost, and that a refit without motion keeps it. Then all structures
//! over one of 25,280 triangles. Asserted: each holds every triangle.

mod common;

use common::{displaced_sphere, mesh_scene, one_thread, quick};
use criterion::{Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use lanecast::internals::accel::{
    BuildQuality, Bvh4Quality, Structure, WIDE, World, build_boxes, build_bvh4, build_mesh,
    corner_bounds, refit,
};
use lanecast::internals::math::Aabb32;
use lanecast::internals::scene::{Instances, Meshes};
use std::hint::black_box;

fn sah_build(c: &mut Criterion) {
    let mut meshes = Meshes::default();
    let id = meshes.push(&displaced_sphere(320, 160));
    let mesh = meshes.row(id);
    let count = mesh.triangles.len();
    assert_eq!(count, 2 * 320 * 159);
    let boxes: Vec<Aabb32> = (0..count)
        .map(|i| corner_bounds(&mesh.corners(i)))
        .collect();
    let quality = BuildQuality::default();
    let pool = one_thread();

    let mut wide = build_mesh(&mesh, quality);
    let mut sources: Vec<u32> = wide.blocks.iter().flat_map(|b| *b.sources()).collect();
    sources.sort();
    assert!((0..count).all(|i| sources[i] == i as u32));
    assert!((8.0..14.0).contains(&wide.tree.sah), "{}", wide.tree.sah);
    let built = wide.tree.sah;
    let high = build_mesh(&mesh, BuildQuality::High);
    assert!(high.tree.sah <= built, "{}", high.tree.sah);
    assert_eq!(refit(&mut wide, &mesh), built);
    let (tree, order) = build_boxes(&boxes, quality);
    assert_eq!(order.len(), count);
    assert!((12.0..24.0).contains(&tree.sah), "{}", tree.sah);
    let (tree, order) = build_bvh4(&boxes, &Bvh4Quality::default());
    assert_eq!(order.len(), tree.len);
    assert!((20.0..60.0).contains(&tree.sah), "{}", tree.sah);

    let mut group = c.benchmark_group("build: how fast is a SAH tree built?");
    group.throughput(Throughput::Elements(count as u64));
    group.sampling_mode(SamplingMode::Flat);
    group.bench_function("wide, blocks of triangles", |b| {
        pool.install(|| b.iter(|| build_mesh(black_box(&mesh), quality)));
    });
    group.bench_function("wide, blocks of triangles, high", |b| {
        pool.install(|| b.iter(|| build_mesh(black_box(&mesh), BuildQuality::High)));
    });
    group.bench_function("wide, boxes", |b| {
        pool.install(|| b.iter(|| build_boxes(black_box(&boxes), quality)));
    });
    group.bench_function("four-wide, boxes", |b| {
        b.iter(|| build_bvh4(black_box(&boxes), &Bvh4Quality::default()));
    });
    group.bench_function("wide, refit", |b| {
        pool.install(|| b.iter(|| refit(black_box(&mut wide), &mesh)));
    });
    group.finish();
}

fn structures(c: &mut Criterion) {
    let scene = mesh_scene(&displaced_sphere(160, 80));
    let instances = Instances::of(&scene).unwrap();
    let count = 2 * 160 * 79;
    let pool = one_thread();
    let mut group = c.benchmark_group("build: how do the structures compare?");
    group.throughput(Throughput::Elements(count as u64));
    group.sampling_mode(SamplingMode::Flat);
    for (name, structure) in common::structures() {
        if structure == Structure::Nested {
            // One mesh: the same trees as bvh.
            continue;
        }
        let world = World::build(&scene, &instances, structure);
        // A wide leaf holds blocks.
        let each = match structure {
            Structure::Bvh | Structure::ItemBuffer => WIDE,
            _ => 1,
        };
        let held = world.accelerator.blas_figures()[0].references * each;
        assert!(held >= count, "{name}: {held} triangles");
        group.bench_function(name, |b| {
            pool.install(|| b.iter(|| World::build(black_box(&scene), &instances, structure)));
        });
    }
    group.finish();
}

criterion_group! { name = benches; config = quick(); targets = sah_build, structures }
criterion_main!(benches);
