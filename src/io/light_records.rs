//! Reader and writer of records of indirect light, which `render --cache-file` keeps.
//!
//! A file is "LIRR", u32 version (1), then what the records are of: u64 key of the program, u128 key
//! of the scene, f64 error, u64 seed, u32 depth, u128 key of the precision and u128 key of what lies
//! around the camera; then u32 number of records and u64 checksum of all but "LIRR" and itself; then
//! [`NUMBERS`] f64 per record. All are little-endian without padding or trailing bytes.
//!
//! A header must match the size of the file before memory is allocated, and every number is finite.

use crate::shared::checksum::{eat, fnv};
use crate::shared::folder::open_file;
use crate::{LoadError, Outputs, SaveError};
use std::fs::File;
use std::io::{Error, ErrorKind, Read};
use std::path::Path;

/// Numbers of a record.
pub const NUMBERS: usize = 59;

/// Records of indirect light, as numbers whose meaning the renderer knows.
#[derive(Clone, Debug, PartialEq)]
pub struct LightRecords {
    pub of: RecordsOf,
    pub rows: Vec<[f64; NUMBERS]>,
}

/// What the light of records depends on. Keys are hashes, which tell things apart and nothing else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordsOf {
    pub program: u64,
    pub scene: u128,
    pub error: f64,
    pub seed: u64,
    pub max_depth: u32,
    pub precision: u128,
    pub around: u128,
}

const MAGIC: [u8; 4] = *b"LIRR";
const VERSION: u32 = 1;
const HEADER: usize = 4 + 4 + 8 + 16 + 8 + 8 + 4 + 16 + 16 + 4 + 8;
const RECORD: usize = NUMBERS * size_of::<f64>();

/// So many records take 7.9 GB, and numbers of records fit 32 bits with room to spare.
const MOST_RECORDS: u32 = 1 << 24;

impl RecordsOf {
    /// Names the first thing in which records of a file are others than those that are asked for, if
    /// there is one. What lies around the camera is left to the renderer.
    fn difference(&self, asked: &RecordsOf) -> Option<String> {
        let option = |name: &str, is: &dyn std::fmt::Display, asked: &dyn std::fmt::Display| {
            Some(format!("its records are of {name} {is}, not {asked}"))
        };
        if self.program != asked.program {
            return Some("another version of this program wrote it".into());
        }
        if self.scene != asked.scene {
            return Some("its records are of another scene, or of this one before a change".into());
        }
        if self.error != asked.error {
            return option("--cache-error", &self.error, &asked.error);
        }
        if self.max_depth != asked.max_depth {
            return option("--max-bounces", &self.max_depth, &asked.max_depth);
        }
        if self.seed != asked.seed {
            return option("--seed", &self.seed, &asked.seed);
        }
        let other = "its records are of another --precision, or in fast of other --lanes, --accel, \
                     --build or --solver";
        (self.precision != asked.precision).then(|| other.into())
    }

    /// Returns the bytes of a header between the magic number and the checksum.
    fn fields(&self, count: u32) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(self.program.to_le_bytes());
        bytes.extend(self.scene.to_le_bytes());
        bytes.extend(self.error.to_le_bytes());
        bytes.extend(self.seed.to_le_bytes());
        bytes.extend(self.max_depth.to_le_bytes());
        bytes.extend(self.precision.to_le_bytes());
        bytes.extend(self.around.to_le_bytes());
        bytes.extend(count.to_le_bytes());
        bytes
    }
}

impl LightRecords {
    /// Adds the file to `outputs`, which the caller commits. Fails if it cannot be written, or if there
    /// are too many records for a file.
    pub fn save_into(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SaveError> {
        let count = u32::try_from(self.rows.len()).ok();
        let Some(count) = count.filter(|count| *count <= MOST_RECORDS) else {
            return Err(SaveError::Encode {
                path: path.into(),
                message: format!("a file holds at most {MOST_RECORDS} records of light"),
            });
        };
        let fields = self.of.fields(count);
        let numbers = || self.rows.iter().flatten().flat_map(|x| x.to_le_bytes());
        let checksum = numbers().fold(fnv(&fields), |sum, byte| eat(sum, &byte));
        let mut bytes = Vec::with_capacity(HEADER + self.rows.len() * RECORD);
        bytes.extend(MAGIC);
        bytes.extend(fields);
        bytes.extend(checksum.to_le_bytes());
        bytes.extend(numbers());
        outputs.add(path, bytes)
    }

    /// Reads a file, whose records are to be of what is asked for but for what lies around the camera.
    ///
    /// Fails if the file cannot be read, holds no records of light, is of another version, is damaged or
    /// is of something else, or if memory does not suffice.
    pub fn load(path: &Path, asked: &RecordsOf) -> Result<LightRecords, LoadError> {
        let failed = |source| LoadError::Read {
            path: path.into(),
            source,
        };
        let (of, count, checksum, mut file) = open(path)?;
        let mut rows: Vec<[f64; NUMBERS]> = Vec::new();
        rows.try_reserve_exact(count as usize)
            .map_err(|_| failed(Error::from(ErrorKind::OutOfMemory)))?;
        let mut row = [0; RECORD];
        let mut sum = fnv(&of.fields(count));
        for _ in 0..count {
            file.read_exact(&mut row).map_err(failed)?;
            sum = row.iter().fold(sum, eat);
            let mut numbers = row.chunks_exact(8).map(|bytes| number(bytes, 0));
            rows.push(std::array::from_fn(|_| {
                f64::from_le_bytes(numbers.next().unwrap_or_default())
            }));
        }
        if sum != checksum || !rows.as_flattened().iter().all(|x| x.is_finite()) {
            return Err(unfit(path, "its content is not what was written"));
        }
        match of.difference(asked) {
            Some(what) => Err(unfit(path, &what)),
            None => Ok(LightRecords { of, rows }),
        }
    }
}

/// Opens a file and reads its header, which tells the file's size. Returns what its records are of,
/// their number and the checksum.
fn open(path: &Path) -> Result<(RecordsOf, u32, u64, File), LoadError> {
    let failed = |source| LoadError::Read {
        path: path.into(),
        source,
    };
    let (mut file, bytes_of_file) = open_file(path)?;
    let mut header = [0; HEADER];
    let is_short = bytes_of_file < HEADER as u64;
    if !is_short {
        file.read_exact(&mut header).map_err(failed)?;
    }
    if is_short || header[..4] != MAGIC {
        let message = "it holds no records of light, as render --cache-file writes them";
        return Err(unfit(path, message));
    }
    let word = |at: usize| u32::from_le_bytes(number(&header, at));
    let long = |at: usize| u64::from_le_bytes(number(&header, at));
    let key = |at: usize| u128::from_le_bytes(number(&header, at));
    if word(4) != VERSION {
        let message = format!(
            "its format has version {}, and this program reads {VERSION}",
            word(4)
        );
        return Err(unfit(path, &message));
    }
    let of = RecordsOf {
        program: long(8),
        scene: key(16),
        error: f64::from_bits(long(32)),
        seed: long(40),
        max_depth: word(48),
        precision: key(52),
        around: key(68),
    };
    let (count, checksum) = (word(84), long(88));
    let size = HEADER as u64 + u64::from(count) * RECORD as u64;
    if count > MOST_RECORDS || bytes_of_file != size {
        let message = format!(
            "it has {} bytes, but {count} records take {size}",
            bytes_of_file
        );
        return Err(unfit(path, &message));
    }
    Ok((of, count, checksum, file))
}

/// Makes the error of a file that is not what is asked for.
fn unfit(path: &Path, message: &str) -> LoadError {
    LoadError::Invalid {
        path: path.into(),
        place: "records of --cache-file".into(),
        message: format!("{message}; remove the file, or name another"),
    }
}

fn number<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    std::array::from_fn(|i| bytes[at + i])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn records() -> LightRecords {
        let of = RecordsOf {
            program: 1,
            scene: 2 << 100,
            error: 0.2,
            seed: 3,
            max_depth: 16,
            precision: 4,
            around: 5 << 90,
        };
        let row = |i: u32| std::array::from_fn(|k| f64::from(i) - 1e-300 * k as f64);
        LightRecords {
            of,
            rows: (0..3).map(row).collect(),
        }
    }

    fn written(records: &LightRecords, path: &Path) -> Vec<u8> {
        let mut outputs = Outputs::default();
        records.save_into(path, &mut outputs).unwrap();
        outputs.commit().unwrap();
        std::fs::read(path).unwrap()
    }

    #[test]
    fn every_bit_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        let some = records();
        assert_eq!(written(&some, &path).len(), HEADER + 3 * RECORD);
        assert_eq!(LightRecords::load(&path, &some.of).unwrap(), some);
        let none = LightRecords {
            rows: Vec::new(),
            ..some
        };
        assert_eq!(written(&none, &path).len(), HEADER);
        assert_eq!(LightRecords::load(&path, &some.of).unwrap(), none);
    }

    #[test]
    fn what_differs_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        let of = records().of;
        written(&records(), &path);
        let said = |asked: RecordsOf| {
            let error = LightRecords::load(&path, &asked).unwrap_err().to_string();
            assert!(error.contains("remove the file"), "{error}");
            error
        };
        assert!(said(RecordsOf { program: 0, ..of }).contains("version of this program"));
        assert!(said(RecordsOf { scene: 0, ..of }).contains("another scene"));
        assert!(said(RecordsOf { error: 0.4, ..of }).contains("--cache-error 0.2, not 0.4"));
        assert!(said(RecordsOf { seed: 7, ..of }).contains("--seed 3, not 7"));
        assert!(said(RecordsOf { max_depth: 8, ..of }).contains("--max-bounces 16, not 8"));
        assert!(said(RecordsOf { precision: 0, ..of }).contains("--precision"));
        assert!(LightRecords::load(&path, &RecordsOf { around: 0, ..of }).is_ok());
    }

    #[test]
    fn all_damage_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        let of = records().of;
        let good = written(&records(), &path);
        let load = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            LightRecords::load(&path, &of)
        };
        for len in 0..good.len() {
            assert!(load(&good[..len]).is_err(), "{len} bytes");
        }
        for (at, bits) in (0..good.len()).flat_map(|at| [(at, 1), (at, 0x80), (at, 0xff)]) {
            let mut bytes = good.clone();
            bytes[at] ^= bits;
            let said = load(&bytes).unwrap_err().to_string();
            assert!(said.contains("remove the file"), "{at}: {said}");
        }
        let longer = [&good[..], &[0]].concat();
        assert!(
            load(&longer)
                .unwrap_err()
                .to_string()
                .contains("1513 bytes")
        );
        assert!(LightRecords::load(folder.path(), &of).is_err());
    }

    /// A file with a right checksum may hold anything.
    #[test]
    fn numbers_are_finite() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        for wrong in [f64::NAN, f64::INFINITY] {
            let mut records = records();
            records.rows[2][58] = wrong;
            written(&records, &path);
            assert!(LightRecords::load(&path, &records.of).is_err());
        }
    }
}
