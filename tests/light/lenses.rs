//! Depth of field against the thin lens's closed formula.

use lanecast::internals::render::{Backdrop, Integrator};
use lanecast::internals::scene::{Lens, Projection};
use lanecast::shapes::Sphere;
use lanecast::{
    Camera, DVec3, Edge, Material, Picture, RenderConfig, Scene, SceneBuilder, Tracer,
    TracerOptions,
};

const SIDE: u32 = 96;
const HALF_HEIGHT: f64 = 0.1;

/// The radius of what is seen, at depth 1.
const SPARK: f64 = 4e-3;

/// A small ball that shines, at a depth, before a lens.
fn spark(depth: f64, lens: Lens, parallel: bool) -> Scene {
    let mut scene = SceneBuilder::default();
    let shining = Material {
        emission: [1.0; 3],
        ..Material::default()
    };
    let lamp = scene.material("", shining);
    let ball = scene.sphere(
        "",
        Sphere {
            center: DVec3::new(0.0, 0.0, -depth),
            radius: SPARK * depth,
        },
    );
    scene.instance("", Edge::shape(ball).material(lamp));
    let projection = match parallel {
        false => Projection::Perspective {
            half_height: HALF_HEIGHT,
        },
        true => Projection::Orthographic { half_height: 1.0 },
    };
    let camera = Camera::looking_at(DVec3::ZERO, -DVec3::Z, DVec3::Y, projection);
    let lens = Some(lens);
    scene.camera("", Camera { lens, ..camera });
    scene.finish().unwrap()
}

fn picture(scene: &Scene, spp: u32) -> Picture {
    let config = RenderConfig {
        width: SIDE,
        height: SIDE,
        spp,
        integrator: Integrator::Path,
        backdrop: Backdrop::Color([0.0; 3]),
        ..RenderConfig::default()
    };
    let tracer = Tracer::new(scene, &TracerOptions::default()).unwrap();
    tracer
        .render(&config, &Default::default(), &|_| ())
        .unwrap()
}

/// Returns the standard deviations of a picture's light, right and up, in half pictures.
fn spread(picture: &Picture) -> [f64; 2] {
    let mut sums = [0.0; 3];
    for (i, color) in picture.color.iter().enumerate() {
        let at = |i: usize| (i as f64 + 0.5) / f64::from(SIDE) * 2.0 - 1.0;
        let (x, y) = (at(i % SIDE as usize), at(i / SIDE as usize));
        let light = f64::from(color[0]);
        sums[0] += light;
        sums[1] += light * x * x;
        sums[2] += light * y * y;
    }
    [sums[1], sums[2]].map(|sum| (sum / sums[0]).sqrt())
}

fn round(radius: f64, focus: f64) -> Lens {
    Lens {
        radius,
        focus,
        blades: 0,
        rotation: 0.0,
        squeeze: 1.0,
    }
}

/// A point at depth z is seen as a disc of radius R |1/f - 1/z| at depth 1, where f is in focus; a
/// disc's standard deviation is half its radius.
#[test]
fn what_is_out_of_focus_is_a_disc_of_the_right_size() {
    for (depth, focus) in [(10.0, 2.0), (1.5, 3.0), (1e4, 4.0)] {
        let radius = 0.06 / f64::abs(1.0 / focus - 1.0 / depth);
        let scene = spark(depth, round(radius, focus), false);
        let [x, y] = spread(&picture(&scene, 1024));
        // What is seen is a disc itself, and adds its own.
        let right = f64::hypot(0.06, SPARK) / HALF_HEIGHT / 2.0;
        assert!((x / right - 1.0).abs() < 0.02, "{depth}: {x} for {right}");
        assert!((y / right - 1.0).abs() < 0.02, "{depth}: {y} for {right}");
    }
    // Parallel rays: the disc has the radius R |1 - z / f|.
    let scene = spark(3.0, round(0.6, 2.0), true);
    let [x, y] = spread(&picture(&scene, 1024));
    assert!(
        (x / 0.15 - 1.0).abs() < 0.02 && (y / 0.15 - 1.0).abs() < 0.02,
        "{x} {y}"
    );
}

#[test]
fn what_is_in_focus_is_sharp_and_anamorphic_discs_are_narrow() {
    let scene = spark(2.0, round(0.5, 2.0), false);
    let [x, _] = spread(&picture(&scene, 64));
    assert!(x < 0.05, "{x}");
    let squeezed = Lens {
        squeeze: 2.0,
        ..round(0.15, 2.0)
    };
    let [x, y] = spread(&picture(&spark(10.0, squeezed, false), 1024));
    assert!((y / x / 2.0 - 1.0).abs() < 0.03, "{x} {y}");
}
