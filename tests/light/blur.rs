//! Open shutters: pictures against closed formulas.

use glam::DAffine3;
use lanecast::internals::light::filter::Kind as FilterKind;
use lanecast::internals::math::Affine;
use lanecast::internals::render::{Exposure, Integrator};
use lanecast::internals::scene::{
    Environment, Falloff, Interpolation, Key, Light, Model, ShutterShape,
};
use lanecast::shapes::{Cuboid, Cylinder, Sphere};
use lanecast::{
    Camera, DVec3, Edge, Material, MeshData, Picture, RenderConfig, Scene, SceneBuilder, Tracer,
    TracerOptions,
};

pub fn exposure(open: f64, close: f64) -> Exposure {
    Exposure {
        open,
        close,
        shape: ShutterShape::Box,
        slices: 256,
    }
}

fn moved(x: f64, y: f64) -> Affine {
    DAffine3::from_translation(DVec3::new(x, y, 0.0)).into()
}

fn turned(degrees: f64) -> Affine {
    DAffine3::from_rotation_z(degrees.to_radians()).into()
}

pub fn key(at: f64, local: Affine) -> Key {
    Key { at, local }
}

fn shining() -> Material {
    Material {
        emission: [1.0; 3],
        base_color: [0.0; 3],
        ..Material::default()
    }
}

pub fn rendered(scene: &Scene, config: &RenderConfig) -> Picture {
    let tracer = Tracer::new(scene, &TracerOptions::default()).unwrap();
    tracer.render(config, &Default::default(), &|_| ()).unwrap()
}

/// Returns the mean radiance of a picture.
fn mean(picture: &Picture) -> f64 {
    let all: f64 = picture.color.iter().map(|color| f64::from(color[0])).sum();
    all / picture.color.len() as f64
}

/// What shines and moves, and what a tiny window on a place at z = 0 sees of it.
struct Shown(Box<dyn Fn(&mut SceneBuilder)>);

impl Shown {
    fn at(&self, (x, y): (f64, f64), shutter: Option<Exposure>) -> f64 {
        let mut scene = SceneBuilder::default();
        (self.0)(&mut scene);
        let place = DVec3::new(x, y, 0.0);
        let eye = place + DVec3::Z * 10.0;
        scene.camera("", Camera::orthographic(eye, place, DVec3::Y, 1e-6));
        // Some light, so that no studio is put around it.
        scene.environment(Environment::uniform([0.0; 3]));
        let config = RenderConfig {
            width: 4,
            height: 4,
            spp: 4096,
            integrator: Integrator::Path,
            filter: FilterKind::Box,
            max_depth: 0,
            shutter,
            ..RenderConfig::default()
        };
        mean(&rendered(&scene.finish().unwrap(), &config))
    }
}

/// A wall whose right edge goes from x = 0 to x = 1, evenly.
fn moving_edge() -> Shown {
    Shown(Box::new(|scene| {
        let wall = scene.cuboid(
            "",
            Cuboid {
                min: DVec3::new(-9.0, -1.0, -1.0),
                max: DVec3::new(0.0, 1.0, 0.0),
            },
        );
        let material = scene.material("", shining());
        let id = scene.moving(moved(0.0, 0.0), &[key(1.0, moved(1.0, 0.0))]);
        scene.instance("", Edge::shape(wall).transform(id).material(material));
    }))
}

#[test]
fn a_moving_edge_is_a_ramp() {
    let wall = moving_edge();
    // Rounding to slices moves the edge by half a slice at most.
    let slice = 0.5 / 256.0 + 1e-3;
    for i in 0..=10 {
        let x = f64::from(i) / 10.0;
        let seen = wall.at((x, 0.0), Some(exposure(0.0, 1.0)));
        assert!((seen - (1.0 - x)).abs() < slice, "{x} {seen}");
        // A quarter of the time: the ramp is as much steeper.
        let seen = wall.at((x, 0.0), Some(exposure(0.5, 0.75)));
        let expected = ((0.75 - x) / 0.25).clamp(0.0, 1.0);
        assert!((seen - expected).abs() < slice, "{x} {seen}");
        // Beyond the keys nothing moves: half the light is of the time before.
        let seen = wall.at((x, 0.0), Some(exposure(-1.0, 1.0)));
        let expected = if x > 0.0 { 0.5 * (1.0 - x) } else { seen };
        assert!((seen - expected).abs() < slice, "{x} {seen}");
    }
}

/// A matte floor under a point light that passes over it from x = −a to a at height h: the mean of
/// I h / (x² + h²)^(3/2) is I / (h √(a² + h²)).
#[test]
fn a_light_that_passes_over_a_floor_leaves_its_mean() {
    let (a, h) = (3.0, 2.0);
    for integrator in [Integrator::Path, Integrator::Direct] {
        let mut scene = SceneBuilder::default();
        let floor = scene.polygon(
            "",
            &[
                DVec3::new(-9.0, -9.0, 0.0),
                DVec3::new(9.0, -9.0, 0.0),
                DVec3::new(9.0, 9.0, 0.0),
                DVec3::new(-9.0, 9.0, 0.0),
            ],
            &[],
        );
        let white = Material {
            model: Model::Phong {
                diffuse: [1.0; 3],
                specular: [0.0; 3],
                exponent: 1.0,
                mirror: [0.0; 3],
            },
            ..Material::default()
        };
        let white = scene.material("", white);
        scene.instance("", Edge::shape(floor).material(white));
        let at = |x: f64| Light::Point {
            position: DVec3::new(x, 0.0, h),
            intensity: [1.0; 3],
            falloff: Falloff::InverseSquare,
            radius: 0.0,
        };
        let light = scene.light(at(-a));
        scene.move_light(light, &[(0.0, at(-a)), (1.0, at(a))]);
        let eye = DVec3::Z * 10.0;
        scene.camera("", Camera::orthographic(eye, DVec3::ZERO, DVec3::Y, 1e-6));
        let config = RenderConfig {
            width: 4,
            height: 4,
            spp: 1024,
            integrator,
            filter: FilterKind::Box,
            max_depth: 1,
            shutter: Some(exposure(0.0, 1.0)),
            ..RenderConfig::default()
        };
        let seen = mean(&rendered(&scene.finish().unwrap(), &config));
        let expected = 1.0 / (h * (a * a + h * h).sqrt()) / std::f64::consts::PI;
        let error = (seen / expected - 1.0).abs();
        assert!(error < 2e-3, "{integrator:?}: {seen} {expected}");
    }
}

#[test]
fn vertices_go_straight() {
    // The right edge of a mesh that grows from half a unit to one and a half.
    let wall = Shown(Box::new(|scene| {
        let wall = |x: f64| MeshData {
            positions: vec![
                [-1.0, -1.0, 0.0],
                [x, -1.0, 0.0],
                [x, 1.0, 0.0],
                [-1.0, 1.0, 0.0],
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..MeshData::default()
        };
        let keys = [(0.5, wall(1.0)), (1.0, wall(1.5))];
        let wall = scene.deforming_mesh("", &wall(0.5), &keys);
        let material = scene.material("", shining());
        scene.instance("", Edge::shape(wall).material(material));
    }));
    for i in 0..=8 {
        let x = 0.55 + 0.11 * f64::from(i);
        let seen = wall.at((x, 0.123), Some(exposure(0.0, 1.0)));
        assert!((seen - (1.5 - x)).abs() < 0.5 / 256.0 + 1e-3, "{x} {seen}");
    }
}

#[test]
fn a_trapezoid_ramps_by_squares_at_its_ends() {
    let wall = moving_edge();
    let (rise, fall) = (0.3, 0.5);
    let shutter = Exposure {
        shape: ShutterShape::Trapezoid { rise, fall },
        ..exposure(0.0, 1.0)
    };
    let all = 1.0 - 0.5 * (rise + fall);
    for i in 0..=20 {
        let x = f64::from(i) / 20.0;
        // The light that comes in before the edge is there.
        let before = if x < rise {
            0.5 * x * x / rise
        } else if x < 1.0 - fall {
            x - 0.5 * rise
        } else {
            all - 0.5 * (1.0 - x) * (1.0 - x) / fall
        };
        let seen = wall.at((x, 0.0), Some(shutter));
        let slice = 0.5 / 256.0 / all + 1e-3;
        assert!((seen - (1.0 - before / all)).abs() < slice, "{x} {seen}");
    }
}

#[test]
fn a_propeller_shows_how_long_its_blade_is_there() {
    let half_width = 0.05;
    let blade = Shown(Box::new(move |scene| {
        let blade = scene.cuboid(
            "",
            Cuboid {
                min: DVec3::new(0.0, -half_width, -half_width),
                max: DVec3::new(1.0, half_width, half_width),
            },
        );
        let material = scene.material("", shining());
        let keys = [key(0.5, turned(90.0)), key(1.0, turned(180.0))];
        let id = scene.moving_by(Interpolation::Rigid, turned(0.0), &keys);
        scene.instance("", Edge::shape(blade).transform(id).material(material));
    }));
    for (radius, degrees) in [(0.3_f64, 40.0_f64), (0.6, 75.0), (0.9, 130.0), (0.95, 90.0)] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let seen = blade.at((radius * cos, radius * sin), Some(exposure(0.0, 1.0)));
        let angle = 2.0 * (half_width / radius).asin().to_degrees();
        let off = (seen - angle / 180.0).abs();
        assert!(off < 1.0 / 256.0 + 1e-3, "{radius} {degrees} {seen}");
    }
    // Beyond the tip, and behind the axle.
    assert_eq!(blade.at((1.1, 0.0), Some(exposure(0.0, 1.0))), 0.0);
    assert_eq!(blade.at((0.0, -0.5), Some(exposure(0.0, 1.0))), 0.0);
}

#[test]
fn a_wheel_keeps_its_size_while_it_turns() {
    let wheel = |interpolation| {
        Shown(Box::new(move |scene: &mut SceneBuilder| {
            let wheel = scene.cylinder(
                "",
                Cylinder {
                    base: DVec3::new(0.0, 0.0, -0.1),
                    top: DVec3::ZERO,
                    radius: 1.0,
                    open: false,
                },
            );
            let material = scene.material("", shining());
            let id = scene.moving_by(interpolation, turned(0.0), &[key(1.0, turned(170.0))]);
            scene.instance("", Edge::shape(wheel).transform(id).material(material));
        }))
    };
    let rim = (0.0, 0.999_999);
    let shutter = Some(exposure(0.0, 1.0));
    assert_eq!(wheel(Interpolation::Rigid).at(rim, shutter), 1.0);
    assert_eq!(
        wheel(Interpolation::Rigid).at((0.0, 1.000_001), shutter),
        0.0
    );
    // Straight ways make it shrink to a twelfth.
    assert!(wheel(Interpolation::Linear).at(rim, shutter) < 0.1);
}

#[test]
fn a_ball_bounces_along_its_keys() {
    let heights = [1.0, 0.75, 0.0, 0.75, 1.0];
    let radius = 0.2;
    let ball = Shown(Box::new(move |scene| {
        let ball = scene.sphere(
            "",
            Sphere {
                center: DVec3::ZERO,
                radius,
            },
        );
        let material = scene.material("", shining());
        let keys: Vec<Key> = (1..5)
            .map(|i| key(0.25 * i as f64, moved(0.0, heights[i])))
            .collect();
        let id = scene.moving(moved(0.0, heights[0]), &keys);
        scene.instance("", Edge::shape(ball).transform(id).material(material));
    }));
    for y in [-0.1, 0.0, 0.3, 0.6, 0.9, 1.1] {
        // The share of each straight piece whose height is within the ball's radius.
        let share = |i: usize| {
            let (from, to) = (
                heights[i].min(heights[i + 1]),
                heights[i].max(heights[i + 1]),
            );
            let within = (to.min(y + radius) - from.max(y - radius)).max(0.0);
            within / (to - from)
        };
        let expected = 0.25 * (0..4).map(share).sum::<f64>();
        let seen = ball.at((0.0, y), Some(exposure(0.0, 1.0)));
        assert!(
            (seen - expected).abs() < 4.0 * 0.5 / 256.0 + 1e-3,
            "{y} {seen} {expected}"
        );
    }
}

#[test]
fn a_scene_at_rest_has_one_picture_with_and_without_a_shutter() {
    let wall = || {
        Shown(Box::new(|scene: &mut SceneBuilder| {
            let ball = scene.sphere(
                "",
                Sphere {
                    center: DVec3::ZERO,
                    radius: 1.0,
                },
            );
            let material = scene.material("", shining());
            scene.instance("", Edge::shape(ball).material(material));
        }))
    };
    let blurred = wall().at((0.0, 0.0), Some(exposure(0.0, 1.0)));
    assert_eq!(blurred, wall().at((0.0, 0.0), None));
}
