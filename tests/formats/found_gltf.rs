//! glTF as people have it: what public reports say that other programs misread, from the
//! folder `found/` of the test assets, and made files of the same kinds.

use crate::found_meshes::{assert_spans, assert_warns, found, loaded, made, materials, triangles};
use lanecast::internals::io::{LoadOptions, Loaded, load};
use serde_json::{Value, json};

/// A cube from -½ to ½ as a document, with a node that shows it.
fn cube() -> Value {
    let positions: Vec<u8> = (0..8)
        .flat_map(|i| [(i >> 2) & 1, (i >> 1) & 1, i & 1])
        .flat_map(|bit| (bit as f32 - 0.5).to_le_bytes())
        .collect();
    let corners: [u8; 36] = [
        0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4,
        1, 5, 7, 1, 7, 3,
    ];
    // Three translations, for instances.
    let places = [0.0_f32, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 5.0, 0.0];
    let places = places.iter().flat_map(|x| x.to_le_bytes());
    let bytes: Vec<u8> = positions.into_iter().chain(corners).chain(places).collect();
    let uri: String = bytes.iter().map(|b| format!("%{b:02x}")).collect();
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5121, "count": 36, "type": "SCALAR" },
            { "bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC3" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 96 },
            { "buffer": 0, "byteOffset": 96, "byteLength": 36 },
            { "buffer": 0, "byteOffset": 132, "byteLength": 36 },
        ],
        "buffers": [{ "byteLength": 168, "uri": format!("data:,{uri}") }],
    })
}

/// The document's buffer in base64, with a text before each character by its index.
fn based(document: &Value, before: impl Fn(usize) -> &'static str) -> String {
    let uri = document["buffers"][0]["uri"].as_str().unwrap();
    let hex = uri.strip_prefix("data:,").unwrap().split('%').skip(1);
    let mut bytes = hex.map(|pair| u32::from_str_radix(pair, 16).unwrap());
    let digits = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::from("data:application/octet-stream;base64,");
    let mut at = 0;
    // The length is a multiple of three, so that nothing pads.
    while let (Some(a), Some(b), Some(c)) = (bytes.next(), bytes.next(), bytes.next()) {
        let group = a << 16 | b << 8 | c;
        for shift in [18, 12, 6, 0] {
            text += before(at);
            text.push(char::from(digits[(group >> shift) as usize & 63]));
            at += 1;
        }
    }
    text
}

fn of(document: &Value) -> Loaded {
    made(&[("a.gltf", document.to_string().as_bytes())])
}

fn error(document: &Value) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    load(&path, &LoadOptions::default())
        .unwrap_err()
        .to_string()
}

/// Asserts that there are twelve triangles, of a cube of side 1 about a place.
fn assert_cube(loaded: &Loaded, at: [f64; 3]) {
    assert_eq!(triangles(&loaded.scene).len(), 12);
    assert_spans(&loaded.scene, at.map(|x| x - 0.5), at.map(|x| x + 0.5));
}

#[test]
fn containers_are_padded_marked_and_broken_into_lines() {
    for name in ["nulpad.glb", "bom.gltf", "uri_newlines.gltf"] {
        if let Some(path) = found(&format!("10-gltf-container/{name}")) {
            assert_cube(&loaded(&path), [0.0; 3]);
        }
    }
    let text = cube().to_string();
    assert_cube(
        &made(&[("a.gltf", format!("\u{feff}{text}").as_bytes())]),
        [0.0; 3],
    );
    // Line ends and blanks in the base64 of a buffer.
    let mut document = cube();
    document["buffers"][0]["uri"] = json!(based(&document, |at| match at % 7 {
        0 => "\n",
        3 => " \r\n\t",
        _ => "",
    }));
    assert_cube(&of(&document), [0.0; 3]);
    // GLB with a mark, and padding that is no blank.
    for pad in [b' ', 0] {
        let mut json = format!("\u{feff}{text}").into_bytes();
        json.resize(json.len() + 8 - json.len() % 4, pad);
        let mut glb = b"glTF\x02\0\0\0".to_vec();
        glb.extend((20 + json.len() as u32).to_le_bytes());
        glb.extend((json.len() as u32).to_le_bytes());
        glb.extend(b"JSON");
        glb.extend(json);
        assert_cube(&made(&[("a.glb", &glb)]), [0.0; 3]);
    }
}

#[test]
fn numbers_that_are_nearly_right_are_read() {
    if let Some(path) = found("11-gltf-numbers/m44.gltf") {
        let loaded = loaded(&path);
        assert_cube(&loaded, [2.0, 0.0, 0.0]);
        assert_warns(
            &loaded,
            "repaired: 1 × matrix whose last row is not 0 0 0 1",
        );
    }
    let mut document = cube();
    let matrix = |last: [f64; 4]| {
        let [a, b, c, w] = last;
        json!([2, 0, 0, a, 0, 2, 0, b, 0, 0, 2, c, 2, 4, 6, w])
    };
    // Homogeneous coordinates; and what rounding leaves of zeros.
    document["nodes"][0]["matrix"] = matrix([1e-9, 0.0, 0.0, 2.0]);
    assert_cube(&of(&document), [1.0, 2.0, 3.0]);
    for last in [[0.5, 0.0, 0.0, 1.0], [0.0; 4], [0.0, 0.0, 0.0, -1.0]] {
        document["nodes"][0]["matrix"] = matrix(last);
        assert!(error(&document).contains("its matrix is not affine"));
    }
    if let Some(path) = found("11-gltf-numbers/stride0.gltf") {
        let loaded = loaded(&path);
        assert_cube(&loaded, [0.0; 3]);
        assert_warns(&loaded, "repaired: 1 × byteStride of 0");
    }
    let mut document = cube();
    document["bufferViews"][0]["byteStride"] = json!(0);
    let loaded = of(&document);
    assert_cube(&loaded, [0.0; 3]);
    assert_eq!(
        loaded.warning.as_deref(),
        Some("repaired: 1 × byteStride of 0")
    );
}

#[test]
fn a_direction_scaled_to_0_leaves_a_plane_figure() {
    if let Some(path) = found("11-gltf-numbers/scale0.gltf") {
        let scene = loaded(&path).scene;
        assert_eq!(triangles(&scene).len(), 12);
        assert_spans(&scene, [-0.5, 0.0, -0.5], [0.5, 0.0, 0.5]);
    }
    // Flat below a node that turns, with a child below, which moves along the flat.
    let mut document = cube();
    document["nodes"] = json!([
        { "translation": [0, 0, 7], "children": [1] },
        { "mesh": 0, "scale": [0, 1, 1], "children": [2] },
        { "mesh": 0, "translation": [9, 4, 0] },
    ]);
    let scene = of(&document).scene;
    assert_eq!(triangles(&scene).len(), 24);
    assert_spans(&scene, [0.0, -0.5, 6.5], [0.0, 4.5, 7.5]);
    // A line shows nothing.
    document["nodes"][0]["mesh"] = json!(0);
    document["nodes"][1]["scale"] = json!([0, 1, 0]);
    let loaded = of(&document);
    assert_cube(&loaded, [0.0, 0.0, 7.0]);
    assert_warns(&loaded, "not imported: 1 × node scaled to nothing");
}

#[test]
fn two_parents_are_refused_by_name() {
    if let Some(path) = found("11-gltf-numbers/two_parents.gltf") {
        let error = load(&path, &LoadOptions::default())
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("node 3: is a child of node 1 and of node 2"),
            "{error}"
        );
    }
    let mut document = cube();
    document["nodes"] = json!([
        { "name": "left", "children": [2] },
        { "name": "right", "children": [2] },
        { "name": "wheel", "mesh": 0 },
    ]);
    let says = "node 2 'wheel': is a child of node 0 'left' and of node 1 'right'";
    assert!(error(&document).contains(says), "{}", error(&document));
}

#[test]
fn required_extensions_beside_geometry_are_warnings() {
    for (name, is_imported) in [
        ("EXT_structural_metadata", false),
        ("KHR_materials_anisotropy", true),
    ] {
        if let Some(path) = found(&format!("12-gltf-ext/req_{name}.gltf")) {
            let loaded = loaded(&path);
            assert_cube(&loaded, [0.0; 3]);
            if is_imported {
                assert_eq!(loaded.warning, None);
            } else {
                assert_warns(&loaded, &format!("not imported: 1 × extension {name}"));
            }
        }
    }
    let mut document = cube();
    for (name, is_read) in [
        ("KHR_materials_unheard_of", true),
        ("KHR_xmp_json_ld", true),
        ("MSFT_texture_dds", true),
        ("CESIUM_RTC", false),
        ("VENDOR_unheard_of", false),
    ] {
        document["extensionsUsed"] = json!([name]);
        document["extensionsRequired"] = json!([name]);
        if is_read {
            assert_warns(&of(&document), name);
        } else {
            let says = format!("the required extension '{name}' is not supported");
            assert!(error(&document).contains(&says), "{}", error(&document));
        }
    }
}

#[test]
fn instances_on_the_gpu_are_instances() {
    if let Some(path) = found("12-gltf-ext/gpu_instancing.gltf") {
        let loaded = loaded(&path);
        assert_eq!(triangles(&loaded.scene).len(), 5 * 12);
        assert_spans(&loaded.scene, [-0.5; 3], [8.5, 0.5, 0.5]);
        assert_eq!((loaded.scene.meshes.len(), loaded.warning), (1, None));
    }
    // Below a transform, with a child of the node, which is not repeated, and flat.
    let mut document = cube();
    let instances = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 2 } } });
    document["nodes"] = json!([
        { "mesh": 0, "translation": [0, 0, 1], "scale": [2, 2, 2], "children": [1],
          "extensions": instances },
        { "mesh": 0, "translation": [0, 0, -9] },
    ]);
    let scene = of(&document).scene;
    assert_eq!(triangles(&scene).len(), 4 * 12);
    assert_spans(&scene, [-1.0, -1.0, -18.0], [7.0, 11.0, 2.0]);
    document["nodes"][0]["scale"] = json!([2, 2, 0]);
    assert_spans(&of(&document).scene, [-1.0, -1.0, 1.0], [7.0, 11.0, 1.0]);
    document["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] = json!(0);
    let says = "node 0, instances' attributes: must have as many rows each";
    assert!(error(&document).contains(says), "{}", error(&document));
}

#[test]
fn hidden_nodes_and_invisible_materials_show_nothing() {
    if let Some(path) = found("12-gltf-ext/hidden.gltf") {
        let loaded = loaded(&path);
        assert_cube(&loaded, [2.0, 0.0, 0.0]);
        assert_warns(&loaded, "not imported: 1 × hidden node");
    }
    let mut document = cube();
    let hidden = json!({ "KHR_node_visibility": { "visible": false } });
    document["scenes"] = json!([{ "nodes": [0, 2] }]);
    document["nodes"] = json!([
        { "children": [1], "extensions": hidden },
        { "mesh": 0, "translation": [9, 0, 0] },
        { "mesh": 0, "extensions": { "KHR_node_visibility": { "visible": true } } },
    ]);
    assert_cube(&of(&document), [0.0; 3]);
    if let Some(path) = found("12-gltf-ext/alpha0.gltf") {
        let error = load(&path, &LoadOptions::default())
            .unwrap_err()
            .to_string();
        assert!(error.contains("the scene is empty"), "{error}");
        assert!(
            error.contains("1 × primitive of an invisible material"),
            "{error}"
        );
    }
    let mut document = cube();
    let primitives = &mut document["meshes"][0]["primitives"];
    let mut second = primitives[0].clone();
    second["material"] = json!(0);
    primitives.as_array_mut().unwrap().push(second);
    for (mode, alpha, cutoff, shown) in [
        ("BLEND", 0.0, None, 12),
        ("BLEND", 0.5, None, 24),
        ("OPAQUE", 0.0, None, 24),
        ("MASK", 0.4, None, 12),
        ("MASK", 0.5, None, 24),
        ("MASK", 0.5, Some(0.6), 12),
    ] {
        document["materials"] = json!([{
            "alphaMode": mode,
            "pbrMetallicRoughness": { "baseColorFactor": [1, 0, 0, alpha] },
        }]);
        if let Some(cutoff) = cutoff {
            document["materials"][0]["alphaCutoff"] = json!(cutoff);
        }
        assert_eq!(
            triangles(&of(&document).scene).len(),
            shown,
            "{mode} {alpha}"
        );
    }
}

#[test]
fn positions_that_are_not_finite_count_where_they_are_used() {
    let mut document = cube();
    // The second view's bytes as positions: the first triangle of the cube, and NaN after it.
    let mut bytes: Vec<u8> = [
        [0.0_f32, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [f32::NAN; 3],
    ]
    .iter()
    .flatten()
    .flat_map(|x| x.to_le_bytes())
    .collect();
    bytes.extend([0, 1, 2]);
    let uri: String = bytes.iter().map(|b| format!("%{b:02x}")).collect();
    document["buffers"] = json!([{ "byteLength": 51, "uri": format!("data:,{uri}") }]);
    document["bufferViews"] = json!([
        { "buffer": 0, "byteLength": 48 },
        { "buffer": 0, "byteOffset": 48, "byteLength": 3 },
    ]);
    document["accessors"][0]["count"] = json!(4);
    document["accessors"][1]["count"] = json!(3);
    let loaded = of(&document);
    assert_spans(&loaded.scene, [0.0; 3], [1.0, 1.0, 0.0]);
    assert_warns(&loaded, "repaired: 1 × unused vertex that is not finite");
    document["meshes"][0]["primitives"][0]["mode"] = json!(5);
    document["meshes"][0]["primitives"][0]
        .as_object_mut()
        .unwrap()
        .remove("indices");
    let says = "mesh 0, primitive 0, POSITION: vertex 3 is not finite";
    assert!(error(&document).contains(says), "{}", error(&document));
}

#[test]
fn a_skin_places_its_mesh_and_the_node_does_not() {
    let Some(path) = found("13-gltf-skin/skin_node.gltf") else {
        return;
    };
    let skinned = loaded(&path);
    assert_cube(&skinned, [0.0, 2.0, 0.0]);
    assert_eq!(skinned.warning, None);
    // The node's parents do not count either, nor a scale of 0; joints' parents do.
    let text = std::fs::read_to_string(&path).unwrap();
    let mut document: Value = serde_json::from_str(&text).unwrap();
    document["scenes"][0]["nodes"] = json!([3, 4, 2]);
    document["nodes"][0]["scale"] = json!([0, 0, 0]);
    let nodes = document["nodes"].as_array_mut().unwrap();
    nodes.push(json!({ "translation": [7, 7, 7], "children": [0] }));
    nodes.push(json!({ "scale": [3, 3, 3], "children": [1] }));
    assert_spans(&of(&document).scene, [-1.5, 4.5, -1.5], [1.5, 7.5, 1.5]);
    // A joint that the skin does not have.
    document["skins"][0]["joints"] = json!([]);
    let said = error(&document);
    assert!(
        said.contains("vertex 0 has joint 0, but the skin has 0"),
        "{said}"
    );
}

#[test]
fn a_mesh_file_keeps_its_materials_in_a_native_scene() {
    if let Some(path) = found("14-native-mesh-material/s.toml") {
        let scene = loaded(&path).scene;
        let all = materials(&scene);
        assert!(
            all.iter().all(|m| m.unwrap().base_color == [0.8, 0.0, 0.0]),
            "{all:?}"
        );
    }
    let toml = "format = 1\n[material.blue]\nbase_color = [0.0, 0.0, 1.0]\n\
                [shape.m]\nmesh = \"m.obj\"\n[[instance]]\nshape = \"m\"\n";
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nusemtl red\nf 1 2 3\n\
               usemtl green\nf 1 2 3\n";
    let mtl = "newmtl red\nKd 1 0 0\nnewmtl green\nKd 0 1 0\n";
    let colors = |toml: &str| -> Vec<_> {
        let files = [
            ("s.toml", toml.as_bytes()),
            ("m.obj", obj.as_bytes()),
            ("m.mtl", mtl.as_bytes()),
        ];
        let all = materials(&made(&files).scene).into_iter();
        all.map(|m| m.map(|m| m.base_color)).collect()
    };
    assert_eq!(
        colors(toml),
        [None, Some([1.0, 0.0, 0.0]), Some([0.0, 1.0, 0.0])]
    );
    // The scene's own material comes first.
    let given = format!("{toml}material = \"blue\"\n");
    assert_eq!(colors(&given), [Some([0.0, 0.0, 1.0]); 3]);
}
