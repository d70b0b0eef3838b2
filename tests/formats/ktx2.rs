//! KTX2 textures, against what the transcoder of Basis Universal makes of them.
//!
//! The files in `ktx2/` are 21 × 13 texels made by formulas, as basisu 1.16.3 encodes them (`-ktx2`,
//! `-uastc`, `-ktx2_no_zstandard`); `.rgba` are their texels by that program's own transcoder, in
//! JavaScript (three's basis_transcoder).

use crate::common::in_repository;
use lanecast::internals::io::{LoadOptions, Loaded, load};
#[cfg(feature = "ktx2")]
use std::path::Path;

/// A native scene whose material has the image `t.ktx2`.
const SCENE: &str = "format = 1\n[material.m]\nbase_color = [1, 1, 1]\nalpha = \"blend\"\n\
    base_color_texture = { file = \"t.ktx2\" }\n[shape.s]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
    [[instance]]\nshape = \"s\"\nmaterial = \"m\"\n";

fn file(name: &str) -> Vec<u8> {
    std::fs::read(in_repository("tests/formats/ktx2").join(name)).unwrap()
}

/// Reads a scene beside an image.
fn beside(scene: (&str, &str), image: &[u8]) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(scene.0);
    std::fs::write(&path, scene.1).unwrap();
    std::fs::write(folder.path().join("t.ktx2"), image).unwrap();
    load(&path, &LoadOptions::default()).map_err(|e| e.to_string())
}

/// A triangle of glTF, whose texture is `t.ktx2` by extension and what else is said.
fn triangle(more: &str) -> String {
    format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"extensionsUsed\":[\"KHR_texture_basisu\"],\
         \"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}],\"meshes\":[{{\"primitives\":[{{\
         \"attributes\":{{\"POSITION\":0,\"TEXCOORD_0\":1}},\"material\":0}}]}}],\"materials\":[{{\
         \"pbrMetallicRoughness\":{{\"baseColorTexture\":{{\"index\":0}}}}}}],\"textures\":[{{{more}\
         \"extensions\":{{\"KHR_texture_basisu\":{{\"source\":0}}}}}}],\"images\":[{{\"uri\":\"t.ktx2\",\
         \"mimeType\":\"image/ktx2\"}},{{\"uri\":\"{PNG}\"}}],\"accessors\":[{{\"bufferView\":0,\
         \"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}},{{\"bufferView\":1,\"componentType\":5126,\
         \"count\":3,\"type\":\"VEC2\"}}],\"bufferViews\":[{{\"buffer\":0,\"byteLength\":36}},{{\"buffer\":0,\
         \"byteOffset\":36,\"byteLength\":24}}],\"buffers\":[{{\"byteLength\":60,\
         \"uri\":\"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA{}\"}}]}}",
        "A".repeat(32)
    )
}

/// One red texel.
const PNG: &str = "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGM4\
    kWIEAANWAV/oF4RSAAAAAElFTkSuQmCC";

/// Returns the size and channels of a scene's only image.
fn image(loaded: &Loaded) -> ([u32; 2], u8) {
    let images = &loaded.scene.textures.images;
    assert_eq!(images.len(), 1);
    (images[0].size(), images[0].channels)
}

#[cfg(not(feature = "ktx2"))]
#[test]
fn what_is_not_built_in_is_left_out_with_the_remedy() {
    let says = "it is a KTX2 file; build Lanecast with --features ktx2 to read it";
    let said = beside(("s.toml", SCENE), &file("etc1s.ktx2"))
        .err()
        .unwrap();
    assert!(said.contains(says), "{said}");
    // glTF's own textures go with a warning, unless they have another source.
    let loaded = beside(("s.gltf", &triangle("")), &file("etc1s.ktx2")).unwrap();
    let warning = format!("not imported: 1 × texture (image 0: {says})");
    assert_eq!(loaded.warning.as_deref(), Some(&*warning));
    let loaded = beside(("s.gltf", &triangle("\"source\":1,")), &file("etc1s.ktx2")).unwrap();
    assert_eq!((image(&loaded), loaded.warning), (([1, 1], 3), None));
}

#[cfg(feature = "ktx2")]
mod built_in {
    use super::*;
    use lanecast::internals::scene::Texels;

    /// Returns the channels and the texels of level 0 of an image in a native scene.
    fn texels(bytes: &[u8]) -> Result<(usize, Vec<u8>), String> {
        let loaded = beside(("s.toml", SCENE), bytes)?;
        assert_eq!(loaded.warning, None);
        let image = &loaded.scene.textures.images[0];
        let channels = usize::from(image.channels);
        let Texels::Bytes(texels) = &image.texels else {
            panic!("8 bits");
        };
        let [width, height] = image.size();
        let count = channels * width as usize * height as usize;
        Ok((channels, texels[..count].to_vec()))
    }

    /// Fails unless the texels of a file are those of the transcoder.
    fn assert_texels(path: &Path, theirs: &[u8], name: &str) {
        let (channels, ours) = texels(&std::fs::read(path).unwrap()).unwrap();
        let theirs: Vec<u8> = theirs
            .chunks_exact(4)
            .flat_map(|texel| texel[..channels].to_vec())
            .collect();
        assert_eq!(ours, theirs, "{name}");
    }

    #[test]
    fn texels_are_those_of_the_transcoder() {
        for name in ["etc1s", "etc1s_alpha", "uastc", "uastc_alpha_zstd"] {
            let path = in_repository("tests/formats/ktx2").join(format!("{name}.ktx2"));
            let theirs = file(&format!("{name}.rgba"));
            assert_texels(&path, &theirs, name);
            let (channels, _) = texels(&file(&format!("{name}.ktx2"))).unwrap();
            assert_eq!(
                channels,
                if name.contains("alpha") { 4 } else { 3 },
                "{name}"
            );
        }
    }

    #[test]
    fn files_of_red_and_green_have_them_so() {
        let mut bytes = file("etc1s_alpha.ktx2");
        let descriptor = u32::from_le_bytes(bytes[48..52].try_into().unwrap()) as usize;
        // Channel 15 of the second sample, alpha, becomes 4, green.
        assert_eq!(bytes[descriptor + 47] & 15, 15);
        bytes[descriptor + 47] = 4;
        let (channels, ours) = texels(&bytes).unwrap();
        assert_eq!(channels, 3);
        let theirs = file("etc1s_alpha.rgba");
        for (ours, theirs) in ours.chunks_exact(3).zip(theirs.chunks_exact(4)) {
            assert_eq!(ours, [theirs[0], theirs[3], 0]);
        }
    }

    #[test]
    fn keys_and_values_do_not_matter() {
        let good = file("uastc.ktx2");
        let at = u32::from_le_bytes(good[56..60].try_into().unwrap()) as usize;
        let mut bytes = good.clone();
        // The padding of the first entry ends beyond all.
        bytes[60..64].copy_from_slice(&43_u32.to_le_bytes());
        bytes[at..at + 4].copy_from_slice(&38_u32.to_le_bytes());
        assert_eq!(texels(&bytes), texels(&good));
    }

    #[test]
    fn gltf_prefers_the_extension() {
        for more in ["", "\"source\":1,"] {
            let loaded = beside(("s.gltf", &triangle(more)), &file("etc1s.ktx2")).unwrap();
            assert_eq!((image(&loaded), loaded.warning), (([21, 13], 3), None));
        }
    }

    #[test]
    fn malformed_files_are_refused_by_what_is_wrong() {
        let put = |name: &str, at: usize, word: u32| {
            let mut bytes = file(name);
            bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
            bytes
        };
        let packed = file("uastc_alpha_zstd.ktx2");
        let level = u64::from_le_bytes(packed[80..88].try_into().unwrap()) as usize;
        let cases = [
            // The format of the texels.
            (
                put("uastc.ktx2", 12, 37),
                "it is no KTX2 file of Basis Universal",
            ),
            // The width.
            (
                put("etc1s.ktx2", 20, 1 << 20),
                "1048576 × 13 texels are more than 32768 a side",
            ),
            // Layers.
            (
                put("etc1s.ktx2", 32, 2),
                "it is a cube, an array or a video",
            ),
            // Where the codebooks are, and the level.
            (
                put("etc1s.ktx2", 64, u32::MAX - 2),
                "it is shorter than its header says",
            ),
            (
                put("uastc.ktx2", 80, 300),
                "it is shorter than its header says",
            ),
            // What the level inflates to.
            (
                put("uastc_alpha_zstd.ktx2", 96, 1 << 30),
                "its level 0 inflates to 1073741824 bytes",
            ),
            // The magic of Zstandard.
            (
                put("uastc_alpha_zstd.ktx2", level, 0),
                "its data is malformed",
            ),
            (
                file("etc1s.ktx2")[..300].to_vec(),
                "it is shorter than its header says",
            ),
        ];
        for (bytes, says) in cases {
            let read = beside(("s.toml", SCENE), &bytes);
            let said = read.map(drop).expect_err(says);
            assert!(said.contains(says), "{said}");
        }
    }

    /// Files that are encoded elsewhere (`LANECAST_KTX2` is a folder of pairs `NAME.ktx2` and
    /// `NAME.rgba`).
    #[test]
    fn encoded_samples_are_those_of_the_transcoder() {
        let Some(folder) = std::env::var_os("LANECAST_KTX2") else {
            println!("skipped: no folder of encoded samples");
            return;
        };
        let mut compared = 0;
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|end| end == "ktx2") {
                let theirs = std::fs::read(path.with_extension("rgba")).unwrap();
                assert_texels(&path, &theirs, path.to_str().unwrap());
                compared += 1;
            }
        }
        println!("{compared} samples");
        assert!(compared > 10);
    }
}
