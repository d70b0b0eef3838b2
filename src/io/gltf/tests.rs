//! Tiny documents built in memory: modes, layouts, placements, wrong numbers.

use super::*;
use crate::math::Affine;
use crate::scene::{Appearances, Light, MeshData, Projection, Scene, SceneError};
use serde_json::{Value, json};

/// Five points, four bytes of indices, then what a test adds.
fn points() -> Vec<u8> {
    let points = [
        [0.0_f32, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.5, 2.0, 0.0],
    ];
    points
        .iter()
        .flatten()
        .flat_map(|x| x.to_le_bytes())
        .collect()
}

/// A document with one mesh; view 0 is the whole buffer, accessor 0 the points.
fn document(bytes: &[u8]) -> Value {
    json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": bytes.len()}],
        "bufferViews": [{"buffer": 0, "byteLength": bytes.len()}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"}],
    })
}

fn glb(document: &Value, bin: &[u8]) -> Vec<u8> {
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((28 + json.len() as u32 + bin.len() as u32).to_le_bytes());
    glb.extend((json.len() as u32).to_le_bytes());
    glb.extend(b"JSON");
    glb.extend(json);
    glb.extend((bin.len() as u32).to_le_bytes());
    glb.extend(b"BIN\0");
    glb.extend(bin);
    glb
}

fn on_disk<T>(bytes: &[u8], f: impl FnOnce(&Path) -> T) -> T {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    std::fs::write(&path, bytes).unwrap();
    f(&path)
}

fn load(document: &Value, bin: &[u8]) -> Result<(Scene, Option<String>), LoadError> {
    on_disk(&glb(document, bin), |path| {
        let loaded = super::super::load(path, &LoadOptions::default())?;
        Ok((loaded.scene, loaded.warning))
    })
}

fn bake(document: &Value, bin: &[u8]) -> MeshData {
    on_disk(&glb(document, bin), |path| {
        let mut dropped = Dropped::default();
        super::super::import_mesh(path, &LoadOptions::default(), &mut dropped).unwrap()
    })
}

fn refused(document: &Value, bin: &[u8]) -> String {
    load(document, bin)
        .err()
        .map(|e| e.to_string())
        .unwrap_or_default()
}

fn set(document: &mut Value, pointer: &str, value: Value) {
    let (parent, key) = pointer.rsplit_once('/').unwrap();
    match document.pointer_mut(parent).unwrap() {
        Value::Object(map) => drop(map.insert(key.into(), value)),
        Value::Array(list) => match key.parse::<usize>() {
            Ok(i) if i < list.len() => list[i] = value,
            _ => list.push(value),
        },
        _ => panic!("{pointer}"),
    }
}

#[test]
fn modes_wind_alike() {
    for (mode, triangles) in [
        (4, vec![[0, 1, 2]]),
        (5, vec![[0, 1, 2], [1, 3, 2], [2, 3, 4]]),
        (6, vec![[1, 2, 0], [2, 3, 0], [3, 4, 0]]),
    ] {
        let mut d = document(&points());
        set(&mut d, "/meshes/0/primitives/0/mode", json!(mode));
        let (scene, warning) = load(&d, &points()).unwrap();
        assert_eq!(scene.meshes.triangles, triangles);
        assert_eq!(
            warning.is_some(),
            mode == 4,
            "5 vertices are no whole triangles"
        );
    }
    for mode in 0..4 {
        let mut d = document(&points());
        set(&mut d, "/meshes/0/primitives/0/mode", json!(mode));
        let nothing = load(&d, &points());
        assert!(matches!(
            nothing,
            Err(LoadError::Scene {
                source: SceneError::NothingToSee,
                ..
            })
        ));
    }
}

#[test]
fn indices_of_every_width() {
    for (kind, bytes) in [
        (5121, vec![3, 1, 2]),
        (5123, vec![3, 0, 1, 0, 2, 0]),
        (5125, vec![3, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]),
    ] {
        let bin = [points(), bytes].concat();
        let mut d = document(&bin);
        set(
            &mut d,
            "/accessors/-",
            json!({"bufferView": 0, "byteOffset": 60, "componentType": kind, "count": 3, "type": "SCALAR"}),
        );
        set(&mut d, "/meshes/0/primitives/0/indices", json!(1));
        // Vertex 0 is unused and leaves.
        assert_eq!(load(&d, &bin).unwrap().0.meshes.triangles, [[2, 0, 1]]);
        set(&mut d, "/accessors/1/count", json!(4));
        assert!(refused(&d, &bin).contains("do not fit"));
        set(&mut d, "/accessors/1/componentType", json!(5122));
        assert!(refused(&d, &bin).contains("unsigned"));
        // As signed, the type is wrong before the range is read.
        let mut wrong = bin.clone();
        wrong[60] = 5;
        set(&mut d, "/accessors/1/count", json!(3));
        set(&mut d, "/accessors/1/componentType", json!(kind));
        assert!(refused(&d, &wrong).contains("index 0 is vertex 5, but there are only 5"));
    }
}

#[test]
fn interleaved_and_unaligned() {
    let mut bin = vec![0xff; 3];
    let normal = [0.0_f32, 0.0, 1.0].map(f32::to_le_bytes).concat();
    for p in points().chunks(12).take(3) {
        bin.extend(p);
        bin.extend(&normal);
    }
    let mut d = document(&bin);
    set(
        &mut d,
        "/bufferViews/0",
        json!({"buffer": 0, "byteOffset": 3, "byteLength": 72, "byteStride": 24}),
    );
    set(&mut d, "/accessors/0/count", json!(3));
    set(
        &mut d,
        "/accessors/-",
        json!({"bufferView": 0, "byteOffset": 12, "componentType": 5126, "count": 3, "type": "VEC3"}),
    );
    set(&mut d, "/meshes/0/primitives/0/attributes/NORMAL", json!(1));
    let (scene, _) = load(&d, &bin).unwrap();
    assert_eq!(
        scene.meshes.positions,
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    );
    assert_eq!(scene.meshes.normals, [[0.0, 0.0, 1.0]; 3]);
    for stride in [0, 4, 11] {
        set(&mut d, "/bufferViews/0/byteStride", json!(stride));
        assert!(refused(&d, &bin).contains("byteStride"), "{stride}");
    }
}

fn sparse(bin: &[u8], base: bool) -> Value {
    let mut d = document(bin);
    let mut accessor = json!({"componentType": 5126, "count": 5, "type": "VEC3", "sparse": {
        "count": 2,
        "indices": {"bufferView": 0, "byteOffset": 60, "componentType": 5121},
        "values": {"bufferView": 0, "byteOffset": 12},
    }});
    if base {
        accessor["bufferView"] = json!(0);
    }
    set(&mut d, "/accessors/0", accessor);
    set(&mut d, "/meshes/0/primitives/0/mode", json!(5));
    d
}

#[test]
fn sparse_over_data_and_over_zeros() {
    let bin = [points(), vec![1, 4]].concat();
    let (scene, _) = load(&sparse(&bin, false), &bin).unwrap();
    let z = [0.0; 3];
    assert_eq!(
        scene.meshes.positions,
        [z, [1.0, 0.0, 0.0], z, z, [0.0, 1.0, 0.0]]
    );
    let (scene, _) = load(&sparse(&bin, true), &bin).unwrap();
    assert_eq!(
        scene.meshes.positions[3..],
        [[1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]
    );
    for (rows, says) in [
        ([4, 1], "increase"),
        ([1, 1], "increase"),
        ([1, 5], "element 5"),
    ] {
        let bin = [points(), rows.to_vec()].concat();
        assert!(refused(&sparse(&bin, true), &bin).contains(says));
    }
    for (what, value) in [
        ("/count", json!(6)),
        ("/count", json!(0)),
        ("/count", json!(u64::MAX)),
        ("/indices/byteOffset", json!(u64::MAX)),
        ("/values/byteOffset", json!(60)),
        ("/indices/componentType", json!(5126)),
        ("/values/bufferView", json!(1)),
    ] {
        let mut d = sparse(&bin, true);
        set(&mut d, &format!("/accessors/0/sparse{what}"), value);
        assert!(refused(&d, &bin).contains("sparse"), "{what}");
    }
}

#[test]
fn huge_numbers_are_refused_without_memory() {
    let bin = points();
    for (pointer, value, says) in [
        (
            "/accessors/0/count",
            json!(1_000_000_000),
            "size of the file",
        ),
        ("/accessors/0/count", json!(u64::MAX), "size of the file"),
        ("/accessors/0/count", json!(6), "do not fit"),
        ("/accessors/0/count", json!(0), "at least 1"),
        ("/accessors/0/byteOffset", json!(u64::MAX), "do not fit"),
        ("/accessors/0/byteOffset", json!(1), "do not fit"),
        ("/accessors/0/bufferView", json!(7), "bufferView 7"),
        ("/accessors/0/componentType", json!(5125), "component type"),
        ("/accessors/0/componentType", json!(1), "component type"),
        ("/accessors/0/type", json!("VEC2"), "VEC3"),
        ("/bufferViews/0/byteLength", json!(u64::MAX), "spans"),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), "spans"),
        ("/bufferViews/0/byteOffset", json!(1), "spans"),
        ("/bufferViews/0/buffer", json!(1), "buffer 1"),
        ("/buffers/0/byteLength", json!(u64::MAX), "byteLength"),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            json!(9),
            "accessor 9",
        ),
        ("/meshes/0/primitives/0/material", json!(0), "material 0"),
        ("/nodes/0/mesh", json!(3), "mesh 3"),
        ("/nodes/0/camera", json!(3), "camera 3"),
    ] {
        let mut d = document(&bin);
        set(&mut d, pointer, value);
        let message = refused(&d, &bin);
        assert!(message.contains(says), "{pointer}: {message}");
    }
    // All zeros, no bytes: only the count is there.
    let mut d = document(&bin);
    set(
        &mut d,
        "/accessors/0",
        json!({"componentType": 5126, "count": 1_000_000_000, "type": "VEC3"}),
    );
    assert!(refused(&d, &bin).contains("size of the file"));
    // Shared by many meshes.
    let mut d = document(&bin);
    set(
        &mut d,
        "/accessors/0",
        json!({"componentType": 5126, "count": 1_000_000, "type": "VEC3"}),
    );
    let meshes: Vec<Value> = (0..100).map(|_| d["meshes"][0].clone()).collect();
    set(&mut d, "/meshes", json!(meshes));
    set(
        &mut d,
        "/nodes",
        (0..100).map(|i| json!({"mesh": i})).collect(),
    );
    set(&mut d, "/scenes/0/nodes", (0..100).collect());
    assert!(refused(&d, &bin).contains("size of the file"));
}

#[test]
fn positions_must_be_finite() {
    for wrong in [f32::NAN, f32::INFINITY] {
        let mut bin = points();
        bin[16..20].copy_from_slice(&wrong.to_le_bytes());
        assert!(refused(&document(&bin), &bin).contains("vertex 1 is not finite"));
    }
}

#[test]
fn quantized_positions_need_the_extension() {
    let bin = [0_i8, 0, 0, 127, 0, 0, -128, 127, 0].map(|b| b as u8);
    let mut d = document(&bin);
    set(
        &mut d,
        "/accessors/0",
        json!({"bufferView": 0, "componentType": 5120, "normalized": true, "count": 3, "type": "VEC3"}),
    );
    assert!(refused(&d, &bin).contains("KHR_mesh_quantization"));
    set(
        &mut d,
        "/extensionsRequired",
        json!(["KHR_mesh_quantization"]),
    );
    let positions = load(&d, &bin).unwrap().0.meshes.positions.clone();
    assert_eq!(
        positions,
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 1.0, 0.0]]
    );
    set(
        &mut d,
        "/extensionsRequired",
        json!(["KHR_draco_mesh_compression"]),
    );
    assert!(refused(&d, &bin).contains("'KHR_draco_mesh_compression' is not supported"));
}

#[test]
fn parts_share_vertices_and_keep_file_order() {
    let bin = points();
    let mut d = document(&bin);
    set(&mut d, "/materials", json!([{"name": "a"}, {"name": "b"}]));
    let primitive = |mode: u32, material: Value| {
        let mut p = json!({"attributes": {"POSITION": 0}, "mode": mode});
        if !material.is_null() {
            p["material"] = material;
        }
        p
    };
    set(
        &mut d,
        "/meshes/0/primitives",
        json!([
            primitive(4, Value::Null),
            primitive(5, json!(1)),
            primitive(1, json!(0)),
            primitive(6, json!(0)),
        ]),
    );
    let (scene, warning) = load(&d, &bin).unwrap();
    assert_eq!(scene.meshes.positions.len(), 5);
    assert_eq!(scene.meshes.triangles.len(), 7);
    let parts: Vec<_> = scene
        .meshes
        .parts
        .iter()
        .map(|(i, m)| (*i, m.unwrap().0))
        .collect();
    assert_eq!(parts, [(1, 1), (4, 0)]);
    assert!(warning.unwrap().contains("1 × line primitive"));
}

fn world(scene: &Scene) -> Vec<Affine> {
    let all = Appearances::of(scene).unwrap();
    all.rows.iter().map(|r| r.world_from_object).collect()
}

#[test]
fn matrix_and_trs_agree_and_are_f64() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    // A quarter turn about z, not normalised; then moved by a number f32 lacks.
    let trs = json!({"mesh": 0, "translation": [0.1, 1e9, 3.0], "rotation": [0.0, 0.0, 2.0 * half, 2.0 * half], "scale": [2.0, 3.0, 4.0]});
    let matrix = json!({"mesh": 0, "matrix": [0.0, 2.0, 0.0, 0.0, -3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.1, 1e9, 3.0, 1.0]});
    let placed = [trs, matrix.clone()].map(|node| {
        let mut d = document(&points());
        set(&mut d, "/nodes/0", node);
        world(&load(&d, &points()).unwrap().0)[0]
    });
    for (a, b) in placed[0]
        .linear
        .iter()
        .flatten()
        .zip(placed[1].linear.iter().flatten())
    {
        assert!((a - b).abs() < 1e-15, "{placed:?}");
    }
    assert_eq!(placed[0].translation, [0.1, 1e9, 3.0]);
    assert_eq!(placed[1].translation, [0.1, 1e9, 3.0]);
    let mut d = document(&points());
    set(&mut d, "/nodes/0", matrix);
    set(&mut d, "/nodes/0/matrix/3", json!(0.5));
    assert!(refused(&d, &points()).contains("not affine"));
    set(
        &mut d,
        "/nodes/0",
        json!({"mesh": 0, "rotation": [0, 0, 0, 0]}),
    );
    assert!(refused(&d, &points()).contains("rotation"));
}

#[test]
fn hierarchy_shares_its_mesh_and_leaves_empty_nodes_out() {
    let mut d = document(&points());
    set(
        &mut d,
        "/nodes",
        json!([
            {"name": "top", "children": [1, 2, 3, 4], "translation": [1, 0, 0]},
            {"mesh": 0, "translation": [0, 1, 0]},
            {"mesh": 0, "children": [5]},
            {"name": "empty", "scale": [0, 1, 1]},
            {"mesh": 0, "scale": [0, 0, 0]},
            {"mesh": 0, "translation": [0, 0, 1]},
        ]),
    );
    let (scene, warning) = load(&d, &points()).unwrap();
    assert_eq!((scene.shapes.len(), scene.nodes.len()), (1, 2));
    let at: Vec<_> = world(&scene).iter().map(|m| m.translation).collect();
    assert_eq!(at, [[1.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0]]);
    assert_eq!(scene.instance_names.get(0), Some("top"));
    assert!(warning.unwrap().contains("1 × node scaled to nothing"));
}

#[test]
fn a_deep_chain_and_graphs_that_are_no_forest() {
    let mut d = document(&points());
    let deep = 100_000;
    let chain = (0..deep).map(|i| {
        if i + 1 < deep {
            json!({"children": [i + 1]})
        } else {
            json!({"mesh": 0})
        }
    });
    set(&mut d, "/nodes", chain.collect());
    assert_eq!(world(&load(&d, &points()).unwrap().0).len(), 1);
    for (nodes, says) in [
        (json!([{"children": [0]}]), "own descendant"),
        (
            json!([{}, {"children": [2]}, {"children": [1]}]),
            "own descendant",
        ),
        (
            json!([{"children": [2]}, {"children": [2]}, {}]),
            "one parent",
        ),
        (json!([{"children": [1, 1]}, {}]), "one parent"),
        (json!([{"children": [9]}]), "child node 9"),
    ] {
        set(&mut d, "/nodes", nodes);
        assert!(refused(&d, &points()).contains(says), "{says}");
    }
    set(&mut d, "/nodes", json!([{"children": [1]}, {"mesh": 0}]));
    for (roots, says) in [
        (json!([1]), "not a root"),
        (json!([0, 0]), "twice"),
        (json!([4]), "node 4"),
    ] {
        set(&mut d, "/scenes/0/nodes", roots);
        assert!(refused(&d, &points()).contains(says), "{says}");
    }
}

#[test]
fn without_scenes_every_root_is_shown() {
    let mut d = document(&points());
    d.as_object_mut().unwrap().remove("scenes");
    d.as_object_mut().unwrap().remove("scene");
    set(
        &mut d,
        "/nodes",
        json!([{"mesh": 0}, {"children": [2]}, {"mesh": 0}]),
    );
    assert_eq!(world(&load(&d, &points()).unwrap().0).len(), 2);
}

#[test]
fn cameras_and_lights_are_posed_by_their_nodes() {
    let mut d = document(&points());
    // A half turn about y, far away.
    set(
        &mut d,
        "/nodes",
        json!([
            {"mesh": 0, "children": [1, 2, 3, 4]},
            {"camera": 0, "name": "eye", "translation": [1e17, 2, 3], "rotation": [0, 1, 0, 0], "scale": [2, 2, 2]},
            {"camera": 1, "extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [0, 0, 5]},
            {"extensions": {"KHR_lights_punctual": {"light": 1}}, "rotation": [0, 1, 0, 0]},
            {"extensions": {"KHR_lights_punctual": {"light": 2}}},
        ]),
    );
    set(
        &mut d,
        "/cameras",
        json!([
            {"type": "perspective", "perspective": {"yfov": std::f64::consts::FRAC_PI_2, "znear": 0.1}},
            {"name": "flat", "type": "orthographic", "orthographic": {"xmag": 1, "ymag": 3, "znear": 0, "zfar": 9}},
        ]),
    );
    set(
        &mut d,
        "/extensions",
        json!({"KHR_lights_punctual": {"lights": [
            {"type": "point", "intensity": 4, "color": [1, 0.5, 0]},
            {"type": "directional", "intensity": 2},
            {"type": "spot", "spot": {}},
        ]}}),
    );
    let (scene, warning) = load(&d, &points()).unwrap();
    let [eye, flat] = &scene.cameras.rows[..] else {
        panic!()
    };
    assert_eq!(eye.eye.to_array(), [1e17, 2.0, 3.0]);
    assert!((eye.forward.z - 1.0).abs() < 1e-15 && (eye.right.x + 1.0).abs() < 1e-15);
    let Projection::Perspective { half_height } = eye.projection else {
        panic!()
    };
    assert!((half_height - 1.0).abs() < 1e-7);
    assert_eq!(
        flat.projection,
        Projection::Orthographic { half_height: 3.0 }
    );
    assert_eq!(scene.cameras.names.get(0), Some("eye"));
    assert_eq!(scene.cameras.names.get(1), Some("flat"));
    let Light::Point {
        position,
        intensity,
        ..
    } = scene.lights[0]
    else {
        panic!()
    };
    assert_eq!((position.z, intensity), (5.0, [4.0, 2.0, 0.0]));
    let Light::Directional {
        direction,
        irradiance,
    } = scene.lights[1]
    else {
        panic!()
    };
    assert!((direction.z - 1.0).abs() < 1e-15);
    assert_eq!(irradiance, [2.0; 3]);
    assert!(warning.unwrap().contains("1 × spot light cone"));
}

#[test]
fn baking_keeps_the_outside_outside() {
    let mut d = document(&points());
    set(&mut d, "/accessors/0/count", json!(3));
    set(
        &mut d,
        "/nodes",
        json!([{"mesh": 0, "scale": [-2, 1, 1]}, {"mesh": 0, "translation": [0, 0, 7]}]),
    );
    set(&mut d, "/scenes/0/nodes", json!([0, 1]));
    let mesh = bake(&d, &points());
    assert_eq!(mesh.triangles, [[0, 2, 1], [3, 4, 5]]);
    assert_eq!(mesh.positions[1], [-2.0, 0.0, 0.0]);
    assert_eq!(mesh.positions[4], [1.0, 0.0, 7.0]);
    assert!(mesh.parts.is_empty() && mesh.normals.is_empty());
}

#[test]
fn files_are_read_from_the_folder_only() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("in");
    std::fs::create_dir(&inner).unwrap();
    std::fs::write(inner.join("a b.bin"), points()).unwrap();
    std::fs::write(folder.path().join("out.bin"), points()).unwrap();
    let path = inner.join("a.gltf");
    let try_uri = |uri: &str, allow_outside: bool| {
        let mut d = document(&points());
        set(&mut d, "/buffers/0/uri", json!(uri));
        std::fs::write(&path, d.to_string()).unwrap();
        super::super::load(&path, &LoadOptions { allow_outside })
    };
    assert!(try_uri("a%20b.bin", false).is_ok());
    assert!(matches!(
        try_uri("../out.bin", false),
        Err(LoadError::Outside { .. })
    ));
    assert!(matches!(
        try_uri("%2e%2e/out.bin", false),
        Err(LoadError::Outside { .. })
    ));
    assert!(try_uri("../out.bin", true).is_ok());
    assert!(matches!(
        try_uri("none.bin", false),
        Err(LoadError::Read { .. })
    ));
}

#[test]
fn every_truncation_of_a_glb_is_an_error() {
    let whole = glb(&document(&points()), &points());
    for end in 0..whole.len() {
        on_disk(&whole[..end], |path| {
            assert!(
                super::super::load(path, &LoadOptions::default()).is_err(),
                "{end}"
            );
        });
    }
}
