//! PNG writer: 8-bit sRGB, no alpha, top row first.

use crate::shared::srgb::SrgbEncoder;
use crate::{Picture, SaveError};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::path::Path;

/// Encodes a picture's colour; `path` is for messages only.
pub(super) fn encode(picture: &Picture, path: &Path) -> Result<Vec<u8>, SaveError> {
    let srgb = SrgbEncoder::new();
    let rgb: Vec<u8> = picture
        .color
        .iter()
        .flat_map(|rgb| rgb.map(|channel| srgb.encode(channel)))
        .collect();
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(&rgb, picture.width, picture.height, ExtendedColorType::Rgb8)
        .map_err(|e| SaveError::Encode {
            path: path.into(),
            message: e.to_string(),
        })?;
    Ok(bytes)
}
