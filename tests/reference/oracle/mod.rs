//! Compares the reference with formulas worked out by hand, with itself without its tree, and
//! with published hits.

use glam::{DAffine3, DVec3};
use lanecast::internals::geom::{Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Quadric, Sphere};
use lanecast::internals::reference::{Grid, Hit, Reference, camera_ray, shadow};
use lanecast::internals::scene::*;

mod implicit_operands;
mod implicits;
mod mesh_hits;
mod properties;
mod quadrics;
mod shapes;
mod surfaces;

use shapes::*;

const INF: f64 = f64::INFINITY;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn scene_of(fill: impl FnOnce(&mut SceneBuilder)) -> (Scene, Instances) {
    let mut b = SceneBuilder::default();
    fill(&mut b);
    let scene = b.finish().expect("the test's own scene is sound");
    let instances = Instances::of(&scene).expect("and small");
    (scene, instances)
}

fn place(b: &mut SceneBuilder, make: impl FnOnce(&mut SceneBuilder) -> ShapeId) {
    let shape = make(b);
    b.instance("", Edge::shape(shape));
}

/// Both tracers must agree before their answer is looked at.
fn ask(
    make: impl FnOnce(&mut SceneBuilder) -> ShapeId,
    org: [f64; 3],
    dir: [f64; 3],
) -> Option<Hit> {
    ask_all(|b| place(b, make), org, dir)
}

fn ask_all(fill: impl FnOnce(&mut SceneBuilder), org: [f64; 3], dir: [f64; 3]) -> Option<Hit> {
    let (scene, all) = scene_of(fill);
    let answer = Reference::brute_force(&scene, &all)
        .unwrap()
        .nearest(org, dir, INF);
    assert_eq!(
        answer,
        Reference::new(&scene, &all).unwrap().nearest(org, dir, INF),
        "the tree changes nothing"
    );
    answer
}

fn certain(answer: &Option<Hit>) -> Hit {
    answer.expect("a hit")
}

fn expect(
    make: impl FnOnce(&mut SceneBuilder) -> ShapeId,
    org: [f64; 3],
    dir: [f64; 3],
    t: f64,
    normal: [f64; 3],
) {
    let hit = certain(&ask(make, org, dir));
    assert!((hit.t - t).abs() <= 1e-15 * t.abs(), "t {} not {t}", hit.t);
    let off = (DVec3::from_array(hit.normal) - DVec3::from_array(normal)).length();
    assert!(off < 1e-14, "normal {:?} not {normal:?}", hit.normal);
}

fn expect_miss(make: impl FnOnce(&mut SceneBuilder) -> ShapeId, org: [f64; 3], dir: [f64; 3]) {
    assert_eq!(ask(make, org, dir), None);
}

/// Where t is an f64 and known by hand.
fn expect_at(
    make: impl FnOnce(&mut SceneBuilder) -> ShapeId,
    org: [f64; 3],
    dir: [f64; 3],
    t: f64,
) {
    let hit = ask(make, org, dir);
    assert_eq!(hit.map(|hit| hit.t), Some(t), "{hit:?}");
}

#[test]
fn of_two_at_one_place_the_lower_instance_is_the_answer() {
    for kind in KINDS {
        let twice = |b: &mut SceneBuilder| {
            place(b, kind);
            place(b, kind);
        };
        let answer = ask_all(twice, [0.75, 0.25, 9.0], [0.0, -0.25, -1.0]);
        assert_eq!(answer.map_or(0, |hit| hit.instance), 0);
    }
    // A ball and a box that touch the plane y = 2 in one point, and that plane: all
    // meet the ray there, at an irrational t of the ball's and rational others.
    for order in [[0, 1, 2], [1, 2, 0], [2, 1, 0], [2, 0, 1]] {
        let kinds: [Maker; 3] = [sphere, block, ground];
        let all = |b: &mut SceneBuilder| {
            for kind in order {
                place(b, kinds[kind]);
            }
        };
        let hit = certain(&ask_all(all, [1.0, 5.0, 0.0], [0.0, -1.5, 0.0]));
        assert_eq!((hit.t, hit.instance), (2.0, 0));
    }
}

#[test]
fn the_range_of_t_is_open() {
    let (scene, all) = scene_of(|b| place(b, sphere));
    let reference = Reference::new(&scene, &all).unwrap();
    let (org, dir) = ([-5.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
    for (t_max, met) in [(3.9, false), (4.0, false), (4.0_f64.next_up(), true)] {
        assert_eq!(reference.nearest(org, dir, t_max).is_some(), met);
        assert_eq!(reference.blocked(org, dir, t_max), met);
    }
}

#[test]
fn nonsense_rays_are_answered() {
    let (scene, all) = scene_of(|b| {
        for kind in KINDS {
            place(b, kind);
        }
    });
    let odd = [0.0, f64::NAN, INF, -INF, 1e300, -1e-320, 1.0];
    for reference in [
        Reference::new(&scene, &all).unwrap(),
        Reference::brute_force(&scene, &all).unwrap(),
    ] {
        for a in odd {
            for b in odd {
                for t_max in odd {
                    let hit = reference.nearest([a, b, a], [b, a, 0.0], t_max);
                    assert!(hit.is_none() || a.is_finite() && b.is_finite());
                    let _ = reference.blocked([b, 0.0, a], [a, b, b], t_max);
                }
            }
        }
    }
}

#[test]
fn cameras_look_where_they_should() {
    let camera = Camera::perspective(v(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y, 90.0);
    let ray = |size, grid, at| camera_ray(&camera, size, grid, at);
    // 4×2 centres: x at ±0.75, ±0.25 of the half width 2, y at ±0.5.
    let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-7);
    assert!(near(
        ray([4, 2], Grid::Centers, [0, 0]).dir,
        [-1.5, 0.5, -1.0]
    ));
    assert!(near(
        ray([4, 2], Grid::Centers, [3, 1]).dir,
        [1.5, -0.5, -1.0]
    ));
    // 5×3 corners: the aspect is 4 / 2, and the edges belong to it.
    assert!(near(
        ray([5, 3], Grid::Corners, [0, 0]).dir,
        [-2.0, 1.0, -1.0]
    ));
    assert!(near(
        ray([5, 3], Grid::Corners, [2, 1]).dir,
        [0.0, 0.0, -1.0]
    ));
    assert!(near(
        ray([5, 3], Grid::Corners, [4, 2]).dir,
        [2.0, -1.0, -1.0]
    ));
    assert!(near(
        ray([1, 1], Grid::Corners, [0, 0]).dir,
        [0.0, 0.0, -1.0]
    ));
    assert_eq!(ray([4, 2], Grid::Centers, [0, 0]).org, [0.0, 0.0, 5.0]);

    let camera = Camera::orthographic(v(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y, 4.0);
    let ray = camera_ray(&camera, [4, 2], Grid::Centers, [0, 0]);
    assert_eq!((ray.org, ray.dir), ([-3.0, 1.0, 5.0], [0.0, 0.0, -1.0]));
}

#[test]
fn shadows_leave_no_acne_and_no_leak() {
    // A ball a millimetre wide, a kilometre from the origin, under a scale.
    let (scene, all) = scene_of(|b| {
        let scale = b.transform(DAffine3::from_scale(v(1e3, 3e3, 1e3)).into());
        let ball = b.sphere(
            "",
            Sphere {
                center: v(1.0, 0.0, 0.0),
                radius: 1e-6,
            },
        );
        b.instance("", Edge::shape(ball).transform(scale));
    });
    let reference = Reference::new(&scene, &all).unwrap();
    let org = [1e3, 0.0, 10.0];
    let (mut lit, mut dark) = (0, 0);
    for i in 0..400 {
        let dir = [
            (f64::from(i % 20) - 9.5) * 1e-5,
            (f64::from(i / 20) - 9.5) * 3e-5,
            -1.0,
        ];
        let Some(hit) = reference.nearest(org, dir, INF) else {
            continue;
        };
        for x in [1.0, -1.0] {
            let direction = v(-x, 0.0, -1.0);
            let light = Light::Directional {
                direction,
                irradiance: [1.0; 3],
                angle: 0.0,
            };
            let facing = -DVec3::from_array(hit.normal).dot(direction);
            let own = shadow(&reference, org, dir, &hit, &light);
            if facing.abs() > 1e-2 {
                assert_eq!(own.blocked, facing < 0.0, "facing {facing}");
                lit += u32::from(!own.blocked);
                dark += u32::from(own.blocked);
            }
        }
    }
    assert!(lit > 200 && dark > 20, "{lit} {dark}");
}
