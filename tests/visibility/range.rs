//! Scenes so small and directions so long that the arithmetic of boxes underflows or
//! overflows in f32: every structure has the hits of testing one primitive at a time.

use crate::common::{Random, RayColumns, kernels, structures};
use glam::{DAffine3, DVec3};
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::geom::{Cuboid, Sphere};
use lanecast::internals::plan::{Kernels, Precision};
use lanecast::internals::scene::{Edge, Instances, MeshData, Scene, SceneBuilder};
use lanecast::internals::trace::{Caching, HitId, ShadowCache};

/// Boxes, balls and a mesh of tetrahedra within 1 of the origin, made `size` as large.
fn scene(random: &mut Random, size: f64) -> Scene {
    let mut b = SceneBuilder::default();
    let mut mesh = MeshData::default();
    for i in 0..90 {
        let center = random.vector() * size;
        let (half, radius) = (random.vector().abs() * (0.3 * size), 0.2 * size);
        let shape = match i % 3 {
            0 => b.cuboid(
                "",
                Cuboid {
                    min: center - half,
                    max: center + half,
                },
            ),
            1 => b.sphere("", Sphere { center, radius }),
            _ => {
                let first = mesh.positions.len() as u32;
                let corners = [(); 4].map(|()| center + random.vector() * radius);
                mesh.positions.extend(corners.map(|p| p.to_array()));
                let of = |skipped: u32| [1, 2, 3].map(|k| first + (skipped + k) % 4);
                mesh.triangles.extend([0, 1, 2, 3].map(of));
                continue;
            }
        };
        b.instance("", Edge::shape(shape));
    }
    let mesh = b.mesh("", &mesh);
    b.instance("", Edge::shape(mesh));
    b.finish().unwrap()
}

/// `guarded` and `exact` find `expected` in every structure, and whether there is anything.
fn agree(scene: &Scene, rays: &RayColumns, expected: &[HitId], why: &str) {
    let instances = Instances::of(scene).unwrap();
    let endless = vec![f32::INFINITY; rays.len()];
    for structure in structures() {
        let world = World::build(scene, &instances, structure);
        for precision in [Precision::Guarded, Precision::Exact] {
            let kernels = kernels(precision);
            let compare = |found: Vec<(f64, HitId)>, by: &str| {
                let wrong = (found.iter().zip(expected)).filter(|((_, id), e)| id != *e);
                let wrong = wrong.count();
                let what = format!("{why}: {structure:?} {precision:?} {by}");
                assert_eq!(wrong, 0, "{what}, of {} rays", rays.len());
            };
            compare(rays.closest(&world, &kernels), "closest");
            if let Some(found) = rays.closest_listed(&world, &kernels) {
                compare(found, "listed");
            }
            let any = rays.any(
                &world,
                &kernels,
                &endless,
                &mut ShadowCache::new(Caching::On),
            );
            let wrong = (any.iter().zip(expected)).filter(|(any, e)| **any != (**e != HitId::NONE));
            assert_eq!(wrong.count(), 0, "{why}: {structure:?} {precision:?} any");
        }
    }
}

/// What the linear scan finds of the same rays, each alone.
fn one_by_one(scene: &Scene, rays: &RayColumns) -> Vec<HitId> {
    let instances = Instances::of(scene).unwrap();
    let world = World::build(scene, &instances, Structure::Linear);
    let kernels = Kernels {
        lanes: 1,
        ..kernels(Precision::Exact)
    };
    let found = rays.closest(&world, &kernels);
    found.into_iter().map(|(_, id)| id).collect()
}

/// Of one origin, and of one direction, as tiles and item buffers take them.
#[test]
fn small_scenes_to_the_end_of_f32() {
    for exponent in [-30_i32, -36, -38, -39, -40, -41, -42, -43] {
        let size = libm::exp10(f64::from(exponent));
        let random = &mut Random(exponent.unsigned_abs().into());
        let scene = scene(random, size);
        let eye = DVec3::new(0.3, -0.2, 2.5) * size;
        let [mut fan, mut row] = [RayColumns::default(), RayColumns::default()];
        for i in 0..1024 {
            let place = |x: i32| f64::from(x) - 15.5;
            let across = DVec3::new(place(i % 32), place(i / 32), 0.0);
            let dir = across * (1.0 / 30.0) - DVec3::Z;
            fan.push(eye, dir.as_vec3().to_array());
            let org = eye + across * (size / 15.0);
            row.push(org, [0.1, -0.05, -1.0]);
        }
        for (rays, name) in [(fan, "a fan"), (row, "a row")] {
            let expected = one_by_one(&scene, &rays);
            let met = expected.iter().filter(|id| **id != HitId::NONE).count();
            assert!(met > 200, "{met}");
            agree(&scene, &rays, &expected, &format!("10^{exponent}, {name}"));
        }
    }
}

/// Times of hits below the least normal number, and below the least of all.
#[test]
fn directions_to_the_end_of_f32() {
    for (size, length) in [
        (1e-5, 1e30),
        (1e-7, 1e37),
        (1e-10, 1e30),
        (1e-12, 1e33),
        (1.0, 1e38),
        (1e-3, 1e38),
    ] {
        let random = &mut Random(11);
        let scene = scene(random, size);
        let [mut short, mut long] = [RayColumns::default(), RayColumns::default()];
        // A power of two, so that directions are the same but for it.
        let factor = libm::exp2(libm::log2(length).floor()) as f32;
        let eye = DVec3::new(0.3, -0.2, 2.5) * size;
        for i in 0..1500 {
            let org = match i / 500 {
                0 => eye,
                _ => random.vector() * (2.0 * size),
            };
            let dir = match i / 500 {
                1 => DVec3::new(0.1, -0.05, -1.0),
                _ => random.vector() * 0.8 - org / (1.5 * size),
            };
            let dir = dir.as_vec3();
            short.push(org, dir.to_array());
            long.push(org, (dir * factor).to_array());
        }
        let expected = one_by_one(&scene, &short);
        let met = expected.iter().filter(|id| **id != HitId::NONE).count();
        assert!(met > 400, "{met}");
        agree(&scene, &long, &expected, &format!("{size} by {length}"));
    }
}

/// Shapes beyond f32, and maps that bring them back.
#[test]
fn what_f32_cannot_reach_is_placed_whole() {
    let mut b = SceneBuilder::default();
    for (i, size) in [1e39, 1e40, 1e60].into_iter().enumerate() {
        let center = DVec3::ZERO;
        let half = DVec3::splat(size);
        let ball = b.sphere(
            "",
            Sphere {
                center,
                radius: size,
            },
        );
        let block = b.cuboid(
            "",
            Cuboid {
                min: -half,
                max: half,
            },
        );
        for (k, shape) in [ball, block].into_iter().enumerate() {
            let small = DAffine3::from_scale(DVec3::splat(1.0 / size));
            let place = DVec3::new(3.0 * i as f64, 3.0 * k as f64, 0.0);
            let map = b.transform((DAffine3::from_translation(place) * small).into());
            b.instance("", Edge::shape(shape).transform(map));
        }
    }
    let scene = b.finish().unwrap();
    let mut rays = RayColumns::default();
    let mut expected = Vec::new();
    for i in 0..6 {
        let (x, y) = (3.0 * f64::from(i / 2), 3.0 * f64::from(i % 2));
        let org = DVec3::new(x + 0.1, y + 0.9, 5.0);
        rays.push(org, [0.0, 0.0, -1.0]);
        let instance = i as u64;
        expected.push(HitId {
            instance,
            ..HitId::NONE
        });
        rays.push(org + DVec3::Y * 0.4, [0.0, 0.0, -1.0]);
        expected.push(HitId::NONE);
    }
    let found = one_by_one(&scene, &rays);
    for (found, expected) in found.iter().zip(&mut expected) {
        // Which face of a block it is, is not what this is about.
        if found.instance == expected.instance {
            expected.primitive = found.primitive;
        }
    }
    assert_eq!(found, expected);
    agree(&scene, &rays, &expected, "beyond f32");
}
