//! Animations of glTF files: vertices at times, as other programs have them, and curves that are
//! known; and lights of native scenes that move.

use crate::common::assets;
use lanecast::internals::io::{Animated, LoadOptions, Loaded, load};
use lanecast::internals::scene::{Instances, Light, Pace, Scene, Shape, Timeline};
use lanecast::{DVec3, LoadError};
use serde_json::{Value, json};
use std::path::Path;

fn options(name: Option<&str>, timeline: Timeline) -> LoadOptions {
    LoadOptions {
        animation: Some(Animated {
            name: name.map(Into::into),
            timeline,
            margin: 1,
            blurs: false,
        }),
        ..LoadOptions::default()
    }
}

fn per_second(rate: f64, end: u32) -> Timeline {
    Timeline {
        pace: Pace::PerSecond(rate),
        first: 0,
        end,
        stride: 1,
    }
}

/// Lists the vertices of all meshes in the world.
fn vertices(scene: &Scene) -> Vec<DVec3> {
    let instances = Instances::of(scene).unwrap();
    let mut all = Vec::new();
    for placed in instances.iter(scene) {
        let Shape::Mesh(mesh) = scene.shapes.row(placed.shape) else {
            continue;
        };
        let mesh = scene.meshes.row(mesh);
        for p in mesh.positions {
            let local = DVec3::from_array(p.map(f64::from)) + mesh.center;
            all.push(DVec3::from_array(
                placed.world_from_object.point(local.to_array()),
            ));
        }
    }
    all
}

/// The table is of `.ci/animation`, which compares it with Blender.
#[test]
fn vertices_at_five_times_are_those_of_other_programs() {
    let Some(folder) = assets() else {
        return;
    };
    let table: Value = serde_json::from_str(include_str!("animated.json")).unwrap();
    let rate = table["fps"].as_f64().unwrap();
    for (name, of) in table["files"].as_object().unwrap() {
        let frames = of["frames"].as_array().unwrap();
        let frames = frames.iter().map(|frame| frame.as_u64().unwrap() as u32);
        let loaded = load(&folder.join(name), &options(None, per_second(rate, 102))).unwrap();
        assert_eq!(loaded.warning, None, "{name}");
        for (frame, points) in frames.zip(of["positions"].as_array().unwrap()) {
            let expected: Vec<DVec3> = serde_json::from_value::<Vec<[f64; 3]>>(points.clone())
                .unwrap()
                .into_iter()
                .map(DVec3::from_array)
                .collect();
            let size = expected
                .iter()
                .fold(0.0_f64, |most, p| most.max(p.abs().max_element()));
            let time = per_second(rate, 1).time(frame.into(), loaded.scene.seconds.0);
            let is = vertices(&loaded.scene.clone().at(time).unwrap());
            let near = |p: &DVec3, all: &[DVec3]| {
                all.iter()
                    .any(|q| (*p - *q).abs().max_element() <= 1e-6 * size)
            };
            assert!(!is.is_empty());
            for p in &is {
                assert!(near(p, &expected), "{name}, frame {frame}: {p}");
            }
            for p in &expected {
                assert!(near(p, &is), "{name}, frame {frame} lacks {p}");
            }
        }
    }
}

/// A file of one triangle, whose node an animation moves; and a camera and a light below it.
fn moving(channels: &[(&str, &str, &[f32], &[f32])]) -> Value {
    let mut numbers: Vec<f32> = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut accessors = vec![json!({
        "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
    })];
    let (mut samplers, mut targets) = (Vec::new(), Vec::new());
    for (path, interpolation, input, output) in channels {
        let width = if *path == "rotation" { 4 } else { 3 };
        for (kind, column, count) in [
            ("SCALAR", input, input.len()),
            (
                if width == 4 { "VEC4" } else { "VEC3" },
                output,
                output.len() / width,
            ),
        ] {
            accessors.push(json!({
                "bufferView": 0, "byteOffset": numbers.len() * 4, "componentType": 5126,
                "count": count, "type": kind,
            }));
            numbers.extend(*column);
        }
        let last = accessors.len() - 1;
        samplers.push(json!({
            "input": last - 1, "output": last, "interpolation": interpolation,
        }));
        targets.push(json!({
            "sampler": samplers.len() - 1, "target": { "node": 0, "path": path },
        }));
    }
    let bytes = numbers.iter().flat_map(|x| x.to_le_bytes());
    let uri: String = bytes.map(|b| format!("%{b:02x}")).collect();
    json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "spot" }] } },
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.1 } }],
        "scenes": [{ "nodes": [0] }],
        "nodes": [
            { "mesh": 0, "children": [1], "translation": [9.0, 9.0, 9.0] },
            {
                "camera": 0, "translation": [0.0, 0.0, 2.0],
                "extensions": { "KHR_lights_punctual": { "light": 0 } },
            },
        ],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "animations": [
            { "name": "still", "channels": [], "samplers": [] },
            { "name": "walk", "channels": targets, "samplers": samplers },
        ],
        "accessors": accessors,
        "bufferViews": [{ "buffer": 0, "byteLength": numbers.len() * 4 }],
        "buffers": [{ "byteLength": numbers.len() * 4, "uri": format!("data:,{uri}") }],
    })
}

fn loaded(document: &Value, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    load(&path, options)
}

/// Returns where the first vertex, the origin of the node, and the second are at a time in seconds.
fn ends(scene: &Scene, seconds: f64) -> [DVec3; 2] {
    let scene = scene.clone().at(seconds / scene.seconds.0).unwrap();
    let all = vertices(&scene);
    [all[0], all[1]]
}

#[test]
fn curves_of_all_kinds_move_nodes() {
    let whole = || options(Some("walk"), per_second(8.0, 17));
    // Steps.
    let document = moving(&[(
        "translation",
        "STEP",
        &[0.5, 1.0, 2.0],
        &[1., 0., 0., 2., 0., 0., 3., 0., 0.],
    )]);
    let scene = loaded(&document, &whole()).unwrap().scene;
    assert_eq!(scene.seconds.0, 2.0);
    for (time, x) in [
        (0.0, 1.0),
        (0.5, 1.0),
        (0.999, 1.0),
        (1.0, 2.0),
        (1.9, 2.0),
        (2.0, 3.0),
    ] {
        assert!((ends(&scene, time)[0].x - x).abs() < 1e-6, "{time}");
    }
    // A turn by 350 degrees in three keys, each the shorter way: 175 degrees twice.
    let half = |degrees: f64| {
        let (sin, cos) = (degrees.to_radians() * 0.5).sin_cos();
        [0.0, 0.0, sin as f32, cos as f32]
    };
    let turns = [half(0.0), half(175.0), half(350.0)].concat();
    let document = moving(&[("rotation", "LINEAR", &[0.0, 1.0, 2.0], &turns)]);
    let scene = loaded(&document, &whole()).unwrap().scene;
    for time in [0.0, 0.3, 0.77, 1.0, 1.5, 2.0] {
        let [a, b] = ends(&scene, time);
        let (sin, cos) = (175.0 * time).to_radians().sin_cos();
        assert!(
            (b - a - DVec3::new(cos, sin, 0.0)).length() < 1e-6,
            "{time}"
        );
        assert!((b - a).length() - 1.0 < 1e-12);
    }
    // x = t³, by values and slopes at 0, 1 and 2 seconds.
    let knot = |t: f32| [3.0 * t * t, 0., 0., t * t * t, 0., 0., 3.0 * t * t, 0., 0.];
    let cubic = [knot(0.0), knot(1.0), knot(2.0)].concat();
    let document = moving(&[("translation", "CUBICSPLINE", &[0.0, 1.0, 2.0], &cubic)]);
    let scene = loaded(&document, &whole()).unwrap().scene;
    for frame in 0..=16 {
        let time = f64::from(frame) / 8.0;
        assert!(
            (ends(&scene, time)[0].x - time.powi(3)).abs() < 1e-6,
            "{time}"
        );
    }
    for time in [0.01, 0.7, 1.234, 1.99] {
        assert!(
            (ends(&scene, time)[0].x - time.powi(3)).abs() < 8e-4,
            "{time}"
        );
    }
    // What is scaled to nothing is tiny.
    let document = moving(&[("scale", "LINEAR", &[0.0, 1.0], &[1., 1., 1., 0., 0., 0.])]);
    let scene = loaded(&document, &whole()).unwrap().scene;
    let [a, b] = ends(&scene, 0.5);
    assert!(((b - a).length() - 0.5).abs() < 1e-6);
    let [a, b] = ends(&scene, 1.0);
    assert!((b - a).length() < 2e-6);
}

#[test]
fn cameras_and_lights_move_with_their_nodes() {
    let way = [0., 0., 0., 4., 0., 0.];
    let document = moving(&[("translation", "LINEAR", &[0.0, 2.0], &way)]);
    let scene = loaded(&document, &options(Some("1"), per_second(4.0, 9)))
        .unwrap()
        .scene;
    for time in [0.0, 0.5, 1.25, 2.0] {
        let scene = scene.clone().at(time / 2.0).unwrap();
        let place = DVec3::new(2.0 * time, 0.0, 2.0);
        assert!(
            (scene.cameras.rows[0].eye - place).length() < 1e-6,
            "{time}"
        );
        assert!((scene.cameras.rows[0].forward + DVec3::Z).length() < 1e-12);
        let Light::Spot {
            position,
            direction,
            ..
        } = scene.lights[0]
        else {
            panic!("the light is no spot");
        };
        assert!((position - place).length() < 1e-6, "{time}");
        assert_eq!(direction, -DVec3::Z);
    }
    // A turn of the node takes what is below it round.
    let turned = 0.5_f32.sqrt();
    let turn = [0., 0., 0., 1., 0., turned, 0., turned];
    let document = moving(&[("rotation", "LINEAR", &[0.0, 1.0], &turn)]);
    let options = options(Some("walk"), per_second(4.0, 5));
    let scene = loaded(&document, &options).unwrap().scene;
    for quarter in 0..=4 {
        let time = f64::from(quarter) / 4.0;
        let scene = scene.clone().at(time).unwrap();
        let (sin, cos) = (90.0 * time).to_radians().sin_cos();
        let back = DVec3::new(sin, 0.0, cos);
        let place = DVec3::splat(9.0) + back * 2.0;
        assert!(
            (scene.cameras.rows[0].eye - place).length() < 1e-6,
            "{time}"
        );
        assert!(
            (scene.cameras.rows[0].forward + back).length() < 1e-6,
            "{time}"
        );
    }
}

#[test]
fn without_being_asked_for_things_are_at_rest() {
    let document = moving(&[(
        "translation",
        "LINEAR",
        &[0.0, 2.0],
        &[0., 0., 0., 4., 0., 0.],
    )]);
    let still = loaded(&document, &LoadOptions::default()).unwrap();
    assert!(!still.scene.moves());
    assert_eq!(
        still.warning.unwrap(),
        "not imported: 2 × animation (see --animation)"
    );
    assert_eq!(vertices(&still.scene)[0], DVec3::splat(9.0));
    // The first has no channels.
    let first = loaded(&document, &options(None, Timeline::whole(2))).unwrap();
    assert!(!first.scene.moves());
    let error = |name| {
        let result = loaded(&document, &options(Some(name), Timeline::whole(2)));
        result.unwrap_err().to_string()
    };
    assert!(error("run").contains("there is no animation 'run'; known are still, walk"));
    assert!(error("2").contains("there is no animation '2'"));
    let native = Path::new("scenes/moving.toml");
    let error = load(native, &options(Some("walk"), Timeline::whole(2))).unwrap_err();
    assert!(error.to_string().contains("--animation"), "{error}");
    assert!(load(native, &options(None, Timeline::whole(2))).is_ok());
}

#[test]
fn malformed_animations_are_refused_by_their_place() {
    let good = || {
        moving(&[(
            "translation",
            "LINEAR",
            &[0.0, 2.0],
            &[0., 0., 0., 4., 0., 0.],
        )])
    };
    let walk = options(Some("walk"), Timeline::whole(2));
    for (place, value, says) in [
        (
            "/animations/1/channels/0/sampler",
            json!(7),
            "channel 0: refers to sampler 7, but there are 1",
        ),
        (
            "/animations/1/channels/0/target/node",
            json!(7),
            "refers to node 7, but there are 2",
        ),
        (
            "/animations/1/samplers/0/interpolation",
            json!("FAST"),
            "must be LINEAR, STEP or CUBICSPLINE",
        ),
        (
            "/animations/1/samplers/0/input",
            json!(0),
            "its accessor must be of type SCALAR",
        ),
        (
            "/animations/1/samplers/0/input",
            json!(77),
            "refers to accessor 77",
        ),
        (
            "/animations/1/samplers/0/interpolation",
            json!("CUBICSPLINE"),
            "three times as many",
        ),
        ("/accessors/2/count", json!(1), "has 3 values for 2 keys"),
    ] {
        let mut document = good();
        *document.pointer_mut(place).unwrap() = value;
        let error = loaded(&document, &walk).unwrap_err().to_string();
        assert!(error.contains(says), "{place}: {error}");
    }
    let mut document = good();
    document["animations"][1]["channels"][0]["target"]["path"] = json!("pointer");
    let warning = loaded(&document, &walk).unwrap().warning.unwrap();
    assert_eq!(warning, "not imported: 1 × animation of 'pointer'");
    let falling = moving(&[(
        "translation",
        "LINEAR",
        &[2.0, 1.0],
        &[0., 0., 0., 4., 0., 0.],
    )]);
    let error = loaded(&falling, &walk).unwrap_err().to_string();
    assert!(
        error.contains("input: its times must rise from 0 or later"),
        "{error}"
    );
    // A mirror image has no way to what it mirrors.
    let flips = moving(&[("scale", "LINEAR", &[0.0, 1.0], &[1., 1., 1., -1., 1., 1.])]);
    let warning = loaded(&flips, &walk).unwrap().warning.unwrap();
    assert!(
        warning.contains("animation that turns a node inside out"),
        "{warning}"
    );
}

#[test]
fn lights_of_native_scenes_move() {
    let scene = |light: &str| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        let text = format!(
            "format = 1\nseconds = 4\n[shape.s]\nsphere = {{ center = [0, 0, 0], radius = 1 }}\n\
             [[instance]]\nshape = \"s\"\n[[light]]\n{light}"
        );
        std::fs::write(&path, text).unwrap();
        load(&path, &LoadOptions::default()).map(|loaded| loaded.scene)
    };
    let point = "point = { position = [0, 2, 0], intensity = [1, 1, 1] }\n";
    let moves = scene(&format!(
        "{point}motion = [{{ at = 0.5, position = [4, 2, 0] }}, {{ at = 1, color = [3, 1, 0] }}]"
    ))
    .unwrap();
    assert!(moves.moves());
    assert_eq!(moves.seconds.0, 4.0);
    for (time, x, red) in [
        (0.0, 0.0, 1.0),
        (0.25, 2.0, 1.0),
        (0.5, 4.0, 1.0),
        (0.75, 4.0, 2.0),
    ] {
        let at = moves.clone().at(time).unwrap();
        let Light::Point {
            position,
            intensity,
            ..
        } = at.lights[0]
        else {
            panic!("the light is no point");
        };
        assert_eq!((position.x, intensity[0]), (x, red), "{time}");
    }
    for (motion, says) in [
        ("motion = []", "motion has no keys"),
        (
            "motion = [{ at = 0.0 }]",
            "it must be above that of the key before, 0, and at most 1",
        ),
        (
            "motion = [{ at = 0.5 }, { at = 0.5 }]",
            "above that of the key before, 0.5",
        ),
        (
            "motion = [{ at = 0.5, direction = [1, 0, 0] }]",
            "this kind of light has no direction",
        ),
        (
            "motion = [{ at = 0.5, radius = -1 }]",
            "radius = -1; it must be 0 or greater",
        ),
        (
            "motion = [{ at = 0.5, color = [-1, 0, 0] }]",
            "0 or greater",
        ),
    ] {
        let error = scene(&format!("{point}{motion}")).unwrap_err().to_string();
        assert!(error.contains(says), "{motion}: {error}");
    }
}
