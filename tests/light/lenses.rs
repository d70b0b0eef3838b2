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

/// Where the eye of [`seen_through_glass`] is.
const EYE: f64 = 12.0;

/// Returns the middle of what is seen of a ball of light 6 behind the lens of `lens_glass`, and its
/// radius, both at depth 1, from an eye beside the axis.
fn seen_through_glass(eye: f64, [x, y]: [f64; 2], radius: f64) -> ([f64; 2], f64) {
    const HALF: f64 = 0.02;
    let text = format!(
        r#"format = 1
[camera]
eye = [{eye}, 0.0, {EYE}]
look_at = [{eye}, 0.0, 0.0]
fov_y = {}
[material.glass]
base_color = [1.0, 1.0, 1.0]
roughness = 0.0
transmission = 1.0
ior = 1.5
[material.lamp]
base_color = [0.0, 0.0, 0.0]
emission = [1.0, 1.0, 1.0]
[shape.front]
sphere = {{ center = [0.0, 0.0, -1.9], radius = 2.0 }}
[shape.back]
sphere = {{ center = [0.0, 0.0, 1.9], radius = 2.0 }}
[shape.lens]
intersection = ["front", "back"]
[shape.ball]
sphere = {{ center = [{x}, {y}, -6.0], radius = {radius} }}
[[instance]]
shape = "lens"
material = "glass"
[[instance]]
shape = "ball"
material = "lamp"
"#,
        2.0 * HALF.atan().to_degrees()
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lens.toml");
    std::fs::write(&path, text).unwrap();
    let scene = lanecast::load(&path, &Default::default()).unwrap();
    let picture = picture(&scene.scene, 64);
    let mut sums = [0.0; 4];
    for (i, color) in picture.color.iter().enumerate() {
        let at = |i: usize| ((i as f64 + 0.5) / f64::from(SIDE) * 2.0 - 1.0) * HALF;
        let (x, y) = (at(i % SIDE as usize), -at(i / SIDE as usize));
        // What is mirrored to and fro in the glass is fainter.
        let light = f64::from(color[0]) - 0.1;
        if light > 0.0 {
            let of = [1.0, x, y, x * x + y * y];
            sums.iter_mut()
                .zip(of)
                .for_each(|(sum, of)| *sum += light * of);
        }
    }
    let [x, y, squares] = [1, 2, 3].map(|k| sums[k] / sums[0]);
    // The mean square of the distance from a disc's middle is half that of its radius.
    ([x, y], (2.0 * (squares - x * x - y * y)).sqrt())
}

/// The image that a thick lens of glass makes is where the lensmaker's equation says, as large, and
/// upside down. Rays near the axis obey it to second order: 0.4 % at these heights.
#[test]
fn a_lens_of_glass_makes_the_image_that_the_lensmakers_equation_says() {
    let (radius, thickness, index) = (2.0, 0.2, 1.5);
    let power: f64 =
        (index - 1.0) * (2.0 / radius - (index - 1.0) * thickness / (index * radius * radius));
    // From the vertices to the principal planes, inwards.
    let inwards = (index - 1.0) * thickness / (power * index * radius);
    let plane = 0.5 * thickness - inwards;
    let object = 6.0 - plane;
    let image = 1.0 / (power - 1.0 / object);
    let magnified = -image / object;
    let away = EYE - (image + plane);
    assert!((1.0 / power - 2.034).abs() < 1e-3 && (image + plane - 3.118).abs() < 1e-3);
    let (place, size) = ([0.1, -0.06], 0.03);
    let (middle, seen_size) = seen_through_glass(0.0, place, size);
    let right = place.map(|c| c * magnified / away);
    for k in 0..2 {
        let off = (middle[k] / right[k] - 1.0).abs();
        assert!(off < 0.01, "{middle:?} {right:?}");
    }
    let right_size = -size * magnified / away;
    assert!(
        (seen_size / right_size - 1.0).abs() < 0.03,
        "{seen_size} {right_size}"
    );
    // From an eye beside the axis the image is seen beside where it was, by how far away it is.
    let (beside, _) = seen_through_glass(0.1, place, size);
    let found = 0.1 / (middle[0] - beside[0]);
    assert!((found / away - 1.0).abs() < 0.01, "{found} {away}");
}
