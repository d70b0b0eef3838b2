//! What do solids made of solids cost?
//!
//! Whole pictures of 320×240 pixels with a shadowed point light, one thread, the
//! machine's width, in each precision: 400 parts of three operands, one difference
//! of 441 operands, a plate with 10 and with 10,000 holes, and 100,000 instances
//! of a part. Asserted: every mode sees the same solids.

mod common;

use common::{one_thread, quick};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::geom::{Cuboid, Cylinder, Sphere};
use lanecast::internals::math::Affine;
use lanecast::internals::measure::generate::displaced_sphere;
use lanecast::internals::plan::{Choices, Precision, plan};
use lanecast::internals::render::{Progress, RenderConfig, View, render};
use lanecast::internals::scene::{
    Camera, Edge, Falloff, Instances, Light, MeshData, Operand, Operator, Scene, SceneBuilder,
    ShapeId,
};
use lanecast::internals::trace::{Solids, TraceScratch};

const SIZE: [u32; 2] = [320, 240];
/// In f32 some rays fall on the other side of an edge.
const SLACK: u64 = 16;

/// (box − sphere) ∩ cylinder, of about unit size.
fn part(scene: &mut SceneBuilder) -> ShapeId {
    let (min, max) = (DVec3::splat(-0.4), DVec3::splat(0.4));
    let block = scene.cuboid("", Cuboid { min, max });
    let (center, radius) = (DVec3::new(0.1, 0.4, 0.1), 0.3);
    let ball = scene.sphere("", Sphere { center, radius });
    let rod = upright(scene, DVec3::new(0.0, -0.5, 0.0), 1.0, 0.45);
    let cut = [block, ball].map(Operand::shape);
    let cut = scene.csg("", Operator::Difference, &cut);
    scene.csg("", Operator::Intersection, &[cut, rod].map(Operand::shape))
}

fn upright(scene: &mut SceneBuilder, base: DVec3, height: f64, radius: f64) -> ShapeId {
    let cylinder = Cylinder {
        base,
        top: base + DVec3::Y * height,
        radius,
        open: false,
    };
    scene.cylinder("", cylinder)
}

/// `side`² parts.
fn parts(side: u32) -> Scene {
    let mut scene = SceneBuilder::default();
    let part = part(&mut scene);
    for i in 0..side * side {
        let at = place(i, side, 20.0);
        let scale = 20.0 / f64::from(side);
        let linear = std::array::from_fn(|k| (DVec3::AXES[k] * scale).to_array());
        let local = Affine::new(linear, at.to_array());
        let transform = scene.transform(local);
        scene.instance("", Edge::shape(part).transform(transform));
    }
    scene.finish().expect("the formula gives valid parts")
}

/// On a square about the origin.
fn place(i: u32, side: u32, size: f64) -> DVec3 {
    let step = size / f64::from(side);
    let at = |k: u32| (f64::from(k) + 0.5) * step - 0.5 * size;
    DVec3::new(at(i % side), 0.0, at(i / side))
}

/// A slab without 400 balls and 41 rods.
fn deep() -> Scene {
    let mut scene = SceneBuilder::default();
    let (min, max) = (DVec3::new(-10.0, -0.8, -10.0), DVec3::new(10.0, 0.0, 10.0));
    let mut operands = vec![scene.cuboid("", Cuboid { min, max })];
    for i in 0..400 {
        let (center, radius) = (place(i, 20, 20.0) + DVec3::Y * 0.05, 0.42);
        operands.push(scene.sphere("", Sphere { center, radius }));
    }
    for i in 0..41 {
        let base = DVec3::new(-11.0, -0.45, f64::from(i) * 0.49 - 9.8);
        let rod = Cylinder {
            base,
            top: base + DVec3::X * 22.0,
            radius: 0.1,
            open: false,
        };
        operands.push(scene.cylinder("", rod));
    }
    solid(scene, &operands)
}

/// With `side`² holes of one size, whose ends lie in its faces.
fn plate(columns: u32, rows: u32) -> Scene {
    let mut scene = SceneBuilder::default();
    let (min, max) = (DVec3::new(-10.0, -0.4, -10.0), DVec3::new(10.0, 0.0, 10.0));
    let mut operands = vec![scene.cuboid("", Cuboid { min, max })];
    for i in 0..columns * rows {
        let at = place(i, columns.max(rows), 20.0);
        operands.push(upright(&mut scene, at - DVec3::Y * 0.4, 0.4, 0.07));
    }
    solid(scene, &operands)
}

/// The first without the others.
fn solid(mut scene: SceneBuilder, operands: &[ShapeId]) -> Scene {
    let operands: Vec<Operand> = operands.iter().copied().map(Operand::shape).collect();
    let shape = scene.csg("", Operator::Difference, &operands);
    scene.instance("", Edge::shape(shape));
    scene.finish().expect("the formula gives a valid solid")
}

fn solids(c: &mut Criterion) {
    let pool = one_thread();
    let mut group = c.benchmark_group("solids: what does a picture cost?");
    let scenes = [
        ("400 parts", parts(20)),
        ("441 operands", deep()),
        ("plate, 10 holes", plate(5, 2)),
        ("plate, 10,000 holes", plate(100, 100)),
        ("99,856 parts", parts(316)),
    ];
    let light = Light::Point {
        position: DVec3::new(10.0, 14.0, 9.0),
        intensity: [3.0; 3],
        falloff: Falloff::None,
        radius: 0.0,
    };
    let eye = DVec3::new(0.0, 9.0, 13.0);
    let camera = Camera::perspective(eye, DVec3::new(0.0, 0.0, 0.6), DVec3::Y, 40.0);
    let config = RenderConfig {
        width: SIZE[0],
        height: SIZE[1],
        ..RenderConfig::default()
    };
    group.throughput(Throughput::Elements(u64::from(SIZE[0] * SIZE[1])));
    for (name, scene) in &scenes {
        let instances = Instances::of(scene).expect("few instances");
        let world = World::build(scene, &instances, Structure::Bvh);
        let mut hits = None;
        for precision in [Precision::Exact, Precision::Guarded, Precision::Fast] {
            let choices = Choices {
                precision,
                ..Choices::default()
            };
            let plan = plan(scene, &instances, &choices).expect("the plan's own choice is built");
            let view = View {
                world: &world,
                kernels: plan.kernels,
                camera,
                lights: &[light],
            };
            let picture = || {
                let rendered = pool.install(|| render(&view, &config, false, &Progress::default()));
                rendered.expect("nobody interrupts").counts.primary_hits
            };
            let found = picture();
            let expected = *hits.get_or_insert(found);
            let slack = if precision == Precision::Fast {
                SLACK
            } else {
                0
            };
            assert!(
                found.abs_diff(expected) <= slack,
                "{name}: {found} of {expected} hits"
            );
            group.bench_function(format!("{name}/{}", precision.name()), |b| b.iter(picture));
        }
    }
    group.finish();
}

/// What does one line through prepared solids cost, on one thread: a closed mesh of 86,436
/// triangles, a difference of 45 operands, and 400 parts? Asserted: half of the lines or more
/// pass through something.
fn spans(c: &mut Criterion) {
    let mut group = c.benchmark_group("spans of a line through prepared solids");
    let ball = displaced_sphere(210, 207);
    let mesh = MeshData {
        positions: ball.positions.iter().map(|p| p.map(f64::from)).collect(),
        triangles: ball.triangles,
        ..MeshData::default()
    };
    let mut scene = SceneBuilder::default();
    let shape = scene.mesh("", &mesh);
    scene.instance("", Edge::shape(shape));
    let mesh = scene.finish().expect("a closed mesh");
    let drilled = {
        let mut scene = SceneBuilder::default();
        let (min, max) = (DVec3::new(-1.0, -0.1, -1.0), DVec3::new(1.0, 0.1, 1.0));
        let mut operands = vec![Operand::shape(scene.cuboid("", Cuboid { min, max }))];
        for i in 0..44 {
            let at = DVec3::new(f64::from(i % 7) - 3.0, -0.8, f64::from(i / 7) - 3.0) * 0.28;
            operands.push(Operand::shape(upright(&mut scene, at, 0.5, 0.08)));
        }
        let shape = scene.csg("", Operator::Difference, &operands);
        scene.instance("", Edge::shape(shape));
        scene.finish().expect("a drilled plate")
    };
    let lines: Vec<[DVec3; 2]> = (0..997)
        .map(|i| {
            let turn = |k: f64| libm::sin(f64::from(i) * k);
            let org = DVec3::new(turn(0.7), turn(1.3), turn(2.1)) * 4.0;
            let target = DVec3::new(turn(3.1), turn(0.37) * 0.1, turn(1.9)) * 0.8;
            [org, target - org]
        })
        .collect();
    for (name, scene) in [
        ("mesh", &mesh),
        ("drilled", &drilled),
        ("parts", &parts(20)),
    ] {
        let instances = Instances::of(scene).expect("few");
        let solids = Solids::prepare(scene, &instances).expect("few");
        let scratch = &mut TraceScratch::default();
        let mut all = || {
            let spans = |[org, dir]: &[DVec3; 2]| solids.spans(*org, *dir, scratch).rows.len();
            lines.iter().map(spans).filter(|spans| *spans > 0).count()
        };
        if name != "parts" {
            assert!(all() * 2 > lines.len());
        }
        group.throughput(Throughput::Elements(lines.len() as u64));
        group.bench_function(name, |b| b.iter(&mut all));
    }
}

criterion_group! {
    name = benches;
    config = quick();
    targets = solids, spans
}
criterion_main!(benches);
