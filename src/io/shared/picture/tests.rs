//! Tests of written pictures, which the codecs' own readers read back.

use super::*;
use crate::Attribute;
use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};
use std::collections::BTreeMap;

/// Makes a picture with every column. Values differ from pixel to pixel and include infinite
/// depths, tiny numbers, and ids beyond u32.
fn picture(width: u32, height: u32) -> Picture {
    let n = width as usize * height as usize;
    let triple = |k: f32| {
        (0..n)
            .map(|i| [i as f32 + k, -k / 3.0, 1e-30 * k])
            .collect()
    };
    Picture {
        width,
        height,
        color: (0..n)
            .map(|i| [i as f32 / n as f32, 1e6, 0.1 + i as f32])
            .collect(),
        alpha: None,
        depth: Some(
            (0..n)
                .map(|i| if i % 3 == 0 { f32::INFINITY } else { i as f32 })
                .collect(),
        ),
        position: Some(triple(1.0)),
        normal: Some(triple(2.0)),
        albedo: Some(triple(3.0)),
        instance_id: Some(
            (0..n as u64)
                .map(|i| match i % 4 {
                    0 => Picture::NO_ID,
                    1 => (1 << 32) + i,
                    2 => u64::from(u32::MAX) - i,
                    // Neither half of the id is exact in f32.
                    _ => 0x0123_4567_89ab_cdef_u64.wrapping_mul(i),
                })
                .collect(),
        ),
        primitive_id: Some((0..n as u32).map(|i| u32::MAX - i).collect()),
        samples: Some((0..n as u32).map(|i| 1 + i).collect()),
        ..Picture::default()
    }
}

fn exr_channels(path: &Path) -> (usize, usize, BTreeMap<String, FlatSamples>) {
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .unwrap();
    let size = image.layer_data.size;
    let channels = image
        .layer_data
        .channel_data
        .list
        .into_iter()
        .map(|c| (c.name.to_string(), c.sample_data))
        .collect();
    (size.0, size.1, channels)
}

fn floats(samples: &FlatSamples) -> Vec<u32> {
    match samples {
        FlatSamples::F32(values) => values.iter().map(|v| v.to_bits()).collect(),
        other => panic!("not FLOAT: {other:?}"),
    }
}

fn uints(samples: &FlatSamples) -> &[u32] {
    match samples {
        FlatSamples::U32(values) => values,
        other => panic!("not UINT: {other:?}"),
    }
}

fn assert_triple(
    channels: &BTreeMap<String, FlatSamples>,
    names: [&str; 3],
    expected: &[[f32; 3]],
) {
    for (i, name) in names.iter().enumerate() {
        let bits: Vec<u32> = expected.iter().map(|v| v[i].to_bits()).collect();
        assert_eq!(floats(&channels[*name]), bits, "{name}");
    }
}

fn assert_aovs(picture: &Picture, channels: &BTreeMap<String, FlatSamples>) {
    let axes = |l: &str| ["X", "Y", "Z"].map(|c| format!("{l}.{c}"));
    let [x, y, z] = &axes("position");
    assert_triple(channels, [x, y, z], picture.position.as_ref().unwrap());
    let [x, y, z] = &axes("normal");
    assert_triple(channels, [x, y, z], picture.normal.as_ref().unwrap());
    let albedo = picture.albedo.as_ref().unwrap();
    assert_triple(channels, ["albedo.R", "albedo.G", "albedo.B"], albedo);
    let depth = picture.depth.as_ref().unwrap();
    let depth: Vec<u32> = depth.iter().map(|z| z.to_bits()).collect();
    assert_eq!(floats(&channels["Z"]), depth);
    let ids: Vec<u64> = uints(&channels["instance_id.hi"])
        .iter()
        .zip(uints(&channels["instance_id.lo"]))
        .map(|(hi, lo)| u64::from(*hi) << 32 | u64::from(*lo))
        .collect();
    assert_eq!(&ids, picture.instance_id.as_ref().unwrap());
    assert_eq!(
        uints(&channels["primitive_id"]),
        picture.primitive_id.as_ref().unwrap()
    );
    assert_eq!(
        uints(&channels["samples"]),
        picture.samples.as_ref().unwrap()
    );
}

const SIZES: [(u32, u32); 6] = [(1, 1), (3, 1), (1, 5), (7, 3), (17, 33), (130, 67)];

#[test]
fn exr_keeps_every_bit() {
    let folder = tempfile::tempdir().unwrap();
    for (width, height) in SIZES {
        let picture = picture(width, height);
        let path = folder.path().join("x.exr");
        picture.save(&path).unwrap();
        let (w, h, channels) = exr_channels(&path);
        assert_eq!((w, h), (width as usize, height as usize));
        assert_eq!(channels.len(), 17);
        assert_triple(&channels, ["R", "G", "B"], &picture.color);
        assert_aovs(&picture, &channels);
    }
}

/// Names of layers and texts of the header are UTF-8 in the file, and come back.
#[test]
fn exr_has_texts_of_utf_8() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.exr");
    let mut picture = picture(2, 2);
    picture.layers.push(Layer {
        name: "light_Fläche_光".into(),
        color: vec![[0.5; 3]; 4],
    });
    picture.metadata = vec![("scene".into(), Attribute::Text("Würfel.toml".into()))];
    picture.save(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let has = |text: &str| bytes.windows(text.len()).any(|w| w == text.as_bytes());
    assert!(has("Würfel.toml") && has("light_Fläche_光.R"));
    let channels = crate::read_channels(&path).unwrap().channels;
    assert!(
        channels.contains_key("light_Fläche_光.R"),
        "{:?}",
        channels.keys()
    );
}

#[test]
fn png_has_its_aovs_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    for (width, height) in SIZES {
        let picture = picture(width, height);
        picture.save(&folder.path().join("x.PNG")).unwrap();
        let srgb = crate::SrgbEncoder::new();
        let png =
            image::load_from_memory(&std::fs::read(folder.path().join("x.PNG")).unwrap()).unwrap();
        assert_eq!(png.color(), image::ColorType::Rgb8);
        let png = png.into_rgb8();
        assert_eq!(png.dimensions(), (width, height));
        for (rgb, linear) in png.pixels().zip(&picture.color) {
            assert_eq!(rgb.0, linear.map(|c| srgb.encode(c)));
        }
        let (_, _, channels) = exr_channels(&folder.path().join("x.aov.exr"));
        assert_eq!(channels.len(), 14);
        assert_aovs(&picture, &channels);
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
}

#[test]
fn png_alone_without_aovs() {
    let folder = tempfile::tempdir().unwrap();
    let picture = Picture {
        width: 2,
        height: 1,
        color: vec![[0.0, 0.5, f32::NAN], [1.0, 2.0, -1.0]],
        ..Picture::default()
    };
    let path = folder.path().join("x.png");
    picture.save(&path).unwrap();
    let png = image::load_from_memory(&std::fs::read(&path).unwrap()).unwrap();
    assert_eq!(png.into_rgb8().into_raw(), [0, 188, 0, 255, 255, 0]);
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
}

#[test]
fn failures_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let fails = |picture: &Picture, name: &str, why: &str| {
        let said = picture.save(&folder.path().join(name)).unwrap_err();
        assert!(said.to_string().contains(why), "{said}");
    };
    let good = picture(4, 4);
    fails(&good, "x.bmp", "known are .png, .jpg, .hdr and .exr");
    fails(&good, "x", "known are .png, .jpg, .hdr and .exr");
    fails(&good, "missing/x.png", "create it first");
    // The second file cannot be written, so the first must not appear either.
    std::fs::create_dir(folder.path().join("x.aov.exr")).unwrap();
    fails(&good, "x.png", "a folder of that name");
    std::fs::remove_dir(folder.path().join("x.aov.exr")).unwrap();
    let mut short = good.clone();
    short.normal.as_mut().unwrap().pop();
    fails(&short, "x.png", "column normal has 15 rows for 16 pixels");
    fails(&Picture::default(), "x.exr", "no pixels");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
}

#[test]
fn alpha_is_premultiplied_in_exr_and_straight_in_png() {
    let folder = tempfile::tempdir().unwrap();
    let picture = Picture {
        width: 3,
        height: 1,
        color: vec![[0.25, 0.125, 0.0], [0.5, 0.5, 0.5], [3.0, 0.0, 0.0]],
        alpha: Some(vec![0.5, 1.0, 0.0]),
        ..Picture::default()
    };
    let exr = folder.path().join("x.exr");
    picture.save(&exr).unwrap();
    let (_, _, channels) = exr_channels(&exr);
    assert_triple(&channels, ["R", "G", "B"], &picture.color);
    assert_eq!(
        floats(&channels["A"]),
        [0.5_f32, 1.0, 0.0].map(f32::to_bits)
    );
    let png = folder.path().join("x.png");
    picture.save(&png).unwrap();
    let read = image::open(&png).unwrap();
    assert_eq!(read.color(), image::ColorType::Rgba8);
    let pixels = [[188, 137, 0, 128], [188, 188, 188, 255], [0, 0, 0, 0]];
    assert_eq!(read.into_rgba8().into_raw(), pixels.concat());
    let mut short = picture;
    short.alpha = Some(vec![]);
    let said = short.save(&png).unwrap_err().to_string();
    assert!(
        said.contains("column alpha has 0 rows for 3 pixels"),
        "{said}"
    );
}

#[test]
fn png_of_sixteen_bits_is_developed() {
    let folder = tempfile::tempdir().unwrap();
    let picture = Picture {
        width: 2,
        height: 1,
        color: vec![[0.25, f32::NAN, 9.0], [0.18; 3]],
        ..Picture::default()
    };
    let save = |development: Development| {
        let path = folder.path().join("x.png");
        let mut outputs = Outputs::default();
        picture
            .save_into(&path, &development, &mut outputs)
            .unwrap();
        outputs.commit().unwrap();
        image::open(&path).unwrap()
    };
    let fine = save(Development {
        bits: crate::Bits::Sixteen,
        exposure: 1.0,
        ..Development::default()
    });
    assert_eq!(fine.color(), image::ColorType::Rgb16);
    let half = (65535.0 * (1.055 * 0.5_f64.powf(1.0 / 2.4) - 0.055)).round() as u16;
    let pixels = fine.into_rgb16().into_raw();
    assert_eq!(pixels[..3], [half, 0, 65535]);
    let toned = save(Development {
        tone: crate::Tone::Agx,
        ..Development::default()
    });
    // Middle grey is half of the signal of a display of gamma 2.2, in sRGB 128.49.
    assert_eq!(toned.into_rgb8().into_raw()[3..], [128; 3]);
}
