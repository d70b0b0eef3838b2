//! Meshes of glTF that Draco compresses, against what Google's decoder makes of them.
//!
//! The files in `draco/` are a torus made by formulas, with every attribute that is read, as
//! draco3dgltf 1.5.7 encodes it by glTF-Transform 4.5: sequentially, by edgebreaker, and by that
//! at its slowest. `plain` ones are these after Google's own decoder, in JavaScript.

use crate::common::in_repository;
use lanecast::internals::io::{LoadOptions, load};
use lanecast::internals::scene::Scene;

/// Reads a file of `draco/` after a change of its bytes, with its warning.
fn scene(name: &str, change: impl Fn(&mut [u8])) -> Result<(Scene, Option<String>), String> {
    let from = in_repository("tests/formats/draco").join(name);
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = std::fs::read(from).unwrap();
    change(&mut bytes);
    let path = folder.path().join("x.glb");
    std::fs::write(&path, bytes).unwrap();
    let loaded = load(&path, &LoadOptions::default()).map_err(|e| e.to_string())?;
    Ok((loaded.scene, loaded.warning))
}

#[cfg(not(feature = "draco"))]
#[test]
fn what_is_not_built_in_is_refused_with_the_remedy() {
    let said = scene("edgebreaker.glb", |_| {}).map(drop).unwrap_err();
    let says = "the required extension 'KHR_draco_mesh_compression' is not supported; build \
                Lanecast with --features draco, or export the file without it";
    assert!(said.ends_with(says), "{said}");
}

#[cfg(feature = "draco")]
mod built_in {
    use super::*;
    use std::path::Path;

    /// Fails unless all columns of the meshes of two scenes are equal, bit by bit.
    fn assert_equal(ours: &Scene, theirs: &Scene, name: &str) {
        let (a, b) = (&ours.meshes, &theirs.meshes);
        assert_eq!(a.triangles_of, b.triangles_of, "{name}");
        assert_eq!(a.triangles, b.triangles, "{name}");
        assert_eq!(a.positions, b.positions, "{name}");
        assert_eq!(a.center, b.center, "{name}");
        assert_eq!(a.normals, b.normals, "{name}");
        assert_eq!(a.attributes.uvs, b.attributes.uvs, "{name}");
        assert_eq!(a.attributes.colors, b.attributes.colors, "{name}");
        assert_eq!(a.attributes.tangents, b.attributes.tangents, "{name}");
    }

    #[test]
    fn decoded_meshes_are_those_of_googles_decoder() {
        for name in ["sequential", "edgebreaker", "valence"] {
            let (ours, warning) = scene(&format!("{name}.glb"), |_| {}).unwrap();
            assert_eq!(warning, None);
            let (theirs, _) = scene(&format!("{name}.plain.glb"), |_| {}).unwrap();
            // As it is, and in the pose of its skin.
            assert_eq!(ours.meshes.triangles_of.len(), 2);
            let all = &ours.meshes.attributes;
            assert_eq!(ours.meshes.triangles.len(), 2 * 108);
            assert_eq!(all.uvs.len(), 2 * ours.meshes.positions.len());
            assert!(!all.colors.is_empty() && !all.tangents.is_empty());
            assert_equal(&ours, &theirs, name);
        }
    }

    /// Replaces the first `from` by as long a `to`.
    fn replace(bytes: &mut [u8], from: &[u8], to: &[u8]) {
        assert_eq!(from.len(), to.len());
        let at = bytes.windows(from.len()).position(|w| w == from).unwrap();
        bytes[at..at + to.len()].copy_from_slice(to);
    }

    #[test]
    fn malformed_streams_are_refused_by_primitive() {
        let place = "mesh 0, primitive 0, KHR_draco_mesh_compression: ";
        let cases: [(&[u8], &[u8], &str); 6] = [
            (b"DRACO\x02", b"DRACE\x02", "its stream is none of Draco's"),
            (
                b"DRACO\x02\x02",
                b"DRACO\x07\x02",
                "its stream is none of Draco's, of version 2.2",
            ),
            (
                b"DRACO\x02\x02\x01\x01",
                b"DRACO\x02\x02\x00\x01",
                "its stream is malformed: ",
            ),
            (
                b"\"NORMAL\":1,\"TAN",
                b"\"NORMAL\":9,\"TAN",
                "its stream has no attribute 9",
            ),
            (
                b"\"mode\":4",
                b"\"mode\":1",
                "the mode of its primitive must be 4 or 5",
            ),
            (
                b"{\"bufferView\":1,",
                b"{\"bufferView\":7,",
                "refers to bufferView 7",
            ),
        ];
        for (from, to, says) in cases {
            let read = scene("edgebreaker.glb", |bytes| replace(bytes, from, to));
            let said = read.map(drop).expect_err(says);
            assert!(said.contains(&format!("{place}{says}")), "{said}");
        }
    }

    #[test]
    fn counts_of_the_stream_are_right() {
        for (from, to) in [
            ("\"count\":324", "\"count\":321"),
            ("\"count\":70", "\"count\":99"),
        ] {
            let change = |bytes: &mut [u8]| replace(bytes, from.as_bytes(), to.as_bytes());
            let (ours, warning) = scene("edgebreaker.glb", change).unwrap();
            let says = "repaired: 1 × accessor that differs from its Draco stream";
            assert_eq!(warning.as_deref(), Some(says));
            let (theirs, _) = scene("edgebreaker.plain.glb", |_| {}).unwrap();
            assert_equal(&ours, &theirs, from);
        }
    }

    /// Samples that are encoded elsewhere (`LANECAST_DRACO` is a folder of pairs `NAME.c.glb` and
    /// `NAME.plain.glb`).
    #[test]
    fn encoded_samples_are_those_of_googles_decoder() {
        let Some(folder) = std::env::var_os("LANECAST_DRACO") else {
            println!("skipped: no folder of encoded samples");
            return;
        };
        let read = |path: &Path| load(path, &LoadOptions::default());
        let (mut compared, mut triangles) = (0, 0);
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.to_str().unwrap().to_string();
            if let Some(base) = name.strip_suffix(".c.glb") {
                let theirs = read(Path::new(&format!("{base}.plain.glb")));
                let (ours, theirs) = match (read(&path), theirs) {
                    (Ok(ours), Ok(theirs)) => (ours.scene, theirs.scene),
                    // Such as samples of points alone.
                    (ours, theirs) => {
                        assert_eq!(ours.is_ok(), theirs.is_ok(), "{name}");
                        continue;
                    }
                };
                assert_equal(&ours, &theirs, &name);
                triangles += ours.meshes.triangles.len();
                compared += 1;
            }
        }
        println!("{compared} samples, {triangles} triangles");
        assert!(compared > 10);
    }
}
