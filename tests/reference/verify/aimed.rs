//! Aimed rays are hard for f32, and moving a scene changes nothing but its place.

use super::*;
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::geom::{Cone, Cylinder, Ellipsoid, HalfSpace, Quadric};
use lanecast::internals::measure::adversarial::*;
use lanecast::internals::plan::{Kernels, Precision};

const COUNT: usize = 4000;

type Maker = fn(&mut SceneBuilder) -> ShapeId;

/// One of each kind, away from the origin.
const KINDS: [(&str, Maker); 10] = [
    ("sphere", |b| {
        let (center, radius) = (DVec3::new(0.3, 0.1, -0.7), 1.1);
        b.sphere("", Sphere { center, radius })
    }),
    ("ellipsoid", |b| {
        let (center, radii) = (DVec3::new(0.3, 0.1, -0.7), DVec3::new(1.1, 0.3, 2.0));
        b.ellipsoid("", Ellipsoid { center, radii })
    }),
    ("cylinder", |b| {
        let (base, top) = (DVec3::new(0.3, 0.1, -0.7), DVec3::new(0.5, 1.9, 0.2));
        let (radius, open) = (0.7, false);
        let row = Cylinder {
            base,
            top,
            radius,
            open,
        };
        b.cylinder("", row)
    }),
    ("cone", |b| {
        let row = Cone {
            base: DVec3::new(0.3, 0.1, -0.7),
            top: DVec3::new(0.5, 1.9, 0.2),
            base_radius: 0.9,
            top_radius: 0.0,
            open: false,
        };
        b.cone("", row)
    }),
    ("box", |b| {
        let (min, max) = (DVec3::new(-0.3, 0.1, -0.7), DVec3::new(0.4, 1.3, 0.1));
        b.cuboid("", Cuboid { min, max })
    }),
    ("hyperboloid", |b| {
        let coefficients = [1.0, 0.7, -0.6, 0.2, 0.1, -0.3, 0.4, -0.2, 0.1, -0.5];
        b.quadric("", Quadric { coefficients })
    }),
    ("saddle", |b| {
        let coefficients = [0.7, 0.0, -0.6, 0.0, 0.25, 0.0, 0.0, 1.0, 0.0, -0.5];
        b.quadric("", Quadric { coefficients })
    }),
    ("polygon", |b| {
        let corner = |x: f64, y: f64| DVec3::new(x, y, 0.25 * x);
        let points = [corner(0.1, 0.3), corner(1.2, 0.4), corner(0.3, 1.7)];
        b.polygon("", &points, &[])
    }),
    ("half_space", |b| {
        let (normal, offset) = (DVec3::new(0.3, 0.9, 0.1), 0.7);
        b.half_space("", HalfSpace { normal, offset })
    }),
    ("mesh", |b| {
        let corner = |i: usize| [0, 1, 2].map(|k| f64::from(u8::from(i >> k & 1 == 1)) * 1.7);
        let data = MeshData {
            positions: (0..8).map(corner).collect(),
            triangles: vec![
                [0, 1, 2],
                [1, 3, 2],
                [4, 5, 6],
                [5, 7, 6],
                [0, 1, 4],
                [1, 5, 4],
                [2, 3, 6],
                [3, 7, 6],
            ],
            ..MeshData::default()
        };
        b.mesh("", &data)
    }),
];

/// A shape of one kind, turned and moved.
fn placed(make: Maker) -> Scene {
    let mut b = SceneBuilder::default();
    let shape = make(&mut b);
    let turn = glam::DAffine3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
    let place = glam::DAffine3::from_translation(DVec3::new(0.5, -1.25, 3.0)) * turn;
    let at = b.transform(place.into());
    b.instance("", Edge::shape(shape).transform(at));
    b.camera(
        "",
        Camera::perspective(DVec3::new(0.7, 2.0, 9.0), DVec3::Y, DVec3::Y, 45.0),
    );
    b.finish().expect("the test's own scene is sound")
}

fn aimed(scene: &Scene, rows: &[Instance], seed: u64) -> Vec<Aimed> {
    adversarial_rays(scene, rows, &scene.cameras.rows[0], COUNT, seed)
}

#[test]
fn aimed_rays_are_many_finite_and_the_same_again() {
    for (kind, make) in KINDS {
        let scene = placed(make);
        let rows = Instances::of(&scene).unwrap().rows.clone();
        let rays = aimed(&scene, &rows, 7);
        assert_eq!(rays, aimed(&scene, &rows, 7), "{kind}");
        assert_ne!(rays, aimed(&scene, &rows, 8), "{kind}");
        assert!(rays.len() > COUNT * 99 / 100, "{kind}: {}", rays.len());
        for ray in &rays {
            let finite = ray.org.iter().all(|x| x.is_finite());
            assert!(finite && ray.dir.iter().all(|x| x.is_finite()), "{ray:?}");
            assert!(ray.dir != [0.0; 3] && ray.t_max > 0.0, "{ray:?}");
        }
    }
    let empty = SceneBuilder::default().finish();
    if let Ok(empty) = empty {
        let camera = Camera::perspective(DVec3::X, DVec3::ZERO, DVec3::Y, 45.0);
        assert_eq!(adversarial_rays(&empty, &[], &camera, 5, 0), []);
    }
}

/// That is what they are for: of rays in general f32 gets a few in a million wrong.
#[test]
fn of_every_kind_aimed_rays_are_hard_for_f32() {
    for (kind, make) in KINDS {
        let scene = placed(make);
        let instances = Instances::of(&scene).unwrap();
        let reference = Reference::new(&scene, &instances).unwrap();
        let world = World::build(&scene, &instances, Structure::Bvh);
        let rays = aimed(&scene, &instances.rows, 1);
        let rows = |precision| {
            let kernels = Kernels {
                precision,
                lanes: 1,
            };
            trace_aimed(&world, &kernels, &rays, 0, &Progress::default()).unwrap()
        };
        let fast = rows(Precision::Fast);
        assert_eq!(fast.len(), 2 * rays.len());
        // Nearest hits first, then any, of the same rays.
        for (row, ray) in fast.iter().zip(rays.iter().chain(&rays)) {
            assert_eq!((row.org, row.dir, row.t_max), (ray.org, ray.dir, ray.t_max));
        }
        let compared = replay(&reference, &fast, &ALL);
        let counts = compared.counts;
        assert!(counts.wrong() > COUNT as u64 / 100, "{kind}: {counts:?}");
        // The reference may be asked about each ray once, for all modes.
        let none = Progress::default();
        let nearest = nearest_hits(&reference, &rays, &none).unwrap();
        let once = replay_aimed(&reference, &nearest, &fast, &ALL, &none).unwrap();
        assert_eq!(once.counts, counts, "{kind}");
        assert_eq!(once.t_ulps, compared.t_ulps, "{kind}");
        assert_eq!(once.wrong_kinds, compared.wrong_kinds, "{kind}");
        let hits = fast
            .iter()
            .filter(|r| matches!(r.outcome, Outcome::Hit { .. } | Outcome::Blocked));
        assert!(hits.count() > COUNT / 4, "{kind}");
        if kind == "mesh" {
            for precision in [Precision::Guarded, Precision::Exact] {
                let c = replay(&reference, &rows(precision), &ALL);
                assert_eq!(c.counts.wrong(), 0, "{precision:?} {:?}", c.mismatches);
            }
        }
    }
}

#[test]
fn a_moved_scene_is_the_same_scene_elsewhere() {
    let (scale, offset) = (4.0, DVec3::new(8.0, -16.0, 32.0));
    let before = scene();
    let after = before.clone().moved(scale, offset).unwrap();
    let all = [&before, &after].map(|s| Instances::of(s).unwrap());
    let [here, there] = [(&before, &all[0]), (&after, &all[1])]
        .map(|(scene, all)| Reference::new(scene, all).unwrap());
    // Numbers of few bits, so that nothing is rounded.
    let mut hits = 0;
    for i in 0..4000 {
        let part = |k: i32| f64::from(i / k % 16) / 4.0 - 2.0;
        let (org, dir) = (
            DVec3::new(part(1), 3.0 + part(16), 9.0),
            DVec3::new(part(256), -0.5, -4.0),
        );
        let one = here.nearest(org.to_array(), dir.to_array(), f64::INFINITY);
        let moved = (org * scale + offset).to_array();
        let other = there.nearest(moved, (dir * scale).to_array(), f64::INFINITY);
        assert_eq!(one, other);
        hits += u32::from(one.is_some());
    }
    assert!(hits > 1000, "{hits}");
    // The cameras and lights are where the shapes are.
    let (eye, moved) = (before.cameras.rows[0].eye, after.cameras.rows[0].eye);
    assert_eq!(moved, eye * scale + offset);
    let light = |scene: &Scene| match scene.lights[0] {
        Light::Point {
            position,
            intensity,
            ..
        } => (position, intensity[0]),
        _ => panic!("the first is a point"),
    };
    let ((p, i), (q, j)) = (light(&before), light(&after));
    assert_eq!((q, j), (p * scale + offset, i * 16.0));
    assert_eq!(before.lights[1], after.lights[1]);
    // Nothing happens for nothing; what f64 cannot hold is refused.
    let same = before.clone().moved(1.0, DVec3::ZERO).unwrap();
    assert_eq!(same.nodes.len(), before.nodes.len());
    assert!(before.clone().moved(1e308, DVec3::ZERO).is_err());
    assert!(before.moved(1e-320, DVec3::ZERO).is_err());
}
