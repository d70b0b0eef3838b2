//! PNG writer: 8 or 16 bits, sRGB, top row first, with straight alpha if the picture has any.
//!
//! Colour is premultiplied in a picture and straight in the file, as PNG asks for: it is divided
//! by alpha, and then developed. Where alpha is 0 the file is black, and light that a pixel has
//! without covering anything, such as a glow, is lost. Alpha is linear and not dithered. A
//! picture that is laid over a colour ([`Development::behind`]) has no alpha in the file.

use crate::shared::srgb::SrgbEncoder;
use crate::{Bits, Development, Picture, SaveError};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::path::Path;

/// Develops and encodes a picture's colour; `path` is for messages only.
pub fn encode(
    picture: &Picture,
    development: &Development,
    path: &Path,
) -> Result<Vec<u8>, SaveError> {
    let has_alpha = picture.alpha.is_some() && development.behind.is_none();
    let (samples, kind) = match (development.bits, has_alpha) {
        (Bits::Eight, false) if development.is_plain() => (plain(picture), ExtendedColorType::Rgb8),
        (Bits::Eight, false) => (low(picture, development), ExtendedColorType::Rgb8),
        (Bits::Eight, true) => (low(picture, development), ExtendedColorType::Rgba8),
        (Bits::Sixteen, false) => (high(picture, development), ExtendedColorType::Rgb16),
        (Bits::Sixteen, true) => (high(picture, development), ExtendedColorType::Rgba16),
    };
    written(&samples, (picture.width, picture.height), kind, path)
}

/// Encodes numbers, one a pixel and row by row, as grey of 16 bits: no colour, and no curve.
pub fn numbers(
    width: u32,
    height: u32,
    numbers: &[u16],
    path: &Path,
) -> Result<Vec<u8>, SaveError> {
    let samples: Vec<u8> = numbers.iter().flat_map(|n| n.to_ne_bytes()).collect();
    written(&samples, (width, height), ExtendedColorType::L16, path)
}

/// Encodes numbers, three a pixel and row by row, as channels of 16 bits without a curve.
pub fn triples(
    width: u32,
    height: u32,
    triples: &[[u16; 3]],
    path: &Path,
) -> Result<Vec<u8>, SaveError> {
    let samples = triples.iter().flatten();
    let samples: Vec<u8> = samples.flat_map(|n| n.to_ne_bytes()).collect();
    written(&samples, (width, height), ExtendedColorType::Rgb16, path)
}

/// Encodes a mask as grey of 8 bits: 255 where it holds, else 0.
pub fn mask(width: u32, height: u32, mask: &[bool], path: &Path) -> Result<Vec<u8>, SaveError> {
    let samples: Vec<u8> = mask.iter().map(|is| if *is { 255 } else { 0 }).collect();
    written(&samples, (width, height), ExtendedColorType::L8, path)
}

fn written(
    samples: &[u8],
    (width, height): (u32, u32),
    kind: ExtendedColorType,
    path: &Path,
) -> Result<Vec<u8>, SaveError> {
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new(&mut bytes);
    let encoded = encoder.write_image(samples, width, height, kind);
    encoded.map_err(|e| SaveError::Encode {
        path: path.into(),
        message: e.to_string(),
    })?;
    Ok(bytes)
}

/// Encodes by the table of borders, without alpha.
fn plain(picture: &Picture) -> Vec<u8> {
    let srgb = SrgbEncoder::new();
    let pixels = picture.color.iter();
    pixels
        .flat_map(|rgb| rgb.map(|channel| srgb.encode(channel)))
        .collect()
}

pub(super) fn low(picture: &Picture, development: &Development) -> Vec<u8> {
    let mut samples = Vec::with_capacity(picture.color.len() * 4);
    each_sample(picture, development, |code| samples.push(code as u8));
    samples
}

/// Returns samples in the machine's order of bytes, which the encoder turns to PNG's.
fn high(picture: &Picture, development: &Development) -> Vec<u8> {
    let mut samples = Vec::with_capacity(picture.color.len() * 8);
    each_sample(picture, development, |code| {
        samples.extend(code.to_ne_bytes())
    });
    samples
}

/// Gives every sample of the file in turn: the channels of a pixel, then its alpha.
fn each_sample(picture: &Picture, development: &Development, mut put: impl FnMut(u16)) {
    let develop = development.developer();
    for (i, color) in picture.color.iter().enumerate() {
        let alpha = picture.alpha.as_ref().map(|alpha| alpha[i]);
        let straight = match alpha {
            None => *color,
            // NaN counts as 0.
            Some(alpha) if alpha > 0.0 => color.map(|c| c / alpha),
            Some(_) => [0.0; 3],
        };
        let (x, y) = (i as u32 % picture.width, i as u32 / picture.width);
        let codes = match (alpha, development.behind) {
            (Some(alpha), Some(behind)) => develop.codes_over(straight, alpha, behind, x, y),
            _ => develop.codes(straight, x, y),
        };
        for code in codes {
            put(code);
        }
        if let (Some(alpha), None) = (alpha, development.behind) {
            let highest = development.bits.highest();
            put((f64::from(alpha) * f64::from(highest) + 0.5).min(f64::from(highest)) as u16);
        }
    }
}
