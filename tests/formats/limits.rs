//! Scenes that ask for more than their size: they load in little memory, or are refused with
//! the number.

use lanecast::internals::io::{LoadOptions, Loaded, load};
use lanecast::internals::scene::Instances;
use std::fmt::Write as _;

fn loaded(name: &str, bytes: &[u8]) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    load(&path, &LoadOptions::default()).map_err(|e| e.to_string())
}

/// A union of 2^k balls, `times` of which are placed.
fn doubled(k: u32, times: u32) -> String {
    let mut text = "format = 1\n[shape.s]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
                    [shape.c0]\nunion = [\"s\"]\n"
        .to_string();
    for i in 1..=k {
        let below = i - 1;
        let _ = write!(text, "[shape.c{i}]\nunion = [\"c{below}\", \"c{below}\"]\n");
    }
    for i in 0..times {
        let _ = write!(
            text,
            "[shape.d{i}]\nunion = [\"c{k}\"]\n[[instance]]\nshape = \"d{i}\"\n"
        );
    }
    text
}

#[test]
fn operands_have_one_budget_for_the_scene() {
    loaded("s.toml", doubled(10, 100).as_bytes()).unwrap();
    let said = loaded("s.toml", doubled(18, 100).as_bytes()).unwrap_err();
    for part in [
        "s.toml:",
        "CSG solid 'd4' and the solids before it",
        "1310720 operands in all",
        "at most 1048576",
    ] {
        assert!(said.contains(part), "{said}");
    }
}

/// The same triangles once in the tables, however many shapes name the file.
#[test]
fn a_mesh_file_is_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    std::fs::write(folder.path().join("m.obj"), mesh).unwrap();
    let mut text = "format = 1\n".to_string();
    for i in 0..400 {
        let open = i % 2 == 1;
        let _ = write!(
            text,
            "[shape.m{i}]\nmesh = \"m.obj\"\nopen = {open}\n[[instance]]\nshape = \"m{i}\"\n"
        );
    }
    let path = folder.path().join("s.toml");
    std::fs::write(&path, text).unwrap();
    let scene = load(&path, &LoadOptions::default()).unwrap().scene;
    assert_eq!(scene.shapes.len(), 400);
    assert_eq!(Instances::of(&scene).unwrap().count(), 400);
    assert_eq!(scene.meshes.open, [false, true]);
    assert_eq!(scene.meshes.triangles.len(), 2);
}

#[test]
fn gltf_has_no_more_objects_than_its_size_justifies() {
    let of = |list: &str, count: usize| {
        format!(
            "{{\"asset\":{{\"version\":\"2.0\"}},\"{list}\":[{}{{}}]}}",
            "{},".repeat(count)
        )
    };
    for (list, count) in [("nodes", 2_800_000), ("materials", 1_400_000)] {
        let said = loaded("s.gltf", of(list, count).as_bytes()).unwrap_err();
        let part = format!("{list}: {} are more than the size", count + 1);
        assert!(said.contains(&part), "{said}");
    }
    let said = loaded("s.gltf", of("nodes", 100_000).as_bytes()).unwrap_err();
    assert!(said.contains("the scene is empty"), "{said}");
}

#[test]
fn a_long_header_of_ply_is_read_in_linear_time() {
    let mut bytes = b"ply\nformat binary_little_endian 1.0\n\
        element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\n"
        .to_vec();
    let elements = 300_000;
    for i in 0..elements {
        bytes.extend(format!("element e{i} 100\n").bytes());
    }
    bytes.extend(b"end_header\n");
    for x in [0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
        bytes.extend(x.to_le_bytes());
    }
    bytes.push(3);
    for corner in [0_u32, 1, 2] {
        bytes.extend(corner.to_le_bytes());
    }
    bytes.extend([0; 100]);
    let warning = loaded("m.ply", &bytes).unwrap().warning.unwrap();
    assert!(warning.len() < 400, "{} bytes", warning.len());
    assert!(
        warning.ends_with(", 29999000 × 299990 other kinds"),
        "{warning}"
    );
}

/// Looking up each of 64,000 names among all others would take minutes.
#[test]
fn a_scene_of_64_000_shapes_is_read() {
    let mut text = "format = 1\n".to_string();
    for i in 0..64_000 {
        let _ = write!(
            text,
            "[shape.s{i}]\nbox = {{ min = [0, 0, 0], max = [1, 1, {i}.5] }}\n"
        );
        let _ = write!(text, "[[instance]]\nshape = \"s{i}\"\n");
    }
    let loaded = loaded("s.toml", text.as_bytes()).unwrap();
    assert_eq!(Instances::of(&loaded.scene).unwrap().count(), 64_000);
}

#[test]
fn base_colours_above_1_count_as_1() {
    let text = "format = 1\n[material.m]\nbase_color = [10, 0.5, 1e30]\n\
                [shape.s]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
                [[instance]]\nshape = \"s\"\nmaterial = \"m\"\n";
    let loaded = loaded("s.toml", text.as_bytes()).unwrap();
    assert_eq!(loaded.scene.materials.rows[0].base_color, [1.0, 0.5, 1.0]);
    let warning = loaded.warning.unwrap();
    assert_eq!(warning, "repaired: 1 × base_color with a part above 1");
}
