//! The parts of the reference's light against those of the path integrator, by the same random
//! numbers: BSDFs, emitters and the sky.

use crate::common::Random;
use crate::light::spotted_sky;
use glam::DVec3;
use lanecast::internals::light::bsdf::Bsdf;
use lanecast::internals::light::emitter::{Body, Emitter, Emitters};
use lanecast::internals::math::Vec3;
use lanecast::internals::reference::light::{bsdf, emitters};
use lanecast::internals::scene::*;

/// Values below this are compared as if they were this: at the horizon, and in the tail of
/// refraction, they go to 0 with numbers that f32 knows to some roundings of 1.
const FAINT: f64 = 0.02;

const NUMBERS: usize = 4000;

fn narrow(v: DVec3) -> Vec3<f32> {
    let [x, y, z] = v.to_array().map(|x| x as f32);
    Vec3::new(x, y, z)
}

fn widen(v: Vec3<f32>) -> DVec3 {
    DVec3::new(v.x.into(), v.y.into(), v.z.into())
}

/// A number in [0, 1).
fn uniform(random: &mut Random) -> f64 {
    0.5 * (random.unit() + 1.0)
}

/// A number of f32 in [0, 1).
fn number(random: &mut Random) -> f32 {
    ((uniform(random) * 16_777_216.0) as u32 as f32 / 16_777_216.0).min(1.0 - f32::EPSILON)
}

fn direction(random: &mut Random, least: f64) -> DVec3 {
    let z = least + (1.0 - least) * uniform(random);
    let turn = std::f64::consts::TAU * uniform(random);
    let across = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(across * turn.cos(), across * turn.sin(), z)
}

/// The greatest difference, relative to the greater of the largest number and [`FAINT`].
fn apart(a: [f32; 3], b: [f64; 3]) -> f64 {
    let size = b.iter().fold(FAINT, |m, x| m.max(x.abs()));
    (0..3).fold(0.0, |m: f64, k| m.max((f64::from(a[k]) - b[k]).abs())) / size
}

fn materials() -> Vec<(&'static str, Material)> {
    let new = Material::metallic_roughness;
    let glass = |transmission: f32, roughness: f32| Material {
        transmission,
        ..new([1.0, 0.9, 0.8], 0.0, roughness)
    };
    let mut thin = glass(1.0, 0.3);
    thin.layers.thin_walled = true;
    let mut through = new([0.5, 0.6, 0.3], 0.0, 0.5);
    through.layers.diffuse_transmission = 0.4;
    through.layers.diffuse_transmission_color = [0.3, 0.9, 0.2];
    let coated = |metallic: f32, roughness: f32| {
        let mut material = new([0.7, 0.3, 0.2], metallic, 0.4);
        material.layers.clearcoat = 0.8;
        material.layers.clearcoat_roughness = roughness;
        material
    };
    let layered = |base: Material, layers: Layers| Material { layers, ..base };
    let velvet = Layers {
        specular: 0.0,
        sheen_color: [0.9, 0.25, 0.35],
        sheen_roughness: 0.35,
        ..Layers::default()
    };
    let film = Layers {
        iridescence: 0.8,
        iridescence_ior: 1.6,
        iridescence_thickness: 480.0,
        ..Layers::default()
    };
    let brushed = Layers {
        anisotropy: 0.85,
        anisotropy_rotation: 0.6,
        ..Layers::default()
    };
    let clay = Layers {
        diffuse_roughness: 0.8,
        ..Layers::default()
    };
    let everything = Layers {
        clearcoat: 0.5,
        clearcoat_roughness: 0.2,
        sheen_color: [0.3, 0.5, 0.2],
        sheen_roughness: 0.6,
        diffuse_transmission: 0.3,
        iridescence: 0.5,
        ..clay
    };
    let phong = Material {
        model: Model::Phong {
            diffuse: [0.4, 0.3, 0.2],
            specular: [0.2; 3],
            exponent: 40.0,
            mirror: [0.1; 3],
        },
        transmission: 0.3,
        ..Material::default()
    };
    vec![
        ("diffuse", new([0.7, 0.3, 0.2], 0.0, 1.0)),
        ("plastic", new([0.7, 0.3, 0.2], 0.0, 0.3)),
        ("smooth plastic", new([0.7, 0.3, 0.2], 0.0, 0.0)),
        ("metal", new([0.9, 0.7, 0.4], 1.0, 0.35)),
        ("mirror", new([0.9, 0.7, 0.4], 1.0, 0.0)),
        ("mixture", new([0.9, 0.7, 0.4], 0.5, 0.5)),
        ("glass", glass(1.0, 0.0)),
        ("rough glass", glass(1.0, 0.3)),
        ("half glass", glass(0.5, 0.4)),
        ("sheet", thin),
        ("leaf", through),
        ("phong", phong),
        ("lacquer", coated(0.0, 0.3)),
        ("smooth lacquer", coated(1.0, 0.0)),
        ("velvet", layered(new([0.2, 0.1, 0.1], 0.0, 1.0), velvet)),
        (
            "film on metal",
            layered(new([0.7, 0.7, 0.8], 1.0, 0.2), film),
        ),
        (
            "film on plastic",
            layered(new([0.1, 0.2, 0.3], 0.0, 0.4), film),
        ),
        ("brushed", layered(new([0.9, 0.8, 0.7], 1.0, 0.4), brushed)),
        ("clay", layered(new([0.6, 0.4, 0.3], 0.0, 1.0), clay)),
        (
            "everything",
            layered(new([0.6, 0.4, 0.3], 0.4, 0.5), everything),
        ),
    ]
}

#[test]
fn bsdfs_are_those_of_the_reference() {
    for (name, material) in materials() {
        let (ours, own) = (Bsdf::new(&material), bsdf::Bsdf::new(&material).unwrap());
        let flags = [own.is_black(), own.only_delta(), own.transmits()];
        assert_eq!([ours.is_black, ours.only_delta, ours.transmits], flags);
        let looks = ours.looks::<f32>();
        let mut random = Random(name.len() as u64);
        let mut turned = 0;
        for i in 0..NUMBERS {
            let eta = match i % 2 {
                0 => material.ior,
                _ => 1.0 / material.ior,
            };
            let wide = f64::from(eta);
            let out = direction(&mut random, 0.01);
            let [u, v, lobe] = [0; 3].map(|_| number(&mut random));
            let a = ours.sample::<f32>(&looks, eta, narrow(out), [u, v], lobe);
            let b = own.sample(wide, out, [u, v].map(f64::from), lobe.into());
            match b {
                Some(b) if a.some && widen(a.into).distance(b.into) < 1e-4 => {
                    assert_eq!((a.delta, a.through), (b.delta, b.through()), "{name}");
                    let error = apart(a.weight, b.weight);
                    assert!(error < 1e-3, "{name}: {a:?} {b:?}");
                    let error = (f64::from(a.pdf) / b.pdf - 1.0).abs();
                    assert!(error < 1e-3, "{name}: {a:?} {b:?}");
                }
                None if !a.some => {}
                // A number at the threshold of a choice.
                _ => turned += 1,
            }
            let into = direction(&mut random, -1.0);
            let a = ours.eval::<f32>(&looks, eta, narrow(out), narrow(into));
            let b = own.eval(wide, out, into);
            let error = apart(a.value, b.value).max(apart([a.pdf; 3], [b.pdf; 3]));
            assert!(error < 2e-3, "{name}: {a:?} {b:?}");
        }
        assert!(turned < 4, "{name}: {turned}");
    }
}

#[test]
fn emitters_are_those_of_the_reference() {
    let mut scene = SceneBuilder::default();
    let light = [9.0, 8.0, 6.0];
    let shining = Material {
        emission: light,
        ..Material::default()
    };
    let shining = scene.material("", shining);
    let at = |x: f64, z: f64| DVec3::new(x, 3.5, z);
    let square = [at(-1.0, -0.5), at(1.0, -0.5), at(1.0, 1.0), at(-1.0, 1.0)];
    let triangle = [
        DVec3::new(-3.0, 0.5, -1.0),
        DVec3::new(-2.5, 2.0, 0.0),
        DVec3::new(-2.8, 0.4, 0.6),
    ];
    let (center, radius) = (DVec3::new(1.6, 1.5, 0.9), 0.2);
    let shapes = [
        scene.polygon("", &square, &[]),
        scene.polygon("", &triangle, &[]),
        scene.sphere("", lanecast::shapes::Sphere { center, radius }),
    ];
    for shape in shapes {
        scene.instance("", Edge::shape(shape).material(shining));
    }
    let scene = scene.finish().expect("a right scene");
    let instances = Instances::of(&scene).expect("few instances");
    let rows = instances.laid_out(&scene).expect("few instances");
    let lights = [
        Light::Directional {
            direction: DVec3::new(-1.0, -1.5, -0.4),
            irradiance: [2.0, 1.8, 1.5],
            angle: 0.02,
        },
        Light::Point {
            position: DVec3::new(2.5, 4.0, 3.0),
            intensity: [40.0, 35.0, 30.0],
            falloff: Falloff::InverseSquare,
            radius: 0.3,
        },
        Light::Spot {
            position: DVec3::new(-2.5, 4.0, 3.0),
            direction: DVec3::new(0.4, -1.0, -0.4),
            intensity: [40.0, 35.0, 30.0],
            inner: 0.3,
            outer: 0.8,
            radius: 0.0,
        },
    ];
    let map = spotted_sky([1.0, 0.9, 1.1]);
    let bodies = [
        Body::Rectangle {
            corner: square[0],
            u: square[1] - square[0],
            v: square[3] - square[0],
        },
        Body::Triangle(triangle),
        Body::Sphere { center, radius },
    ];
    let all = lights.iter().map(Emitter::from);
    let all = all.chain(bodies.map(|body| Emitter { body, light }));
    let ours = Emitters::new(all.collect(), Some(&map), [0.0; 3]);
    let own = emitters::Emitters::new(&scene, &rows, &lights, Some(&map)).unwrap();
    // Edges of cells of the sky and thresholds of choices.
    let turned = samples_apart(&ours, &own);
    assert!(turned < 8, "{turned}");
}

/// Counts samples and skies of two models that differ, by the same points and numbers.
fn samples_apart(ours: &Emitters, own: &emitters::Emitters) -> u32 {
    let mut random = Random(5);
    let mut turned = 0;
    for i in 0..NUMBERS {
        let point = DVec3::new(
            uniform(&mut random) * 6.0 - 3.0,
            uniform(&mut random) * 3.0,
            uniform(&mut random) * 6.0 - 3.0,
        );
        let normal = match i % 3 {
            0 => DVec3::ZERO,
            _ => direction(&mut random, -1.0),
        };
        let [pick, u, v] = [0; 3].map(|_| number(&mut random));
        let a = ours.sample::<f32>(point.into(), narrow(normal), true, pick, [u, v]);
        let b = own.sample((point, normal), pick.into(), [u, v].map(f64::from));
        let toward = DVec3::from(a.dir).normalize_or_zero();
        match b {
            Some(b) if a.some && toward.distance(b.dir.normalize()) < 1e-4 => {
                assert_eq!((a.far, a.delta), (b.far, b.delta));
                let error = (f64::from(a.pdf) / b.pdf - 1.0).abs();
                let error = error.max(apart(a.radiance, b.radiance));
                turned += u32::from(error > 1e-3);
            }
            None if !a.some => {}
            _ => turned += 1,
        }
        let dir = direction(&mut random, -1.0);
        let (a, pdf) = ours.sky::<f32>(narrow(dir), point.into(), narrow(normal));
        let (b, other) = own.sky(dir, point, normal);
        let error = apart(a, b).max(apart([pdf; 3], [other; 3]));
        turned += u32::from(error > 1e-3);
    }
    turned
}

/// The tree that chooses among many is grown from the same clusters, in the same order.
#[test]
fn many_emitters_are_those_of_the_reference() {
    let mut scene = SceneBuilder::default();
    let mut bodies = Vec::new();
    let mut random = Random(9);
    for k in 0..300 {
        let mut place = || random.unit() * 3.0;
        // Some in rows, so that cuts have equal costs.
        let center = match k % 3 {
            0 => DVec3::new(f64::from(k / 3 % 10), f64::from(k / 30), 2.0),
            _ => DVec3::new(place(), place(), place()),
        };
        let light = [4.0, 1.0 + (k % 5) as f32, 2.0];
        let material = Material {
            emission: light,
            ..Material::default()
        };
        let material = scene.material("", material);
        let radius = 0.05;
        let (shape, body) = match k % 2 {
            0 => (
                scene.sphere("", lanecast::shapes::Sphere { center, radius }),
                Body::Sphere { center, radius },
            ),
            _ => {
                let triangle = [
                    center,
                    center + DVec3::new(0.1, 0.02, 0.0),
                    center + DVec3::Y * 0.2,
                ];
                (scene.polygon("", &triangle, &[]), Body::Triangle(triangle))
            }
        };
        scene.instance("", Edge::shape(shape).material(material));
        bodies.push(Emitter { body, light });
    }
    let scene = scene.finish().expect("a right scene");
    let instances = Instances::of(&scene).expect("few instances");
    let rows = instances.laid_out(&scene).expect("few instances");
    let sun = [Light::Directional {
        direction: DVec3::new(-1.0, -1.5, -0.4),
        irradiance: [2.0, 1.8, 1.5],
        angle: 0.02,
    }];
    for lights in [&sun[..], &[]] {
        let all = lights
            .iter()
            .map(Emitter::from)
            .chain(bodies.iter().copied());
        let ours = Emitters::new(all.collect(), None, [0.0; 3]);
        let own = emitters::Emitters::new(&scene, &rows, lights, None).unwrap();
        let turned = samples_apart(&ours, &own);
        assert!(turned < 8, "{turned}");
    }
}
