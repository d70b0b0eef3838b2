//! Image files as textures: PNG, JPEG, WebP and KTX2, decoded within limits.

use super::images::{Budget, too_large};
use super::jpeg_end::check_end;
use crate::scene::{Texels, linear_from_srgb};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use std::ops::Range;

/// The longest side of a texture.
pub(super) const LONGEST: u32 = 32_768;

/// Bytes that a decoder may take beside the texels.
const BESIDE_TEXELS: u64 = 1 << 28;

/// What a KTX2 file begins with.
const KTX2: [u8; 12] = *b"\xABKTX 20\xBB\r\n\x1A\n";

/// What materials read of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImageUse {
    /// Colours, encoded by sRGB's curve; alpha is dropped, for it does not count.
    Color,
    /// Such colours, and the alpha that they are there by, unless it is 1 everywhere.
    ColorAndAlpha,
    /// Linear numbers, of which alpha may be one.
    Numbers,
    /// Alpha, or the first channel of an image that has none.
    Opacity,
}

impl ImageUse {
    /// Says whether colours are encoded by sRGB's curve.
    pub fn is_color(self) -> bool {
        matches!(self, ImageUse::Color | ImageUse::ColorAndAlpha)
    }
}

/// A decoded image: rows from the top, `channels` numbers a texel.
pub struct Decoded {
    pub texels: Texels,
    pub channels: u8,
    pub size: [u32; 2],
    /// Whether the file has an alpha that is not 1 everywhere.
    pub had_alpha: bool,
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
///
/// What the texels and their smaller levels will take is asked of the file's header and taken
/// from the budget before they are decoded, also of a file that turns out to be broken, so that the
/// time for any number of those is bounded, too.
pub fn decode(bytes: &[u8], used: ImageUse, budget: &mut Budget) -> Result<Decoded, String> {
    let (mut texels, channels, size) = match bytes.starts_with(&KTX2) {
        true => decode_ktx2(bytes, budget)?,
        false => decode_picture(bytes, budget)?,
    };
    let had_alpha = has_alpha(&texels, channels);
    let colors = channels - u8::from(channels.is_multiple_of(2));
    let kept = match (used, had_alpha) {
        (ImageUse::Opacity, true) => colors..channels,
        (ImageUse::Color, _) | (_, false) => 0..colors,
        _ => 0..channels,
    };
    keep(&mut texels, channels, kept.clone());
    let channels = kept.len() as u8;
    if let (true, Texels::Words(all)) = (used.is_color(), &mut texels) {
        linearise(all, channels);
    }
    Ok(Decoded {
        texels,
        channels,
        size,
        had_alpha,
    })
}

/// Decoded texels, their channels, and their size.
type Opened = (Texels, u8, [u32; 2]);

/// Decodes a KTX2 file.
#[cfg(feature = "ktx2")]
fn decode_ktx2(bytes: &[u8], budget: &mut Budget) -> Result<Opened, String> {
    let (texels, size) = super::ktx2::decode(bytes, budget)?;
    Ok((Texels::Bytes(texels), 4, size))
}

/// Refuses a KTX2 file.
#[cfg(not(feature = "ktx2"))]
fn decode_ktx2(_: &[u8], _: &mut Budget) -> Result<Opened, String> {
    Err("it is a KTX2 file; build Lanecast with --features ktx2 to read it".into())
}

/// Decodes a PNG, JPEG or WebP file.
fn decode_picture(bytes: &[u8], budget: &mut Budget) -> Result<Opened, String> {
    let format = match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP)) => format,
        _ => return Err("it is no PNG, JPEG, WebP or KTX2 file".into()),
    };
    if format == ImageFormat::Jpeg {
        check_end(bytes)?;
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(LONGEST);
    limits.max_image_height = Some(LONGEST);
    limits.max_alloc = Some(budget.left + BESIDE_TEXELS);
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| e.to_string())?;
    let size: [u32; 2] = decoder.dimensions().into();
    // Smaller levels are a third of the largest one.
    let takes = decoder.total_bytes().saturating_mul(4) / 3;
    let left = budget.left.checked_sub(takes);
    budget.left = left.ok_or_else(|| too_large(size, takes, budget))?;
    let picture = DynamicImage::from_decoder(decoder).map_err(|e| e.to_string())?;
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
    Ok((texels, channels, size))
}

/// Says whether texels have an alpha that is not 1 everywhere.
fn has_alpha(texels: &Texels, channels: u8) -> bool {
    fn varies<T: PartialEq>(all: &[T], per: usize, full: T) -> bool {
        let mut texels = all.chunks_exact(per);
        texels.any(|texel| texel[per - 1] != full)
    }
    let per = usize::from(channels);
    channels.is_multiple_of(2)
        && match texels {
            Texels::Bytes(all) => varies(all, per, u8::MAX),
            Texels::Words(all) => varies(all, per, u16::MAX),
        }
}

/// Keeps some channels of each texel, in place.
fn keep(texels: &mut Texels, channels: u8, kept: Range<u8>) {
    fn of<T>(all: &mut Vec<T>, channels: u8, kept: &Range<u8>) {
        let mut channel = channels - 1;
        all.retain(|_| {
            channel = (channel + 1) % channels;
            kept.contains(&channel)
        });
    }
    if kept.len() < usize::from(channels) {
        match texels {
            Texels::Bytes(all) => of(all, channels, &kept),
            Texels::Words(all) => of(all, channels, &kept),
        }
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
