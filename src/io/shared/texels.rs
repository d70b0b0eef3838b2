//! Image files as textures: PNG, JPEG and WebP, decoded within limits.

use crate::scene::{Texels, linear_from_srgb};
use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use std::io::Cursor;

/// The longest side of a texture, and the bytes that decoding one may take.
const LONGEST: u32 = 32_768;
const MOST_BYTES: u64 = 1 << 31;

/// A decoded image: rows from the top, `channels` numbers a texel.
pub struct Decoded {
    pub texels: Texels,
    pub channels: u8,
    pub size: [u32; 2],
}

impl Decoded {
    /// Says whether texels have an alpha that is not 1 everywhere.
    pub fn has_alpha(&self) -> bool {
        self.channels.is_multiple_of(2)
    }
}

/// Returns the map of texture coordinates that scales, turns by radians and moves them
/// (KHR_texture_transform); v counts downwards, so that a turn is counter-clockwise.
pub fn texture_transform([su, sv]: [f64; 2], turn: f64, offset: [f64; 2]) -> [[f64; 3]; 2] {
    let (sin, cos) = (libm::sin(turn), libm::cos(turn));
    [
        [cos * su, sin * sv, offset[0]],
        [-sin * su, cos * sv, offset[1]],
    ]
}

/// Decodes the bytes of an image file, whose kind its first bytes tell. The codes of 8 bits stay
/// as they are; 16 bits of an sRGB image become linear. Fails with what is wrong.
pub fn decode(bytes: &[u8], is_srgb: bool) -> Result<Decoded, String> {
    let format = match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP)) => format,
        _ => return Err("it is no PNG, JPEG or WebP file".into()),
    };
    let mut limits = Limits::default();
    limits.max_image_width = Some(LONGEST);
    limits.max_image_height = Some(LONGEST);
    limits.max_alloc = Some(MOST_BYTES);
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| e.to_string())?;
    let size = [picture.width(), picture.height()];
    let (texels, channels) = match picture {
        DynamicImage::ImageLuma8(it) => (Texels::Bytes(it.into_raw()), 1),
        DynamicImage::ImageLumaA8(it) => (Texels::Bytes(it.into_raw()), 2),
        DynamicImage::ImageRgb8(it) => (Texels::Bytes(it.into_raw()), 3),
        DynamicImage::ImageRgba8(it) => (Texels::Bytes(it.into_raw()), 4),
        DynamicImage::ImageLuma16(it) => (Texels::Words(it.into_raw()), 1),
        DynamicImage::ImageLumaA16(it) => (Texels::Words(it.into_raw()), 2),
        DynamicImage::ImageRgb16(it) => (Texels::Words(it.into_raw()), 3),
        DynamicImage::ImageRgba16(it) => (Texels::Words(it.into_raw()), 4),
        other => (Texels::Bytes(other.into_rgba8().into_raw()), 4),
    };
    let (mut texels, channels) = without_opaque(texels, channels);
    if let (true, Texels::Words(all)) = (is_srgb, &mut texels) {
        linearise(all, channels);
    }
    Ok(Decoded {
        texels,
        channels,
        size,
    })
}

/// Drops an alpha that is 1 everywhere.
fn without_opaque(texels: Texels, channels: u8) -> (Texels, u8) {
    fn dropped<T: Copy + PartialEq>(all: Vec<T>, per: usize, full: T) -> Result<Vec<T>, Vec<T>> {
        if !all.chunks_exact(per).all(|texel| texel[per - 1] == full) {
            return Err(all);
        }
        let mut kept = all;
        let mut place = 0;
        kept.retain(|_| {
            place += 1;
            place % per != 0
        });
        kept.shrink_to_fit();
        Ok(kept)
    }
    if !channels.is_multiple_of(2) {
        return (texels, channels);
    }
    let per = usize::from(channels);
    match texels {
        Texels::Bytes(all) => match dropped(all, per, u8::MAX) {
            Ok(all) => (Texels::Bytes(all), channels - 1),
            Err(all) => (Texels::Bytes(all), channels),
        },
        Texels::Words(all) => match dropped(all, per, u16::MAX) {
            Ok(all) => (Texels::Words(all), channels - 1),
            Err(all) => (Texels::Words(all), channels),
        },
    }
}

/// Turns codes of sRGB into linear ones, alpha aside.
fn linearise(all: &mut [u16], channels: u8) {
    let table: Vec<u16> = (0..=u16::MAX)
        .map(|code| (linear_from_srgb(f64::from(code) / 65_535.0) * 65_535.0 + 0.5) as u16)
        .collect();
    let colors = usize::from(channels - u8::from(channels.is_multiple_of(2)));
    for texel in all.chunks_exact_mut(usize::from(channels)) {
        for code in &mut texel[..colors] {
            *code = table[usize::from(*code)];
        }
    }
}
