//! What a path-traced picture holds beside its colour, and how pictures of one scene differ.

use lanecast::internals::render::{Adaptive, AovSet, Backdrop, Integrator};
use lanecast::internals::scene::Layers;
use lanecast::shapes::{Cuboid, HalfSpace, Sphere};
use lanecast::{
    Camera, DVec3, Edge, Light, Material, Picture, RenderConfig, Scene, SceneBuilder, Tracer,
    TracerOptions,
};

/// A ball on a floor, under a soft lamp.
fn ball_and_lamp() -> Scene {
    let mut scene = SceneBuilder::default();
    let ball = scene.sphere(
        "",
        Sphere {
            center: DVec3::Y,
            radius: 1.0,
        },
    );
    scene.instance("", Edge::shape(ball));
    let floor = scene.half_space(
        "",
        HalfSpace {
            normal: DVec3::Y,
            offset: 0.0,
        },
    );
    scene.instance("", Edge::shape(floor));
    scene.light(Light::Directional {
        direction: DVec3::new(1.0, -2.0, -1.0),
        irradiance: [2.0; 3],
        angle: 0.2,
    });
    scene.camera(
        "",
        Camera::perspective(DVec3::new(0.0, 2.0, 6.0), DVec3::Y, DVec3::Y, 40.0),
    );
    scene.finish().unwrap()
}

fn render(scene: &Scene, config: &RenderConfig) -> Picture {
    let tracer = Tracer::new(scene, &TracerOptions::default()).unwrap();
    tracer.render(config, &Default::default(), &|_| ()).unwrap()
}

fn config() -> RenderConfig {
    RenderConfig {
        width: 64,
        height: 48,
        spp: 4,
        integrator: Integrator::Path,
        max_depth: 4,
        ..RenderConfig::default()
    }
}

#[test]
fn the_number_of_samples_is_an_output() {
    let mut config = RenderConfig {
        width: 96,
        height: 72,
        ..config()
    };
    assert!(config.aovs.add("samples"));
    let plain = render(&ball_and_lamp(), &config);
    assert_eq!(plain.samples, Some(vec![4; 96 * 72]));
    assert_eq!(plain.depth, None);
    config.adaptive = Some(Adaptive {
        noise: 0.05,
        most: 256,
    });
    let counts = render(&ball_and_lamp(), &config).samples.unwrap();
    let (least, most) = (counts.iter().min().unwrap(), counts.iter().max().unwrap());
    assert!(least.is_power_of_two() && most.is_power_of_two());
    assert!(least < most && *most <= 256, "{least} {most}");
    config.aovs = AovSet::default();
    assert_eq!(render(&ball_and_lamp(), &config).samples, None);
}

#[test]
fn frames_of_a_sequence_have_noise_of_their_own() {
    for integrator in [Integrator::Path, Integrator::Direct] {
        let of = |frame| {
            let config = RenderConfig {
                integrator,
                frame,
                ..config()
            };
            render(&ball_and_lamp(), &config).color
        };
        assert_eq!(of(0), of(0));
        assert_ne!(of(0), of(1));
    }
}

/// A block that is half there, or a pane, before nothing.
fn sheet(layers: Layers, transmission: f32, tint: [f32; 3]) -> Scene {
    let mut scene = SceneBuilder::default();
    let material = Material {
        transmission,
        layers,
        ..Material::metallic_roughness(tint, 0.0, 0.0)
    };
    let material = scene.material("", material);
    let block = scene.cuboid(
        "",
        Cuboid {
            min: DVec3::new(-9.0, -9.0, -0.5),
            max: DVec3::new(9.0, 9.0, 0.5),
        },
    );
    scene.instance("", Edge::shape(block).material(material));
    scene.background([3.0; 3]);
    scene.light(Light::Directional {
        direction: DVec3::new(0.0, -1.0, -1.0),
        irradiance: [1.0; 3],
        angle: 0.0,
    });
    scene.camera(
        "",
        Camera::perspective(DVec3::new(0.0, 0.0, 6.0), DVec3::ZERO, DVec3::Y, 20.0),
    );
    scene.finish().unwrap()
}

#[test]
fn what_is_behind_holes_and_panes_shows_through() {
    let holes = Layers {
        opacity: 0.25,
        ..Layers::default()
    };
    let pane = Layers {
        thin_walled: true,
        specular: 0.0,
        ..Layers::default()
    };
    // Two sides let three quarters pass each; panes of no reflection their tint each.
    for (layers, transmission, through) in [(holes, 0.0, 0.5625), (pane, 1.0, 0.25)] {
        let scene = sheet(layers, transmission, [0.5; 3]);
        let config = RenderConfig {
            width: 16,
            height: 16,
            spp: 64,
            backdrop: Backdrop::Transparent,
            ..config()
        };
        let alpha = render(&scene, &config).alpha.unwrap();
        let mean = alpha.iter().sum::<f32>() / alpha.len() as f32;
        assert!((mean - (1.0 - through)).abs() < 0.02, "{mean} {through}");
        // A backdrop shows by as much, and lights nothing.
        let of = |color| {
            let config = RenderConfig {
                backdrop: Backdrop::Color([color; 3]),
                ..config.clone()
            };
            let color = render(&scene, &config).color;
            color.iter().map(|c| c[0]).sum::<f32>() / color.len() as f32
        };
        let shown = of(1.0) - of(0.0);
        assert!((shown - through).abs() < 0.02, "{shown} {through}");
    }
}
