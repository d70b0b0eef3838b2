//! A blurred picture has one set of bits, whatever renders it, and its slices do not show.

use crate::blur::{exposure, key, rendered};
use glam::DAffine3;
use lanecast::internals::math::Affine;
use lanecast::internals::plan::{Accel, Choices, LaneCount, Precision};
use lanecast::internals::render::{Adaptive, AovSet, Exposure, Integrator, TileOrder};
use lanecast::internals::scene::{CameraId, CameraKey, Interpolation};
use lanecast::shapes::{Cuboid, HalfSpace, Sphere};
use lanecast::{
    Camera, DVec3, Edge, Light, Material, MeshData, Picture, RenderConfig, Scene, SceneBuilder,
    Tracer, TracerOptions,
};

/// Things of all kinds that move before a camera that moves, one of which shines.
fn busy_scene() -> Scene {
    let mut scene = SceneBuilder::default();
    let matte = scene.material("", Material::metallic_roughness([0.7, 0.4, 0.3], 0.0, 0.6));
    let metal = scene.material("", Material::metallic_roughness([0.9, 0.8, 0.6], 1.0, 0.2));
    let glass = scene.material(
        "",
        Material {
            transmission: 1.0,
            ..Material::metallic_roughness([1.0; 3], 0.0, 0.0)
        },
    );
    let lamp = scene.material(
        "",
        Material {
            emission: [6.0, 5.0, 4.0],
            ..Material::default()
        },
    );
    let ball = scene.sphere(
        "",
        Sphere {
            center: DVec3::ZERO,
            radius: 0.5,
        },
    );
    let block = scene.cuboid(
        "",
        Cuboid {
            min: DVec3::splat(-0.4),
            max: DVec3::splat(0.4),
        },
    );
    for (i, (shape, material)) in [(ball, matte), (block, metal), (ball, glass), (ball, lamp)]
        .into_iter()
        .enumerate()
    {
        let x = i as f64 * 1.1 - 1.7;
        let there = |x: f64, y: f64, degrees: f64| -> Affine {
            let turn = DAffine3::from_rotation_y(f64::to_radians(degrees));
            (DAffine3::from_translation(DVec3::new(x, y, 0.0)) * turn).into()
        };
        let keys = [
            key(0.4, there(x + 0.3, 0.9, 70.0)),
            key(1.0, there(x - 0.2, 0.6, 200.0)),
        ];
        let id = scene.moving_by(Interpolation::Rigid, there(x, 0.5, 0.0), &keys);
        scene.instance("", Edge::shape(shape).transform(id).material(material));
    }
    let leaf = |y: f64| MeshData {
        positions: vec![[-1.5, 1.2, -1.0], [1.5, 1.2, -1.0], [0.0, y, -1.2]],
        normals: vec![
            [0.0, 0.2, 1.0],
            [0.1, 0.0, 1.0],
            [0.0, -0.5 * y as f32, 1.0],
        ],
        triangles: vec![[0, 1, 2]],
        ..MeshData::default()
    };
    let leaf = scene.deforming_mesh("", &leaf(1.9), &[(1.0, leaf(2.6))]);
    scene.instance("", Edge::shape(leaf).material(lamp));
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
    let (eye, look_at) = (DVec3::new(0.0, 1.5, 5.0), DVec3::new(0.0, 0.5, 0.0));
    let camera = scene.camera("", Camera::perspective(eye, look_at, DVec3::Y, 40.0));
    let pose = |at, x| CameraKey {
        at,
        eye: eye + DVec3::X * x,
        look_at,
        up: DVec3::Y,
    };
    scene.move_camera(camera, &[pose(0.0, 0.0), pose(1.0, 0.4)]);
    scene.finish().unwrap()
}

fn busy_config(integrator: Integrator) -> RenderConfig {
    RenderConfig {
        width: 70,
        height: 45,
        spp: 6,
        integrator,
        max_depth: 5,
        shutter: Some(Exposure {
            slices: 24,
            ..exposure(0.1, 0.9)
        }),
        aovs: all_aovs(),
        ..RenderConfig::default()
    }
}

fn all_aovs() -> AovSet {
    let mut aovs = AovSet::default();
    aovs.add_all(true);
    aovs
}

fn bits(choices: Choices, config: &RenderConfig, threads: usize) -> Vec<u32> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.unwrap().install(|| {
        let options = TracerOptions {
            choices,
            build: config.build,
        };
        let tracer = Tracer::new(&busy_scene(), &options).unwrap();
        let picture = tracer.render(config, &Default::default(), &|_| ()).unwrap();
        let color = picture.color.iter().flatten().map(|c| c.to_bits());
        let depth = picture.depth.iter().flatten().map(|d| d.to_bits());
        let ids = picture.instance_id.iter().flatten().map(|id| *id as u32);
        let variance = picture.variance.iter().flatten().flatten();
        let layers = picture.layers.iter().flat_map(|layer| &layer.color);
        let mattes = picture.mattes.iter().flat_map(|matte| &matte.rows);
        let light = variance
            .chain(layers.flatten())
            .chain(mattes.flatten())
            .map(|x| x.to_bits());
        color.chain(depth).chain(ids).chain(light).collect()
    })
}

#[test]
fn blurred_pictures_show_no_threads_tiles_lanes_and_structures() {
    for integrator in [Integrator::Path, Integrator::Direct, Integrator::Ao] {
        let config = busy_config(integrator);
        let expected = bits(Choices::default(), &config, 1);
        assert!(expected.iter().any(|x| *x != 0));
        assert_eq!(bits(Choices::default(), &config, 3), expected);
        for tiles in [TileOrder::Reverse, TileOrder::Small] {
            let config = RenderConfig {
                tiles,
                ..config.clone()
            };
            assert_eq!(bits(Choices::default(), &config, 2), expected, "{tiles:?}");
        }
        for lanes in [LaneCount::One, LaneCount::Auto] {
            for precision in [Precision::Guarded, Precision::Exact] {
                let choices = Choices {
                    lanes,
                    precision,
                    ..Choices::default()
                };
                let is = bits(choices, &config, 2);
                assert_eq!(is, expected, "{integrator:?} {lanes:?} {precision:?}");
            }
        }
        for accel in [Accel::Kd, Accel::Grid, Accel::Linear, Accel::ItemBuffer] {
            let choices = Choices {
                accel: Some(accel),
                ..Choices::default()
            };
            assert_eq!(bits(choices, &config, 2), expected, "{accel:?}");
        }
    }
}

#[test]
fn a_shutter_of_an_instant_is_a_still_of_its_time() {
    // With all slices at one time the picture is that of a static scene, sample by sample.
    let time = 0.3;
    let config = RenderConfig {
        shutter: Some(Exposure {
            slices: 7,
            ..exposure(time, time)
        }),
        ..busy_config(Integrator::Path)
    };
    let still = RenderConfig {
        shutter: None,
        ..config.clone()
    };
    let scene = busy_scene();
    let blurred = rendered(&scene, &config);
    let there = rendered(&scene.clone().at(time).unwrap(), &still);
    assert_eq!(blurred.color, there.color);
    assert_eq!(blurred.depth, there.depth);
    assert_eq!(blurred.variance, there.variance);
    assert!(blurred.layers.len() > 6 && blurred.mattes.len() == 3);
    assert!(blurred.layers == there.layers && blurred.mattes == there.mattes);
    // What is kept changes no bit of the colour.
    let plain = RenderConfig {
        aovs: AovSet::default(),
        ..config
    };
    assert_eq!(rendered(&scene, &plain).color, blurred.color);
}

#[test]
fn blurred_layers_add_up_to_the_picture() {
    let config = RenderConfig {
        spp: 16,
        ..busy_config(Integrator::Path)
    };
    let adaptive = RenderConfig {
        adaptive: Some(Adaptive {
            noise: 0.2,
            most: 32,
        }),
        ..config.clone()
    };
    for config in [config, adaptive] {
        let picture = rendered(&busy_scene(), &config);
        let ways = picture.layers.iter().take(6);
        for (pixel, color) in picture.color.iter().enumerate() {
            for k in 0..3 {
                let sum: f64 = ways.clone().map(|l| f64::from(l.color[pixel][k])).sum();
                let color = f64::from(color[k]);
                // Each layer is rounded to f32, and so are the parts of each contribution.
                assert!((sum - color).abs() < 2e-6 * (color + 1e-3), "{sum} {color}");
            }
        }
        // The moving lamp is seen, and blurred: its edge has parts of its radiance.
        let emission = &picture.layers[4].color;
        assert!(emission.iter().any(|c| c[0] > 0.5 && c[0] < 5.0));
        let noisy = picture.variance.as_ref().unwrap();
        assert!(noisy.iter().any(|v| v[0] > 0.0));
    }
}

#[test]
fn adaptive_pictures_blur_as_well() {
    let config = RenderConfig {
        adaptive: Some(Adaptive {
            noise: 0.2,
            most: 64,
        }),
        spp: 64,
        ..busy_config(Integrator::Path)
    };
    let expected = bits(Choices::default(), &config, 1);
    assert_eq!(bits(Choices::default(), &config, 2), expected);
    let plain = RenderConfig {
        shutter: None,
        ..config
    };
    assert_ne!(bits(Choices::default(), &plain, 1), expected);
}

/// The root of the mean squared difference of two pictures.
fn difference(a: &Picture, b: &Picture) -> f64 {
    let pairs = a.color.iter().flatten().zip(b.color.iter().flatten());
    let squares: f64 = pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum();
    (squares / (3 * a.color.len()) as f64).sqrt()
}

/// 256 slices against 4,096 at 1,024 samples: what the rounding of time changes is below the
/// noise.
#[test]
#[ignore = "renders three pictures of 1,024 samples; run it after changes of slices"]
fn slices_do_not_show_in_the_noise() {
    let picture = |slices, seed| {
        let config = RenderConfig {
            width: 96,
            height: 64,
            spp: 1024,
            seed,
            shutter: Some(Exposure {
                slices,
                ..exposure(0.0, 1.0)
            }),
            aovs: AovSet::default(),
            ..busy_config(Integrator::Path)
        };
        rendered(&busy_scene(), &config)
    };
    let few = picture(256, 0);
    let many = picture(4096, 0);
    let noise = difference(&few, &picture(256, 1));
    let rounding = difference(&few, &many);
    println!("noise {noise:.3e}, 256 slices for 4096 {rounding:.3e}");
    assert!(rounding < noise);
}

#[test]
fn ids_of_rows_of_cameras_are_their_places() {
    assert_eq!(busy_scene().cameras.motions.of, [CameraId(0).0]);
}
