//! Importers on foreign files: odd, broken and good ones.
//!
//! Every file under `bad/`, `gltf_odd/` and `obj/` either loads or is refused by a message of
//! one line, in limited time and without a panic. The Khronos validator is the oracle for
//! glTF: a file that it finds valid must load, or stand in [`REFUSED`], or have no triangle by
//! the validator's own count. Good files have their known number of triangles, in their known
//! order.

use crate::common::{assets, property};
use lanecast::internals::io::{ImportReport, LoadError, LoadOptions, import_mesh, load};
use lanecast::internals::scene::{Instances, SceneError};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

const MESH_FILES: [&str; 5] = ["gltf", "glb", "obj", "ply", "stl"];
const EMPTY: &str = "the scene is empty";

/// Valid glTF that does not load, and what the message must say.
#[rustfmt::skip]
const REFUSED: &[(&str, &str)] = &[
    // Not supported.
    ("bad/magnum/Test/required-extensions-unsupported.gltf", "KHR_materials_pbrSpecularGlossiness"),
    ("bad/magnum/Test/version-unsupported-min.gltf", "minVersion '2.1'"),
    ("bad/validator/base/asset/min_version_valid.gltf", "minVersion '2.1'"),
    // Triangles that no node shows.
    ("bad/validator/base/mesh/custom_property.gltf", EMPTY),
    ("bad/validator/base/mesh/primitive_incompatible_mode.gltf", EMPTY),
    ("bad/validator/base/mesh/valid.gltf", EMPTY),
    ("bad/validator/base/mesh_data/index_buffer_degenerate_triangle.gltf", EMPTY),
    ("bad/validator/ext/KHR_materials_clearcoat/material/valid_with_tangent.gltf", EMPTY),
    ("bad/validator/ext/KHR_materials_variants/primitive/custom_property.gltf", EMPTY),
    ("bad/validator/ext/KHR_materials_variants/primitive/valid.gltf", EMPTY),
    ("bad/validator/ext/KHR_mesh_quantization/primitive/valid.gltf", EMPTY),
];

/// All files below a folder, sorted, by their path relative to `root`.
fn files(root: &Path, folder: &str) -> Vec<String> {
    let mut open = vec![root.join(folder)];
    let mut found = Vec::new();
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                let relative = path.strip_prefix(root).unwrap();
                found.push(relative.to_str().unwrap().replace('\\', "/"));
            }
        }
    }
    found.sort();
    found
}

fn extension(name: &str) -> String {
    let extension = Path::new(name).extension();
    extension.map_or(String::new(), |e| e.to_string_lossy().to_lowercase())
}

fn verdicts(root: &Path) -> BTreeMap<String, Value> {
    let text = std::fs::read_to_string(root.join("gltf_validator_results.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// The most memory that this process has had, where the system tells.
fn peak_mib() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? / 1024)
}

#[test]
fn strange_files_load_or_say_why_not() {
    let Some(root) = assets() else { return };
    let verdicts = verdicts(&root);
    let mut names = files(&root, "bad");
    names.extend(files(&root, "gltf_odd"));
    names.extend(files(&root, "obj"));
    let (mut loaded, mut refused, mut empty, mut other) = (0, 0, 0, 0);
    let mut slowest = (Duration::ZERO, String::new());
    let mut unexplained = Vec::new();
    for name in &names {
        let path = root.join(name);
        let start = Instant::now();
        let result = load(&path, &LoadOptions::default());
        let _ = import_mesh(&path, &LoadOptions::default(), &mut ImportReport::default());
        let time = start.elapsed();
        if time > slowest.0 {
            slowest = (time, name.clone());
        }
        let known = MESH_FILES.contains(&&*extension(name));
        let Err(error) = result else {
            assert!(known, "{name} is of no known kind, and loads");
            loaded += 1;
            continue;
        };
        let message = error.to_string();
        assert!(message.starts_with(root.to_str().unwrap()), "{message}");
        let said = message.len() - path.to_str().unwrap().len().min(message.len());
        assert!((12..400).contains(&said), "{message}");
        assert!(!message.contains('\n'), "{message}");
        if !known {
            // `.json` is a scene format too; the reports beside the files are none.
            let scene = extension(name) == "json";
            let unknown = matches!(error, LoadError::UnknownFormat { .. });
            assert!(scene || unknown, "{message}");
            other += 1;
            continue;
        }
        refused += 1;
        let nothing = matches!(
            error,
            LoadError::Empty { .. }
                | LoadError::Scene {
                    source: SceneError::NothingToSee,
                    ..
                }
        );
        empty += usize::from(nothing);
        let Some(verdict) = verdicts.get(name) else {
            continue;
        };
        let listed = |(listed, says): &(&str, &str)| listed == name && message.contains(says);
        let shows_nothing = nothing && verdict["triangles"] == 0;
        if verdict["errors"] == 0 && !shows_nothing && !REFUSED.iter().any(listed) {
            unexplained.push(message);
        }
    }
    println!(
        "{} files: {loaded} loaded, {refused} refused ({empty} with nothing to see), \
         {other} of other kinds; slowest {:?} ({}); peak memory {:?} MiB",
        names.len(),
        slowest.0,
        slowest.1,
        peak_mib()
    );
    assert!(unexplained.is_empty(), "valid, but: {unexplained:#?}");
    for (name, _) in REFUSED {
        let stale = load(&root.join(name), &LoadOptions::default()).is_ok();
        assert!(!stale && names.iter().any(|n| n == name), "take {name} off");
    }
    assert!(loaded > 40 && refused > 200, "{loaded} {refused}");
    assert!(peak_mib().is_none_or(|peak| peak < 512));
}

/// Many of the validator's files have meshes that no node shows, so that nothing
/// reads them. Shown by a node each, they are read: the valid ones must give the
/// triangles that the validator counts.
#[test]
fn meshes_without_nodes_are_read_too() {
    let Some(root) = assets() else { return };
    let verdicts = verdicts(&root);
    let mut names = files(&root, "bad");
    names.extend(files(&root, "gltf_odd"));
    names.retain(|n| extension(n) == "gltf");
    let (mut loaded, mut refused) = (0, 0);
    for name in names {
        let bytes = std::fs::read(root.join(&name)).unwrap();
        let Ok(mut document) = serde_json::from_slice::<Value>(&bytes) else {
            continue;
        };
        let Some(meshes) = document["meshes"].as_array().map(Vec::len) else {
            continue;
        };
        if document.get("scenes").is_some() {
            continue;
        }
        let nodes = (0..meshes).map(|mesh| serde_json::json!({ "mesh": mesh }));
        document["nodes"] = nodes.collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.gltf");
        std::fs::write(&path, document.to_string()).unwrap();
        for beside in std::fs::read_dir(root.join(&name).parent().unwrap()).unwrap() {
            let beside = beside.unwrap();
            if extension(beside.path().to_str().unwrap()) == "bin" {
                std::fs::copy(beside.path(), folder.path().join(beside.file_name())).unwrap();
            }
        }
        let valid = verdicts[&name]["errors"] == 0;
        match load(&path, &LoadOptions::default()) {
            Ok(scene) => {
                loaded += 1;
                let found = scene.scene.meshes.triangles.len();
                assert!(
                    !valid || verdicts[&name]["triangles"] == found,
                    "{name}: {found}"
                );
            }
            Err(error) => {
                refused += 1;
                let known = REFUSED
                    .iter()
                    .any(|(listed, says)| *listed == name && *says != EMPTY);
                let empty = error.to_string().contains(EMPTY) && verdicts[&name]["triangles"] == 0;
                assert!(!valid || known || empty, "{name}: {error}");
            }
        }
    }
    println!("{loaded} loaded, {refused} refused");
    assert!(loaded + refused > 30);
}

#[test]
fn good_gltf_has_its_triangles() {
    let Some(root) = assets() else { return };
    let verdicts = verdicts(&root);
    let mut names = files(&root, "gltf");
    names.extend(files(&root, "meshes"));
    names.retain(|n| ["gltf", "glb"].contains(&&*extension(n)));
    assert!(names.len() > 50);
    for name in names {
        let triangles = verdicts[&name]["triangles"].as_u64().unwrap();
        match load(&root.join(&name), &LoadOptions::default()) {
            Ok(loaded) => {
                let found = loaded.scene.meshes.triangles.len() as u64;
                assert_eq!(found, triangles, "{name}");
                assert!(Instances::of(&loaded.scene).is_ok());
            }
            Err(error) => {
                assert_eq!(triangles, 0, "{error}");
                assert!(error.to_string().contains(EMPTY), "{error}");
            }
        }
    }
}

/// Known numbers of triangles, every instance counted.
#[test]
fn instances_multiply_when_baked() {
    let Some(root) = assets() else { return };
    for (name, triangles) in [
        ("gltf/2CylinderEngine/2CylinderEngine.glb", 121_496),
        ("gltf/ShapeCollection/ShapeCollection.glb", 3_542),
        ("gltf/TextureTransformTest/TextureTransformTest.gltf", 24),
        ("gltf/many-cubes/many-cubes.gltf", 6_012),
        ("obj/original/stanford-bunny.obj", 69_451),
        ("obj/original/suzanne.obj", 968),
        ("obj/original/teapot.obj", 6_320),
        ("obj/original/dragon_vrip_res4.ply", 11_102),
        ("obj/tinyobjloader/cube.obj", 12),
        ("obj/tinyobjloader/catmark_torus_creases0.obj", 64),
        ("obj/tinyobjloader/cornell_box.obj", 36),
        ("obj/tinyobjloader/map-bump.obj", 400),
        ("obj/tinyobjloader/smoothing-group-two-squares.obj", 3),
    ] {
        let mut report = ImportReport::default();
        let mesh = import_mesh(&root.join(name), &LoadOptions::default(), &mut report);
        assert_eq!(mesh.unwrap().triangles.len(), triangles, "{name}");
    }
}

/// Rays met by brute force elsewhere name a triangle and the place on it: so
/// triangle ids, and the order of their corners, are the file's.
#[test]
fn triangle_ids_are_the_files() {
    let Some(root) = assets() else { return };
    let text = std::fs::read_to_string(root.join("meshes_ray_hits.json")).unwrap();
    let all: Value = serde_json::from_str(&text).unwrap();
    let mut hits = 0;
    for (name, rays) in all["rays"].as_object().unwrap() {
        let path = root.join("meshes").join(name);
        let mut report = ImportReport::default();
        let mesh = import_mesh(&path, &LoadOptions::default(), &mut report).unwrap();
        for ray in rays.as_array().unwrap() {
            let Some(triangle) = ray["tri"].as_u64() else {
                continue;
            };
            let number = |v: &Value| v.as_f64().unwrap();
            let (t, u, v) = (number(&ray["t"]), number(&ray["u"]), number(&ray["v"]));
            let [a, b, c] = mesh.triangles[triangle as usize].map(|v| mesh.positions[v as usize]);
            for axis in 0..3 {
                let on_ray = number(&ray["o"][axis]) + t * number(&ray["d"][axis]);
                let on_triangle = (1.0 - u - v) * a[axis] + u * b[axis] + v * c[axis];
                // Two f64 evaluations; t grows with the mesh.
                let error = (on_ray - on_triangle).abs();
                assert!(error < 1e-11 * (1.0 + t), "{name} {triangle}: {error}");
            }
            hits += 1;
        }
    }
    assert!(hits > 500, "{hits}");
}

/// Small files of every kind, to be damaged.
const SEEDS: [&str; 5] = [
    "gltf/BoxInterleaved/BoxInterleaved.glb",
    "gltf/triangle-without-indices/triangle-without-indices.gltf",
    "obj/tinyobjloader/cube.obj",
    "bad/trimesh/emptyIO/ply_points_bin.ply",
    "made.stl",
];

fn seed(root: &Path, name: &str) -> Vec<u8> {
    if name != "made.stl" {
        return std::fs::read(root.join(name)).unwrap();
    }
    let mut stl = vec![b' '; 80];
    stl.extend(2_u32.to_le_bytes());
    stl.resize(84 + 2 * 50, 0);
    stl
}

/// Damage anywhere: no panic, no endless work, one line of message.
#[test]
fn damaged_files_do_no_harm() {
    let Some(root) = assets() else { return };
    let seeds = SEEDS.map(|name| (name, seed(&root, name)));
    let folder = tempfile::tempdir().unwrap();
    let byte = (any::<prop::sample::Index>(), any::<u8>());
    let damage = prop::collection::vec(byte, 1..6);
    let cut = prop::option::weighted(0.2, any::<prop::sample::Index>());
    let mut runner = TestRunner::new(property(1500));
    let input = (0..SEEDS.len(), damage, cut);
    let result = runner.run(&input, |(which, damage, cut)| {
        let (name, mut bytes) = seeds[which].clone();
        for (at, byte) in damage {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let path = folder.path().join("a").with_extension(extension(name));
        std::fs::write(&path, bytes).unwrap();
        if let Err(error) = load(&path, &LoadOptions::default()) {
            prop_assert!(!error.to_string().contains('\n'), "{}", error);
        }
        Ok(())
    });
    result.unwrap();
}
