//! Rendered pictures: one column per channel, row-major, top row first; and the files that
//! they are written to.
//!
//! `x.png` and `x.jpg` are sRGB, developed by a view transform; `x.hdr` and `x.exr` are linear, and
//! the last also holds the AOVs. Those of the others go to `x.aov.exr` beside it. `openexr.rs` names the channels;
//! `outputs.rs` makes files appear complete or not at all.

use crate::openexr::{self, Content};
use crate::{Development, Matte, Metadata, Outputs, SaveError, jpeg, png, radiance};
use std::path::{Path, PathBuf};

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
    /// Distance of the hit point from where the camera's ray starts; infinity where nothing was
    /// hit.
    pub distance: Option<Vec<f32>>,
    /// Unit geometric normal in world space on the side that is seen; (0, 0, 0) where nothing was
    /// hit.
    pub geometric_normal: Option<Vec<[f32; 3]>>,
    /// The shading normal in camera space: x to the right, y up, z towards the viewer.
    pub camera_normal: Option<Vec<[f32; 3]>>,
    /// Barycentric coordinates of triangles; (0, 0) elsewhere.
    pub uv: Option<Vec<[f32; 2]>>,
    /// Ways in pixels, x to the right and y up: from where what is seen was a step before to where
    /// it is, and from where it is to where it will be, both reversed, as Blender has them.
    pub vector: Option<Vec<[f32; 4]>>,
    /// Ways in pixels, x to the right and y up: to where what is seen will be a step later, and to
    /// where it was a step before, as Nuke has them.
    pub motion: Option<Vec<[f32; 4]>>,
    /// The variance of the pixel's colour, by channel, as two halves of its samples tell it.
    pub variance: Option<Vec<[f32; 3]>>,
    /// Parts of the colour, linear.
    pub layers: Vec<Layer>,
    pub mattes: Vec<Matte>,
    /// What an OpenEXR file's header tells of the picture; nothing if empty.
    pub metadata: Metadata,
}

/// A part of a picture's colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    pub name: String,
    pub color: Vec<[f32; 3]>,
}

impl Picture {
    /// The `instance_id` of a pixel where nothing was hit.
    pub const NO_ID: u64 = u64::MAX;

    /// Says whether the picture has anything beside colour and alpha.
    pub fn has_aovs(&self) -> bool {
        let columns = self.columns();
        columns.iter().skip(2).any(|(_, len)| len.is_some())
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
        for (path, what) in picture_files(path, self.has_aovs())? {
            let bytes = match what {
                PictureFile::Png => png::encode(self, development, &path)?,
                PictureFile::Jpeg => jpeg::encode(self, development, &path)?,
                PictureFile::Hdr => radiance::encode(self, &path)?,
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
        let pixels = self.width as usize * self.height as usize;
        let columns = self.columns();
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

    /// Lists the columns with their lengths, of mattes the number of pixels; colour and alpha come
    /// first.
    fn columns(&self) -> Vec<(&str, Option<usize>)> {
        fn len<T>(column: &Option<Vec<T>>) -> Option<usize> {
            column.as_ref().map(Vec::len)
        }
        let mut columns = vec![
            ("color", Some(self.color.len())),
            ("alpha", len(&self.alpha)),
            ("depth", len(&self.depth)),
            ("position", len(&self.position)),
            ("normal", len(&self.normal)),
            ("albedo", len(&self.albedo)),
            ("instance_id", len(&self.instance_id)),
            ("primitive_id", len(&self.primitive_id)),
            ("samples", len(&self.samples)),
            ("distance", len(&self.distance)),
            ("geometric_normal", len(&self.geometric_normal)),
            ("camera_normal", len(&self.camera_normal)),
            ("uv", len(&self.uv)),
            ("vector", len(&self.vector)),
            ("motion", len(&self.motion)),
            ("variance", len(&self.variance)),
        ];
        let layers = self.layers.iter();
        columns.extend(layers.map(|layer| (&layer.name[..], Some(layer.color.len()))));
        let pixels = |matte: &Matte| matte.rows.len() / matte.ranks.max(1) as usize;
        let mattes = self.mattes.iter();
        columns.extend(mattes.map(|matte| (matte.name, Some(pixels(matte)))));
        columns
    }
}

/// The content of one file of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureFile {
    /// Colour, sRGB, and alpha.
    Png,
    /// Colour, sRGB.
    Jpeg,
    /// Colour, linear.
    Hdr,
    /// Colour, linear, alpha and AOVs.
    Exr,
    /// AOVs alone.
    AovExr,
}

/// Lists the files to which a picture with these AOVs is saved as `path`; fails unless the
/// extension is `.png`, `.jpg`, `.hdr` or `.exr`.
pub fn picture_files(
    path: &Path,
    has_aovs: bool,
) -> Result<Vec<(PathBuf, PictureFile)>, SaveError> {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    match extension.as_str() {
        "exr" => Ok(vec![(path.into(), PictureFile::Exr)]),
        "png" | "jpg" | "jpeg" | "hdr" => {
            let own = match extension.as_str() {
                "png" => PictureFile::Png,
                "hdr" => PictureFile::Hdr,
                _ => PictureFile::Jpeg,
            };
            let mut files = vec![(path.into(), own)];
            if has_aovs {
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
