//! Rendered pictures: one column per channel, row-major, top row first; and the files that
//! they are written to.
//!
//! `x.png` is sRGB, developed by a view transform; `x.exr` is linear and also holds the AOVs.
//! The AOVs of `x.png` go to `x.aov.exr` beside it. `openexr.rs` names the channels;
//! `outputs.rs` makes files appear complete or not at all.

use crate::openexr::{self, Content};
use crate::{Development, Outputs, SaveError, png};
use std::path::{Path, PathBuf};

/// A set of arbitrary output variables (AOVs) to keep beside the colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AovSet {
    pub depth: bool,
    pub position: bool,
    pub normal: bool,
    pub albedo: bool,
    pub instance_id: bool,
    pub primitive_id: bool,
    pub samples: bool,
}

impl AovSet {
    /// Whether the set has an AOV.
    pub fn any(&self) -> bool {
        *self != AovSet::default()
    }

    /// Whether the set has an AOV that the pixels' first hits tell.
    pub fn any_of_hits(&self) -> bool {
        let hits = AovSet {
            samples: false,
            ..*self
        };
        hits.any()
    }

    /// The names of the AOVs, as `--aov` takes them.
    pub const NAMES: [&str; 7] = [
        "depth",
        "position",
        "normal",
        "albedo",
        "instance_id",
        "primitive_id",
        "samples",
    ];

    /// Adds the AOV called `name`; returns false if there is none of this name.
    pub fn add(&mut self, name: &str) -> bool {
        match name {
            "depth" => self.depth = true,
            "position" => self.position = true,
            "normal" => self.normal = true,
            "albedo" => self.albedo = true,
            "instance_id" => self.instance_id = true,
            "primitive_id" => self.primitive_id = true,
            "samples" => self.samples = true,
            _ => return false,
        }
        true
    }
}

/// A picture with its AOVs. AOVs that are not kept are `None`. An AOV is the value at the
/// pixel's centre, never a mean.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    /// Radiance, linear, Rec. 709 primaries; premultiplied where there is alpha.
    pub color: Vec<[f32; 3]>,
    /// The fraction of the pixel that the scene covers, from 0 to 1; `None` for pictures whose
    /// background is a part of them. OpenEXR files get it as it is beside the premultiplied
    /// colour, PNG files beside the colour divided by it.
    pub alpha: Option<Vec<f32>>,
    /// Distance along the camera's view axis in world units; infinity where nothing was hit.
    pub depth: Option<Vec<f32>>,
    /// The hit point in world space; (0, 0, 0), not NaN, where nothing was hit.
    pub position: Option<Vec<[f32; 3]>>,
    /// Unit shading normal in world space; (0, 0, 0) where nothing was hit.
    pub normal: Option<Vec<[f32; 3]>>,
    pub albedo: Option<Vec<[f32; 3]>>,
    /// The path index of the instance; [`Picture::NO_ID`] where nothing was hit.
    pub instance_id: Option<Vec<u64>>,
    /// The index of the triangle in its source file, the surface's number of a CSG solid, 0
    /// for other shapes; `u32::MAX` where nothing was hit.
    pub primitive_id: Option<Vec<u32>>,
    /// The number of samples that the colour is the mean of.
    pub samples: Option<Vec<u32>>,
}

impl Picture {
    /// The `instance_id` of a pixel where nothing was hit.
    pub const NO_ID: u64 = u64::MAX;

    /// The set of AOVs that the picture has.
    pub fn aovs(&self) -> AovSet {
        AovSet {
            depth: self.depth.is_some(),
            position: self.position.is_some(),
            normal: self.normal.is_some(),
            albedo: self.albedo.is_some(),
            instance_id: self.instance_id.is_some(),
            primitive_id: self.primitive_id.is_some(),
            samples: self.samples.is_some(),
        }
    }

    /// Encodes the picture into the files of [`picture_files`] and adds them to `outputs`,
    /// which the caller commits. A PNG file is developed first.
    ///
    /// Fails for unknown extensions, columns of wrong length, and errors of encoding or
    /// writing.
    pub fn save_into(
        &self,
        path: &Path,
        development: &Development,
        outputs: &mut Outputs,
    ) -> Result<(), SaveError> {
        self.check_columns(path)?;
        for (path, what) in picture_files(path, self.aovs())? {
            let bytes = match what {
                PictureFile::Png => png::encode(self, development, &path)?,
                PictureFile::Exr => openexr::encode(self, Content::ColorAndAovs, &path)?,
                PictureFile::AovExr => openexr::encode(self, Content::Aovs, &path)?,
            };
            outputs.add(&path, bytes)?;
        }
        Ok(())
    }

    /// Writes the picture to the files of [`picture_files`], PNG by the default development;
    /// fails as [`Picture::save_into`] does.
    pub fn save(&self, path: &Path) -> Result<(), SaveError> {
        let mut outputs = Outputs::default();
        self.save_into(path, &Development::default(), &mut outputs)?;
        outputs.commit()
    }

    /// Checks that the picture has pixels and every column has one row per pixel, because
    /// a program may fill the public fields.
    fn check_columns(&self, path: &Path) -> Result<(), SaveError> {
        fn len<T>(column: &Option<Vec<T>>) -> Option<usize> {
            column.as_ref().map(Vec::len)
        }
        let pixels = self.width as usize * self.height as usize;
        let columns = [
            ("color", Some(self.color.len())),
            ("alpha", len(&self.alpha)),
            ("depth", len(&self.depth)),
            ("position", len(&self.position)),
            ("normal", len(&self.normal)),
            ("albedo", len(&self.albedo)),
            ("instance_id", len(&self.instance_id)),
            ("primitive_id", len(&self.primitive_id)),
            ("samples", len(&self.samples)),
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

/// The content of one file of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFile {
    /// Colour, sRGB, and alpha.
    Png,
    /// Colour, linear, alpha and AOVs.
    Exr,
    /// AOVs alone.
    AovExr,
}

/// Lists the files to which a picture with these AOVs is saved as `path`; fails unless the
/// extension is `.png` or `.exr`.
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
