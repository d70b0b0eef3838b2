//! Maps of coats, tangents of stretched highlights, and environment lights.

use super::*;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use lanecast::internals::scene::{Environment, Slot};

/// A triangle with texture coordinates, which go along x and down, of one material.
fn textured(turned: bool, material: Value) -> (Value, Vec<u8>) {
    let mut bin = points();
    let uvs = bin.len();
    let corners: [[f32; 2]; 3] = match turned {
        false => [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]],
        // A quarter turn: u goes along y.
        true => [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]],
    };
    for x in corners.iter().flatten() {
        bin.extend(x.to_le_bytes());
    }
    let mut d = document(&bin);
    set(&mut d, "/accessors/0/count", json!(3));
    let view = json!({"buffer": 0, "byteOffset": uvs, "byteLength": 24});
    set(&mut d, "/bufferViews/9", view);
    let view = d["bufferViews"].as_array().unwrap().len() - 1;
    let accessor = json!({"bufferView": view, "componentType": 5126, "count": 3, "type": "VEC2"});
    set(&mut d, "/accessors/9", accessor);
    let accessor = d["accessors"].as_array().unwrap().len() - 1;
    let place = "/meshes/0/primitives/0/attributes/TEXCOORD_0";
    set(&mut d, place, json!(accessor));
    set(&mut d, "/meshes/0/primitives/0/material", json!(0));
    set(&mut d, "/materials", json!([material]));
    (d, bin)
}

/// Encodes a PNG of one colour as bytes.
fn png(color: [u8; 4]) -> Vec<u8> {
    let texels: Vec<u8> = std::iter::repeat_n(color, 16).flatten().collect();
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new(&mut bytes);
    encoder
        .write_image(&texels, 4, 4, ExtendedColorType::Rgba8)
        .unwrap();
    bytes
}

/// Appends images to a document, as views of its buffer.
fn add_images(d: &mut Value, bin: &mut Vec<u8>, files: &[Vec<u8>]) {
    let mut images = Vec::new();
    for file in files {
        bin.resize(bin.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": file.len()});
        bin.extend(file);
        let views = d["bufferViews"].as_array_mut().unwrap();
        images.push(json!({"bufferView": views.len(), "mimeType": "image/png"}));
        views.push(view);
    }
    d["images"] = json!(images);
    d["buffers"][0]["byteLength"] = json!(bin.len());
}

#[test]
fn a_coat_has_a_normal_map_of_its_own() {
    let coat = json!({
        "clearcoatFactor": 1,
        "clearcoatNormalTexture": {"index": 0, "scale": 0.5},
    });
    let (mut d, mut bin) = textured(
        false,
        json!({"extensions": {"KHR_materials_clearcoat": coat}}),
    );
    add_images(&mut d, &mut bin, &[png([128, 128, 255, 255])]);
    d["textures"] = json!([{"source": 0}]);
    let (scene, warning) = load(&d, &bin).unwrap();
    assert_eq!(warning, None);
    let row = scene.textures.iter().next().unwrap();
    assert!(row.has(Slot::ClearcoatNormal) && !row.has(Slot::Normal));
    assert_eq!(row.texturing.coat_normal_scale, 0.5);
    assert_eq!(scene.meshes.attributes.tangents.len(), 3);
}

#[test]
fn a_stretch_follows_the_frame_of_texture_coordinates() {
    let tangents = |turned: bool| {
        let stretch = json!({"anisotropyStrength": 0.5, "anisotropyRotation": 0.25});
        let material = json!({"extensions": {"KHR_materials_anisotropy": stretch}});
        let (d, bin) = textured(turned, material);
        let (scene, warning) = load(&d, &bin).unwrap();
        assert_eq!(warning, None);
        let row = scene.textures.iter().next().unwrap();
        assert!(row.texturing.follows_tangents && row.refs.is_empty());
        scene.meshes.attributes.tangents[0].map(|x| f32::from(x) / 32_767.0)
    };
    let (plain, turned) = (tangents(false), tangents(true));
    let [a, b] = [plain, turned].map(|[x, y, z, _]| glam::Vec3::new(x, y, z));
    assert!((a.length() - 1.0).abs() < 1e-3 && a.dot(b).abs() < 1e-3);
}

/// A file with an environment light of six colours: 2 of red ahead along +x, and so on.
fn lit(rotation: [f64; 4], faces: &[[u8; 4]]) -> (Value, Vec<u8>) {
    let (mut d, mut bin) = textured(false, json!({}));
    let files: Vec<_> = faces.iter().map(|color| png(*color)).collect();
    add_images(&mut d, &mut bin, &files);
    let all: Vec<_> = (0..faces.len()).collect();
    d["extensions"] = json!({"EXT_lights_image_based": {"lights": [{
        "intensity": 2.0,
        "rotation": rotation,
        "irradianceCoefficients": [[0.0, 0.0, 0.0]],
        "specularImageSize": 4,
        "specularImages": [all],
    }]}});
    d["extensionsUsed"] = json!(["EXT_lights_image_based"]);
    d["scenes"][0]["extensions"] = json!({"EXT_lights_image_based": {"light": 0}});
    (d, bin)
}

const FACES: [[u8; 4]; 6] = [
    [255, 0, 0, 255],
    [0, 255, 0, 255],
    [0, 0, 255, 255],
    [255, 255, 0, 255],
    [255, 0, 255, 255],
    // RGBD: white over one half.
    [255, 255, 255, 128],
];

/// Returns the radiance of a map in a direction, of its nearest pixel.
fn radiance(map: &Environment, [x, y, z]: [f64; 3]) -> [f32; 3] {
    use std::f64::consts::{PI, TAU};
    let column = (0.5 + libm::atan2(x, -z) / TAU) * f64::from(map.width);
    let row = libm::acos(y) / PI * f64::from(map.height);
    let [column, row] =
        [(column, map.width), (row, map.height)].map(|(at, count)| (at as u32).min(count - 1));
    let pixel = map.pixels[(row * map.width + column) as usize];
    std::array::from_fn(|k| pixel[k] * map.scale[k])
}

#[test]
fn the_faces_of_an_environment_light_are_where_the_axes_point() {
    let (d, bin) = lit([0.0, 0.0, 0.0, 1.0], &FACES);
    let (scene, warning) = load(&d, &bin).unwrap();
    assert_eq!(warning, None);
    let map = scene.environment.as_ref().unwrap();
    assert_eq!([map.width, map.height], [16, 8]);
    let axes = [
        ([1.0, 0.0, 0.0], [2.0, 0.0, 0.0]),
        ([-1.0, 0.0, 0.0], [0.0, 2.0, 0.0]),
        ([0.0, 1.0, 0.0], [0.0, 0.0, 2.0]),
        ([0.0, -1.0, 0.0], [2.0, 2.0, 0.0]),
        ([0.0, 0.0, 1.0], [2.0, 0.0, 2.0]),
        ([0.0, 0.0, -1.0], [2.0 * 255.0 / 128.0; 3]),
    ];
    for (towards, expected) in axes {
        let found = radiance(map, towards);
        let near = found
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(near, "{towards:?}: {found:?}");
    }
    // A quarter turn about y brings what was along z to x.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let (d, bin) = lit([0.0, half, 0.0, half], &FACES);
    let (scene, _) = load(&d, &bin).unwrap();
    let found = radiance(scene.environment.as_ref().unwrap(), [1.0, 0.0, 0.0]);
    assert_eq!(found, [2.0, 0.0, 2.0]);
}

#[test]
fn an_environment_light_that_is_malformed_is_left_out_with_a_reason() {
    let (good, bin) = lit([0.0, 0.0, 0.0, 1.0], &FACES);
    let light = "/extensions/EXT_lights_image_based/lights/0";
    for (place, value, says) in [
        ("rotation", json!([0, 0, 0, 0]), "a rotation that is none"),
        ("intensity", json!(-1), "an intensity of -1"),
        ("specularImages", json!([]), "no images"),
        ("specularImages", json!([[0, 1, 2, 3, 4]]), "length"),
        ("specularImages", json!([[0, 1, 2, 3, 4, 9]]), "image 9"),
        ("specularImages", json!(7), "invalid type"),
    ] {
        let mut d = good.clone();
        set(&mut d, &format!("{light}/{place}"), value);
        let (scene, warning) = load(&d, &bin).unwrap();
        assert!(scene.environment.is_none());
        let warning = warning.unwrap_or_default();
        let told = warning.contains("1 × environment light (") && warning.contains(says);
        assert!(told, "{place}: {warning}");
    }
    let mut d = good.clone();
    d["scenes"][0]["extensions"] = json!({"EXT_lights_image_based": {"light": 3}});
    let warning = load(&d, &bin).unwrap().1.unwrap();
    assert!(warning.contains("light 3 of 1"), "{warning}");
}
