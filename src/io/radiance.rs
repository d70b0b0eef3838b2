//! Radiance HDR writer: linear radiance in 32 bits a pixel, without alpha; what is transparent lies
//! over black. Each pixel has one exponent, so the smaller channels keep fewer digits.

use crate::{Picture, SaveError};
use image::codecs::hdr::HdrEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::path::Path;

/// The largest number of the format: 255/256 of 2^127.
const LARGEST: f32 = 1.69e38;

/// Encodes a picture's colour; `path` is for messages only.
pub(super) fn encode(picture: &Picture, path: &Path) -> Result<Vec<u8>, SaveError> {
    // NaN fails the comparison.
    let kept = |c: f32| if c > 0.0 { c.min(LARGEST) } else { 0.0 };
    let channels = picture.color.iter().flatten();
    let samples: Vec<u8> = channels.flat_map(|c| kept(*c).to_ne_bytes()).collect();
    let mut bytes = Vec::new();
    HdrEncoder::new(&mut bytes)
        .write_image(
            &samples,
            picture.width,
            picture.height,
            ExtendedColorType::Rgb32F,
        )
        .map_err(|e| SaveError::Encode {
            path: path.into(),
            message: e.to_string(),
        })?;
    Ok(bytes)
}
