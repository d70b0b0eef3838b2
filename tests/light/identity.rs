//! A path-traced picture has one set of bits, whatever renders it.

use lanecast::internals::accel::BuildQuality;
use lanecast::internals::plan::{Accel, Choices, LaneCount, Precision};
use lanecast::internals::render::{Integrator, TileOrder};
use lanecast::internals::scene::{Environment, Layers};
use lanecast::shapes::{Cuboid, HalfSpace, Sphere};
use lanecast::{
    Camera, DVec3, Edge, Light, Material, RenderConfig, Scene, SceneBuilder, Tracer, TracerOptions,
};

/// Glass, metal, matte and shining things under a sky, with a sun and a lamp.
fn scene() -> Scene {
    let mut scene = SceneBuilder::default();
    let rough = Material::metallic_roughness;
    let materials = [
        rough([0.8, 0.3, 0.2], 0.0, 0.6),
        rough([0.9, 0.8, 0.5], 1.0, 0.2),
        Material {
            transmission: 1.0,
            ..rough([1.0; 3], 0.0, 0.0)
        },
        Material {
            transmission: 1.0,
            layers: Layers {
                attenuation_color: [0.2, 0.9, 0.4],
                attenuation_distance: 0.5,
                ..Layers::default()
            },
            ..rough([1.0; 3], 0.0, 0.3)
        },
        Material {
            emission: [4.0, 3.0, 2.0],
            ..rough([0.5; 3], 0.0, 0.5)
        },
        Material {
            layers: Layers {
                opacity: 0.5,
                clearcoat: 1.0,
                sheen_color: [0.3; 3],
                sheen_roughness: 0.4,
                ..Layers::default()
            },
            ..rough([0.2, 0.3, 0.9], 0.0, 0.4)
        },
    ];
    let materials = materials.map(|m| scene.material("", m));
    for (i, material) in materials.into_iter().enumerate() {
        let (x, z) = ((i % 3) as f64 - 1.0, (i / 3) as f64);
        let ball = Sphere {
            center: DVec3::new(x * 1.1, 0.5, z * -1.2),
            radius: 0.5,
        };
        let ball = scene.sphere("", ball);
        scene.instance("", Edge::shape(ball).material(material));
    }
    let block = scene.cuboid(
        "",
        Cuboid {
            min: DVec3::new(-2.0, 0.0, -3.0),
            max: DVec3::new(2.0, 1.5, -2.5),
        },
    );
    scene.instance("", Edge::shape(block).material(materials[0]));
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
        irradiance: [1.0, 0.9, 0.8],
        angle: 0.05,
    });
    let pixels = (0..32 * 16)
        .map(|i| {
            let x = (i % 32) as f32 / 32.0;
            [0.2 + x, 0.5, 1.2 - x]
        })
        .collect();
    scene.environment(Environment {
        width: 32,
        height: 16,
        pixels,
        rotation: 0.3,
        scale: [0.5; 3],
    });
    scene.camera(
        "",
        Camera::perspective(
            DVec3::new(0.5, 2.0, 4.0),
            DVec3::new(0.0, 0.4, 0.0),
            DVec3::Y,
            40.0,
        ),
    );
    scene.finish().unwrap()
}

fn config() -> RenderConfig {
    RenderConfig {
        width: 70,
        height: 45,
        spp: 5,
        integrator: Integrator::Path,
        max_depth: 8,
        ..RenderConfig::default()
    }
}

fn bits(choices: Choices, config: &RenderConfig, threads: usize) -> Vec<u32> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    pool.install(|| {
        let options = TracerOptions {
            choices,
            build: config.build,
        };
        let tracer = Tracer::new(&scene(), &options).unwrap();
        let picture = tracer.render(config, &Default::default(), &|_| ()).unwrap();
        picture
            .color
            .iter()
            .flatten()
            .map(|c| c.to_bits())
            .collect()
    })
}

#[test]
fn threads_tiles_lanes_and_structures_do_not_show() {
    let expected = bits(Choices::default(), &config(), 1);
    assert!(expected.iter().any(|x| *x != 0));
    for threads in [2, 3] {
        assert_eq!(bits(Choices::default(), &config(), threads), expected);
    }
    for tiles in [TileOrder::Reverse, TileOrder::Small] {
        let config = RenderConfig { tiles, ..config() };
        assert_eq!(bits(Choices::default(), &config, 2), expected);
    }
    let config = RenderConfig {
        build: BuildQuality::High,
        ..config()
    };
    assert_eq!(bits(Choices::default(), &config, 2), expected);
    let widths = [
        (1, LaneCount::One),
        (4, LaneCount::Four),
        (8, LaneCount::Eight),
        (16, LaneCount::Sixteen),
    ];
    let there = lanecast::internals::plan::widths();
    for (_, lanes) in widths.into_iter().filter(|(w, _)| there.contains(w)) {
        let choices = Choices {
            lanes,
            ..Choices::default()
        };
        assert_eq!(bits(choices, &config, 2), expected, "{lanes:?}");
    }
    for accel in [Accel::Kd, Accel::Grid, Accel::Linear] {
        let choices = Choices {
            accel: Some(accel),
            ..Choices::default()
        };
        assert_eq!(bits(choices, &config, 2), expected, "{accel:?}");
    }
    let exact = Choices {
        precision: Precision::Exact,
        ..Choices::default()
    };
    assert_eq!(bits(exact, &config, 2), expected);
}
