//! Points and lines of files are spheres and capsules of a given radius, or named as left out.

use crate::common::{RayColumns, kernels};
use glam::DVec3;
use lanecast::internals::accel::{Structure, World};
use lanecast::internals::io::{LoadError, LoadOptions, Loaded, load};
use lanecast::internals::plan::Precision;
use lanecast::internals::scene::{Instances, Scene};
use std::fs;
use std::path::Path;

fn read(folder: &Path, name: &str, point_radius: Option<f64>) -> Result<Loaded, LoadError> {
    let options = LoadOptions {
        point_radius,
        ..LoadOptions::default()
    };
    load(&folder.join(name), &options)
}

/// Loads a file of these bytes, drawn with a radius of 0.25.
fn drawn(name: &str, bytes: &[u8]) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(name), bytes).unwrap();
    read(folder.path(), name, Some(0.25)).unwrap_or_else(|e| panic!("{e}"))
}

/// How far rays along -z from z = 10 go, at places (x, y); infinity where they meet nothing.
fn depths(scene: &Scene, at: &[[f64; 2]]) -> Vec<f64> {
    let mut rays = RayColumns::default();
    for [x, y] in at {
        rays.push(DVec3::new(*x, *y, 10.0), [0.0, 0.0, -1.0]);
    }
    let instances = Instances::of(scene).unwrap();
    let world = World::build(scene, &instances, Structure::Bvh);
    let hits = rays.closest(&world, &kernels(Precision::Exact));
    hits.into_iter().map(|hit| hit.0).collect()
}

fn colors(scene: &Scene) -> Vec<[f32; 3]> {
    let instances = Instances::of(scene).unwrap();
    let color = |row: lanecast::internals::scene::Instance| {
        let material = row.material.expect("a colour");
        scene.materials.rows[material.index()].base_color
    };
    instances.iter(scene).map(color).collect()
}

const CLOUD: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n\
    property float y\nproperty float z\nproperty uchar red\nproperty uchar green\n\
    property uchar blue\nend_header\n0 0 0 255 0 0\n1 0 2 0 255 0\nnan 0 0 9 9 9\n";

#[test]
fn points_of_a_cloud_are_balls_with_their_colours() {
    let loaded = drawn("cloud.ply", CLOUD.as_bytes());
    let scene = &loaded.scene;
    let expected = [9.75, 7.75, f64::INFINITY, f64::INFINITY];
    assert_eq!(
        depths(scene, &[[0.0, 0.0], [1.0, 0.0], [0.3, 0.0], [0.5, 0.0]]),
        expected
    );
    assert_eq!(colors(scene), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let said = loaded.warning.unwrap();
    assert_eq!(said, "not imported: 1 × point that is not finite");
}

#[test]
fn points_and_lines_of_obj_are_balls_and_bars() {
    let text = "mtllib m.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 1\nv 5 5 0\nv 0 0 9\n\
                p 4\nusemtl red\nl 1 2/7 -3\nl 1 1\n";
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("m.mtl"), "newmtl red\nKd 1 0 0\n").unwrap();
    fs::write(folder.path().join("a.obj"), text).unwrap();
    let loaded = read(folder.path(), "a.obj", Some(0.25)).unwrap();
    let scene = &loaded.scene;
    // Balls at four vertices, a segment of length 0 none, and the fifth vertex in no element.
    assert_eq!((scene.spheres.len(), scene.cylinders.len()), (4, 2));
    let at = [
        [5.0, 5.0],
        [1.0, 0.0],
        [-0.125, 0.0],
        [2.0, 2.0],
        [3.0, 0.0],
        [0.0, 1.0],
    ];
    let round = 10.0 - (0.0625_f64 - 0.015625).sqrt();
    let [ball, bar, end, top, beside, off] = depths(scene, &at)[..] else {
        panic!("six rays");
    };
    assert_eq!((ball, bar, top), (9.75, 9.75, 8.75));
    assert_eq!((beside, off), (f64::INFINITY, f64::INFINITY));
    assert!((end - round).abs() < 1e-14, "{end} {round}");
    // Along the bar that rises, the ray meets its side at √(1 + 1/4) of the radius above.
    let [slope] = depths(scene, &[[2.0, 1.0]])[..] else {
        panic!("one ray");
    };
    assert!(
        (slope - (9.5 - 0.25 * 1.25_f64.sqrt())).abs() < 1e-14,
        "{slope}"
    );
    let instances = Instances::of(scene).unwrap();
    let materials: Vec<bool> = instances
        .iter(scene)
        .map(|row| row.material.is_some())
        .collect();
    assert_eq!(materials.iter().filter(|has| **has).count(), 5);
    let gone = "v 0 0 0\nl 1 7\n";
    fs::write(folder.path().join("b.obj"), gone).unwrap();
    let error = read(folder.path(), "b.obj", Some(0.25))
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("b.obj:2:1: there is no vertex 7: the file has 1"),
        "{error}"
    );
    let colored = drawn("c.obj", b"v 0 0 0 1 0 0\nv 1 0 0 0 0 1\np 1 2\n");
    assert_eq!(colors(&colored.scene), [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_eq!(colored.warning, None);
}

/// A glTF of one primitive of the four corners of a square, below a node that is scaled by 2.
fn square(folder: &Path, mode: u32) -> Scene {
    let corners: [[f32; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
    let bytes: Vec<u8> = corners
        .iter()
        .flatten()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    fs::write(folder.join("p.bin"), bytes).unwrap();
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"mesh":0,"scale":[2,2,2]}}],
        "meshes":[{{"primitives":[{{"mode":{mode},"attributes":{{"POSITION":0}}}}]}}],
        "buffers":[{{"uri":"p.bin","byteLength":48}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3",
        "min":[0,0,0],"max":[1,1,0]}}]}}"#
    );
    fs::write(folder.join("a.gltf"), text).unwrap();
    read(folder, "a.gltf", Some(0.25))
        .unwrap_or_else(|e| panic!("{e}"))
        .scene
}

#[test]
fn modes_of_gltf_say_what_is_joined() {
    let folder = tempfile::tempdir().unwrap();
    // The middles of the sides of a square of 2: bottom, right, top, left.
    let middles = [[1.0, 0.0], [2.0, 1.0], [1.0, 2.0], [0.0, 1.0]];
    for (mode, sides) in [
        (0, [false; 4]),
        (1, [true, false, true, false]),
        (2, [true; 4]),
        (3, [true, true, true, false]),
    ] {
        let scene = square(folder.path(), mode);
        let far = |is: bool| if is { 9.75 } else { f64::INFINITY };
        assert_eq!(depths(&scene, &middles), sides.map(far), "{mode}");
        let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        assert_eq!(depths(&scene, &corners), [9.75; 4], "{mode}");
    }
}

#[test]
fn without_a_radius_the_option_is_named() {
    let folder = tempfile::tempdir().unwrap();
    square(folder.path(), 0);
    fs::write(folder.path().join("c.ply"), CLOUD).unwrap();
    fs::write(folder.path().join("a.obj"), "v 0 0 0\np 1\n").unwrap();
    for (name, what) in [
        ("a.gltf", "1 × point primitive (see --point-radius)"),
        ("c.ply", "3 × loose point (see --point-radius)"),
        ("a.obj", "1 × point or line element (see --point-radius)"),
    ] {
        let error = read(folder.path(), name, None).unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    }
}

#[test]
fn a_placed_cloud_is_drawn_in_its_own_units() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("c.ply"), CLOUD).unwrap();
    let text = "format = 1\n[[instance]]\nscene = 'c.ply'\ntransform = [{ scale = 2.0 }]\n";
    fs::write(folder.path().join("a.toml"), text).unwrap();
    let scene = read(folder.path(), "a.toml", Some(0.25)).unwrap().scene;
    assert_eq!(depths(&scene, &[[0.0, 0.0], [2.0, 0.0]]), [9.5, 5.5]);
}

#[test]
fn more_colours_than_materials_are_rounded() {
    use std::fmt::Write as _;
    let count = 70_000_u32;
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n\
         property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
    );
    for i in 0..count {
        let _ = writeln!(
            text,
            "{i} 0 0 {} {} {}",
            i & 255,
            i >> 8 & 255,
            i >> 16 & 255
        );
    }
    let loaded = drawn("many.ply", text.as_bytes());
    assert!(loaded.scene.materials.len() <= 1 << 15);
    let said = loaded.warning.unwrap();
    assert_eq!(
        said,
        "shown as: 1 × set of colours of points, rounded to 5 bits a channel"
    );
    let grey = loaded.scene.materials.rows.iter().map(|row| row.base_color);
    assert!(grey.clone().any(|c| c == [1.0, 1.0, 0.0]) && grey.clone().any(|c| c == [0.0; 3]));
}
