//! How fast is a tree built, and how good is it?
//!
//! The surface area heuristic's builder over a displaced sphere of 102,080
//! triangles, one thread. Asserted: every triangle once, the expected cost.

mod common;

use common::{displaced_sphere, quick};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use lanecast::accel::{Quality, build, corner_bounds};
use lanecast::math::Aabb32;
use std::hint::black_box;

fn sah_build(c: &mut Criterion) {
    let mesh = displaced_sphere(320, 160);
    let position = |i: u32| mesh.positions[i as usize].map(|x| x as f32);
    let boxes: Vec<Aabb32> = mesh
        .triangles
        .iter()
        .map(|t| corner_bounds(&t.map(position)))
        .collect();
    assert_eq!(boxes.len(), 2 * 320 * 159);

    let (tree, order) = build(&boxes, &Quality::default());
    assert_eq!(tree.len, boxes.len());
    let mut sorted = order.clone();
    sorted.sort();
    assert!(sorted.iter().enumerate().all(|(i, o)| i == *o as usize));
    assert!((20.0..60.0).contains(&tree.sah), "{}", tree.sah);

    let mut group = c.benchmark_group("build: how fast is a SAH tree built?");
    group.throughput(Throughput::Elements(boxes.len() as u64));
    group.bench_function("displaced sphere, 101,760 triangles", |b| {
        b.iter(|| build(black_box(&boxes), &Quality::default()));
    });
    group.finish();
}

criterion_group! { name = benches; config = quick(); targets = sah_build }
criterion_main!(benches);
