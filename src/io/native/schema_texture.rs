//! Images of materials as types.

use super::source_spans::At;
use schemars::JsonSchema;
use serde::Deserialize;

/// An image that scales a number of a material where a mesh has texture coordinates. These count
/// from the image's left and top edges; those of .obj files are turned to that.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Texture {
    /// A picture (.png, .jpg, .webp; .ktx2 by a feature), relative to this file.
    pub file: At<String>,
    /// The mesh's set of texture coordinates: 0, the only one that is kept; 0 if absent.
    pub uv: Option<At<u32>>,
    /// What is beyond the picture's edges; `repeat` if absent.
    pub wrap: Option<Wrap>,
    /// `linear` if absent.
    pub filter: Option<Filter>,
    /// Factors of the texture coordinates; 1 if absent.
    pub scale: Option<[f64; 2]>,
    /// Degrees that the coordinates are turned after that, counter-clockwise in the picture; 0 if
    /// absent.
    pub rotation: Option<f64>,
    /// What is added after that; 0 if absent.
    pub offset: Option<[f64; 2]>,
}

/// What is beyond the edges of an image.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Wrap {
    Repeat,
    Mirror,
    Clamp,
}

/// How an image is shown from nearby.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Filter {
    Linear,
    Nearest,
}

/// What an image's alpha does.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AlphaMode {
    Mask,
    Blend,
}
