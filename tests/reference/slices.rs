//! Slices of a shutter against the reference: each is an exact static scene of its time.

use crate::common::{
    Random, RayColumns, campaign, dented, in_repository, kernels, load, random_mesh, random_shape,
};
use glam::{DAffine3, DVec3};
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::csg::Operator;
use lanecast::internals::geom::{Cuboid, Sphere};
use lanecast::internals::math::Affine;
use lanecast::internals::plan::Precision;
use lanecast::internals::reference::Reference;
use lanecast::internals::render::{Exposure, Slices};
use lanecast::internals::scene::{
    Camera, Edge, Instances, Interpolation, Key, MeshData, Operand, Scene, SceneBuilder, ShapeId,
    ShutterShape,
};
use lanecast::internals::trace::HitId;

/// Puts nine placements of a shape on ways of their own, some stretched, some below a node that
/// moves as well.
fn swarm(scene: &mut SceneBuilder, shape: ShapeId, seed: u64, interpolation: Interpolation) {
    let random = &mut Random(seed);
    let place = |random: &mut Random, degrees: f64| -> Affine {
        let size = DVec3::splat(0.7) + random.vector() * 0.3;
        let to = DAffine3::from_translation(random.vector() * 2.0);
        (to * DAffine3::from_rotation_y(degrees.to_radians()) * DAffine3::from_scale(size)).into()
    };
    for i in 0..9 {
        let start = place(random, 0.0);
        let keys = [0.3, 0.7, 1.0].map(|at| Key {
            at,
            local: place(random, 100.0 * at),
        });
        let id = scene.moving_by(interpolation, start, &keys);
        let edge = Edge::shape(shape).transform(id);
        let edge = match i % 3 {
            0 => {
                let node = scene.node("", &[edge]);
                let away = DAffine3::from_translation(DVec3::new(0.3, 0.1, -0.4));
                let keys = [Key {
                    at: 1.0,
                    local: away.into(),
                }];
                let id = scene.moving(Affine::IDENTITY, &keys);
                Edge::node(node).transform(id)
            }
            _ => edge,
        };
        scene.instance("", edge);
    }
}

fn finished(mut scene: SceneBuilder) -> Scene {
    let eye = DVec3::new(0.0, 1.0, 8.0);
    scene.camera("", Camera::perspective(eye, DVec3::ZERO, DVec3::Y, 40.0));
    scene.finish().unwrap()
}

fn meshes() -> Scene {
    let mut scene = SceneBuilder::default();
    let corners = dented(|x, y| DVec3::new(x, y, 0.3 * x * y));
    let leaf = MeshData {
        positions: corners.iter().map(|p| p.to_array()).collect(),
        triangles: vec![[0, 1, 3], [1, 2, 3], [0, 3, 4]],
        ..MeshData::default()
    };
    let soup = random_mesh(&mut Random(5));
    let keys = [0.4, 1.0].map(|at| {
        let random = &mut Random((at * 10.0) as u64);
        let mut key = soup.clone();
        for vertex in &mut key.positions {
            *vertex = (DVec3::from_array(*vertex) + random.vector() * 0.4).to_array();
        }
        (at, key)
    });
    let deforming = scene.deforming_mesh("", &soup, &keys);
    swarm(&mut scene, deforming, 3, Interpolation::Rigid);
    let soup = scene.mesh("", &soup);
    let leaf = scene.mesh("", &leaf);
    swarm(&mut scene, soup, 1, Interpolation::Linear);
    swarm(&mut scene, leaf, 2, Interpolation::Rigid);
    finished(scene)
}

fn solids() -> Scene {
    let mut scene = SceneBuilder::default();
    let ball = scene.sphere(
        "",
        Sphere {
            center: DVec3::ZERO,
            radius: 0.8,
        },
    );
    let block = scene.cuboid(
        "",
        Cuboid {
            min: DVec3::new(-1.0, -0.3, -0.3),
            max: DVec3::new(1.0, 0.3, 0.3),
        },
    );
    let operands = [ball, block].map(Operand::shape);
    let drilled = scene.csg("", Operator::Difference, &operands);
    swarm(&mut scene, drilled, 3, Interpolation::Rigid);
    finished(scene)
}

/// Shapes of many kinds.
fn shapes() -> Scene {
    let mut scene = SceneBuilder::default();
    for seed in 0..8 {
        let shape = random_shape(&mut scene, &mut Random(30 + seed));
        let interpolation = [Interpolation::Linear, Interpolation::Rigid][seed as usize % 2];
        swarm(&mut scene, shape, 10 + seed, interpolation);
    }
    finished(scene)
}

/// Asks the lanes and the reference about random pairs of rays and slices, and returns how many
/// there were, how many rays hit, and what was wrong.
fn compare(scene: Scene, pairs: usize, seed: u64) -> (usize, usize, Vec<String>) {
    let instances = Instances::of(&scene).unwrap();
    let world = World::build(&scene, &instances, Structure::Bvh);
    let exposure = Exposure {
        open: 0.0,
        close: 1.0,
        shape: ShutterShape::Box,
        slices: 256,
    };
    let camera = scene.cameras.rows[0];
    let slices = Slices::build(&world, (&camera, Some(0)), &exposure).unwrap();
    let random = &mut Random(seed);
    let mut by_slice: Vec<RayColumns> = Vec::new();
    by_slice.resize_with(256, RayColumns::default);
    for _ in 0..pairs {
        let rays = &mut by_slice[random.below(256) as usize];
        let org = match random.below(2) {
            0 => camera.eye,
            _ => random.vector() * 8.0,
        };
        let to = random.vector() * 3.0;
        rays.push(org, (to - org).to_array());
    }
    let (mut asked, mut hits, mut wrong) = (0, 0, Vec::new());
    for (number, rays) in by_slice.iter().enumerate() {
        // The scene of a slice is made anew here, from that of the file.
        let there = scene.clone().at(exposure.time(number as u32)).unwrap();
        let placed = Instances::of(&there).unwrap();
        let reference = Reference::new(&there, &placed).unwrap();
        let answers = rays.closest(&slices.rows[number].world, &kernels(Precision::Guarded));
        for (i, (t, id)) in answers.into_iter().enumerate() {
            let (org, dir) = rays.ray(i);
            let truth = reference.nearest(org, dir, f64::INFINITY);
            asked += 1;
            hits += usize::from(truth.is_some());
            let ours = (id != HitId::NONE).then_some((id.instance, id.primitive));
            // The t of guarded is one evaluation in f32 (S58), about the size of what it meets.
            let right = ours == truth.map(|hit| (hit.instance, hit.primitive))
                && truth.is_none_or(|hit| (t - hit.t).abs() <= 1e-4 * hit.t + 1e-6);
            if !right {
                wrong.push(format!(
                    "slice {number}, {org:?} {dir:?}: {ours:?} at {t}, {truth:?}"
                ));
            }
        }
    }
    (asked, hits, wrong)
}

fn check(pairs: usize) {
    let of_file = |path: &str| load(&in_repository(path), 1.5).scene;
    let scenes = [
        ("moving", of_file("scenes/moving.toml")),
        ("shutter", of_file("scenes/shutter.toml")),
        ("meshes", meshes()),
        ("solids", solids()),
        ("shapes", shapes()),
    ];
    for (seed, (name, scene)) in (0..).zip(scenes) {
        let (asked, hits, wrong) = compare(scene, pairs, seed);
        println!("{name}: {asked} pairs, {hits} hits, {} wrong", wrong.len());
        assert!(hits * 20 > asked, "{name}: hardly anything is met");
        assert!(wrong.is_empty(), "{name}: {}", wrong[0]);
    }
}

#[test]
fn slices_are_as_the_reference_says() {
    check(campaign(40_000));
}

#[test]
#[ignore = "asks the reference about a million rays; run it after changes of motion"]
fn slices_are_as_the_reference_says_a_million_times() {
    check(200_000);
}
