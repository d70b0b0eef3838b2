//! Reader of environment maps: OpenEXR, Radiance HDR and PNG.
//!
//! OpenEXR and HDR files hold linear radiance, of which the channels R, G and B are read; PNG
//! files hold sRGB, which is decoded to radiance from 0 to 1. Alpha is not read. Values that are
//! no radiance (negative, NaN) become 0, and infinite ones 65,504, the largest number of half
//! precision in which most maps are stored; both are counted in the [`ImportReport`].

use crate::scene::Rgb;
use crate::shared::folder::read_file;
use crate::shared::messages::one_line;
use crate::shared::srgb::linear_from_srgb;
use crate::{ImportReport, LoadError};
use exr::prelude::{ReadChannels, ReadLayers, read};
use image::codecs::{hdr::HdrDecoder, png::PngDecoder};
use image::{DynamicImage, ImageDecoder};
use std::fmt::Display;
use std::io::Cursor;
use std::path::Path;

/// The endings of the names of environment maps.
pub(super) const MAP_FORMATS: &str = ".exr .hdr .png";

/// A map's rows from the top, as the file has them.
#[derive(Debug)]
pub(super) struct Map {
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<Rgb>,
}

/// The most pixels of a map: 16,384 × 8,192, which take 1.6 GB.
const MAX_PIXELS: u64 = 1 << 27;
/// A file may have that many pixels whatever its size, and so many more for each of its bytes:
/// compression does not make less of them.
const FREE_PIXELS: u64 = 1 << 20;
const PIXELS_A_BYTE: u64 = 1024;
const LARGEST_HALF: f32 = 65_504.0;

/// Whether a file name has one of the endings [`MAP_FORMATS`].
pub(super) fn names_map(path: &Path) -> bool {
    matches!(&*crate::extension(path), "exr" | "hdr" | "png")
}

/// Reads a map. Fails if the file cannot be read, is malformed, or is larger than the limits.
pub(super) fn read_map(path: &Path, report: &mut ImportReport) -> Result<Map, LoadError> {
    let bytes = read_file(path)?;
    let (format, map) = match &*crate::extension(path) {
        "exr" => ("OpenEXR", openexr(&bytes)),
        "hdr" => ("Radiance HDR", radiance(&bytes)),
        _ => ("PNG", png(&bytes)),
    };
    let mut map = map.map_err(|message| LoadError::Invalid {
        path: path.into(),
        place: format.into(),
        message,
    })?;
    let wrong = map.pixels.iter_mut().flatten().filter_map(|value| {
        let right = match *value {
            f32::INFINITY => LARGEST_HALF,
            // NaN fails the comparison.
            v if v >= 0.0 => return None,
            _ => 0.0,
        };
        *value = right;
        Some(())
    });
    let count = wrong.count();
    report.repair("value of an environment map that is no radiance", count);
    Ok(map)
}

/// Formats the error of a codec in one line.
pub(super) fn told(error: impl Display) -> String {
    one_line(&error.to_string())
}

/// Checks a size before anything of that size is allocated.
pub(super) fn check_size(width: u64, height: u64, bytes: usize) -> Result<(), String> {
    let pixels = width.saturating_mul(height);
    if pixels == 0 {
        return Err(format!("it has no pixels: {width} by {height}"));
    }
    if pixels > MAX_PIXELS {
        return Err(format!(
            "{width} by {height} pixels are too many; at most {MAX_PIXELS} are read: make it smaller"
        ));
    }
    if pixels > FREE_PIXELS + PIXELS_A_BYTE * bytes as u64 {
        return Err(format!(
            "{width} by {height} pixels are more than the size of the file justifies"
        ));
    }
    Ok(())
}

fn openexr(bytes: &[u8]) -> Result<Map, String> {
    let meta = exr::meta::MetaData::read_from_buffered(bytes, false).map_err(told)?;
    for header in &meta.headers {
        let size = header.layer_size;
        check_size(size.width() as u64, size.height() as u64, bytes.len())?;
    }
    let has_color = |header: &exr::meta::header::Header| {
        let channels = &header.channels.list;
        let has = |name: &str| {
            channels
                .iter()
                .any(|channel| channel.name.eq_case_insensitive(name))
        };
        ["R", "G", "B"].into_iter().all(has)
    };
    if !meta.headers.iter().any(has_color) {
        let all = meta.headers.iter().flat_map(|header| &header.channels.list);
        let names: Vec<String> = all
            .map(|channel| one_line(&channel.name.to_string()))
            .collect();
        return Err(format!(
            "an environment needs the channels R, G and B; the file has {}",
            names.join(", ")
        ));
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.width(), vec![[0.0; 3]; size.area()]),
            |(width, pixels): &mut (usize, Vec<Rgb>), at, (r, g, b): (f32, f32, f32)| {
                pixels[at.y() * *width + at.x()] = [r, g, b];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(told)?;
    let size = image.layer_data.size;
    Ok(Map {
        width: size.width() as u32,
        height: size.height() as u32,
        pixels: image.layer_data.channel_data.pixels.1,
    })
}

fn radiance(bytes: &[u8]) -> Result<Map, String> {
    if !bytes.starts_with(b"#?") {
        return Err("it does not begin with #?, as such files do".into());
    }
    let decoder = HdrDecoder::new_nonstrict(Cursor::new(bytes)).map_err(told)?;
    let exposure = decoder.metadata().exposure.unwrap_or(1.0);
    if !(exposure > 0.0 && exposure.is_finite()) {
        return Err(format!(
            "its exposure is {exposure}; it must be greater than 0"
        ));
    }
    let mut map = decoded(decoder, bytes, |image| image.into_rgb32f().into_raw())?;
    // The file's values were multiplied by its exposure.
    map.pixels = map
        .pixels
        .into_iter()
        .map(|pixel| pixel.map(|c| c / exposure))
        .collect();
    Ok(map)
}

fn png(bytes: &[u8]) -> Result<Map, String> {
    let decoder = PngDecoder::new(Cursor::new(bytes)).map_err(told)?;
    decoded(decoder, bytes, |image| {
        let color = image.color();
        if color.bytes_per_pixel() == color.channel_count() {
            let table = linear_table(255);
            let codes = image.into_rgb8().into_raw();
            codes.iter().map(|c| table[usize::from(*c)]).collect()
        } else {
            let table = linear_table(65_535);
            let codes = image.into_rgb16().into_raw();
            codes.iter().map(|c| table[usize::from(*c)]).collect()
        }
    })
}

/// Returns the linear values of all sRGB codes up to `highest`.
fn linear_table(highest: u32) -> Vec<f32> {
    (0..=highest)
        .map(|code| linear_from_srgb(f64::from(code) / f64::from(highest)) as f32)
        .collect()
}

/// Decodes a picture of the crate `image`, whose channels `linear` returns pixel by pixel.
fn decoded(
    decoder: impl ImageDecoder,
    bytes: &[u8],
    linear: impl FnOnce(DynamicImage) -> Vec<f32>,
) -> Result<Map, String> {
    let (width, height) = decoder.dimensions();
    check_size(u64::from(width), u64::from(height), bytes.len())?;
    let image = DynamicImage::from_decoder(decoder).map_err(told)?;
    let channels = linear(image);
    let (pixels, _) = channels.as_chunks::<3>();
    Ok(Map {
        width,
        height,
        pixels: pixels.to_vec(),
    })
}

#[cfg(test)]
mod tests;
