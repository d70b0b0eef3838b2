//! Pictures of a cache of indirect light against pictures of paths.

use lanecast::internals::accel::{Structure, World};
use lanecast::internals::light::filter::Kind;
use lanecast::internals::plan::{Kernels, Precision, native_width};
use lanecast::internals::render::{
    AovSet, Backdrop, IndirectCaching, Integrator, Progress, View, render as drawn_by,
};
use lanecast::internals::scene::{Environment, Instances};
use lanecast::shapes::{Cuboid, Sphere};
use lanecast::{
    Camera, DVec3, Edge, Material, Picture, RenderConfig, Scene, SceneBuilder, Tracer,
    TracerOptions,
};

const SIDE: u32 = 32;

fn matte(color: [f32; 3]) -> Material {
    Material::metallic_roughness(color, 0.0, 1.0)
}

/// A room of five walls, one red, a block in it and a lamp below its ceiling.
fn room() -> Scene {
    let mut scene = SceneBuilder::default();
    let white = scene.material("", matte([0.7; 3]));
    let red = scene.material("", matte([0.7, 0.1, 0.1]));
    let shining = Material {
        emission: [12.0; 3],
        ..matte([0.0; 3])
    };
    let lamp = scene.material("", shining);
    let mut add = |min: [f64; 3], max: [f64; 3], material| {
        let (min, max) = (DVec3::from(min), DVec3::from(max));
        let shape = scene.cuboid("", Cuboid { min, max });
        scene.instance("", Edge::shape(shape).material(material));
    };
    add([-1.0, -1.1, -1.0], [1.0, -1.0, 1.0], white);
    add([-1.0, 1.0, -1.0], [1.0, 1.1, 1.0], white);
    add([-1.0, -1.0, -1.1], [1.0, 1.0, -1.0], white);
    add([-1.1, -1.0, -1.0], [-1.0, 1.0, 1.0], red);
    add([1.0, -1.0, -1.0], [1.1, 1.0, 1.0], white);
    add([-0.5, -1.0, -0.6], [0.2, -0.2, 0.0], white);
    let ball = scene.sphere(
        "",
        Sphere {
            center: DVec3::new(0.0, 0.7, 0.0),
            radius: 0.15,
        },
    );
    scene.instance("", Edge::shape(ball).material(lamp));
    let eye = DVec3::Z * 3.4;
    scene.camera("", Camera::perspective(eye, DVec3::ZERO, DVec3::Y, 40.0));
    scene.finish().unwrap()
}

fn config(error: Option<f64>, is_unbiased: bool) -> RenderConfig {
    RenderConfig {
        width: SIDE,
        height: SIDE,
        spp: 64,
        integrator: Integrator::Path,
        backdrop: Backdrop::Color([0.0; 3]),
        max_depth: 8,
        caching: error.map(|error| IndirectCaching { is_unbiased, error }),
        ..RenderConfig::default()
    }
}

fn render(scene: &Scene, config: &RenderConfig, threads: Option<u32>) -> Picture {
    let options = TracerOptions::default();
    let tracer = Tracer::new(scene, &options).unwrap();
    let draw = || tracer.render(config, &Default::default(), &|_| ()).unwrap();
    match threads {
        None => draw(),
        Some(threads) => rayon::ThreadPoolBuilder::new()
            .num_threads(threads as usize)
            .build()
            .unwrap()
            .install(draw),
    }
}

/// Mean, and root of the mean squared difference, of pictures, relative to the truth's mean.
fn errors(picture: &Picture, truth: &Picture) -> [f64; 2] {
    let all = |p: &Picture| -> Vec<f64> {
        let shown = |c: &f32| f64::from(c.min(2.0));
        p.color.as_flattened().iter().map(shown).collect()
    };
    let (is, should) = (all(picture), all(truth));
    let mean = should.iter().sum::<f64>() / should.len() as f64;
    let off: Vec<f64> = is.iter().zip(&should).map(|(a, b)| a - b).collect();
    let count = off.len() as f64;
    [
        off.iter().sum::<f64>() / count / mean,
        (off.iter().map(|d| d * d).sum::<f64>() / count).sqrt() / mean,
    ]
}

#[test]
fn a_cached_picture_is_nearly_right_and_less_noisy() {
    let scene = room();
    // More pixels than elsewhere, since means are compared.
    let config = |error, is_unbiased| RenderConfig {
        width: 48,
        height: 48,
        ..config(error, is_unbiased)
    };
    let truth = config(None, false);
    let truth = render(&scene, &RenderConfig { spp: 1024, ..truth }, None);
    let [_, noise] = errors(&render(&scene, &config(None, false), None), &truth);
    // The mean of a picture has the noise of direct light, about as large as the bound.
    let seeds = [0, 1, 2].map(|seed| {
        let config = RenderConfig {
            seed,
            ..config(Some(0.2), false)
        };
        errors(&render(&scene, &config, None), &truth)
    });
    let [bias, rms] = [0, 1].map(|k| seeds.iter().map(|of| of[k]).sum::<f64>() / 3.0);
    assert!(bias.abs() < 0.005, "{bias}");
    assert!(rms < 0.8 * noise, "{rms} of {noise}");
    let [bias, _] = errors(&render(&scene, &config(Some(0.4), true), None), &truth);
    assert!(bias.abs() < 0.003, "{bias}");
}

#[test]
fn rays_that_fill_a_cache_are_counted() {
    let scene = room();
    let instances = Instances::of(&scene).unwrap();
    let (scene, camera) = scene.completed(Some(0), &instances, 1.0);
    let view = View {
        world: &World::build(&scene, &instances, Structure::default()),
        kernels: Kernels {
            precision: Precision::Guarded,
            lanes: native_width(),
        },
        camera,
        lights: &scene.lights,
    };
    let drawn = |error| {
        let progress = Progress::default();
        let config = RenderConfig {
            spp: 1,
            ..config(error, false)
        };
        drawn_by(&view, &config, false, &progress).unwrap()
    };
    let (plain, cached) = (drawn(None), drawn(Some(0.4)));
    assert_eq!(plain.cache, None);
    let records = cached.cache.unwrap().records() as u64;
    assert!(records > 0);
    // Each takes two hundred at least; those of one sample a pixel are few.
    let many = cached.counts.reflection;
    assert!(many > 200 * records, "{many} rays for {records} records");
}

/// What a cache gives is light of other surfaces that is scattered diffusely; layers add up to the
/// picture, and have the means that paths find.
#[test]
fn layers_know_what_a_cache_gives() {
    let scene = room();
    let mut aovs = AovSet::default();
    for name in [
        "diffuse_direct",
        "diffuse_indirect",
        "specular_direct",
        "specular_indirect",
        "emission",
        "environment",
        "variance",
        "crypto_object",
    ] {
        assert!(aovs.add(name));
    }
    let of = |error, is_unbiased, spp| {
        let config = config(error, is_unbiased);
        let picture = render(
            &scene,
            &RenderConfig {
                spp,
                aovs,
                ..config.clone()
            },
            None,
        );
        let plain = render(&scene, &RenderConfig { spp, ..config }, None);
        assert_eq!(picture.color, plain.color);
        for (pixel, color) in picture.color.iter().enumerate() {
            for k in 0..3 {
                let layers = picture.layers.iter();
                let sum: f64 = layers.map(|l| f64::from(l.color[pixel][k])).sum();
                let color = f64::from(color[k]);
                assert!((sum - color).abs() < 2e-6 * (color + 1e-3), "{sum} {color}");
            }
        }
        let means = picture.layers.iter().map(|layer| {
            let sum: f64 = layer.color.iter().flatten().map(|c| f64::from(*c)).sum();
            sum / layer.color.len() as f64
        });
        means.collect::<Vec<f64>>()
    };
    let paths = of(None, false, 512);
    assert!(paths[1] > 0.05 && paths[3] > 0.001, "{paths:?}");
    for is_unbiased in [false, true] {
        let cached = of(Some(0.2), is_unbiased, 256);
        for (name, (found, expected)) in ["dd", "di", "sd", "si", "e"]
            .iter()
            .zip(cached.iter().zip(&paths))
        {
            let off = (found - expected).abs();
            assert!(
                off < 0.03 * expected + 2e-4,
                "{name} {is_unbiased}: {cached:?} {paths:?}"
            );
        }
    }
}

#[test]
fn threads_do_not_show_in_a_cache() {
    let scene = room();
    for is_unbiased in [false, true] {
        let config = RenderConfig {
            spp: 4,
            ..config(Some(0.4), is_unbiased)
        };
        let one = render(&scene, &config, Some(1)).color;
        assert_eq!(render(&scene, &config, Some(2)).color, one);
        assert_eq!(render(&scene, &config, Some(3)).color, one);
    }
}

/// A lamp on one side of a wall of a thousandth, on a floor that goes below the wall: the other
/// side sees nothing that is lit.
#[test]
fn no_light_leaks_through_a_thin_wall() {
    let mut scene = SceneBuilder::default();
    let white = scene.material("", matte([0.8; 3]));
    let shining = Material {
        emission: [50.0; 3],
        ..matte([0.0; 3])
    };
    let lamp = scene.material("", shining);
    for (min, max) in [
        ([-3.0, -0.1, -3.0], [3.0, 0.0, 3.0]),
        ([0.0, 0.0, -3.0], [1e-3, 1.0, 3.0]),
        ([-2.0, 0.0, -3.0], [-1.9, 1.0, 3.0]),
    ] {
        let (min, max) = (DVec3::from(min), DVec3::from(max));
        let shape = scene.cuboid("", Cuboid { min, max });
        scene.instance("", Edge::shape(shape).material(white));
    }
    let center = DVec3::new(-0.6, 0.3, 0.0);
    let ball = scene.sphere(
        "",
        Sphere {
            center,
            radius: 0.05,
        },
    );
    scene.instance("", Edge::shape(ball).material(lamp));
    let eye = DVec3::new(0.5, 6.0, 0.0);
    let camera = Camera::orthographic(eye, DVec3::new(0.5, 0.0, 0.0), DVec3::NEG_Z, 3.0);
    scene.camera("", camera);
    let scene = scene.finish().unwrap();
    for error in [0.2, 1.0] {
        let config = RenderConfig {
            filter: Kind::Box,
            spp: 16,
            ..config(Some(error), false)
        };
        let picture = render(&scene, &config, None);
        let (mut lit, mut dark) = (0.0, 0.0_f32);
        for (i, color) in picture.color.iter().enumerate() {
            let x = -1.0 + 3.0 * (i as u32 % SIDE) as f32 / SIDE as f32;
            match x > 2e-3 {
                true => dark = dark.max(color[0]),
                false => lit += color[0] / (SIDE * SIDE) as f32,
            }
        }
        assert!(lit > 0.01, "{lit}");
        assert_eq!(dark, 0.0, "at {error}");
    }
}

/// A white ball on a white floor under a white sky: all is as bright as the sky, also where the
/// two nearly touch and small records meet large ones.
#[test]
fn a_cached_furnace_is_as_bright_as_its_sky() {
    let mut scene = SceneBuilder::default();
    let mut white = matte([1.0; 3]);
    white.layers.specular = 0.0;
    let white = scene.material("", white);
    let (min, max) = (DVec3::new(-50.0, -1.0, -50.0), DVec3::new(50.0, 0.0, 50.0));
    let floor = scene.cuboid("", Cuboid { min, max });
    scene.instance("", Edge::shape(floor).material(white));
    let (center, radius) = (DVec3::Y * 0.5, 0.5);
    let ball = scene.sphere("", Sphere { center, radius });
    scene.instance("", Edge::shape(ball).material(white));
    scene.environment(Environment::uniform([0.5; 3]));
    let (eye, look_at) = (DVec3::new(0.0, 1.0, 6.0), DVec3::new(0.0, 0.1, 0.5));
    scene.camera("", Camera::perspective(eye, look_at, DVec3::Y, 8.0));
    let scene = scene.finish().unwrap();
    for (error, bound) in [(0.2, 0.015), (0.05, 0.004)] {
        let config = RenderConfig {
            filter: Kind::Box,
            max_depth: 128,
            backdrop: Backdrop::Auto,
            ..config(Some(error), false)
        };
        let color = render(&scene, &config, None).color;
        let sum: f64 = color.as_flattened().iter().map(|c| f64::from(*c)).sum();
        let mean = sum / color.as_flattened().len() as f64;
        assert!((mean / 0.5 - 1.0).abs() < bound, "{mean} at {error}");
    }
}
