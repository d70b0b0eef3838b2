//! Compressed views of glTF, against the same views as the encoder's own decoder has them.
//!
//! The files in `meshopt/` are a ball made by formulas, as gltfpack 1.3 encodes it (`-cc -vp 14
//! -vn 10 -kv`, and `-ce khr`), with all filters; `plain` ones are these after meshoptimizer's
//! JavaScript decoder.

use crate::common::in_repository;
use lanecast::internals::io::{Animated, LoadOptions, load};
use lanecast::internals::scene::{Instances, Scene, Timeline};
use std::path::Path;

/// Reads a file of `meshopt/`, with its animation, after a change of its bytes.
fn scene(name: &str, change: impl Fn(&mut [u8])) -> Result<Scene, String> {
    let from = in_repository("tests/formats/meshopt").join(name);
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = std::fs::read(from).unwrap();
    change(&mut bytes);
    let path = folder.path().join("x.glb");
    std::fs::write(&path, bytes).unwrap();
    let options = LoadOptions {
        animation: Some(Animated {
            name: None,
            timeline: Timeline::whole(3),
            margin: 1,
            blurs: false,
        }),
        ..LoadOptions::default()
    };
    let loaded = load(&path, &options).map_err(|e| e.to_string())?;
    assert_eq!(loaded.warning, None);
    Ok(loaded.scene)
}

/// Replaces every `from` by as long a `to`.
fn replace(bytes: &mut [u8], from: &str, to: &str) {
    assert_eq!(from.len(), to.len());
    let places: Vec<usize> = (0..bytes.len() - from.len())
        .filter(|at| bytes[*at..].starts_with(from.as_bytes()))
        .collect();
    assert!(!places.is_empty(), "{from}");
    for at in places {
        bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
    }
}

#[test]
fn decoded_views_are_those_of_the_encoder() {
    for name in ["ext", "khr"] {
        let ours = scene(&format!("{name}.glb"), |_| {}).unwrap();
        let theirs = scene(&format!("{name}.plain.glb"), |_| {}).unwrap();
        let (a, b) = (&ours.meshes, &theirs.meshes);
        assert_eq!(a.triangles.len(), 720);
        assert_eq!(a.triangles, b.triangles, "{name}");
        assert_eq!(a.positions, b.positions, "{name}");
        // Filters may differ by a unit: of 16 bits in normals and rotations, of 8 in colours.
        let unit = 1.01 / 32_767.0;
        assert_eq!(a.normals.len(), b.normals.len());
        for (a, b) in a.normals.iter().flatten().zip(b.normals.iter().flatten()) {
            assert!((a - b).abs() <= unit, "{name}: {a} {b}");
        }
        let (a, b) = (&a.attributes, &b.attributes);
        assert!(!a.colors.is_empty() && a.colors.len() == b.colors.len());
        for (a, b) in a.colors.iter().flatten().zip(b.colors.iter().flatten()) {
            assert!(a.abs_diff(*b) <= 258, "{name}: {a} {b}");
        }
        let [a, b] = [ours, theirs].map(|scene| {
            let scene = scene.at(0.75).unwrap();
            let all = Instances::of(&scene).unwrap();
            let first = all.iter(&scene).next().unwrap();
            first.world_from_object
        });
        assert_eq!(a.translation, b.translation);
        for (a, b) in a.linear().iter().flatten().zip(b.linear().iter().flatten()) {
            assert!((a - b).abs() < 4.0 * f64::from(unit), "{name}: {a} {b}");
        }
    }
}

#[test]
fn malformed_views_are_refused_by_number() {
    for (from, to, says) in [
        (
            "\"TRIANGLES\"",
            "\"TRIANGLEZ\"",
            "its mode 'TRIANGLEZ' is none of ATTRIBUTES, TRIANGLES and",
        ),
        (
            "\"mode\":\"TRIANGLES\"",
            "\"mode\":\"INDICES\"  ",
            "the stream of indices has an unknown version",
        ),
        (
            "\"OCTAHEDRAL\"",
            "\"QUATERNIOM\"",
            "its filter 'QUATERNIOM' is unknown",
        ),
    ] {
        let said = scene("ext.glb", |bytes| replace(bytes, from, to)).unwrap_err();
        assert!(
            said.contains("bufferView ") && said.contains(says),
            "{said}"
        );
    }
}

/// Samples that gltfpack encodes elsewhere (`LANECAST_MESHOPT` is a folder of pairs `NAME.c.glb`
/// and `NAME.plain.glb`): both have the same triangles by their corners' positions.
#[test]
fn encoded_samples_have_the_positions_of_their_originals() {
    let Some(folder) = std::env::var_os("LANECAST_MESHOPT") else {
        println!("skipped: no folder of encoded samples");
        return;
    };
    let corners = |path: &Path| {
        let loaded = load(path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let meshes = &loaded.scene.meshes;
        let mut all: Vec<[u32; 3]> = Vec::new();
        for (of, vertices) in meshes.triangles_of.iter().zip(&meshes.vertices_of) {
            for triangle in &meshes.triangles[of.start as usize..of.end as usize] {
                let at = |v: u32| meshes.positions[(vertices.start + v) as usize];
                all.extend(triangle.map(|v| at(v).map(f32::to_bits)));
            }
        }
        all.sort_unstable();
        all
    };
    let mut compared = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.to_str().unwrap().to_string();
        if let Some(base) = name.strip_suffix(".c.glb") {
            let plain = format!("{base}.plain.glb");
            assert_eq!(corners(&path), corners(Path::new(&plain)), "{name}");
            compared += 1;
        }
    }
    println!("{compared} samples");
    assert!(compared > 10);
}
