//! glTF by tiny documents built in memory: their builders, whole meshes, and files.

mod accessors;
mod extensions;
mod materials;
mod nodes;
mod textures;

use lanecast::internals::io::{self, ImportReport, LoadError, LoadOptions};
use lanecast::internals::scene::{MeshData, Scene};
use serde_json::{Value, json};
use std::path::Path;

/// The buffer of a document: five points and four bytes of indices, to which tests append.
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

/// Makes a document with one mesh; view 0 is the whole buffer, accessor 0 the points.
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
        let loaded = io::load(path, &LoadOptions::default())?;
        Ok((loaded.scene, loaded.warning))
    })
}

fn bake(document: &Value, bin: &[u8]) -> MeshData {
    on_disk(&glb(document, bin), |path| {
        let mut report = ImportReport::default();
        io::import_mesh(path, &LoadOptions::default(), &mut report).unwrap()
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
        io::load(
            &path,
            &LoadOptions {
                allow_outside,
                ..Default::default()
            },
        )
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
            assert!(io::load(path, &LoadOptions::default()).is_err(), "{end}");
        });
    }
}
