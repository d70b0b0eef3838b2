//! Textures and colours of vertices: images, samplers, transforms, and what is left out.

use super::*;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use lanecast::internals::scene::{Alpha, Slot, Texels, Wrap};

/// Encodes a PNG file as a data URI.
fn png(texels: &[u8], size: [u32; 2], kind: ExtendedColorType) -> String {
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new(&mut bytes);
    encoder.write_image(texels, size[0], size[1], kind).unwrap();
    uri(&bytes)
}

/// Writes a file as a data URI.
fn uri(bytes: &[u8]) -> String {
    let digits = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::from("data:image/png;base64,");
    for three in bytes.chunks(3) {
        let word = three
            .iter()
            .fold(0_u32, |word, b| word << 8 | u32::from(*b));
        let word = word << (8 * (3 - three.len()));
        for k in 0..=three.len() {
            text.push(digits[(word >> (18 - 6 * k) & 63) as usize] as char);
        }
    }
    text
}

/// Two by two texels: black, red, green, and white that is half there.
const TEXELS: [u8; 16] = [
    0, 0, 0, 255, 255, 0, 0, 255, 0, 255, 0, 255, 255, 255, 255, 128,
];

/// A triangle with texture coordinates, of a material with a texture.
fn textured() -> (Value, Vec<u8>) {
    let mut bin = points();
    let uvs = bin.len();
    for x in [0.0_f32, 0.0, 1.0, 0.0, 0.0, 1.0] {
        bin.extend(x.to_le_bytes());
    }
    let mut d = document(&bin);
    set(&mut d, "/accessors/0/count", json!(3));
    set(
        &mut d,
        "/bufferViews/9",
        json!({"buffer": 0, "byteOffset": uvs, "byteLength": 24}),
    );
    let view = d["bufferViews"].as_array().unwrap().len() - 1;
    set(
        &mut d,
        "/accessors/9",
        json!({"bufferView": view, "componentType": 5126, "count": 3, "type": "VEC2"}),
    );
    let accessor = d["accessors"].as_array().unwrap().len() - 1;
    set(
        &mut d,
        "/meshes/0/primitives/0/attributes/TEXCOORD_0",
        json!(accessor),
    );
    set(&mut d, "/meshes/0/primitives/0/material", json!(0));
    set(
        &mut d,
        "/images",
        json!([{"uri": png(&TEXELS, [2, 2], ExtendedColorType::Rgba8)}]),
    );
    set(&mut d, "/textures", json!([{"source": 0, "sampler": 0}]));
    set(
        &mut d,
        "/samplers",
        json!([{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}]),
    );
    set(
        &mut d,
        "/materials",
        json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]),
    );
    (d, bin)
}

#[test]
fn a_texture_keeps_its_texels_sampler_and_coordinates() {
    let (mut d, bin) = textured();
    set(&mut d, "/materials/0/alphaMode", json!("BLEND"));
    let (scene, warning) = load(&d, &bin).unwrap();
    assert_eq!(warning, None);
    let rows: Vec<_> = scene.textures.iter().collect();
    assert_eq!(rows.len(), 1);
    let (slot, texture) = rows[0].refs[0];
    assert_eq!(slot, Slot::BaseColor);
    assert_eq!(texture.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert!(texture.nearest);
    let image = &scene.textures.images[0];
    assert_eq!((image.channels, image.size()), (4, [2, 2]));
    let Texels::Bytes(texels) = &image.texels else {
        panic!("8 bits stay 8 bits");
    };
    assert_eq!(texels[..16], TEXELS);
    // The smaller level is the mean in linear light, weighed by alpha: what is half there has
    // half a part in the colour.
    let [r, .., alpha] = scene.textures.texel(image, 1, 0, 0);
    let there = 128.0 / 255.0;
    assert!((alpha - (3.0 + there) / 4.0).abs() < 0.003, "{alpha}");
    assert!((r - (1.0 + there) / (3.0 + there)).abs() < 0.005, "{r}");
    assert_eq!(
        scene.meshes.attributes.uvs,
        [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
    );
}

#[test]
fn levels_are_weighed_by_alpha_where_it_counts() {
    let (good, bin) = textured();
    // An opaque material and one with a mask have the image, and so has a number.
    let mut d = good.clone();
    let base = json!({"baseColorTexture": {"index": 0}});
    let number = json!({"KHR_materials_specular": {"specularTexture": {"index": 0}}});
    set(
        &mut d,
        "/materials",
        json!([
            {"pbrMetallicRoughness": base},
            {"pbrMetallicRoughness": base, "alphaMode": "MASK"},
            {"pbrMetallicRoughness": base, "alphaMode": "BLEND"},
            {"extensions": number},
        ]),
    );
    let (scene, warning) = load(&d, &bin).unwrap();
    assert_eq!(warning, None);
    let images: Vec<_> = scene
        .textures
        .iter()
        .map(|row| row.refs[0].1.image)
        .collect();
    assert_eq!(images[1], images[2]);
    assert_eq!(scene.textures.images.len(), 3);
    let smallest = |row: usize| {
        let image = &scene.textures.images[images[row].index()];
        scene.textures.texel(image, 1, 0, 0)
    };
    let there = 128.0 / 255.0;
    let near = |a: [f32; 4], b: [f32; 4]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.005);
    let (plain, weighed) = (0.5, (1.0 + there) / (3.0 + there));
    let alpha = (3.0 + there) / 4.0;
    let blue = there / (3.0 + there);
    assert!(
        near(smallest(0), [plain, plain, 0.25, 1.0]),
        "{:?}",
        smallest(0)
    );
    assert!(
        near(smallest(1), [weighed, weighed, blue, alpha]),
        "{:?}",
        smallest(1)
    );
    assert!(
        near(smallest(3), [plain, plain, 0.25, alpha]),
        "{:?}",
        smallest(3)
    );
    // Without alpha there is one set of levels for all.
    let opaque = png(&TEXELS[..12], [2, 2], ExtendedColorType::Rgb8);
    set(&mut d, "/images/0/uri", json!(opaque));
    let (scene, _) = load(&d, &bin).unwrap();
    assert_eq!(scene.textures.images.len(), 2);
}

#[test]
fn a_transform_scales_turns_and_moves() {
    let (mut d, bin) = textured();
    let transform =
        json!({"offset": [0.5, 0.25], "rotation": std::f64::consts::FRAC_PI_2, "scale": [2, 3]});
    set(
        &mut d,
        "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions",
        json!({"KHR_texture_transform": transform}),
    );
    let (scene, _) = load(&d, &bin).unwrap();
    let [u, v] = scene.textures.iter().next().unwrap().refs[0].1.transform;
    let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    // A quarter turn counter-clockwise, seen with v downwards.
    assert!(
        near(u, [0.0, 3.0, 0.5]) && near(v, [-2.0, 0.0, 0.25]),
        "{u:?} {v:?}"
    );
}

#[test]
fn alpha_that_an_image_has_masks_or_blends() {
    let with = |mode: &str, factor: f32| {
        let (mut d, bin) = textured();
        set(&mut d, "/materials/0/alphaMode", json!(mode));
        let color = json!([1, 1, 1, factor]);
        set(
            &mut d,
            "/materials/0/pbrMetallicRoughness/baseColorFactor",
            color,
        );
        let scene = load(&d, &bin).unwrap().0;
        let alpha = scene.textures.iter().next().unwrap().texturing.alpha;
        (alpha, scene.materials.rows[0].layers.opacity)
    };
    assert_eq!(with("OPAQUE", 0.5), (Alpha::Opaque, 1.0));
    assert_eq!(with("BLEND", 0.5), (Alpha::Blend, 0.5));
    assert_eq!(with("MASK", 0.75), (Alpha::Mask(0.5 / 0.75), 1.0));
}

#[test]
fn images_that_are_broken_or_absent_are_left_out_with_a_reason() {
    let (good, bin) = textured();
    for (image, says) in [
        (
            json!({"uri": "data:image/png;base64,AAAA"}),
            "image 0: it is no PNG",
        ),
        (json!({"uri": "no_such_file.png"}), "image 0: "),
        (json!({"uri": "../outside.png"}), "outside"),
        (json!({"bufferView": 77}), "bufferView 77"),
        (json!({}), "neither a uri nor a bufferView"),
        (json!({"uri": 7}), "image 0: "),
    ] {
        let mut d = good.clone();
        set(&mut d, "/images/0", image);
        let (scene, warning) = load(&d, &bin).unwrap();
        assert!(scene.textures.images.is_empty());
        let warning = warning.unwrap();
        assert!(
            warning.contains("1 × texture (") && warning.contains(says),
            "{warning}"
        );
    }
    // Equal images, and an image that several materials have, are of one kind.
    let mut d = good.clone();
    let broken = json!({"uri": "data:image/png;base64,AAAA"});
    set(&mut d, "/images", json!([broken, broken, broken]));
    set(
        &mut d,
        "/textures",
        json!([{"source": 0}, {"source": 1}, {"source": 2}]),
    );
    let material = |i: u32| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": i % 3}}});
    set(&mut d, "/materials", (0..6).map(material).collect());
    let warning = load(&d, &bin).unwrap().1.unwrap();
    assert_eq!(
        warning,
        "not imported: 6 × texture (image 0: it is no PNG, JPEG, WebP or KTX2 file)"
    );
    // So are images of one file that there is not.
    let absent = json!({"uri": "no_such_file.png"});
    set(&mut d, "/images", json!([absent, absent, absent]));
    let warning = load(&d, &bin).unwrap().1.unwrap();
    assert!(
        warning.starts_with("not imported: 6 × texture (image 0: "),
        "{warning}"
    );
    let whole = png(&TEXELS, [2, 2], ExtendedColorType::Rgba8);
    for end in (40..whole.len()).step_by(4) {
        let mut d = good.clone();
        set(&mut d, "/images/0/uri", json!(whole[..end]));
        load(&d, &bin).unwrap();
    }
}

#[test]
fn a_sampler_that_there_is_not_is_counted() {
    let (good, bin) = textured();
    for sampler in [json!(1), json!(-1), json!("a")] {
        let mut d = good.clone();
        set(&mut d, "/textures/0/sampler", sampler);
        let (scene, warning) = load(&d, &bin).unwrap();
        let texture = scene.textures.iter().next().unwrap().refs[0].1;
        assert_eq!(texture.wrap, [Wrap::Repeat; 2]);
        let says = "not imported: 1 × sampler that the file does not have";
        assert_eq!(warning.unwrap(), says);
    }
    for sampler in [json!(null), json!(0)] {
        let mut d = good.clone();
        set(&mut d, "/textures/0/sampler", sampler);
        assert_eq!(load(&d, &bin).unwrap().1, None);
    }
}

#[test]
fn an_image_is_one_by_its_file_and_its_bytes() {
    let (mut d, bin) = textured();
    let image = d["images"][0].clone();
    set(&mut d, "/images", (0..8).map(|_| image.clone()).collect());
    set(
        &mut d,
        "/textures",
        (0..8).map(|i| json!({"source": i})).collect(),
    );
    let material = |i: u32| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}});
    set(&mut d, "/materials", (0..8).map(material).collect());
    let (scene, warning) = load(&d, &bin).unwrap();
    assert_eq!(warning, None);
    assert_eq!(scene.textures.iter().count(), 8);
    assert_eq!(scene.textures.images.len(), 1);
}

#[test]
fn an_image_is_refused_by_its_size_before_it_is_decoded() {
    // The start of a file that says how large it is, and no texels: decoding would say so.
    let header = |size: [u32; 2], depth: u8, kind: u8| {
        let mut bytes = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR".to_vec();
        bytes.extend(size.iter().flat_map(|n| n.to_be_bytes()));
        bytes.extend([depth, kind, 0, 0, 0]);
        bytes.extend(crc(&bytes[12..]).to_be_bytes());
        bytes.extend(b"\0\0\0\0IDAT");
        bytes.extend(crc(b"IDAT").to_be_bytes());
        bytes
    };
    let (good, bin) = textured();
    for (size, depth, kind, says) in [
        ([26_000, 19_000], 8, 6, "26000 × 19000 texels take 2513 MiB"),
        // Twice the bytes of 8 bits.
        (
            [12_000, 12_000],
            16,
            6,
            "12000 × 12000 texels take 1465 MiB",
        ),
        ([12_000, 12_000], 8, 6, "broken"),
    ] {
        let mut d = good.clone();
        set(
            &mut d,
            "/images/0/uri",
            json!(uri(&header(size, depth, kind))),
        );
        let (scene, warning) = load(&d, &bin).unwrap();
        assert!(scene.textures.images.is_empty());
        let warning = warning.unwrap();
        assert!(warning.contains("1 × texture (image 0: "), "{warning}");
        match says {
            "broken" => assert!(!warning.contains("texels take"), "{warning}"),
            says => assert!(warning.contains(says), "{warning}"),
        }
    }
}

/// The checksum of PNG's chunks.
fn crc(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = crc >> 1 ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 };
        }
    }
    !crc
}

#[test]
fn colours_of_vertices_have_any_type_and_need_no_material() {
    let bin: Vec<u8> = points()
        .into_iter()
        .chain([255, 0, 51, 0, 0, 255, 0, 0, 255, 255, 255, 0])
        .collect();
    let at = points().len();
    let mut d = document(&bin);
    set(&mut d, "/accessors/0/count", json!(3));
    set(
        &mut d,
        "/bufferViews/9",
        json!({"buffer": 0, "byteOffset": at, "byteLength": 12, "byteStride": 4}),
    );
    let view = d["bufferViews"].as_array().unwrap().len() - 1;
    set(
        &mut d,
        "/accessors/9",
        json!({
            "bufferView": view, "componentType": 5121, "normalized": true, "count": 3,
            "type": "VEC3"
        }),
    );
    let accessor = d["accessors"].as_array().unwrap().len() - 1;
    set(
        &mut d,
        "/meshes/0/primitives/0/attributes/COLOR_0",
        json!(accessor),
    );
    let (scene, warning) = load(&d, &bin).unwrap();
    assert_eq!(warning, None);
    let full = u16::MAX;
    let expected = [
        [full, 0, full / 5, full],
        [0, full, 0, full],
        [full, full, full, full],
    ];
    assert_eq!(scene.meshes.attributes.colors, expected);
    assert!(scene.textures.iter().next().unwrap().texturing.vertex_color);
    assert_eq!(
        scene.meshes.parts,
        [(0, Some(lanecast::internals::scene::MaterialId(0)))]
    );
}

#[test]
fn a_variant_is_shown_by_its_name() {
    let bin = points();
    let mut d = document(&bin);
    set(&mut d, "/accessors/0/count", json!(3));
    set(
        &mut d,
        "/materials",
        json!([{"name": "plain"}, {"name": "red"}]),
    );
    set(
        &mut d,
        "/extensions",
        json!({"KHR_materials_variants": {"variants": [{"name": "day"}, {"name": "night"}]}}),
    );
    set(&mut d, "/meshes/0/primitives/0/material", json!(0));
    set(
        &mut d,
        "/meshes/0/primitives/0/extensions",
        json!({"KHR_materials_variants": {"mappings": [{"material": 1, "variants": [1]}]}}),
    );
    let shown = |d: &Value, variant: Option<&str>| {
        on_disk(&glb(d, &bin), |path| {
            let options = LoadOptions {
                variant: variant.map(Into::into),
                ..LoadOptions::default()
            };
            let loaded = io::load(path, &options).map_err(|e| e.to_string())?;
            Ok(loaded.scene.meshes.parts[0].1.map(|id| id.0))
        })
    };
    assert_eq!(shown(&d, None), Ok(Some(0)));
    assert_eq!(shown(&d, Some("day")), Ok(Some(0)));
    assert_eq!(shown(&d, Some("night")), Ok(Some(1)));
    // No name is not the name of a variant without one.
    set(
        &mut d,
        "/extensions/KHR_materials_variants/variants/2",
        json!({}),
    );
    let said: String = shown(&d, Some("")).unwrap_err();
    assert!(
        said.contains("no variant ''; known are day, night"),
        "{said}"
    );
    let said: Result<Option<u32>, String> = shown(&d, Some("dusk"));
    let said = said.unwrap_err();
    assert!(
        said.contains("no variant 'dusk'; known are day, night"),
        "{said}"
    );
}
