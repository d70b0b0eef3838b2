//! Compares the k-d tree with the linear scan, ray by ray and bit by bit, on small random
//! scenes and degenerate ones, for every stopping rule and every way to clip.

use crate::common::{Random, RayColumns, property};
use glam::DVec3;
use lanecast::internals::accel::{Index, Primitives};
use lanecast::internals::accel::{KdClip, KdQuality, KdStop, Structure, World, build_kd};
use lanecast::internals::geom::{Cuboid, Sphere};
use lanecast::internals::math::Aabb32;
use lanecast::internals::plan::{Kernels, Precision, native_width};
use lanecast::internals::scene::*;
use proptest::prelude::*;

type Triangle = [DVec3; 3];

/// Sets of triangles, among them all that a builder may stumble over.
fn triangles(random: &mut Random) -> Vec<Triangle> {
    let count = 1 + random.below(40) as usize;
    let any = |random: &mut Random| [(); 3].map(|()| random.vector());
    let one = any(random);
    let (u, v) = (random.vector(), random.vector());
    let family = random.below(11);
    (0..count)
        .map(|i| match family {
            0 => any(random),
            // All of them identical.
            1 => one,
            // In a plane of the axes, or in another one.
            2 => any(random).map(|p| DVec3::new(p.x, 0.25, p.z)),
            3 => any(random).map(|p| u * p.x + v * p.y),
            // On a line, and at a point.
            4 => any(random).map(|p| u * p.x),
            5 => [u; 3],
            // Each inside the next.
            6 => one.map(|p| p * (i as f64 + 1.0) / count as f64),
            // About a common corner.
            7 => [DVec3::ZERO, random.vector(), random.vector()],
            // Long and thin, shorter and shorter.
            8 => {
                let (from, along) = (random.vector(), random.vector());
                let width = random.vector() * f64::powi(10.0, -1 - (i % 6) as i32);
                [from, from + along * 3.0, from + width]
            }
            // Facets of a lattice: planar, with common coordinates.
            9 => {
                let axis = random.below(3) as usize;
                let mut lattice = || (random.below(4) as f64) * 0.5;
                let mut facet = [(); 3].map(|()| DVec3::new(lattice(), lattice(), lattice()));
                let corner = facet[0];
                facet[1][axis] = corner[axis];
                facet[2][axis] = corner[axis];
                facet
            }
            // Small ones far apart.
            _ => {
                let center = random.vector() * 20.0;
                any(random).map(|p| center + p * 0.1)
            }
        })
        .collect()
}

fn scene_of(triangles: &[Triangle], solids: u64, random: &mut Random) -> Scene {
    let mut scene = SceneBuilder::default();
    let corners = triangles.iter().flatten();
    let data = MeshData {
        positions: corners.map(|p| p.to_array()).collect(),
        triangles: (0..triangles.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        ..MeshData::default()
    };
    let mesh = scene.mesh("", &data);
    scene.instance("", Edge::shape(mesh));
    for i in 0..solids {
        let center = random.vector();
        let shape = match i % 3 {
            0 => scene.sphere(
                "",
                Sphere {
                    center,
                    radius: random.size(),
                },
            ),
            1 => scene.sphere(
                "",
                Sphere {
                    center: DVec3::ZERO,
                    radius: 0.1 * (i + 1) as f64,
                },
            ),
            _ => scene.cuboid(
                "",
                Cuboid {
                    min: center,
                    max: center + random.size(),
                },
            ),
        };
        scene.instance("", Edge::shape(shape));
    }
    scene.finish().expect("a good scene")
}

/// Through the set, at corners, along axes, and (`level`) along the triangles'
/// own planes.
fn rays(triangles: &[Triangle], random: &mut Random, level: bool) -> RayColumns {
    let mut rays = RayColumns::default();
    let narrow = |v: DVec3| v.to_array().map(|x| x as f32);
    for i in 0..96 {
        let triangle = &triangles[random.below(triangles.len() as u64) as usize];
        let inside = |random: &mut Random| {
            let w = [(); 3].map(|()| random.unit().abs());
            let sum: f64 = w.iter().sum();
            (0..3).map(|k| triangle[k] * w[k]).sum::<DVec3>() / sum
        };
        let (org, at) = match i % 4 {
            0 => (random.vector() * 3.0, inside(random)),
            1 => (random.vector() * 3.0, triangle[random.below(3) as usize]),
            2 => {
                let at = triangle[random.below(3) as usize];
                let axis = random.below(3) as usize;
                let mut org = at;
                org[axis] -= 4.0;
                (org, at)
            }
            _ if level => {
                let [a, b, c] = *triangle;
                let weights = [random.unit() * 3.0, random.unit() * 3.0];
                (
                    a + (b - a) * weights[0] + (c - a) * weights[1],
                    inside(random),
                )
            }
            _ => (inside(random), inside(random) + random.vector() * 1e-3),
        };
        let dir = narrow(at - org);
        if dir.iter().any(|x| *x != 0.0) {
            rays.push(org, dir);
        }
    }
    rays
}

/// Both precisions, one lane and the machine's width.
fn same_as_linear(scene: &Scene, rays: &RayColumns, qualities: &[KdQuality]) {
    let instances = Instances::of(scene).unwrap();
    let linear = World::build(scene, &instances, Structure::Linear);
    for precision in [Precision::Exact, Precision::Fast] {
        let expected = rays.closest(
            &linear,
            &Kernels {
                precision,
                lanes: 1,
            },
        );
        for quality in qualities {
            let world = World::build(scene, &instances, Structure::Kd(*quality));
            for lanes in [1, native_width()] {
                let found = rays.closest(&world, &Kernels { precision, lanes });
                for (i, (a, b)) in expected.iter().zip(&found).enumerate() {
                    let same = a.1 == b.1
                        && (a.1 == lanecast::internals::trace::HitId::NONE || a.0 == b.0);
                    let ray = rays.ray(i);
                    assert!(
                        same,
                        "{a:?} {b:?}: {ray:?}, {precision:?} {lanes} {quality:?}"
                    );
                }
            }
        }
    }
}

fn qualities(clips: &[KdClip]) -> Vec<KdQuality> {
    let mut all = Vec::new();
    for stop in KdStop::ALL {
        for clip in clips {
            all.push(KdQuality {
                stop,
                clip: *clip,
                ..KdQuality::default()
            });
        }
    }
    all.push(KdQuality {
        depth: Some(64),
        stop: KdStop::Depth,
        ..KdQuality::default()
    });
    all.push(KdQuality {
        depth: Some(0),
        ..KdQuality::default()
    });
    all
}

proptest! {
    #![proptest_config(property(1250))]

    #[test]
    fn hits_are_those_of_a_linear_scan(seed in any::<u64>()) {
        let random = &mut Random(seed);
        let triangles = triangles(random);
        let solids = random.below(3) * random.below(8);
        let scene = scene_of(&triangles, solids, random);
        let level = rays(&triangles, random, true);
        same_as_linear(&scene, &level, &qualities(&[KdClip::Box, KdClip::Plane]));
    }

    #[test]
    fn triangles_themselves_serve_for_rays_that_do_not_run_along_them(seed in any::<u64>()) {
        let random = &mut Random(seed);
        let triangles = triangles(random);
        let scene = scene_of(&triangles, 0, random);
        let instances = Instances::of(&scene).unwrap();
        let across = rays(&triangles, random, false);
        let linear = World::build(&scene, &instances, Structure::Linear);
        let exact = Kernels { precision: Precision::Exact, lanes: 1 };
        let expected = across.closest(&linear, &exact);
        for quality in qualities(&[KdClip::Triangle]) {
            let world = World::build(&scene, &instances, Structure::Kd(quality));
            prop_assert_eq!(&across.closest(&world, &exact), &expected);
        }
    }
}

/// Nothing that is bounded.
#[test]
fn empty_scenes() {
    let mut scene = SceneBuilder::default();
    let floor = lanecast::internals::geom::HalfSpace {
        normal: DVec3::Y,
        offset: 0.0,
    };
    let floor = scene.half_space("", floor);
    scene.instance("", Edge::shape(floor));
    let scene = scene.finish().unwrap();
    let mut rays = RayColumns::default();
    rays.push(DVec3::Y, [0.1, -1.0, 0.2]);
    rays.push(DVec3::Y, [0.1, 1.0, 0.2]);
    same_as_linear(&scene, &rays, &qualities(&[KdClip::Plane]));
}

/// Threads share the building; the tree is the same.
#[test]
fn trees_do_not_depend_on_threads() {
    let random = &mut Random(7);
    let corners: Vec<[[f32; 3]; 3]> = (0..20_000)
        .map(|_| {
            let center = random.vector();
            [(); 3].map(|()| {
                (center + random.vector() * 0.02)
                    .to_array()
                    .map(|x| x as f32)
            })
        })
        .collect();
    let boxes: Vec<Aabb32> = corners
        .iter()
        .map(lanecast::internals::accel::corner_bounds)
        .collect();
    let primitives = Primitives {
        boxes: &boxes,
        corners: Some(&corners),
    };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let build = || build_kd(&primitives, &KdQuality::default());
        pool.build().unwrap().install(build)
    };
    let (one, three) = (on(1), on(3));
    assert!(one == three);
    let figures = one.0.figures();
    assert!(figures.depth > 8 && figures.references >= 20_000);
    // Clipping and stopping do something.
    let of = |clip, stop| {
        let quality = KdQuality {
            clip,
            stop,
            ..KdQuality::default()
        };
        build_kd(&primitives, &quality).0.figures()
    };
    let [as_box, plane, triangle] = KdClip::ALL.map(|clip| of(clip, KdStop::Cost).sah);
    assert!(as_box > plane && plane > triangle);
    let count = of(KdClip::Plane, KdStop::Count);
    assert!(figures.references < count.references);
}
