//! Tests of vertices and indices: modes, widths, strides, sparse and huge columns.

use super::*;

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
        let Err(LoadError::Empty { left_out, .. }) = nothing else {
            panic!("{nothing:?}");
        };
        assert!(left_out.contains(" primitive"), "{left_out}");
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
        // Vertex 0 is unused and therefore removed.
        assert_eq!(load(&d, &bin).unwrap().0.meshes.triangles, [[2, 0, 1]]);
        set(&mut d, "/accessors/1/count", json!(4));
        assert!(refused(&d, &bin).contains("do not fit"));
        set(&mut d, "/accessors/1/componentType", json!(5122));
        assert!(refused(&d, &bin).contains("unsigned"));
        // A signed component type is refused before the range is read.
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
    for stride in [4, 11] {
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
    // The accessor is all zeros without bytes, so only its count limits it.
    let mut d = document(&bin);
    set(
        &mut d,
        "/accessors/0",
        json!({"componentType": 5126, "count": 1_000_000_000, "type": "VEC3"}),
    );
    assert!(refused(&d, &bin).contains("size of the file"));
    // Many meshes share one accessor.
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
        json!(["KHR_unheard_of_compression"]),
    );
    assert!(refused(&d, &bin).contains("'KHR_unheard_of_compression' is not supported"));
}
