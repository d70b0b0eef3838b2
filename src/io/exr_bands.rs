//! OpenEXR files of pictures that are rendered band by band: the bytes of the whole picture's file,
//! without the whole picture in memory.
//!
//! A file of scan lines is a header, the offsets of its chunks, and the chunks: sixteen rows each,
//! compressed alone, behind the number of their first row. So the chunks of a band, which begins at a
//! multiple of sixteen rows, are those of the whole but for that number. The header may depend on
//! what the last band shows (the names in a manifest), so chunks wait in a file without a name.

use crate::exr_header;
use crate::openexr::{self, CHUNK_ROWS, Content};
use crate::{Outputs, Picture, SaveError};
use std::fs::File;
use std::io::{BufWriter, Error, Seek, Write};
use std::path::{Path, PathBuf};

/// The bands of a picture that are done, from the top down.
pub struct ExrBands {
    path: PathBuf,
    /// Width and height of the whole picture.
    size: (u32, u32),
    /// Rows of the bands so far.
    rows: u32,
    /// The chunks so far, in a file that goes with its handle.
    chunks: BufWriter<File>,
    /// Bytes of each chunk.
    lengths: Vec<u64>,
}

/// Bytes of a chunk before its pixels: the number of its first row, and their length.
const CHUNK_HEAD: usize = 8;

impl ExrBands {
    /// Bands have multiples of this many rows, but for the last.
    pub const STEP: u32 = CHUNK_ROWS;

    /// Begins the file `path` of a picture of a size. Fails if nothing can be written in its folder.
    pub fn begin(path: &Path, size: (u32, u32)) -> Result<ExrBands, SaveError> {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
        let chunks = tempfile::tempfile_in(folder.unwrap_or(Path::new(".")));
        Ok(ExrBands {
            path: path.into(),
            size,
            rows: 0,
            chunks: BufWriter::new(chunks.map_err(|source| failed(path, source))?),
            lengths: Vec::new(),
        })
    }

    /// Adds the next band: rows of the picture's whole width.
    pub fn add(&mut self, band: &Picture) -> Result<(), SaveError> {
        let file = openexr::encode(band, Content::ColorAndAovs, &self.path)?;
        let broken = || encoding(&self.path, "a band is not as the encoder wrote it");
        if band.width != self.size.0 || !self.rows.is_multiple_of(Self::STEP) {
            return Err(encoding(&self.path, "a band does not fit below the others"));
        }
        let offsets = exr_header::end(&file).ok_or_else(broken)?;
        let count = band.height.div_ceil(CHUNK_ROWS) as usize;
        let mut rest = file.get(offsets + 8 * count..).ok_or_else(broken)?;
        for number in 0..count as u32 {
            let length = rest.get(4..CHUNK_HEAD).and_then(|l| l.try_into().ok());
            let length = u32::from_le_bytes(length.ok_or_else(broken)?) as usize;
            let (chunk, next) = (rest.split_at_checked(CHUNK_HEAD + length)).ok_or_else(broken)?;
            let row = self.rows + number * CHUNK_ROWS;
            let written = self.chunks.write_all(&row.to_le_bytes());
            let written = written.and_then(|()| self.chunks.write_all(&chunk[4..]));
            written.map_err(|source| failed(&self.path, source))?;
            self.lengths.push(chunk.len() as u64);
            rest = next;
        }
        self.rows += band.height;
        Ok(())
    }

    /// Adds the file to `outputs`, which the caller commits. `last` is the last band, with the
    /// metadata and the manifests of the whole.
    pub fn save_into(self, last: &Picture, outputs: &mut Outputs) -> Result<(), SaveError> {
        let path = self.path;
        if self.rows != self.size.1 {
            return Err(encoding(&path, "the picture's last bands are missing"));
        }
        let mut header = openexr::encode(last, Content::ColorAndAovs, &path)?;
        let end = exr_header::end(&header);
        header.truncate(end.unwrap_or(0));
        if !exr_header::set_size(&mut header, self.size, self.lengths.len() as u32) {
            return Err(encoding(
                &path,
                "the header does not tell the picture's size",
            ));
        }
        let mut at = (header.len() + 8 * self.lengths.len()) as u64;
        for length in &self.lengths {
            header.extend(at.to_le_bytes());
            at += length;
        }
        let chunks = self.chunks.into_inner();
        let mut chunks = chunks.map_err(|e| failed(&path, e.into_error()))?;
        outputs.add_by(&path, |file| {
            file.write_all(&header)?;
            chunks.rewind()?;
            std::io::copy(&mut chunks, file).map(drop)
        })
    }
}

fn failed(path: &Path, source: Error) -> SaveError {
    SaveError::Write {
        path: path.into(),
        source,
    }
}

fn encoding(path: &Path, message: &str) -> SaveError {
    SaveError::Encode {
        path: path.into(),
        message: message.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Attribute, Layer, Matte};

    /// Returns rows of a picture whose channels of every kind tell the pixel.
    fn rows(width: u32, rows: std::ops::Range<u32>) -> Picture {
        let pixels = rows.clone().flat_map(|y| (0..width).map(move |x| (x, y)));
        let float: Vec<f32> = pixels.map(|(x, y)| (x * 7 + y * 1009) as f32).collect();
        let color: Vec<[f32; 3]> = float.iter().map(|v| [*v, 0.5 * v, 1.0 / v]).collect();
        let name = match rows.start {
            0 => "first",
            _ => "other",
        };
        Picture {
            width,
            height: rows.len() as u32,
            color: color.clone(),
            depth: Some(float.clone()),
            instance_id: Some(float.iter().map(|v| *v as u64 + (1 << 40)).collect()),
            layers: vec![Layer {
                name: "emission".into(),
                color,
            }],
            mattes: vec![Matte {
                name: "CryptoObject",
                ranks: 1,
                rows: float.iter().map(|v| [*v, 0.5]).collect(),
                manifest: [(name.to_owned(), 9)].into(),
            }],
            ..Picture::default()
        }
    }

    #[test]
    fn bands_make_the_file_of_the_whole() {
        let folder = tempfile::tempdir().unwrap();
        let metadata = vec![
            ("rays".to_string(), Attribute::Double(17.0)),
            ("software".to_string(), Attribute::Text("lanecast".into())),
        ];
        for (height, band) in [(1, 16), (16, 16), (77, 16), (77, 48), (96, 32)] {
            let mut whole = rows(13, 0..height);
            whole.metadata.clone_from(&metadata);
            let manifest: [(String, u32); 2] = [("first".into(), 9), ("other".into(), 9)];
            if height > band {
                whole.mattes[0].manifest = manifest.into();
            }
            let path = folder.path().join("bands.exr");
            let mut bands = ExrBands::begin(&path, (13, height)).unwrap();
            let mut last = Picture::default();
            for first in (0..height).step_by(band as usize) {
                last = rows(13, first..height.min(first + band));
                bands.add(&last).unwrap();
            }
            last.metadata.clone_from(&metadata);
            last.mattes[0]
                .manifest
                .clone_from(&whole.mattes[0].manifest);
            let mut outputs = Outputs::default();
            bands.save_into(&last, &mut outputs).unwrap();
            outputs.commit().unwrap();
            let expected = openexr::encode(&whole, Content::ColorAndAovs, &path).unwrap();
            assert!(std::fs::read(&path).unwrap() == expected, "{height} {band}");
        }
    }

    #[test]
    fn what_is_no_whole_picture_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bands.exr");
        let begun = || ExrBands::begin(&path, (4, 40)).unwrap();
        assert!(begun().add(&rows(5, 0..16)).is_err());
        let mut bands = begun();
        bands.add(&rows(4, 0..24)).unwrap();
        assert!(bands.add(&rows(4, 24..40)).is_err());
        let last = rows(4, 24..40);
        let error = bands.save_into(&last, &mut Outputs::default()).unwrap_err();
        assert!(error.to_string().contains("missing"), "{error}");
        let nowhere = folder.path().join("no/bands.exr");
        assert!(ExrBands::begin(&nowhere, (4, 40)).is_err());
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
    }
}
