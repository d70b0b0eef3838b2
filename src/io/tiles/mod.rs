//! Reader and writer of tiles of pictures: all that a picture has in a rectangle of its pixels.
//!
//! `.tile` is "LTIL", then u32 version (1), the picture's width and height, the tile's x, y, width and
//! height, flags (1: dithered, 2: 16 bits a channel), the number of the tone curve, the exposure as
//! f64, 16 bytes key and u64 checksum (FNV-1a) of all other bytes after the magic number. The body has
//! u32 columns (a bit for each that is there) and the columns, row by row; layers; mattes; and
//! metadata. Numbers are little-endian without padding, texts and lists begin with their u32 length.
//!
//! Tiles of one key are tiles of one picture. Memory is allocated for what the file has bytes for.

mod columns;

use crate::exr_header::{Attribute, Metadata};
use crate::shared::checksum::fnv;
use crate::shared::folder::read_file;
use crate::{Bits, Development, Layer, LoadError, Matte, Outputs, Picture, SaveError, Tone};
use columns::{Cell, Place, each_column};
use std::collections::TryReserveError;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// A tile of a picture.
#[derive(Clone, Debug)]
pub struct PictureTile {
    pub header: TileHeader,
    /// Of the tile's size.
    pub picture: Picture,
}

/// What a tile is of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileHeader {
    /// Width and height of the whole picture.
    pub whole: (u32, u32),
    /// Position of the left upper pixel.
    pub corner: (u32, u32),
    pub size: (u32, u32),
    /// How PNG and JPEG files of the picture are developed; `behind` is not kept.
    pub development: Development,
    /// Stands for the scene and all settings that show in the picture.
    pub key: u128,
}

const MAGIC: [u8; 4] = *b"LTIL";
const VERSION: u32 = 1;
/// Bytes from the magic number to the key.
const FIELDS: usize = 9 * 4 + 8 + 16;
const HEADER: usize = 4 + FIELDS + 8;
/// As of `--size`.
const MAX_PIXELS: u64 = 1 << 28;

/// The layers that mattes have.
const MATTES: [&str; 3] = ["CryptoObject", "CryptoMaterial", "CryptoInstance"];

impl TileHeader {
    /// Returns the bytes of the header between the magic number and the checksum.
    fn fields(&self) -> Vec<u8> {
        let Development {
            tone, dither, bits, ..
        } = self.development;
        let tone = Tone::ALL.iter().position(|known| *known == tone);
        let words = [
            VERSION,
            self.whole.0,
            self.whole.1,
            self.corner.0,
            self.corner.1,
            self.size.0,
            self.size.1,
            u32::from(dither) | u32::from(bits == Bits::Sixteen) << 1,
            tone.unwrap_or_default() as u32,
        ];
        let mut bytes = Vec::with_capacity(FIELDS);
        words.into_iter().for_each(|word| word.put(&mut bytes));
        bytes.extend(self.development.exposure.to_le_bytes());
        bytes.extend(self.key.to_le_bytes());
        bytes
    }

    /// Reads the header of a `.tile` file; fails as [`PictureTile::load`] does.
    pub fn load(path: &Path) -> Result<TileHeader, LoadError> {
        let failed = |source| LoadError::Read {
            path: path.into(),
            source,
        };
        let about = std::fs::metadata(path).map_err(failed)?;
        let mut bytes = Vec::new();
        if about.is_file() {
            // Opening a pipe would wait for its writer.
            let file = File::open(path).map_err(failed)?;
            let read = file.take(HEADER as u64).read_to_end(&mut bytes);
            read.map_err(failed)?;
        }
        TileHeader::parsed(&bytes).map_err(|message| invalid(path, message))
    }

    /// Reads a header, whose checksum is not looked at.
    fn parsed(bytes: &[u8]) -> Result<TileHeader, &'static str> {
        let (Some(HEADER), true) = (
            bytes.get(..HEADER).map(<[u8]>::len),
            bytes.starts_with(&MAGIC),
        ) else {
            return Err("it is no tile of a picture, as render --tile writes it");
        };
        let mut body = Body(&bytes[4..HEADER]);
        let words = body.words::<9>().ok_or(DAMAGED)?;
        let [version, flags, tone] = [words[0], words[7], words[8]];
        if version != VERSION {
            return Err("it is of another version of the format; render it again");
        }
        let exposure = f64::from_bits(body.cell::<u64>().ok_or(DAMAGED)?);
        let [low, high] = [body.cell::<u64>(), body.cell::<u64>()];
        let key = u128::from(low.ok_or(DAMAGED)?) | u128::from(high.ok_or(DAMAGED)?) << 64;
        let header = TileHeader {
            whole: (words[1], words[2]),
            corner: (words[3], words[4]),
            size: (words[5], words[6]),
            development: Development {
                tone: *Tone::ALL.get(tone as usize).ok_or(DAMAGED)?,
                exposure,
                dither: flags & 1 != 0,
                bits: match flags & 2 {
                    0 => Bits::Eight,
                    _ => Bits::Sixteen,
                },
                behind: None,
            },
            key,
        };
        let end = |corner: u32, size: u32| u64::from(corner) + u64::from(size);
        let is_inside = end(words[3], words[5]) <= u64::from(words[1])
            && end(words[4], words[6]) <= u64::from(words[2]);
        let pixels = u64::from(words[1]) * u64::from(words[2]);
        let is_empty = words[5] == 0 || words[6] == 0;
        match is_inside && !is_empty && pixels <= MAX_PIXELS && flags <= 3 {
            true => Ok(header),
            false => Err(DAMAGED),
        }
    }
}

const DAMAGED: &str = "its content is not what was written; copy or render it again";

impl PictureTile {
    /// Adds the `.tile` file to `outputs`, which the caller commits.
    pub fn save_into(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SaveError> {
        let fields = self.header.fields();
        let body = body_of(&self.picture);
        let mut bytes = Vec::with_capacity(HEADER + body.len());
        bytes.extend(MAGIC);
        bytes.extend(&fields);
        bytes.extend(fnv(fields.iter().chain(&body)).to_le_bytes());
        bytes.extend(body);
        outputs.add(path, bytes)
    }

    /// Reads a `.tile` file.
    ///
    /// Fails if the file cannot be read, is no tile, is of another version or damaged.
    pub fn load(path: &Path) -> Result<PictureTile, LoadError> {
        let bytes = read_file(path)?;
        let header = TileHeader::parsed(&bytes).map_err(|message| invalid(path, message))?;
        let (fields, body) = (&bytes[4..4 + FIELDS], &bytes[HEADER..]);
        let picture =
            match fnv(fields.iter().chain(body)).to_le_bytes() == bytes[4 + FIELDS..HEADER] {
                true => Body(body).picture(header.size),
                false => None,
            };
        match picture {
            Some(picture) => Ok(PictureTile { header, picture }),
            None => Err(invalid(path, DAMAGED)),
        }
    }

    /// Copies the tile into the whole picture, which gets its columns by the first tile. Fails if
    /// memory does not suffice.
    pub fn put(&self, whole: &mut Picture) -> Result<(), TryReserveError> {
        (whole.width, whole.height) = self.header.whole;
        let place = Place {
            corner: self.header.corner,
            size: self.header.size,
            whole: self.header.whole,
        };
        place.put(&self.picture, whole)
    }
}

/// Writes a picture as the body of a file.
fn body_of(picture: &Picture) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut there = 0_u32;
    macro_rules! bit {
        ($bit:expr, $name:ident) => {
            there |= u32::from(picture.$name.is_some()) << $bit;
        };
    }
    each_column!(bit);
    there.put(&mut bytes);
    put_all(&picture.color, &mut bytes);
    macro_rules! column {
        ($bit:expr, $name:ident) => {
            put_all(picture.$name.as_deref().unwrap_or_default(), &mut bytes);
        };
    }
    each_column!(column);
    (picture.layers.len() as u32).put(&mut bytes);
    for layer in &picture.layers {
        put_text(&layer.name, &mut bytes);
        put_all(&layer.color, &mut bytes);
    }
    (picture.mattes.len() as u32).put(&mut bytes);
    for matte in &picture.mattes {
        put_text(matte.name, &mut bytes);
        matte.ranks.put(&mut bytes);
        put_all(&matte.rows, &mut bytes);
        (matte.manifest.len() as u32).put(&mut bytes);
        for (name, id) in &matte.manifest {
            put_text(name, &mut bytes);
            id.put(&mut bytes);
        }
    }
    (picture.metadata.len() as u32).put(&mut bytes);
    for (name, value) in &picture.metadata {
        put_text(name, &mut bytes);
        match value {
            Attribute::Text(text) => {
                0_u32.put(&mut bytes);
                put_text(text, &mut bytes);
            }
            Attribute::Int(x) => [1, *x as u32].iter().for_each(|x| x.put(&mut bytes)),
            Attribute::Float(x) => [2, x.to_bits()].iter().for_each(|x| x.put(&mut bytes)),
            Attribute::Double(x) => {
                3_u32.put(&mut bytes);
                x.to_bits().put(&mut bytes);
            }
            Attribute::Matrix(rows) => {
                4_u32.put(&mut bytes);
                put_all(rows, &mut bytes);
            }
        }
    }
    bytes
}

fn put_all<T: Cell>(cells: &[T], to: &mut Vec<u8>) {
    cells.iter().for_each(|cell| cell.put(to));
}

fn put_text(text: &str, to: &mut Vec<u8>) {
    (text.len() as u32).put(to);
    to.extend(text.as_bytes());
}

/// What is left of a body that is read; `None` comes of what is shorter than it says.
struct Body<'b>(&'b [u8]);

impl<'b> Body<'b> {
    fn bytes(&mut self, count: usize) -> Option<&'b [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn words<const N: usize>(&mut self) -> Option<[u32; N]> {
        let (words, []) = self.bytes(4 * N)?.as_chunks::<4>() else {
            return None;
        };
        Some(std::array::from_fn(|k| u32::from_le_bytes(words[k])))
    }

    fn cell<T: Cell>(&mut self) -> Option<T> {
        Some(self.cells(1)?[0])
    }

    fn cells<T: Cell>(&mut self, count: usize) -> Option<Vec<T>> {
        let bytes = self.bytes(count.checked_mul(4 * T::WORDS)?)?;
        let words: Vec<u32> = bytes
            .as_chunks::<4>()
            .0
            .iter()
            .map(|word| u32::from_le_bytes(*word))
            .collect();
        Some(words.chunks_exact(T::WORDS).map(T::get).collect())
    }

    fn text(&mut self) -> Option<String> {
        let len = self.cell::<u32>()? as usize;
        Some(std::str::from_utf8(self.bytes(len)?).ok()?.into())
    }

    /// Reads a picture of a size, which is all that is left.
    fn picture(mut self, (width, height): (u32, u32)) -> Option<Picture> {
        let pixels = width as usize * height as usize;
        let there = self.cell::<u32>()?;
        let mut picture = Picture {
            width,
            height,
            color: self.cells(pixels)?,
            ..Picture::default()
        };
        macro_rules! column {
            ($bit:expr, $name:ident) => {
                if there >> $bit & 1 != 0 {
                    picture.$name = Some(self.cells(pixels)?);
                }
            };
        }
        each_column!(column);
        for _ in 0..self.cell::<u32>()? {
            picture.layers.push(Layer {
                name: self.text()?,
                color: self.cells(pixels)?,
            });
        }
        for _ in 0..self.cell::<u32>()? {
            picture.mattes.push(self.matte(pixels)?);
        }
        picture.metadata = self.metadata()?;
        self.0.is_empty().then_some(picture)
    }

    fn matte(&mut self, pixels: usize) -> Option<Matte> {
        let name = self.text()?;
        let ranks = self.cell::<u32>()?;
        let mut matte = Matte {
            name: MATTES.iter().find(|known| **known == name)?,
            ranks,
            rows: self.cells(pixels.checked_mul(ranks as usize)?)?,
            manifest: Default::default(),
        };
        for _ in 0..self.cell::<u32>()? {
            let name = self.text()?;
            matte.manifest.insert(name, self.cell()?);
        }
        Some(matte)
    }

    fn metadata(&mut self) -> Option<Metadata> {
        let mut metadata = Metadata::new();
        for _ in 0..self.cell::<u32>()? {
            let name = self.text()?;
            let value = match self.cell::<u32>()? {
                0 => Attribute::Text(self.text()?),
                1 => Attribute::Int(self.cell::<u32>()? as i32),
                2 => Attribute::Float(self.cell()?),
                3 => Attribute::Double(f64::from_bits(self.cell()?)),
                4 => Attribute::Matrix(self.cells(16)?.try_into().ok()?),
                _ => return None,
            };
            metadata.push((name, value));
        }
        Some(metadata)
    }
}

fn invalid(path: &Path, message: &str) -> LoadError {
    LoadError::Invalid {
        path: path.into(),
        place: "tile".into(),
        message: message.into(),
    }
}

#[cfg(test)]
mod tests;
