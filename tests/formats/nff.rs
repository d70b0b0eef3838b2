//! NFF: published counts of the published databases, the mapping of small files, and the
//! messages for bad files.

use crate::common::assets;
use glam::DVec3;
use lanecast::internals::io::{LoadError, LoadOptions, Loaded, load};
use lanecast::internals::scene::{Falloff, Light, Model, Projection, Shape, Target};

fn load_text(text: &[u8]) -> Result<Loaded, LoadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.nff");
    std::fs::write(&path, text).unwrap();
    load(&path, &LoadOptions::default())
}

#[test]
fn every_published_database_has_its_published_counts() {
    let Some(assets) = assets() else { return };
    let index = std::fs::read_to_string(assets.join("spd/index.json")).unwrap();
    let index: Vec<serde_json::Value> = serde_json::from_str(&index).unwrap();
    assert!(index.len() >= 20);
    for entry in &index {
        let file = entry["file"].as_str().unwrap();
        let loaded = load(&assets.join(file), &LoadOptions::default()).unwrap();
        let scene = &loaded.scene;
        let smooth = scene.polygons.normals_of.iter().flatten().count();
        let found = [
            ("spheres", scene.spheres.len()),
            ("polygons", scene.polygons.len() - smooth),
            ("patches", smooth),
            ("cones_cyl", scene.cones.len() + scene.cylinders.len()),
            ("lights", scene.lights.len()),
            ("materials", scene.materials.len()),
            ("total_prims", scene.roots.len()),
        ];
        for (what, count) in found {
            assert_eq!(entry[what].as_u64(), Some(count as u64), "{file}: {what}");
        }
        assert_eq!(scene.cameras.rows.len(), 1, "{file}");
        assert_eq!(loaded.warning, None, "{file}");
    }
}

#[test]
fn objects_and_their_fills_keep_the_order_of_the_file() {
    let text = b"# a comment \xff\n\
        b .1 .2 .3\n\
        v from 0 0 5 at 0 0 0 up 0 1 0\nangle 45 hither 1\n resolution 512 512\n\
        l 1 2 3 l 4 5 6 1 .5 0#tail\n\
        s 0 0 0 1\n\
        f 1 .5 0 .5 .25 10 0 0\n\
        c 0 0 0 1 0\n1 0 1\n\
        c 0 0 0 2 0 1 0 0\n\
        f 1 1 1 0 0 1 .8 1.5\n\
        p 3 0 0 0 1 0 0 0 1 0\n\
        pp 3 0 0 0 0 0 1 1 0 0 0 0 1 0 1 0 0 0 1\n\
        s 0 0 0 -2\n";
    let loaded = load_text(text).unwrap();
    let scene = &loaded.scene;
    assert_eq!(
        loaded.warning.as_deref(),
        Some("not imported: 1 × one-sided visibility")
    );
    let kinds: Vec<Shape> = scene
        .roots
        .target
        .iter()
        .map(|t| match t {
            Target::Shape(id) => scene.shapes.row(*id),
            Target::Node(_) => panic!("NFF has no nodes"),
        })
        .collect();
    assert!(matches!(
        kinds[..],
        [
            Shape::Sphere(_),
            Shape::Cylinder(_),
            Shape::Cone(_),
            Shape::Polygon(_),
            Shape::Polygon(_),
            Shape::Sphere(_),
        ]
    ));
    let materials: Vec<_> = scene
        .roots
        .material
        .iter()
        .map(|m| m.map(|m| m.0))
        .collect();
    let expected = [None, Some(0), Some(0), Some(1), Some(1), Some(1)];
    assert_eq!(materials, expected);
    assert_eq!(scene.spheres.radius, [1.0, 2.0]);
    assert!(scene.cylinders.open[0] && scene.cones.open[0]);
    assert_eq!(scene.cones.top_radius, [0.0]);
    assert_eq!(scene.background, [0.1, 0.2, 0.3]);

    let brown = scene.materials.rows[0];
    assert_eq!((brown.base_color, brown.ior), ([1.0, 0.5, 0.0], 1.0));
    assert_eq!(
        brown.model,
        Model::Phong {
            diffuse: [0.5, 0.25, 0.0],
            specular: [0.25; 3],
            exponent: 10.0,
            mirror: [0.25; 3],
        }
    );
    let glass = scene.materials.rows[1];
    assert_eq!((glass.transmission, glass.ior), (0.8, 1.5));

    let share = (std::f64::consts::PI / 2.0_f64.sqrt()) as f32;
    let light = |position, color: [f32; 3]| Light::Point {
        position,
        intensity: color,
        falloff: Falloff::None,
        radius: 0.0,
    };
    assert_eq!(
        scene.lights[0],
        light(DVec3::new(1.0, 2.0, 3.0), [share; 3])
    );
    let warm = [
        share,
        (f64::from(0.5_f32) * std::f64::consts::PI / 2.0_f64.sqrt()) as f32,
        0.0,
    ];
    assert_eq!(scene.lights[1], light(DVec3::new(4.0, 5.0, 6.0), warm));

    let camera = scene.cameras.rows[0];
    assert_eq!(camera.forward, DVec3::NEG_Z);
    let half_height = (22.5_f64).to_radians().tan();
    match camera.projection {
        Projection::Perspective { half_height: h } => assert!((h - half_height).abs() < 1e-15),
        _ => panic!("NFF views are perspective"),
    }
}

#[test]
fn bad_files_are_refused_with_their_place() {
    let view = "v from 0 0 5 at 0 0 0 up 0 1 0";
    let cases: &[(&str, &str)] = &[
        ("", "the scene is empty"),
        ("# only a comment", "the scene is empty"),
        ("s 0 0 0 1\nq 1", "scene.nff:2:1: unknown entity 'q'"),
        (
            "s 0 0 0",
            "scene.nff:1:8: expected a number, found the end of the file",
        ),
        ("s 0 0 x 1", "scene.nff:1:7: expected a number, found 'x'"),
        (
            "s 0 0\n  nan 1",
            "scene.nff:2:3: 'nan' is not a finite number",
        ),
        (
            "s 0 0 1e999 1",
            "scene.nff:1:7: '1e999' is not a finite number",
        ),
        ("s 0 0 0 0", "scene.nff:1:9: the sphere's radius is 0"),
        ("s 0 0 0 s 1", "scene.nff:1:9: expected a number, found 's'"),
        (
            "p 1000000000\n0 0 0",
            "scene.nff:2:6: expected a number, found the end",
        ),
        (
            "p 99999999999999999999 0 0 0",
            "scene.nff:1:3: a polygon has a whole number",
        ),
        (
            "p -3 0 0 0",
            "scene.nff:1:3: a polygon has a whole number of points, 3 or more",
        ),
        (
            "p 2 0 0 0 1 1 1",
            "scene.nff:1:3: a polygon has a whole number",
        ),
        ("p 3.5 0 0 0", "scene.nff:1:3: a polygon has a whole number"),
        ("p 3 0 0 0 1 0 0 2 0 0", "its points lie on a line"),
        (
            "p 4 0 0 0 1 0 0 1 1 0 0 1 1",
            "its points are not in one plane",
        ),
        (
            "c 0 0 0 1 0 0 0 1",
            "scene.nff:1:1: the cone's base and apex are the same point",
        ),
        (
            "c 0 0 0 0 1 0 0 0",
            "scene.nff:1:1: both radii of the cone are 0",
        ),
        (
            "f 1 1 1 1 0 0 2 1",
            "scene.nff:1:15: T is 2; it must be between 0 and 1",
        ),
        (
            "f 1 -1 1 1 0 0 0 1",
            "scene.nff:1:5: the colour is '-1'; it must be 0 or greater",
        ),
        (
            "f 1 1 1 1 0 0 0 -1",
            "scene.nff:1:17: the index of refraction is '-1'",
        ),
        ("v from 0 0 5", "scene.nff:1:1: the view has no 'at'"),
        ("v", "scene.nff:1:1: the view has no 'from'"),
        (
            "v from 0 0 5 at 0 0 5 up 0 1 0 angle 45",
            "from and at are the same point",
        ),
        (
            "v from 0 0 5 at 0 0 0 up 0 0 0 angle 45",
            "scene.nff:1:23: up is (0, 0, 0)",
        ),
        (
            &format!("{view} angle 180"),
            "scene.nff:1:32: angle is 180; it must be between",
        ),
        (
            &format!("{view} angle"),
            "expected a number, found the end of the file",
        ),
        ("\u{1b}[31m", "unknown entity '\\x1b[31m'"),
    ];
    for (text, expected) in cases {
        let message = match load_text(text.as_bytes()) {
            Ok(_) => panic!("this was loaded: {text}"),
            Err(e) => e.to_string(),
        };
        assert!(
            message.contains(expected),
            "{text}\n  gave {message}\n  not  {expected}"
        );
    }
}
