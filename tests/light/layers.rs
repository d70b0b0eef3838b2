//! Layers of light add up to the picture, and mattes cover it.

use lanecast::internals::io::matte_id;
use lanecast::internals::render::{Adaptive, AovSet, Backdrop, Integrator, TileOrder};
use lanecast::internals::scene::{Environment, Falloff, Layers, Lit, Model};
use lanecast::shapes::{Cuboid, HalfSpace, Sphere};
use lanecast::{
    Camera, DVec3, Edge, Light, Material, Picture, RenderConfig, Scene, SceneBuilder, Tracer,
    TracerOptions,
};

/// Matter of all kinds under lights of three groups, and one of none.
fn scene() -> Scene {
    lit_by(true)
}

/// The same things, under all lights or the sun alone.
fn lit_by(all: bool) -> Scene {
    let mut scene = SceneBuilder::default();
    let sun = scene.light(Light::Directional {
        direction: DVec3::new(-1.0, -2.0, -1.0),
        irradiance: [1.0, 0.9, 0.7],
        angle: 0.05,
    });
    scene.light_group("sun", Lit::Light(sun));
    if all {
        let lamp = scene.light(Light::Rectangle {
            center: DVec3::new(0.0, 4.0, 0.0),
            edges: [DVec3::X * 2.0, DVec3::Z * 2.0],
            radiance: [6.0, 5.0, 4.0],
            two_sided: false,
        });
        scene.light_group("key", Lit::Light(lamp));
        scene.light(Light::Point {
            position: DVec3::new(2.0, 2.0, 3.0),
            intensity: [4.0; 3],
            falloff: Falloff::InverseSquare,
            radius: 0.1,
        });
        scene.environment(Environment::uniform([0.1, 0.15, 0.25]));
        scene.light_group("sky", Lit::Environment);
    }
    let glow = scene.material(
        "glow",
        Material {
            emission: if all { [3.0, 1.0, 0.5] } else { [0.0; 3] },
            ..Material::default()
        },
    );
    scene.light_group("key", Lit::Material(glow));
    let gold = Material::metallic_roughness([0.9, 0.7, 0.3], 1.0, 0.2);
    let gold = scene.material("gold", gold);
    let lacquer = scene.material(
        "lacquer",
        Material {
            base_color: [0.2, 0.5, 0.8],
            layers: Layers {
                clearcoat: 1.0,
                sheen_color: [0.3; 3],
                sheen_roughness: 0.5,
                ..Layers::default()
            },
            ..Material::default()
        },
    );
    let net = scene.material(
        "net",
        Material {
            layers: Layers {
                opacity: 0.4,
                ..Layers::default()
            },
            ..Material::default()
        },
    );
    let glass = scene.material(
        "glass",
        Material {
            transmission: 1.0,
            model: Model::MetallicRoughness {
                metallic: 0.0,
                roughness: 0.0,
            },
            ..Material::default()
        },
    );
    let ball = |scene: &mut SceneBuilder, name: &str, x: f64, material| {
        let center = DVec3::new(x, 0.5, 0.0);
        let ball = scene.sphere(
            name,
            Sphere {
                center,
                radius: 0.5,
            },
        );
        scene.instance("", Edge::shape(ball).material(material));
    };
    ball(&mut scene, "golden", -1.5, gold);
    ball(&mut scene, "painted", -0.4, lacquer);
    ball(&mut scene, "clear", 0.7, glass);
    ball(&mut scene, "glowing", 1.8, glow);
    let screen = Cuboid {
        // Not on the floor: through a hole in its bottom a path would leave the floor, too.
        min: DVec3::new(-2.0, 0.01, 1.0),
        max: DVec3::new(-1.0, 1.0, 1.1),
    };
    let screen = scene.cuboid("screen", screen);
    scene.instance("", Edge::shape(screen).material(net));
    let floor = HalfSpace {
        normal: DVec3::Y,
        offset: 0.0,
    };
    let floor = scene.half_space("floor", floor);
    scene.instance("", Edge::shape(floor));
    let eye = DVec3::new(0.0, 2.0, 6.0);
    scene.camera("", Camera::perspective(eye, DVec3::Y * 0.4, DVec3::Y, 40.0));
    scene.finish().unwrap()
}

fn render(scene: &Scene, config: &RenderConfig) -> Picture {
    let tracer = Tracer::new(scene, &TracerOptions::default()).unwrap();
    tracer.render(config, &Default::default(), &|_| ()).unwrap()
}

fn config() -> RenderConfig {
    let mut aovs = AovSet::default();
    aovs.add_all(true);
    RenderConfig {
        width: 48,
        height: 32,
        spp: 16,
        integrator: Integrator::Path,
        max_depth: 8,
        aovs,
        ..RenderConfig::default()
    }
}

/// The largest difference of the sum of some layers from the colour, relative to it.
fn apart(picture: &Picture, of: impl Fn(&str) -> bool) -> f64 {
    let layers: Vec<_> = picture.layers.iter().filter(|l| of(&l.name)).collect();
    assert!(layers.len() > 3);
    let mut most = 0.0_f64;
    for (i, color) in picture.color.iter().enumerate() {
        for k in 0..3 {
            let sum: f64 = layers.iter().map(|l| f64::from(l.color[i][k])).sum();
            let color = f64::from(color[k]);
            most = most.max((sum - color).abs() / (color + 1e-3));
        }
    }
    most
}

/// Six layers are rounded to f32, and the parts of each contribution twice.
const ROUNDED: f64 = 2e-6;

#[test]
fn layers_add_up_to_the_picture() {
    let scene = scene();
    for config in [
        config(),
        RenderConfig {
            adaptive: Some(Adaptive {
                noise: 0.1,
                most: 64,
            }),
            ..config()
        },
        RenderConfig {
            backdrop: Backdrop::Color([0.5, 0.2, 0.1]),
            spp: 5,
            ..config()
        },
    ] {
        let picture = render(&scene, &config);
        let is_way = |name: &str| !name.starts_with("light_") && !name.starts_with("denoising_");
        let by_way = apart(&picture, is_way);
        let by_group = apart(&picture, |name| name.starts_with("light_"));
        assert!(
            by_way < ROUNDED && by_group < ROUNDED,
            "{by_way} {by_group}"
        );
        // What is kept changes no bit of the colour.
        let plain = render(
            &scene,
            &RenderConfig {
                aovs: AovSet::default(),
                ..config.clone()
            },
        );
        assert_eq!(plain.color, picture.color);
        assert!(plain.layers.is_empty() && plain.mattes.is_empty());
        let light = |name: &str| {
            let layer = picture
                .layers
                .iter()
                .find(|layer| layer.name == name)
                .unwrap();
            layer
                .color
                .iter()
                .flatten()
                .map(|c| f64::from(*c))
                .sum::<f64>()
        };
        for layer in &picture.layers {
            assert!(light(&layer.name) > 0.0, "{}", layer.name);
        }
    }
}

#[test]
fn layers_and_mattes_have_one_set_of_bits() {
    let scene = scene();
    let one = render(&scene, &config());
    let other = render(
        &scene,
        &RenderConfig {
            tiles: TileOrder::Small,
            threads: Some(3),
            ..config()
        },
    );
    assert!(one.layers == other.layers && one.mattes == other.mattes);
    assert!(one.variance == other.variance && one.uv == other.uv);
}

#[test]
fn a_group_has_the_light_that_its_lights_bring_alone() {
    let config = RenderConfig {
        spp: 64,
        ..config()
    };
    let mean = |colors: &[[f32; 3]]| {
        let sum: f64 = colors.iter().flatten().map(|c| f64::from(*c)).sum();
        sum / colors.len() as f64
    };
    let picture = render(&scene(), &config);
    let sun = picture
        .layers
        .iter()
        .find(|layer| layer.name == "light_sun");
    let alone = render(&lit_by(false), &config);
    let (part, whole) = (mean(&sun.unwrap().color), mean(&alone.color));
    assert!((part / whole - 1.0).abs() < 0.03, "{part} {whole}");
}

#[test]
fn mattes_cover_what_is_seen() {
    let picture = render(&scene(), &config());
    assert_eq!(picture.mattes.len(), 3);
    let nothing = picture.depth.as_ref().unwrap();
    for matte in &picture.mattes {
        let ranks = matte.ranks as usize;
        for (name, id) in &matte.manifest {
            assert_eq!(*id, matte_id(name));
        }
        for (pixel, rows) in matte.rows.chunks(ranks).enumerate() {
            let sum: f32 = rows.iter().map(|[_, cover]| cover).sum();
            assert!((0.0..=1.0001).contains(&sum), "{sum}");
            assert!(rows.windows(2).all(|two| two[0][1] >= two[1][1]));
            for [id, cover] in rows {
                let known = matte.manifest.values().any(|known| *known == id.to_bits());
                assert_eq!(known, *cover > 0.0, "{id} {cover}");
            }
            // The floor has no end: below the horizon all is covered, but by the filter's reach.
            if pixel / 48 > 16 && nothing[pixel].is_finite() {
                assert!((sum - 1.0).abs() < 1e-5, "{pixel} {sum}");
            }
        }
    }
    let objects = &picture.mattes[0];
    let names: Vec<&str> = objects.manifest.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        ["clear", "floor", "glowing", "golden", "painted", "screen"]
    );
    // Through the net's holes what is behind it is met: both share its pixels.
    let screen = f32::from_bits(matte_id("screen"));
    let shared = objects.rows.chunks(6).filter(|rows| {
        let of = rows.iter().find(|[id, _]| *id == screen);
        of.is_some_and(|[_, cover]| (0.2..0.6).contains(cover)) && rows[1][1] > 0.2
    });
    assert!(shared.count() > 5);
}

#[test]
fn outputs_of_geometry_agree() {
    let scene = scene();
    let camera = scene.cameras.rows[0];
    let picture = render(&scene, &config());
    let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let column = |column: &Option<Vec<[f32; 3]>>, i: usize| vector(column.as_ref().unwrap()[i]);
    let mut seen = 0;
    for i in 0..picture.color.len() {
        let [depth, distance] =
            [&picture.depth, &picture.distance].map(|c| f64::from(c.as_ref().unwrap()[i]));
        assert_eq!(depth.is_finite(), distance.is_finite());
        if !depth.is_finite() {
            assert_eq!(column(&picture.geometric_normal, i), DVec3::ZERO);
            continue;
        }
        seen += 1;
        let way = column(&picture.position, i) - camera.eye;
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-5 * (1.0 + b.abs()), "{a} {b}");
        near(distance, way.length());
        near(depth, way.dot(camera.forward));
        let normal = column(&picture.normal, i);
        let turned = column(&picture.camera_normal, i);
        near(turned.x, normal.dot(camera.right));
        near(turned.y, normal.dot(camera.up));
        near(turned.z, -normal.dot(camera.forward));
        let own = column(&picture.geometric_normal, i);
        near(own.length(), 1.0);
        assert!(own.dot(way) < 0.0, "it faces the viewer");
    }
    assert!(seen > 500);
}
