//! Reader of pictures by channel: OpenEXR, Radiance HDR, PNG and JPEG.
//!
//! OpenEXR files give every channel of every part under its name, `part.channel` where there are
//! several parts; the others give `R`, `G`, `B`, and `A` if they have it. Numbers are those of the
//! file, NaN and infinity too: radiance from OpenEXR and HDR, codes from 0 to 1 from PNG and JPEG.

use crate::LoadError;
use crate::environment_map::{check_size, told};
use crate::exr_header::text_from;
use crate::shared::folder::read_file;
use crate::shared::jpeg_end::check_end;
use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};
use image::codecs::{hdr::HdrDecoder, jpeg::JpegDecoder, png::PngDecoder};
use image::{DynamicImage, ImageDecoder};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

/// A picture's columns by name, row-major, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelPicture {
    pub width: u32,
    pub height: u32,
    pub encoding: Encoding,
    pub channels: BTreeMap<String, Channel>,
}

/// What the numbers of a picture's colours mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Linear radiance, Rec. 709 primaries.
    Linear,
    /// sRGB codes from 0 to 1.
    Srgb,
}

/// One channel, one row a pixel.
#[derive(Clone, Debug, PartialEq)]
pub enum Channel {
    Numbers(Vec<f32>),
    /// Ids, which are alike or not, and have no distance.
    Ids(Vec<u32>),
}

/// The most numbers of a file that are read: 2 GB of them.
const MOST_NUMBERS: u64 = 1 << 29;

/// Decodes a file of one format; fails with what is wrong.
type Decode = fn(&[u8]) -> Result<ChannelPicture, String>;

/// Reads a picture. Fails if the file cannot be read, is malformed or of another format, or is
/// larger than the limits.
pub fn read_channels(path: &Path) -> Result<ChannelPicture, LoadError> {
    let extension = crate::extension(path);
    let (format, read): (&str, Decode) = match &*extension {
        "exr" => ("OpenEXR", openexr),
        "hdr" => ("Radiance HDR", radiance),
        "png" => ("PNG", png),
        "jpg" | "jpeg" => ("JPEG", jpeg),
        _ => {
            return Err(LoadError::Unsupported {
                path: path.into(),
                what: format!("the picture format '{extension}'"),
                remedy: Some("known are .exr, .hdr, .png and .jpg".into()),
            });
        }
    };
    let bytes = read_file(path)?;
    read(&bytes).map_err(|message| LoadError::Invalid {
        path: path.into(),
        place: format.into(),
        message,
    })
}

fn openexr(bytes: &[u8]) -> Result<ChannelPicture, String> {
    let meta = exr::meta::MetaData::read_from_buffered(bytes, false).map_err(told)?;
    let mut numbers = 0;
    for header in &meta.headers {
        let size = header.layer_size;
        check_size(size.width() as u64, size.height() as u64, bytes.len())?;
        numbers += size.area() as u64 * header.channels.list.len() as u64;
    }
    if numbers > MOST_NUMBERS {
        return Err(format!(
            "its channels have {numbers} numbers; at most {MOST_NUMBERS} are read: take fewer channels"
        ));
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(told)?;
    let size = image.layer_data.first().map(|layer| layer.size);
    let size = size.ok_or("it has no parts")?;
    let several = image.layer_data.len() > 1;
    let mut channels = BTreeMap::new();
    for layer in image.layer_data {
        if layer.size != size {
            return Err("its parts differ in size; take a file of one size".into());
        }
        let prefix = match layer.attributes.layer_name {
            Some(name) if several => format!("{}.", text_from(&name)),
            _ => String::new(),
        };
        for channel in layer.channel_data.list {
            let name = format!("{prefix}{}", text_from(&channel.name));
            let values = match channel.sample_data {
                FlatSamples::F16(values) => {
                    Channel::Numbers(values.iter().map(|x| x.to_f32()).collect())
                }
                FlatSamples::F32(values) => Channel::Numbers(values),
                FlatSamples::U32(values) => Channel::Ids(values),
            };
            channels.insert(name.clone(), matte_ids(&name, values));
        }
    }
    Ok(ChannelPicture {
        width: size.width() as u32,
        height: size.height() as u32,
        encoding: Encoding::Linear,
        channels,
    })
}

/// Takes the ids of a Cryptomatte's ranks for ids, though the file has them as numbers.
fn matte_ids(name: &str, values: Channel) -> Channel {
    let is_id = name.rsplit_once('.').is_some_and(|(layer, part)| {
        let digits = layer.bytes().rev().take_while(u8::is_ascii_digit).count();
        layer.contains("Crypto") && digits == 2 && matches!(part, "R" | "B")
    });
    match values {
        Channel::Numbers(numbers) if is_id => {
            Channel::Ids(numbers.iter().map(|x| x.to_bits()).collect())
        }
        values => values,
    }
}

fn radiance(bytes: &[u8]) -> Result<ChannelPicture, String> {
    let decoder = HdrDecoder::new_nonstrict(Cursor::new(bytes)).map_err(told)?;
    decoded(decoder, bytes, Encoding::Linear)
}

fn png(bytes: &[u8]) -> Result<ChannelPicture, String> {
    let decoder = PngDecoder::new(Cursor::new(bytes)).map_err(told)?;
    decoded(decoder, bytes, Encoding::Srgb)
}

fn jpeg(bytes: &[u8]) -> Result<ChannelPicture, String> {
    check_end(bytes)?;
    let decoder = JpegDecoder::new(Cursor::new(bytes)).map_err(told)?;
    decoded(decoder, bytes, Encoding::Srgb)
}

/// Decodes a picture of the crate `image`.
fn decoded(
    decoder: impl ImageDecoder,
    bytes: &[u8],
    encoding: Encoding,
) -> Result<ChannelPicture, String> {
    let (width, height) = decoder.dimensions();
    check_size(u64::from(width), u64::from(height), bytes.len())?;
    let image = DynamicImage::from_decoder(decoder).map_err(told)?;
    let has_alpha = image.color().has_alpha();
    let is_real = matches!(
        image,
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_)
    );
    let rows: Vec<f32> = match is_real {
        true => image.into_rgba32f().into_raw(),
        // Codes of 8 bits are 257 times as large among 16 bits, so that equal fractions are equal.
        false => {
            let codes = image.into_rgba16().into_raw().into_iter();
            codes.map(|code| f32::from(code) / 65_535.0).collect()
        }
    };
    let names: &[&str] = match has_alpha {
        true => &["R", "G", "B", "A"],
        false => &["R", "G", "B"],
    };
    let column = |k: usize| rows.iter().skip(k).step_by(4).copied().collect();
    let channels = names.iter().enumerate();
    let channels = channels.map(|(k, name)| (name.to_string(), Channel::Numbers(column(k))));
    Ok(ChannelPicture {
        width,
        height,
        encoding,
        channels: channels.collect(),
    })
}
