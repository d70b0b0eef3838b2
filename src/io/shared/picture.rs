//! The finished film: one column per channel, row-major, top row first; and the
//! files that it is written to.
//!
//! `x.png` is 8-bit sRGB; `x.exr` is linear and holds the AOVs too. Beside a
//! `x.png` the AOVs go to `x.aov.exr`. The channels' names are in
//! `openexr.rs`; that files appear whole or not at all is the work of
//! `atomic.rs`.

use crate::Outputs;
use crate::openexr::{self, Content};
use crate::{SaveError, png};
use std::path::{Path, PathBuf};

/// Which arbitrary output variables are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AovSet {
    pub depth: bool,
    pub position: bool,
    pub normal: bool,
    pub albedo: bool,
    pub instance_id: bool,
    pub primitive_id: bool,
}

impl AovSet {
    pub fn any(&self) -> bool {
        *self != AovSet::default()
    }

    /// The names that `--aov` takes.
    pub const NAMES: [&str; 6] = [
        "depth",
        "position",
        "normal",
        "albedo",
        "instance_id",
        "primitive_id",
    ];

    /// Adds the output of this name; false if there is none.
    pub fn add(&mut self, name: &str) -> bool {
        match name {
            "depth" => self.depth = true,
            "position" => self.position = true,
            "normal" => self.normal = true,
            "albedo" => self.albedo = true,
            "instance_id" => self.instance_id = true,
            "primitive_id" => self.primitive_id = true,
            _ => return false,
        }
        true
    }
}

/// Channels that were not asked for are `None` and take no memory. AOVs are of
/// the pixel's first sample, never blended.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    /// Linear Rec. 709 radiance.
    pub color: Vec<[f32; 3]>,
    /// Along the camera's view axis, world units; infinity where nothing is.
    pub depth: Option<Vec<f32>>,
    /// World space; NaN-free: (0, 0, 0) where nothing is.
    pub position: Option<Vec<[f32; 3]>>,
    /// Shading normal, world space, unit; (0, 0, 0) where nothing is.
    pub normal: Option<Vec<[f32; 3]>>,
    pub albedo: Option<Vec<[f32; 3]>>,
    /// The appearance's path index; [`Picture::NO_ID`] where nothing is.
    pub instance_id: Option<Vec<u64>>,
    /// Triangle in source order, 0 for other shapes; `u32::MAX` where nothing is.
    pub primitive_id: Option<Vec<u32>>,
}

impl Picture {
    pub const NO_ID: u64 = u64::MAX;

    /// The AOVs that it holds.
    pub fn aovs(&self) -> AovSet {
        AovSet {
            depth: self.depth.is_some(),
            position: self.position.is_some(),
            normal: self.normal.is_some(),
            albedo: self.albedo.is_some(),
            instance_id: self.instance_id.is_some(),
            primitive_id: self.primitive_id.is_some(),
        }
    }

    /// Encodes it into the files that `path` asks for, to be committed with the
    /// others of the run.
    pub fn save_into(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SaveError> {
        self.check_columns(path)?;
        for (path, what) in picture_files(path, self.aovs())? {
            let bytes = match what {
                PictureFile::Png => png::encode(self, &path)?,
                PictureFile::Exr => openexr::encode(self, Content::ColorAndAovs, &path)?,
                PictureFile::AovExr => openexr::encode(self, Content::Aovs, &path)?,
            };
            outputs.add(&path, bytes)?;
        }
        Ok(())
    }

    pub fn save(&self, path: &Path) -> Result<(), SaveError> {
        let mut outputs = Outputs::default();
        self.save_into(path, &mut outputs)?;
        outputs.commit()
    }

    /// The fields are public: a program may have filled them.
    fn check_columns(&self, path: &Path) -> Result<(), SaveError> {
        fn len<T>(column: &Option<Vec<T>>) -> Option<usize> {
            column.as_ref().map(Vec::len)
        }
        let pixels = self.width as usize * self.height as usize;
        let columns = [
            ("color", Some(self.color.len())),
            ("depth", len(&self.depth)),
            ("position", len(&self.position)),
            ("normal", len(&self.normal)),
            ("albedo", len(&self.albedo)),
            ("instance_id", len(&self.instance_id)),
            ("primitive_id", len(&self.primitive_id)),
        ];
        let message = if pixels == 0 {
            "the picture has no pixels".into()
        } else if let Some((name, len)) = columns
            .iter()
            .find_map(|(name, len)| len.filter(|n| *n != pixels).map(|n| (name, n)))
        {
            format!("the picture's column {name} has {len} rows for {pixels} pixels")
        } else {
            return Ok(());
        };
        Err(SaveError::Encode {
            path: path.into(),
            message,
        })
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFile {
    Png,
    /// Colour and AOVs.
    Exr,
    AovExr,
}

/// The files that a picture saved as `path` with these AOVs is written to.
pub fn picture_files(path: &Path, aovs: AovSet) -> Result<Vec<(PathBuf, PictureFile)>, SaveError> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    match extension.as_str() {
        "exr" => Ok(vec![(path.into(), PictureFile::Exr)]),
        "png" => {
            let mut files = vec![(path.into(), PictureFile::Png)];
            if aovs.any() {
                files.push((path.with_extension("aov.exr"), PictureFile::AovExr));
            }
            Ok(files)
        }
        _ => Err(SaveError::UnknownFormat {
            path: path.into(),
            extension,
        }),
    }
}

#[cfg(test)]
mod tests;
