//! `verify --light`: the path integrator's samples are those of the reference's own path
//! tracer, and a fault in a recorded path is seen.

use crate::common::{in_repository, kernels};
use glam::DVec3;
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::measure::light::{LightComparison, LightError, verify_light};
use lanecast::internals::plan::Precision;
use lanecast::internals::reference::Reference;
use lanecast::internals::reference::light::{LightReference, Profile, Settings, Vertex};
use lanecast::internals::render::{Integrator, Progress, RenderConfig, View};
use lanecast::internals::scene::*;
use lanecast::shapes::{Cuboid, HalfSpace, Sphere};

fn config() -> RenderConfig {
    RenderConfig {
        width: 24,
        height: 18,
        spp: 4,
        integrator: Integrator::Path,
        max_depth: 8,
        ..RenderConfig::default()
    }
}

/// Compares a scene's picture, seen by its first camera.
fn compared(scene: &Scene, config: &RenderConfig) -> Result<LightComparison, LightError> {
    let instances = Instances::of(scene).expect("few instances");
    let world = World::build(scene, &instances, Structure::Bvh);
    let reference = Reference::new(scene, &instances).expect("few instances");
    let view = View {
        world: &world,
        kernels: kernels(Precision::Guarded),
        camera: scene.cameras.rows[0],
        lights: &scene.lights,
    };
    verify_light(&view, config, &reference, 3, &Progress::default())
}

pub fn is_right(name: &str, scene: SceneBuilder) {
    let scene = scene.finish().expect("a right scene");
    let found = compared(&scene, &config()).unwrap_or_else(|e| panic!("{name}: {e}"));
    println!("{name}: {:?}", found.counts);
    let (counts, size) = (found.counts, 24 * 18 * 4);
    assert_eq!(counts.samples, size);
    for one in &found.unexplained {
        println!("{one}");
    }
    assert_eq!(counts.unexplained, 0, "{name}");
    assert!(counts.same > size * 9 / 10, "{name}: {counts:?}");
}

/// A floor and a box, seen from above, and a ball of a material.
pub fn stage(ball: Material) -> SceneBuilder {
    let mut scene = SceneBuilder::default();
    let floor = scene.material(
        "floor",
        Material::metallic_roughness([0.6, 0.5, 0.4], 0.0, 0.8),
    );
    let ball = scene.material("ball", ball);
    let plane = scene.half_space(
        "",
        HalfSpace {
            normal: DVec3::Y,
            offset: 0.0,
        },
    );
    let sphere = scene.sphere(
        "",
        Sphere {
            center: DVec3::new(-0.6, 1.0, 0.2),
            radius: 1.0,
        },
    );
    let block = scene.cuboid(
        "",
        Cuboid {
            min: DVec3::new(0.7, 0.0, -0.8),
            max: DVec3::new(1.7, 1.1, 0.3),
        },
    );
    scene.instance("", Edge::shape(plane).material(floor));
    scene.instance("", Edge::shape(sphere).material(ball));
    scene.instance("", Edge::shape(block).material(floor));
    scene.camera(
        "",
        Camera::perspective(
            DVec3::new(0.4, 2.2, 6.0),
            DVec3::new(0.0, 0.8, 0.0),
            DVec3::Y,
            40.0,
        ),
    );
    scene
}

pub fn matte() -> Material {
    Material::metallic_roughness([0.7, 0.3, 0.2], 0.0, 1.0)
}

fn lamp(scene: &mut SceneBuilder, radius: f64) {
    scene.light(Light::Point {
        position: DVec3::new(2.5, 4.0, 3.0),
        intensity: [40.0, 35.0, 30.0],
        falloff: Falloff::InverseSquare,
        radius,
    });
}

/// A square lamp above, and a shining triangle and ball beside it.
pub fn shining(scene: &mut SceneBuilder) {
    let light = Material {
        emission: [9.0, 8.0, 6.0],
        ..matte()
    };
    let light = scene.material("light", light);
    let corner = |x: f64, z: f64| DVec3::new(x, 3.5, z);
    let square = [
        corner(-1.0, -0.5),
        corner(1.0, -0.5),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ];
    let triangle = [
        DVec3::new(-3.0, 0.5, -1.0),
        DVec3::new(-2.5, 2.0, 0.0),
        DVec3::new(-2.8, 0.4, 0.6),
    ];
    let polygons = [square.to_vec(), triangle.to_vec()];
    for points in polygons {
        let shape = scene.polygon("", &points, &[]);
        scene.instance("", Edge::shape(shape).material(light));
    }
    let ball = scene.sphere(
        "",
        Sphere {
            center: DVec3::new(1.6, 1.5, 0.9),
            radius: 0.2,
        },
    );
    scene.instance("", Edge::shape(ball).material(light));
}

#[test]
fn diffuse_surfaces_are_right() {
    let mut scene = stage(matte());
    lamp(&mut scene, 0.0);
    is_right("diffuse", scene);
}

#[test]
fn rough_metal_is_right() {
    let mut scene = stage(Material::metallic_roughness([0.9, 0.7, 0.4], 1.0, 0.35));
    shining(&mut scene);
    lamp(&mut scene, 0.3);
    is_right("metal", scene);
}

#[test]
fn glass_is_right() {
    for roughness in [0.0, 0.3] {
        let layers = Layers {
            attenuation_color: [0.4, 0.9, 0.6],
            attenuation_distance: 1.5,
            ..Layers::default()
        };
        let glass = Material {
            transmission: 1.0,
            layers,
            ..Material::metallic_roughness([1.0, 0.9, 0.8], 0.0, roughness)
        };
        let mut scene = stage(glass);
        shining(&mut scene);
        is_right("glass", scene);
    }
}

#[test]
fn lacquer_is_right() {
    let layers = Layers {
        clearcoat: 0.8,
        clearcoat_roughness: 0.2,
        ..Layers::default()
    };
    let mut scene = stage(Material {
        layers,
        ..Material::metallic_roughness([0.1, 0.3, 0.6], 0.2, 0.6)
    });
    shining(&mut scene);
    is_right("lacquer", scene);
}

/// Water fills a hollow of glass, so that their surfaces coincide and the eye is in air.
#[test]
fn media_that_touch_are_right() {
    let clear = |ior: f32, priority: i32| {
        let layers = Layers {
            priority,
            attenuation_color: [0.6, 0.9, 0.8],
            attenuation_distance: 2.0,
            ..Layers::default()
        };
        Material {
            transmission: 1.0,
            ior,
            layers,
            ..Material::metallic_roughness([1.0; 3], 0.0, 0.0)
        }
    };
    let mut scene = stage(matte());
    let [glass, water] = [("glass", 1.5, 2), ("water", 1.33, 1)]
        .map(|(name, ior, priority)| scene.material(name, clear(ior, priority)));
    let mut ball = |radius: f64| {
        let center = DVec3::new(0.5, 0.8, 1.6);
        scene.sphere("", Sphere { center, radius })
    };
    let [outer, inner] = [0.7, 0.5].map(&mut ball);
    scene.instance("", Edge::shape(outer).material(glass));
    scene.instance("", Edge::shape(inner).material(water));
    shining(&mut scene);
    is_right("media", scene);
}

/// Smooth panes and holes let rays to lights pass.
#[test]
fn panes_and_holes_are_right() {
    let layers = Layers {
        thin_walled: true,
        ..Layers::default()
    };
    let pane = Material {
        transmission: 1.0,
        layers,
        ..Material::metallic_roughness([0.9, 0.3, 0.2], 0.0, 0.0)
    };
    let layers = Layers {
        opacity: 0.4,
        ..Layers::default()
    };
    let gauze = Material { layers, ..matte() };
    let mut scene = stage(gauze);
    let pane = scene.material("pane", pane);
    let corner = |x: f64, y: f64| DVec3::new(x, y, 1.4);
    let points = [
        corner(-0.6, 0.0),
        corner(1.2, 0.0),
        corner(1.2, 1.6),
        corner(-0.6, 1.6),
    ];
    let shape = scene.polygon("", &points, &[]);
    scene.instance("", Edge::shape(shape).material(pane));
    lamp(&mut scene, 0.3);
    shining(&mut scene);
    is_right("panes", scene);
}

/// More lamps than are weighed one by one, so that a tree chooses among them.
#[test]
fn many_lamps_are_right() {
    let mut scene = stage(matte());
    let colors = [[9.0, 8.0, 6.0], [3.0, 8.0, 12.0], [12.0, 3.0, 5.0]];
    let lights = colors.map(|emission| {
        scene.material(
            "",
            Material {
                emission,
                ..matte()
            },
        )
    });
    for k in 0..40 {
        let angle = 0.7 * f64::from(k);
        let center = DVec3::new(
            (1.5 + 0.05 * f64::from(k)) * angle.cos(),
            0.3 + 0.08 * f64::from(k),
            (1.5 + 0.05 * f64::from(k)) * angle.sin(),
        );
        let shape = match k % 2 {
            0 => scene.sphere(
                "",
                Sphere {
                    center,
                    radius: 0.06,
                },
            ),
            _ => scene.polygon(
                "",
                &[center, center + 0.2 * DVec3::X, center + 0.2 * DVec3::Z],
                &[],
            ),
        };
        let light = lights[k as usize % 3];
        scene.instance("", Edge::shape(shape).material(light));
    }
    is_right("many lamps", scene);
}

#[test]
fn area_lights_are_right() {
    let mut scene = stage(matte());
    shining(&mut scene);
    is_right("area light", scene);
}

/// A sky with slow colours and one bright spot, turned about the vertical.
pub fn spotted_sky(scale: Rgb) -> Environment {
    let (width, height) = (32, 16);
    let pixel = |k: u32| {
        let [x, y] = [k % width, k / width].map(|x| x as f32);
        let spot = if (x - 9.0).abs() + (y - 4.0).abs() < 3.0 {
            12.0
        } else {
            0.0
        };
        [0.2 + 0.02 * x + spot, 0.3 + 0.5 * spot, 0.8 - 0.03 * y]
    };
    Environment {
        width,
        height,
        pixels: (0..width * height).map(pixel).collect(),
        rotation: 0.7,
        scale,
    }
}

#[test]
fn skies_and_suns_are_right() {
    let mut scene = stage(Material::metallic_roughness([0.5; 3], 0.0, 0.3));
    scene.environment(spotted_sky([1.0; 3]));
    scene.light(Light::Directional {
        direction: DVec3::new(-1.0, -1.5, -0.4),
        irradiance: [2.0, 1.8, 1.5],
        angle: 0.02,
    });
    is_right("environment", scene);
}

#[test]
fn solids_are_right() {
    let file = in_repository("scenes/csg_bracket.toml");
    let loaded = lanecast::internals::io::load(&file, &Default::default());
    let scene = loaded.unwrap_or_else(|e| panic!("{e}")).scene;
    let found = compared(&scene, &config()).unwrap_or_else(|e| panic!("{e}"));
    println!("bracket: {:?}", found.counts);
    assert_eq!(found.counts.unexplained, 0, "{:?}", found.unexplained);
}

#[test]
fn what_is_unknown_is_named() {
    let mut layered = matte();
    layered.transmission = 1.0;
    layered.layers.dispersion = 0.5;
    let scene = stage(layered).finish().expect("a right scene");
    let refused = compared(&scene, &config()).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "verify --light does not know dispersion"
    );
}

/// The bound on grown rounding is neither 0 nor so loose that it explains what it should not:
/// of most paths among matte and rough metal it is below a thousandth of the light.
#[test]
fn rounding_of_most_paths_is_small() {
    let mut scene = stage(Material::metallic_roughness([0.9, 0.7, 0.4], 1.0, 0.35));
    shining(&mut scene);
    let scene = scene.finish().expect("a right scene");
    let instances = Instances::of(&scene).expect("few instances");
    let reference = Reference::new(&scene, &instances).expect("few instances");
    let settings = settings(&scene);
    let light = LightReference::new(&reference, &scene.lights, None, settings).expect("known");
    let mut parts = Vec::new();
    for k in 0..60 {
        let (pixel, sample) = ([k % 24, k * 7 % 18], k);
        let path = light.trace(pixel, sample);
        let size = path.radiance.into_iter().fold(0.0, f64::max);
        if size > 0.0 && path.vertices.len() > 1 {
            let spread = light.spread((pixel, sample), &path, None);
            assert!(spread.radiance > 1e-9 * size, "{spread:?}");
            parts.push(spread.radiance / size);
        }
    }
    parts.sort_by(f64::total_cmp);
    println!("{parts:?}");
    assert!(parts.len() > 20);
    assert!(parts[parts.len() * 3 / 4] < 1e-3, "{parts:?}");
}

fn settings(scene: &Scene) -> Settings {
    Settings {
        camera: scene.cameras.rows[0],
        size: [24, 18],
        seed: 0,
        frame: 0,
        filter: Profile::Box,
        max_depth: 4,
        backdrop: None,
        asks_solids: false,
        eye_inside: false,
    }
}

/// The reference's own path is right, and no longer after a change.
#[test]
fn a_fault_in_a_path_is_seen() {
    let mut scene = stage(matte());
    shining(&mut scene);
    let scene = scene.finish().expect("a right scene");
    let instances = Instances::of(&scene).expect("few instances");
    let reference = Reference::new(&scene, &instances).expect("few instances");
    let settings = settings(&scene);
    let light = LightReference::new(&reference, &scene.lights, None, settings).expect("known");
    let pixel = [11, 12];
    let long = |sample: &u32| {
        let path = light.trace(pixel, *sample);
        path.vertices.len() > 2 && path.vertices[0].light.is_some()
    };
    let sample = (0..64).find(long).expect("some path is long");
    let path = light.trace(pixel, sample);
    let followed = light.follow(pixel, sample, &path.vertices).expect("right");
    assert_eq!((followed.radiance, followed.turned), (path.radiance, 0));
    let falsified = |change: &dyn Fn(&mut Vec<Vertex>)| {
        let mut vertices = path.vertices.clone();
        change(&mut vertices);
        light.follow(pixel, sample, &vertices).is_err()
    };
    assert!(falsified(&|v| v[1].weight[0] *= 1.01));
    assert!(falsified(&|v| v[1].dir[0] += 1e-4));
    assert!(falsified(&|v| v[1].org[0] += 1e-3));
    assert!(falsified(&|v| v[1].met = Some((77, 0))));
    assert!(falsified(&|v| v.truncate(1)));
    assert!(falsified(&|v| v[0].light = None));
    assert!(falsified(&|v| {
        let light = v[0].light.as_mut().expect("there is one");
        light.blocked = !light.blocked;
    }));
    assert!(falsified(&|v| {
        let light = v[0].light.as_mut().expect("there is one");
        light.weight = light.weight.map(|w| w * 1.01);
    }));
}
