//! Reader and writer of parts of pictures: the sums of some of each pixel's samples.
//!
//! `.sums` is "LSUM", then u32 version (1), width, height, first sample, end of the samples,
//! flags (1: the picture has alpha, 2: its radiance is that of paths), then 16 bytes key and
//! u64 checksum of the sums, then four f64 per pixel, row by row: the sums of red, green, blue
//! and coverage. All are little-endian without padding or trailing bytes.
//!
//! Parts of one key are parts of one picture. A header must match the size of the file before
//! memory is allocated.

use crate::shared::checksum::{eat, fnv};
use crate::shared::folder::open_file;
use crate::{LoadError, Outputs, SaveError};
use std::fs::File;
use std::io::{Error, ErrorKind, Read};
use std::ops::Range;
use std::path::Path;

/// A part of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    pub header: PartHeader,
    /// Sums of red, green, blue and coverage over the part's samples, row by row.
    pub sums: Vec<[f64; 4]>,
}

/// What a part is of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartHeader {
    pub width: u32,
    pub height: u32,
    /// The numbers of the samples of each pixel.
    pub samples: Range<u32>,
    /// Whether the picture has alpha.
    pub has_alpha: bool,
    /// Whether PNG files of the picture are developed as those of paths.
    pub is_radiance: bool,
    /// Stands for the scene and all settings that show in the picture.
    pub key: u128,
    /// [`fnv`] of the sums' bytes.
    checksum: u64,
}

const MAGIC: [u8; 4] = *b"LSUM";
const VERSION: u32 = 1;
const HEADER: usize = 4 + 6 * 4 + 16 + 8;
const PIXEL: usize = 4 * size_of::<f64>();
/// As of `--size`.
const MAX_PIXELS: u64 = 1 << 28;

impl PartHeader {
    /// Returns the bytes of the header between the magic number and the checksum.
    fn fields(&self) -> Vec<u8> {
        let words = [
            VERSION,
            self.width,
            self.height,
            self.samples.start,
            self.samples.end,
            u32::from(self.has_alpha) | u32::from(self.is_radiance) << 1,
        ];
        let words = words.iter().flat_map(|word| word.to_le_bytes());
        words.chain(self.key.to_le_bytes()).collect()
    }
}

impl Part {
    /// Makes a part; `sums` has a row per pixel.
    pub fn new(
        (width, height): (u32, u32),
        samples: Range<u32>,
        [has_alpha, is_radiance]: [bool; 2],
        key: u128,
        sums: Vec<[f64; 4]>,
    ) -> Part {
        let mut header = PartHeader {
            width,
            height,
            samples,
            has_alpha,
            is_radiance,
            key,
            checksum: 0,
        };
        let bytes = sums.iter().flatten().flat_map(|x| x.to_le_bytes());
        header.checksum = bytes.fold(fnv(&header.fields()), |sum, byte| eat(sum, &byte));
        Part { header, sums }
    }

    /// Adds the `.sums` file to `outputs`, which the caller commits.
    pub fn save_into(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SaveError> {
        let header = &self.header;
        let mut bytes = Vec::with_capacity(HEADER + self.sums.len() * PIXEL);
        bytes.extend(MAGIC);
        bytes.extend(header.fields());
        bytes.extend(header.checksum.to_le_bytes());
        bytes.extend(self.sums.iter().flatten().flat_map(|x| x.to_le_bytes()));
        outputs.add(path, bytes)
    }

    /// Reads a `.sums` file.
    ///
    /// Fails if the file cannot be read, is no part, is of another version or damaged, or if
    /// memory does not suffice.
    pub fn load(path: &Path) -> Result<Part, LoadError> {
        let (header, mut file) = open(path)?;
        let failed = |source| LoadError::Read {
            path: path.into(),
            source,
        };
        let pixels = header.width as usize * header.height as usize;
        let out_of_memory = || failed(Error::from(ErrorKind::OutOfMemory));
        let mut sums: Vec<[f64; 4]> = Vec::new();
        sums.try_reserve_exact(pixels)
            .map_err(|_| out_of_memory())?;
        let mut row = vec![0; header.width as usize * PIXEL];
        let mut checksum = fnv(&header.fields());
        for _ in 0..header.height {
            file.read_exact(&mut row).map_err(failed)?;
            checksum = row.iter().fold(checksum, eat);
            sums.extend(row.chunks_exact(PIXEL).map(|pixel| {
                let mut numbers = pixel.chunks_exact(8);
                std::array::from_fn(|_| number(numbers.next().unwrap_or_default()))
            }));
        }
        if checksum != header.checksum {
            return Err(invalid(
                path,
                "its content is not what was written; copy or render it again",
            ));
        }
        Ok(Part { header, sums })
    }
}

impl PartHeader {
    /// Reads the header of a `.sums` file; fails as [`Part::load`] does.
    pub fn load(path: &Path) -> Result<PartHeader, LoadError> {
        Ok(open(path)?.0)
    }
}

/// Opens a file and reads its header, which tells the file's size.
fn open(path: &Path) -> Result<(PartHeader, File), LoadError> {
    let failed = |source| LoadError::Read {
        path: path.into(),
        source,
    };
    let (mut file, bytes_of_file) = open_file(path)?;
    let mut bytes = [0; HEADER];
    if bytes_of_file < HEADER as u64 {
        let message = "it is too short for a part of a picture, as render --samples writes it";
        return Err(invalid(path, message));
    }
    file.read_exact(&mut bytes).map_err(failed)?;
    if bytes[..4] != MAGIC {
        let message = "it is no part of a picture, as render --samples writes it";
        return Err(invalid(path, message));
    }
    let word = |k: usize| u32::from_le_bytes(std::array::from_fn(|i| bytes[4 + 4 * k + i]));
    if word(0) != VERSION {
        return Err(invalid(
            path,
            &format!(
                "its format has version {}, and this program reads {VERSION}; render it again",
                word(0)
            ),
        ));
    }
    let header = PartHeader {
        width: word(1),
        height: word(2),
        samples: word(3)..word(4),
        has_alpha: word(5) & 1 != 0,
        is_radiance: word(5) & 2 != 0,
        key: u128::from_le_bytes(std::array::from_fn(|i| bytes[28 + i])),
        checksum: u64::from_le_bytes(std::array::from_fn(|i| bytes[44 + i])),
    };
    let pixels = u64::from(header.width) * u64::from(header.height);
    if pixels == 0 || pixels > MAX_PIXELS || header.samples.is_empty() || word(5) > 3 {
        return Err(invalid(path, "its header is damaged; render it again"));
    }
    let size = HEADER as u64 + pixels * PIXEL as u64;
    if bytes_of_file != size {
        return Err(invalid(
            path,
            &format!(
                "it has {} bytes, but {}x{} pixels take {size}; copy or render it again",
                bytes_of_file, header.width, header.height
            ),
        ));
    }
    Ok((header, file))
}

fn invalid(path: &Path, message: &str) -> LoadError {
    LoadError::Invalid {
        path: path.into(),
        place: "part".into(),
        message: message.into(),
    }
}

fn number(bytes: &[u8]) -> f64 {
    f64::from_le_bytes(bytes.try_into().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part() -> Part {
        let sums = (0..6).map(|i| [f64::from(i), -0.0, f64::INFINITY, 1e-300]);
        Part::new((3, 2), 64..128, [true, false], 7 << 100 | 5, sums.collect())
    }

    fn written(part: &Part, folder: &Path) -> Vec<u8> {
        let path = folder.join("x.sums");
        let mut outputs = Outputs::default();
        part.save_into(&path, &mut outputs).unwrap();
        outputs.commit().unwrap();
        std::fs::read(path).unwrap()
    }

    #[test]
    fn every_bit_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let bytes = written(&part(), folder.path());
        assert_eq!(bytes.len(), HEADER + 6 * PIXEL);
        let path = folder.path().join("x.sums");
        assert_eq!(Part::load(&path).unwrap(), part());
        assert_eq!(PartHeader::load(&path).unwrap(), part().header);
    }

    #[test]
    fn damage_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let good = written(&part(), folder.path());
        let path = folder.path().join("y.sums");
        let said = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            Part::load(&path).unwrap_err().to_string()
        };
        let changed = |at: usize, to: u8| {
            let mut bytes = good.clone();
            bytes[at] = to;
            said(&bytes)
        };
        assert!(said(&[]).contains("too short"));
        assert!(said(&good[..good.len() - 1]).contains("243 bytes"));
        assert!(changed(0, b'X').contains("no part of a picture"));
        assert!(changed(4, 2).contains("version 2"));
        // A width that would take terabytes is compared with the file first.
        assert!(changed(11, 0x7f).contains("damaged"));
        assert!(changed(8, 4).contains("4x2"));
        assert!(changed(20, 0).contains("damaged"));
        // Other samples of as good a range, and a sum.
        assert!(changed(16, 0).contains("not what was written"));
        assert!(changed(24, 0).contains("not what was written"));
        assert!(changed(HEADER + 3, 1).contains("not what was written"));
        assert!(Part::load(folder.path()).is_err());
    }
}
