//! Tests of maps that are written here and read back, whole and cut off.

use super::*;
use crate::Picture;
use image::codecs::hdr::HdrEncoder;
use std::path::PathBuf;

/// A map of 4 × 2 pixels that differ, whose values Radiance HDR holds exactly.
fn pixels() -> Vec<Rgb> {
    (0..8).map(|i| [i as f32, 0.5 * i as f32, 32.0]).collect()
}

fn load(path: &Path) -> Result<(Map, Option<String>), String> {
    let mut report = ImportReport::default();
    let map = read_map(path, &mut report).map_err(|e| e.to_string())?;
    Ok((map, report.summary()))
}

fn in_folder<T>(name: &str, bytes: &[u8], f: impl FnOnce(PathBuf) -> T) -> T {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    f(path)
}

fn exr_bytes(color: Vec<Rgb>) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.exr");
    let picture = Picture {
        width: 4,
        height: 2,
        color,
        ..Picture::default()
    };
    picture.save(&path).unwrap();
    std::fs::read(&path).unwrap()
}

fn hdr_bytes() -> Vec<u8> {
    let mut bytes = Vec::new();
    let pixels: Vec<image::Rgb<f32>> = pixels().into_iter().map(image::Rgb).collect();
    HdrEncoder::new(&mut bytes).encode(&pixels, 4, 2).unwrap();
    bytes
}

#[test]
fn maps_come_back() {
    for (name, bytes) in [("x.exr", exr_bytes(pixels())), ("x.HDR", hdr_bytes())] {
        let (map, told) = in_folder(name, &bytes, |path| load(&path)).unwrap();
        assert_eq!((map.width, map.height), (4, 2));
        assert_eq!(map.pixels, pixels(), "{name}");
        assert_eq!(told, None);
    }
}

#[test]
fn the_exposure_of_a_file_is_taken_out() {
    let text = String::from_utf8_lossy(&hdr_bytes()[..10]).into_owned();
    assert_eq!(text, "#?RADIANCE");
    let mut bytes = b"#?RGBE\nEXPOSURE=4\nEXPOSURE=0.5\n".to_vec();
    let rest = hdr_bytes();
    let head = rest.windows(2).position(|w| w == b"\n\n").unwrap();
    bytes.extend(b"FORMAT=32-bit_rle_rgbe");
    bytes.extend(&rest[head..]);
    let (map, _) = in_folder("x.hdr", &bytes, |path| load(&path)).unwrap();
    assert_eq!(map.pixels[3], [1.5, 0.75, 16.0]);
}

#[test]
fn png_is_decoded_to_linear() {
    for sixteen in [false, true] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.png");
        if sixteen {
            let row = vec![0_u16, 32_896, 65_535];
            let image = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(3, 1, row).unwrap();
            image.save(&path).unwrap();
        } else {
            image::GrayImage::from_raw(3, 1, vec![0, 128, 255])
                .unwrap()
                .save(&path)
                .unwrap();
        }
        let (map, _) = load(&path).unwrap();
        let half = linear_from_srgb(128.0 / 255.0) as f32;
        assert_eq!(map.pixels, [[0.0; 3], [half; 3], [1.0; 3]]);
    }
}

#[test]
fn what_is_no_radiance_is_repaired_and_counted() {
    let mut color = pixels();
    color[1] = [f32::NAN, -2.0, f32::INFINITY];
    let bytes = exr_bytes(color);
    let (map, told) = in_folder("x.exr", &bytes, |path| load(&path)).unwrap();
    assert_eq!(map.pixels[1], [0.0, 0.0, 65_504.0]);
    assert_eq!(
        told.unwrap(),
        "repaired: 3 × value of an environment map that is no radiance"
    );
}

#[test]
fn every_truncation_is_an_error() {
    let png = {
        let mut bytes = Cursor::new(Vec::new());
        let image = DynamicImage::ImageRgb8(image::RgbImage::from_raw(2, 2, vec![7; 12]).unwrap());
        image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    };
    for (name, whole) in [
        ("x.exr", exr_bytes(pixels())),
        ("x.hdr", hdr_bytes()),
        ("x.png", png),
    ] {
        // The last chunk of a PNG has no pixels.
        let least = if name == "x.png" {
            whole.len() - 12
        } else {
            whole.len()
        };
        for end in 0..least {
            let loaded = in_folder(name, &whole[..end], |path| load(&path));
            assert!(loaded.is_err(), "{name} {end} of {}", whole.len());
        }
        // Bytes that are wrong may be read, but nothing panics.
        for at in 0..whole.len() {
            for bit in [0, 3, 7] {
                let mut bytes = whole.clone();
                bytes[at] ^= 1 << bit;
                let _ = in_folder(name, &bytes, |path| load(&path));
            }
        }
    }
}

#[test]
fn sizes_are_checked_before_anything_is_allocated() {
    let huge = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 100000 +X 100000\n";
    let said = in_folder("x.hdr", huge, |path| load(&path)).unwrap_err();
    assert!(
        said.contains("100000 by 100000 pixels are too many"),
        "{said}"
    );
    let large = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4096 +X 8192\n";
    let said = in_folder("x.hdr", large, |path| load(&path)).unwrap_err();
    assert!(
        said.contains("more than the size of the file justifies"),
        "{said}"
    );
    let none = b"#?RADIANCE\n\n-Y 0 +X 8\n";
    let said = in_folder("x.hdr", none, |path| load(&path)).unwrap_err();
    assert!(said.contains("no pixels"), "{said}");
    let said = in_folder("x.hdr", b"P6", |path| load(&path)).unwrap_err();
    assert!(
        said.contains("Radiance HDR: it does not begin with #?"),
        "{said}"
    );
}
