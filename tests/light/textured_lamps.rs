//! Lamps whose light an image scales: what they make of a floor, and with how little noise.

use lanecast::internals::light::filter::Kind as FilterKind;
use lanecast::internals::plan::{Choices, LaneCount};
use lanecast::internals::render::Integrator;
use lanecast::internals::scene::{
    Alpha, Environment, MeshData, Slot, Texels, TextureRef, Texturing, Wrap,
};
use lanecast::{
    Camera, DVec3, Edge, Material, RenderConfig, Scene, SceneBuilder, Tracer, TracerOptions,
};
use std::f64::consts::PI;

/// How high the lamp hangs.
const HEIGHT: f64 = 2.0;

/// A square across y of half a side `half`, whose u goes along x and v along z.
fn square(half: f64, y: f64) -> MeshData {
    let corner = |x: f64, z: f64| [x * half, y, z * half];
    MeshData {
        positions: vec![
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        uvs: vec![vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]],
        ..MeshData::default()
    }
}

/// A white floor under a square lamp of radiance 1 that a row of texels scales, seen by a window
/// on the floor below the lamp's middle.
fn scene(texels: &[u8], half: f64, how: (bool, Texturing)) -> Scene {
    let (nearest, texturing) = how;
    let mut scene = SceneBuilder::default();
    let channels = if texturing.alpha == Alpha::Opaque {
        1
    } else {
        2
    };
    let width = texels.len() as u32 / channels;
    let image = scene.image(
        Texels::Bytes(texels.to_vec()),
        channels as u8,
        false,
        [width, 1],
    );
    let texture = TextureRef {
        nearest,
        wrap: [Wrap::Clamp; 2],
        ..TextureRef::plain(image)
    };
    let lamp = scene.material(
        "lamp",
        Material {
            emission: [1.0, 0.5, 0.25],
            ..Material::metallic_roughness([0.0; 3], 0.0, 1.0)
        },
    );
    let refs = [(Slot::Emission, texture), (Slot::BaseColor, texture)];
    scene.texture(lamp, texturing, &refs);
    let white = scene.material("floor", Material::metallic_roughness([1.0; 3], 0.0, 1.0));
    for (mesh, material) in [(square(half, HEIGHT), lamp), (square(10.0, 0.0), white)] {
        let shape = scene.mesh("", &mesh);
        scene.instance("", Edge::shape(shape).material(material));
    }
    scene.environment(Environment::uniform([0.0; 3]));
    let eye = DVec3::new(0.0, 1.0, 0.0);
    let camera = Camera::orthographic(eye, DVec3::ZERO, DVec3::Z, 1e-3);
    scene.camera("", camera);
    scene.finish().unwrap()
}

fn render(scene: &Scene, choices: Choices, spp: u32) -> Vec<[f32; 3]> {
    let options = TracerOptions {
        choices,
        ..TracerOptions::default()
    };
    let tracer = Tracer::new(scene, &options).unwrap();
    let config = RenderConfig {
        width: 32,
        height: 32,
        spp,
        integrator: Integrator::Path,
        filter: FilterKind::Box,
        max_depth: 1,
        ..RenderConfig::default()
    };
    let picture = tracer.render(&config, &Default::default(), &|_| ());
    picture.unwrap().color
}

/// Returns the mean of the first channel, and the root mean square of relative deviations from it.
fn mean_and_noise(pixels: &[[f32; 3]]) -> (f64, f64) {
    let count = pixels.len() as f64;
    let mean = pixels.iter().map(|c| f64::from(c[0])).sum::<f64>() / count;
    let squares = pixels.iter().map(|c| (f64::from(c[0]) - mean).powi(2));
    (mean, (squares.sum::<f64>() / count).sqrt() / mean)
}

/// Returns the irradiance below the middle of the lamp, whose radiance is a function of u.
fn irradiance(half: f64, radiance: impl Fn(f64) -> f64) -> f64 {
    const STEPS: u32 = 800;
    let at = |n: u32| (f64::from(n) + 0.5) / f64::from(STEPS);
    let mut sum = 0.0;
    for column in 0..STEPS {
        for row in 0..STEPS {
            let [x, z] = [column, row].map(|n| (2.0 * at(n) - 1.0) * half);
            let squared = x * x + z * z + HEIGHT * HEIGHT;
            sum += radiance(at(column)) * HEIGHT * HEIGHT / (squared * squared);
        }
    }
    sum * (2.0 * half / f64::from(STEPS)).powi(2)
}

/// What the floor shows of an irradiance: a share of it that is the same for all lamps of this
/// size, which a lamp without an image tells.
fn floor_shows(half: f64) -> f64 {
    let plain = scene(&[255], half, (true, Texturing::default()));
    let (mean, _) = mean_and_noise(&render(&plain, Choices::default(), 256));
    mean / irradiance(half, |_| 1.0)
}

#[test]
fn a_lamp_with_an_image_lights_as_the_integral_of_its_texels() {
    // Half black and half white, and a slope between the middles of two texels.
    let slope = |u: f64| ((u - 0.25) * 2.0).clamp(0.0, 1.0);
    for half in [0.1, 2.0] {
        let share = floor_shows(half);
        assert!((share * PI - 0.96).abs() < 0.06, "{share}");
        for (nearest, radiance) in [
            (
                true,
                &(|u: f64| f64::from(u32::from(u > 0.5))) as &dyn Fn(f64) -> f64,
            ),
            (false, &slope),
        ] {
            let lamp = scene(&[0, 255], half, (nearest, Texturing::default()));
            let (mean, noise) = mean_and_noise(&render(&lamp, Choices::default(), 256));
            let expected = irradiance(half, radiance) * share;
            assert!(
                (mean / expected - 1.0).abs() < 4e-3,
                "{half}: {mean} {expected}"
            );
            // The lamp of a side of 0.2 is met by one ray in 1300, which alone would leave a noise
            // of more than 2.
            assert!(noise < 0.1, "{half}: {noise}");
        }
    }
}

#[test]
fn a_lamp_that_is_there_in_part_lights_in_part() {
    let whole = scene(&[255], 0.5, (true, Texturing::default()));
    let (whole, _) = mean_and_noise(&render(&whole, Choices::default(), 256));
    for (alpha, left) in [(Alpha::Blend, 64.0 / 255.0 + 1.0), (Alpha::Mask(0.5), 1.0)] {
        let texturing = Texturing {
            alpha,
            ..Texturing::default()
        };
        // Grey and alpha; by the symmetry of the floor each half lights the same.
        let lamp = scene(&[255, 64, 255, 255], 0.5, (true, texturing));
        let (mean, noise) = mean_and_noise(&render(&lamp, Choices::default(), 256));
        let expected = whole * left / 2.0;
        assert!((mean / expected - 1.0).abs() < 1e-2, "{mean} {expected}");
        assert!(noise < 0.1, "{noise}");
    }
}

#[test]
fn pictures_of_textured_lamps_show_no_lanes() {
    let lamp = scene(&[0, 255, 30, 90], 0.7, (false, Texturing::default()));
    let one = render(&lamp, Choices::default(), 8);
    for lanes in [LaneCount::One, LaneCount::Eight] {
        let choices = Choices {
            lanes,
            ..Choices::default()
        };
        assert_eq!(render(&lamp, choices, 8), one);
    }
}
