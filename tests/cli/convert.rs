//! `convert`: what is written renders with the bits of what was read, and files appear whole.

use super::run::{folder, lanecast, names, stderr, stdout};
use crate::common::{assets, in_repository};
use std::fs;
use std::path::Path;

/// Renders in `folder`, small, and returns the picture's bytes.
fn picture(folder: &Path, scene: &str) -> Vec<u8> {
    let arguments = [
        "render", scene, "-o", "p.png", "--size", "64x40", "--spp", "2",
    ];
    let output = lanecast(folder, &arguments);
    assert!(output.status.success(), "{scene}: {}", stderr(&output));
    let path = folder.join("p.png");
    let bytes = fs::read(&path).unwrap();
    fs::remove_file(path).unwrap();
    bytes
}

/// Converts to both syntaxes, and on from each to the other; all four show the same picture.
/// Returns what the first says to standard error.
fn same_bits(scene: &Path) -> String {
    let folder = folder();
    let source = scene.to_str().unwrap();
    let expected = picture(folder.path(), source);
    let mut said = String::new();
    for (from, to) in [
        (source, "a.toml"),
        (source, "b.json"),
        ("a.toml", "c.json"),
        ("b.json", "d.toml"),
    ] {
        let output = lanecast(folder.path(), &["convert", from, to]);
        assert!(output.status.success(), "{source}: {}", stderr(&output));
        assert!(stdout(&output).starts_with(to), "{}", stdout(&output));
        if said.is_empty() {
            said = stderr(&output).into();
        }
        assert!(picture(folder.path(), to) == expected, "{source} as {to}");
    }
    said
}

#[test]
fn converted_scenes_have_the_same_bits() {
    for name in [
        "primitives",
        "csg_bracket",
        "csg_gear",
        "csg_mesh",
        "formula_solids",
        "glass",
        "instances",
        "lens_glass",
        "light_gyroid",
        "light_panels",
        "light_sunset",
        "placed",
        "prism",
        "surface_heart",
        "surface_torus",
    ] {
        let said = same_bits(&in_repository(&format!("scenes/{name}.toml")));
        assert!(!said.contains("not written"), "{name}: {said}");
    }
}

#[test]
fn converted_patterns_have_the_same_bits() {
    let folder = folder();
    let scene = folder.path().join("patterns.toml");
    let looks = [
        "base_color = { checker = { colors = [[0.1, 0.2, 0.3], [1, 1, 0.5]], size = [0.3, 0.2, 0.1] } }",
        "base_color = { gradient = { colors = [[0, 0, 0], [1, 0, 0], [1, 1, 1]], from = [0, -1, 0], \
         to = [0.1, 0.4, 0], wrap = \"mirror\" } }",
        "base_color = { noise = { colors = [[0, 0, 0], [1, 1, 1]], size = 0.3, octaves = 3, seed = 9 } }\n\
         roughness = { noise = { values = [0.1, 0.9], size = 0.2 } }",
        "base_color = { brick = { colors = [[0.5, 0.1, 0.1], [0.7, 0.7, 0.7]], joint = 0.04 } }",
    ];
    let mut text =
        "format = 1\n[shape.ball]\nsphere = { center = [0, 0, 0], radius = 1 }\n".to_string();
    for (i, look) in looks.iter().enumerate() {
        text += &format!(
            "[material.m{i}]\n{look}\n[[instance]]\nshape = \"ball\"\nmaterial = \"m{i}\"\n\
             transform = [{{ translate = [{}, 0, 0] }}]\n",
            2 * i
        );
    }
    fs::write(&scene, text).unwrap();
    let said = same_bits(&scene);
    assert!(!said.contains("not written"), "{said}");
    let export = ["export", "patterns.toml", "--pov", "p.pov"];
    let said = lanecast(folder.path(), &export);
    assert!(stderr(&said).contains("patterns"), "{}", stderr(&said));
}

#[test]
fn converted_files_of_other_formats_have_the_same_bits() {
    let folder = folder();
    let part = folder.path().join("part.csg");
    let text = "multmatrix([[0, -1, 0, 3], [1, 0, 0, 0.1], [0, 0, 1, 0], [0, 0, 0, 1]]) {\n\
                difference() { cube(size = [2, 2, 2]); cylinder(h = 3, r1 = 0.5, r2 = 0.7, \
                $fn = 6); color([1, 0, 0, 1]) { sphere(r = 1.1); } } }\n";
    fs::write(&part, text).unwrap();
    same_bits(&part);
    let Some(assets) = assets() else { return };
    for name in CONVERTED {
        let said = same_bits(&assets.join(name));
        // Of one image the two directions end otherwise.
        let told = said.contains("not written") && !said.contains("wrap of an image");
        assert!(!told, "{name}: {said}");
    }
}

/// Databases of NFF, with polygons, patches and shared names, and glTF files with nodes, cameras,
/// several materials, images, colours of vertices, alpha and normal maps.
const CONVERTED: [&str; 11] = [
    "spd/balls_2.nff",
    "spd/teapot_4.nff",
    "spd/tree_5.nff",
    "gltf/2CylinderEngine/2CylinderEngine.glb",
    "gltf/Cameras/Cameras.gltf",
    "gltf/multiple-boxes/multiple-boxes.gltf",
    "gltf/BoxTextured/BoxTextured.gltf",
    "gltf/BoxVertexColors/BoxVertexColors.glb",
    "gltf/cube_vc/cubevc.glb",
    "gltf/AlphaBlendModeTest/AlphaBlendModeTest.glb",
    "gltf/Duck/Duck.glb",
];

/// Images of 8 and of 16 bits, grey and coloured, with and without alpha, scaled, clamped and shown by
/// their nearest texels, on a mesh of each format that has texture coordinates.
#[test]
fn converted_images_have_the_same_bits() {
    let folder = folder();
    let path = folder.path();
    let noise = |i: u32| (i.wrapping_mul(2_654_435_761) >> 24) as u8;
    let bytes = |count: u32| -> Vec<u8> { (0..count).map(noise).collect() };
    let color = image::RgbImage::from_raw(6, 5, bytes(90)).unwrap();
    let with_alpha = image::RgbaImage::from_raw(6, 5, bytes(120)).unwrap();
    let grey = image::GrayImage::from_raw(6, 5, bytes(30)).unwrap();
    let words: Vec<u16> = bytes(90).iter().map(|b| u16::from(*b) * 251).collect();
    let wide: image::ImageBuffer<image::Rgb<u16>, _> =
        image::ImageBuffer::from_raw(6, 5, words).unwrap();
    color.save(path.join("color.png")).unwrap();
    with_alpha.save(path.join("alpha.png")).unwrap();
    grey.save(path.join("grey.png")).unwrap();
    wide.save(path.join("wide.png")).unwrap();
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt -0.3 0.1\nvt 1.7 0.2\nvt 1.1 2.3\nvt 0 1e-7\n\
               f 1/1 2/2 3/3 4/4\n";
    fs::write(path.join("a.obj"), obj).unwrap();
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
               property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n\
               property float s\nproperty float t\nelement face 1\nproperty list uchar int vertex_indices\n\
               end_header\n0 0 1 255 7 9 40 0 0\n1 0 1 1 2 3 255 1 0.1\n1 1 1 99 98 97 128 1 1\n\
               0 1 1 0 255 254 9 0 0.7\n4 0 1 2 3\n";
    fs::write(path.join("b.ply"), ply).unwrap();
    let scene = "format = 1\n\
         camera = { eye = [0.3, 0.4, 4], look_at = [0.8, 0.5, 0], fov_y = 40 }\n\
         [material.a]\nbase_color = [0.9, 1, 0.8]\nbase_color_texture = { file = 'color.png', scale = [2, -0.5], offset = [0.1, 0.3], wrap = 'mirror' }\n\
         metallic_roughness_texture = { file = 'color.png', wrap = 'clamp' }\n\
         [material.b]\nbase_color_texture = { file = 'alpha.png', filter = 'nearest' }\nalpha = 'blend'\n\
         [material.c]\nbase_color_texture = { file = 'alpha.png' }\nalpha = 'mask'\nalpha_cutoff = 0.3\n\
         emission = [0.1, 0.2, 0.3]\nemission_texture = { file = 'grey.png' }\n\
         [material.d]\nmetallic_roughness_texture = { file = 'wide.png' }\n\
         [material.e]\nvertex_colors = true\nalpha = 'blend'\n\
         [shape]\na.mesh = 'a.obj'\nb.mesh = 'b.ply'\nown.mesh = 'b.ply'\n\
         [[instance]]\nshape = 'a'\nmaterial = 'a'\n\
         [[instance]]\nshape = 'b'\nmaterial = 'b'\n\
         [[instance]]\nshape = 'a'\nmaterial = 'c'\ntransform = [{ translate = [1, 0, 0] }]\n\
         [[instance]]\nshape = 'b'\nmaterial = 'd'\ntransform = [{ translate = [1, 0, -1] }]\n\
         [[instance]]\nshape = 'b'\nmaterial = 'e'\ntransform = [{ translate = [0, 0.6, -0.5] }]\n\
         [[instance]]\nshape = 'own'\ntransform = [{ translate = [-1, 0.5, -0.5] }]\n";
    fs::write(path.join("s.toml"), scene).unwrap();
    let said = same_bits(&path.join("s.toml"));
    assert!(!said.contains("not written"), "{said}");
    // What the format has no words for is told.
    let turned = scene.replace("scale = [2, -0.5]", "rotation = 30");
    fs::write(path.join("t.toml"), turned).unwrap();
    let output = lanecast(path, &["convert", "t.toml", "u.toml"]);
    let told = "not written: 1 × last digit of turned texture coordinates";
    assert!(stderr(&output).contains(told), "{}", stderr(&output));
    assert!(output.status.success());
}

#[test]
fn convert_overwrites_nothing_that_it_reads() {
    let folder = folder();
    let scene = "format = 1\n[shape]\nmesh.mesh = 'a_meshes/m.ply'\n[[instance]]\nshape = 'mesh'\n";
    let mesh = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
                end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    fs::create_dir(folder.path().join("a_meshes")).unwrap();
    fs::write(folder.path().join("a_meshes/m.ply"), mesh).unwrap();
    fs::write(folder.path().join("a.toml"), scene).unwrap();
    for (out, code, says) in [
        ("a.toml", 2, "is the input"),
        // Its meshes would go where those of the input are.
        ("a.json", 2, "which an output would replace"),
        ("b.txt", 2, ".toml or .json"),
        ("none/b.toml", 4, "none"),
    ] {
        let output = lanecast(folder.path(), &["convert", "a.toml", out]);
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
        assert_eq!(names(folder.path()), ["a.toml", "a_meshes"]);
    }
    let output = lanecast(folder.path(), &["convert", "a.toml", "b.json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(
        names(folder.path()),
        ["a.toml", "a_meshes", "b.json", "b_meshes"]
    );
    assert_eq!(names(&folder.path().join("b_meshes")), ["mesh.ply"]);
    assert_eq!(
        fs::read_to_string(folder.path().join("a_meshes/m.ply")).unwrap(),
        mesh
    );
}

/// What an animation of a glTF file moves has keys in the native scene.
#[test]
fn animations_are_converted() {
    let folder = folder();
    let gltf = r#"{ "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "animations": [{ "name": "slide", "samplers": [{ "input": 1, "output": 2 }],
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] },
            { "bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1] },
            { "bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }, { "buffer": 0, "byteOffset": 36, "byteLength": 8 },
            { "buffer": 0, "byteOffset": 44, "byteLength": 24 }],
        "buffers": [{ "byteLength": 68, "uri": "data:application/octet-stream;base64,B64" }] }"#;
    let gltf = gltf.replace("B64", "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAABAAAAAAAAAAAA=");
    fs::write(folder.path().join("a.gltf"), gltf).unwrap();
    let still = lanecast(folder.path(), &["convert", "a.gltf", "still.toml"]);
    assert!(
        stderr(&still).contains("1 × animation (see --animation)"),
        "{}",
        stderr(&still)
    );
    let moving = ["convert", "a.gltf", "moving.toml", "--animation", "slide"];
    let moving = lanecast(folder.path(), &moving);
    assert!(moving.status.success(), "{}", stderr(&moving));
    assert_eq!(stderr(&moving), "");
    let frames = |scene: &str, more: &[&str], name: &str| {
        let picture = format!("{name}.png");
        let arguments = [
            "render", scene, "--frames", "3", "--size", "48x32", "--spp", "2", "-o", &picture,
        ];
        let output = lanecast(folder.path(), &[&arguments, more].concat());
        assert!(output.status.success(), "{scene}: {}", stderr(&output));
        let frame = |i: u32| fs::read(folder.path().join(format!("{name}_{i:04}.png"))).unwrap();
        [0, 1, 2].map(frame)
    };
    let expected = frames("a.gltf", &["--animation", "slide"], "a");
    assert!(expected[0] != expected[1] && expected[1] != expected[2]);
    assert!(frames("moving.toml", &[], "b") == expected);
}
