//! Mutated files of formats that other programs pack: whatever they hold, they load or are refused
//! by one line, soon and in little memory.
//!
//! ```text
//! LANECAST_CAMPAIGN=10 cargo test --release --features all-lanes,draco,ktx2 --test formats \
//!     mutated_files -- --nocapture   # 10^5
//! ```

use crate::common::{Random, campaign, in_repository};
use crate::threemf;
use image::{ImageFormat, RgbaImage};
use lanecast::internals::io::{Animated, LoadOptions, load};
use lanecast::internals::scene::Timeline;
use std::io::Cursor;
use std::time::{Duration, Instant};

/// A good file, to be mutated: its extension, its bytes, and the range of its text, whose numbers
/// are replaced as well.
struct Seed {
    extension: &'static str,
    bytes: Vec<u8>,
    /// Makes the file of the bytes.
    pack: fn(&[u8]) -> Vec<u8>,
}

/// A model with everything that is read.
fn model() -> String {
    let resources = format!(
        "<basematerials id=\"5\"><base name=\"steel\" displaycolor=\"#80C0FF\"/>\
         <base name=\"glass\" displaycolor=\"#10203040\"/></basematerials>\
         <m:colorgroup id=\"7\"><m:color color=\"#FF0000\"/><m:color color=\"#00FF0080\"/>\
         </m:colorgroup><m:compositematerials id=\"6\" matid=\"5\" matindices=\"0 1\">\
         <m:composite values=\"0.25 0.75\"/></m:compositematerials>\
         <m:texture2d id=\"3\" path=\"/3D/a.png\" contenttype=\"image/png\"/>\
         <m:texture2dgroup id=\"4\" texid=\"3\"><m:tex2coord u=\"0\" v=\"0.25\"/>\
         <m:tex2coord u=\"1\" v=\"0\"/></m:texture2dgroup>\
         <m:multiproperties id=\"8\" pids=\"6 7\"><m:multi pindices=\"0 1\"/></m:multiproperties>\
         <object id=\"1\" pid=\"5\" pindex=\"0\">{}</object>\
         <object id=\"2\" type=\"surface\">{}</object><object id=\"9\">{}</object>\
         <object id=\"10\"><components><component objectid=\"1\"/><component objectid=\"2\" \
         transform=\"0 1 0 -1 0 0 0 0 1 10 0 0\"/></components></object>",
        threemf::cuboid([1.0, 2.0, 3.0], "pid=\"7\" p1=\"0\" p2=\"1\" p3=\"0\""),
        threemf::cuboid([1.0; 3], "pid=\"4\" p1=\"0\" p2=\"1\" p3=\"1\""),
        threemf::cuboid([2.0; 3], "pid=\"8\" p1=\"0\""),
    );
    let items =
        "<item objectid=\"10\"/><item objectid=\"9\" transform=\"2 0 0 0 2 0 0 0 2 9 9 9\"/>";
    threemf::model(
        "unit=\"inch\" requiredextensions=\"m p\"",
        &resources,
        items,
    )
}

fn picture(format: ImageFormat) -> Vec<u8> {
    let image = RgbaImage::from_fn(9, 7, |x, y| {
        image::Rgba([20 * x as u8, 30 * y as u8, (x * y) as u8, 200 + x as u8])
    });
    let image = image::DynamicImage::from(image);
    let image = match format {
        ImageFormat::Jpeg => image.to_rgb8().into(),
        _ => image,
    };
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// A package of a model, which is stored as it is, and of a picture.
fn package(model: &[u8]) -> Vec<u8> {
    let png = picture(ImageFormat::Png);
    threemf::package(&[
        ("_rels/.rels", threemf::RELATIONSHIPS.as_bytes()),
        ("3D/3dmodel.model", model),
        ("3D/a.png", &png),
    ])
}

/// A triangle of glTF with this picture.
fn textured(picture: &[u8]) -> Vec<u8> {
    let mut bin: Vec<u8> = Vec::new();
    for x in [
        0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0,
    ] {
        bin.extend(x.to_le_bytes());
    }
    bin.extend(picture);
    let json = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0,\"TEXCOORD_0\":1}},\
         \"material\":0}}]}}],\"materials\":[{{\"pbrMetallicRoughness\":{{\"baseColorTexture\":\
         {{\"index\":0}}}}}}],\"textures\":[{{\"source\":0}}],\"images\":[{{\"bufferView\":2,\
         \"mimeType\":\"image/png\"}}],\"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\
         \"count\":3,\"type\":\"VEC3\"}},{{\"bufferView\":1,\"componentType\":5126,\"count\":3,\
         \"type\":\"VEC2\"}}],\"bufferViews\":[{{\"buffer\":0,\"byteLength\":36}},{{\"buffer\":0,\
         \"byteOffset\":36,\"byteLength\":24}},{{\"buffer\":0,\"byteOffset\":60,\"byteLength\":{}}}],\
         \"buffers\":[{{\"byteLength\":{}}}]}}",
        picture.len(),
        bin.len()
    );
    glb(json, bin)
}

/// A GLB file of its two chunks.
fn glb(json: String, mut bin: Vec<u8>) -> Vec<u8> {
    let mut json = json.into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let word = |n: usize| (n as u32).to_le_bytes();
    let parts: [&[u8]; 9] = [
        b"glTF",
        &word(2),
        &word(28 + json.len() + bin.len()),
        &word(json.len()),
        b"JSON",
        &json,
        &word(bin.len()),
        b"BIN\0",
        &bin,
    ];
    parts.concat()
}

/// A file whose mesh is a stream with the attributes of those in `draco/`, in a pose of a skin.
/// What its accessors say is replaced by what the stream holds, but that colours are normalised.
#[cfg(feature = "draco")]
fn compressed(stream: &[u8]) -> Vec<u8> {
    let json = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0,\
         \"skin\":0}}],\"skins\":[{{\"joints\":[0,0,0]}}],\"meshes\":[{{\"primitives\":[{{\"indices\":0,\
         \"attributes\":{{\"POSITION\":0,\"NORMAL\":0,\"TANGENT\":0,\"TEXCOORD_0\":0,\"TEXCOORD_1\":0,\
         \"COLOR_0\":1,\"JOINTS_0\":0,\"WEIGHTS_0\":0}},\"extensions\":{{\"KHR_draco_mesh_compression\":{{\
         \"bufferView\":0,\"attributes\":{{\"POSITION\":0,\"NORMAL\":1,\"TANGENT\":2,\"TEXCOORD_0\":3,\
         \"TEXCOORD_1\":4,\"COLOR_0\":5,\"JOINTS_0\":6,\"WEIGHTS_0\":7}}}}}}}}]}}],\"accessors\":[{{\
         \"type\":\"SCALAR\",\"componentType\":5126,\"count\":1}},{{\"type\":\"VEC4\",\
         \"componentType\":5121,\"normalized\":true,\"count\":1}}],\"bufferViews\":[{{\"buffer\":0,\
         \"byteLength\":{0}}}],\"buffers\":[{{\"byteLength\":{0}}}]}}",
        stream.len(),
    );
    glb(json, stream.to_vec())
}

/// Files of meshes compressed by Draco, and streams within them.
#[cfg(feature = "draco")]
fn draco_seeds() -> Vec<Seed> {
    let mut all = Vec::new();
    for name in ["sequential", "edgebreaker", "valence"] {
        let path = in_repository("tests/formats/draco").join(format!("{name}.glb"));
        let file = std::fs::read(path).unwrap();
        let start = file.windows(5).position(|w| w == b"DRACO").unwrap();
        let stream = file[start..].to_vec();
        for (bytes, pack) in [
            (stream, compressed as fn(&[u8]) -> Vec<u8>),
            (file, <[u8]>::to_vec),
        ] {
            let extension = "glb";
            all.push(Seed {
                extension,
                bytes,
                pack,
            });
        }
    }
    all
}

#[cfg(not(feature = "draco"))]
fn draco_seeds() -> Vec<Seed> {
    Vec::new()
}

/// KTX2 files as textures, which without the feature are left out.
fn ktx2_seeds() -> Vec<Seed> {
    let names = ["etc1s", "etc1s_alpha", "uastc", "uastc_alpha_zstd"];
    let folder = in_repository("tests/formats/ktx2");
    let seed = |name: &str| Seed {
        extension: "glb",
        bytes: std::fs::read(folder.join(format!("{name}.ktx2"))).unwrap(),
        pack: textured,
    };
    names.map(seed).into()
}

const CSG: &str = "difference() {\n cube(size = [10, 20, 30], center = true);\n \
    multmatrix([[1, 0, 0, 3], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) {\n  \
    cylinder($fn = 0, $fa = 12, $fs = 2, h = 40, r1 = 3, r2 = 4, center = true);\n }\n \
    linear_extrude(height = 5, center = false, convexity = 1, scale = [1, 1], $fn = 0, $fa = 12, \
    $fs = 2) {\n  polygon(points = [[0, 0], [4, 0], [0, 4]], paths = undef, convexity = 1);\n }\n \
    color([0.5, 0, 1, 0.5]) {\n  hull() {\n   cube(size = [3, 1, 2], center = true);\n   \
    cube(size = [1, 1, 1], center = false);\n  }\n }\n \
    rotate_extrude(angle = 90, convexity = 2, $fn = 5, $fa = 12, $fs = 2) {\n  \
    offset(r = 1, $fn = 0, $fa = 12, $fs = 2) {\n   polygon(points = [[5, 0], [6, 0], [5, 2]], paths = undef, convexity = 1);\n  }\n }\n}\n";

fn seeds() -> Vec<Seed> {
    let as_it_is = |bytes: &[u8]| bytes.to_vec();
    let meshopt =
        |name: &str| std::fs::read(in_repository("tests/formats/meshopt").join(name)).unwrap();
    let seed = |extension, bytes, pack| Seed {
        extension,
        bytes,
        pack,
    };
    let mut all = vec![
        seed("3mf", model().into_bytes(), package),
        seed("3mf", package(model().as_bytes()), as_it_is),
        seed("glb", meshopt("ext.glb"), as_it_is),
        seed("glb", meshopt("khr.glb"), as_it_is),
        seed("glb", picture(ImageFormat::Png), textured),
        seed("glb", picture(ImageFormat::Jpeg), textured),
        seed("glb", picture(ImageFormat::WebP), textured),
        seed("csg", CSG.as_bytes().to_vec(), as_it_is),
    ];
    all.extend(draco_seeds());
    all.extend(ktx2_seeds());
    all
}

/// Numbers that files should not have.
const EXTREMES: [&str; 14] = [
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
    "4294967295",
    "4294967296",
    "2147483647",
    "18446744073709551615",
    "1e999",
    "0.1",
    "",
];

/// Changes a file in one to four ways.
fn mutated(random: &mut Random, mut bytes: Vec<u8>) -> Vec<u8> {
    for _ in 0..=random.below(4) {
        if bytes.is_empty() {
            return bytes;
        }
        let at = random.below(bytes.len() as u64) as usize;
        let most = (bytes.len() - at).min(1 + random.below(64) as usize);
        match random.below(9) {
            0 => bytes[at] = random.bits() as u8,
            1 => bytes[at] ^= 1 << random.below(8),
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..at + most)),
            4 => {
                let again = bytes[at..at + most].to_vec();
                let times = 1 + random.below(40) as usize;
                bytes.splice(at..at, again.repeat(times));
            }
            5 => {
                let word =
                    [0, 1, u32::MAX, 1 << 31, u32::MAX >> 1, 0xffff][random.below(6) as usize];
                for (byte, new) in bytes[at..].iter_mut().zip(word.to_le_bytes()) {
                    *byte = new;
                }
            }
            // A number of the text after this place.
            _ => {
                let is_number = |b: &u8| b.is_ascii_digit() || matches!(b, b'.' | b'-');
                let Some(first) = bytes[at..].iter().position(u8::is_ascii_digit) else {
                    continue;
                };
                let first = at + first;
                let length = bytes[first..].iter().take_while(|b| is_number(b)).count();
                let new = EXTREMES[random.below(EXTREMES.len() as u64) as usize];
                bytes.splice(first..first + length, new.bytes());
            }
        }
    }
    bytes
}

#[test]
fn mutated_files_load_or_are_refused_soon() {
    let seeds = seeds();
    let folder = tempfile::tempdir().unwrap();
    let options = LoadOptions {
        animation: None,
        ..LoadOptions::default()
    };
    let moving = LoadOptions {
        animation: Some(Animated {
            name: None,
            timeline: Timeline::whole(3),
            margin: 1,
            blurs: false,
        }),
        ..LoadOptions::default()
    };
    for seed in &seeds {
        let path = folder.path().join("good").with_extension(seed.extension);
        std::fs::write(&path, (seed.pack)(&seed.bytes)).unwrap();
        load(&path, &options).unwrap_or_else(|e| panic!("{e}"));
    }
    let start = Instant::now();
    let count = campaign(10_000);
    let mut loaded = vec![0; seeds.len()];
    let mut slowest = (Duration::ZERO, 0, 0);
    for case in 0..count {
        let which = case % seeds.len();
        let seed = &seeds[which];
        let mut random = Random(case as u64);
        let bytes = (seed.pack)(&mutated(&mut random, seed.bytes.clone()));
        let path = folder.path().join("a").with_extension(seed.extension);
        std::fs::write(&path, &bytes).unwrap();
        let begin = Instant::now();
        let is_moving = seed.extension == "glb" && (case / seeds.len()).is_multiple_of(2);
        match load(&path, if is_moving { &moving } else { &options }) {
            Ok(_) => loaded[which] += 1,
            Err(error) => {
                let said = error.to_string();
                assert!(
                    !said.contains('\n') && said.len() < 1000,
                    "case {case}: {said}"
                );
            }
        }
        let took = begin.elapsed();
        assert!(took < Duration::from_secs(10), "case {case} took {took:?}");
        slowest = slowest.max((took, case, which));
    }
    println!(
        "{count} files in {:.0} s, slowest {slowest:?}; loaded of each kind: {loaded:?}",
        start.elapsed().as_secs_f64()
    );
    assert!(loaded.iter().all(|n| *n > 0), "{loaded:?}");
}
