//! JPEG writer: 8 bits, sRGB, without alpha; what is transparent lies over black.

use crate::png::low;
use crate::{Bits, Development, Picture, SaveError};
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::path::Path;

/// Artefacts are seen at less, and files grow fast with more.
const QUALITY: u8 = 95;

/// The longest side that the format can tell.
const LONGEST: u32 = 65_535;

/// Develops and encodes a picture's colour; `path` is for messages only.
pub(super) fn encode(
    picture: &Picture,
    development: &Development,
    path: &Path,
) -> Result<Vec<u8>, SaveError> {
    let failed = |message: String| SaveError::Encode {
        path: path.into(),
        message,
    };
    let (width, height) = (picture.width, picture.height);
    if width.max(height) > LONGEST {
        return Err(failed(format!(
            "JPEG has at most {LONGEST} pixels on a side; name a .png or .exr"
        )));
    }
    // What is transparent lies over black, if over no other colour.
    let behind = development.behind.unwrap_or([0.0; 3]);
    let development = Development {
        bits: Bits::Eight,
        behind: picture.alpha.as_ref().map(|_| behind),
        ..*development
    };
    let samples = low(picture, &development);
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, QUALITY)
        .write_image(&samples, width, height, ExtendedColorType::Rgb8)
        .map_err(|e| failed(e.to_string()))?;
    Ok(bytes)
}
