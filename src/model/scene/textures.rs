//! Textures: images in columns of encoded texels with their smaller levels, and which numbers of
//! which materials they scale.
//!
//! Texels stay as files have them, 8 or 16 bits a channel, and sRGB is decoded by a table where a
//! texel is read. Smaller levels are means of four texels in linear light.

use super::ids::{ImageId, MaterialId, PatternId};
use super::patterns::Pattern;
use super::texels::{Levels, decode_tables};
use std::ops::Range;
use std::sync::Arc;

/// The numbers of an image's texels, all levels one after the other, each by rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    Bytes(Vec<u8>),
    Words(Vec<u16>),
}

/// An image with its smaller levels.
#[derive(Clone, Debug)]
pub struct Image {
    pub texels: Texels,
    /// 1 (grey), 2 (grey and alpha), 3 or 4.
    pub channels: u8,
    /// Whether colours are encoded by sRGB's curve; alpha never is.
    pub is_srgb: bool,
    pub levels: Levels,
}

/// What is beyond an image's edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    #[default]
    Repeat,
    Mirror,
    Clamp,
}

/// An image as a material refers to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    pub image: ImageId,
    /// The mesh's set of texture coordinates.
    pub uv_set: u8,
    /// Along u and v.
    pub wrap: [Wrap; 2],
    /// Whether the nearest texel is shown instead of a mean of four.
    pub nearest: bool,
    /// Image coordinates from texture coordinates, by rows: the last column is the shift.
    pub transform: [[f64; 3]; 2],
}

/// The numbers of a material that an image may scale. Channels are glTF's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Slot {
    /// Colour, and alpha.
    BaseColor,
    /// Roughness in green, metallic in blue.
    MetallicRoughness,
    Emission,
    /// A normal of the tangent frame, encoded from 0 to 1.
    Normal,
    /// Opacity in the first channel: MTL's `map_d`.
    Opacity,
    Specular,
    SpecularColor,
    Clearcoat,
    ClearcoatRoughness,
    /// As `Normal`, of the coat alone.
    ClearcoatNormal,
    SheenColor,
    SheenRoughness,
    Transmission,
    Iridescence,
    IridescenceThickness,
    /// A direction in red and green, the strength in blue.
    Anisotropy,
    DiffuseTransmission,
    DiffuseTransmissionColor,
}

impl Slot {
    /// Says whether images of this use hold colours, encoded by sRGB's curve.
    pub fn is_color(self) -> bool {
        use Slot::*;
        matches!(
            self,
            BaseColor | Emission | SpecularColor | SheenColor | DiffuseTransmissionColor
        )
    }

    /// Says whether the number is one of those that shading varies in lanes; the others make a
    /// material of its own of each hit.
    pub fn is_plain(self) -> bool {
        use Slot::*;
        matches!(
            self,
            BaseColor | MetallicRoughness | Emission | Normal | Opacity | ClearcoatNormal
        )
    }
}

/// What a surface's alpha does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Alpha {
    /// Nothing.
    #[default]
    Opaque,
    /// It is the share of the surface that is there.
    Blend,
    /// The surface is there where alpha is no less than this.
    Mask(f32),
}

/// A material that differs from hit to hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texturing {
    pub alpha: Alpha,
    /// Whether the colours of vertices scale the base colour, and alpha.
    pub vertex_color: bool,
    /// The pattern in place of the base colour, and the one in place of the roughness.
    pub base_color: Option<PatternId>,
    pub roughness: Option<PatternId>,
    /// The scale of the x and y of the normal map.
    pub normal_scale: f32,
    /// That of the coat's own.
    pub coat_normal_scale: f32,
    /// Whether the stretch of highlights counts from the tangents of meshes that have some.
    pub follows_tangents: bool,
    /// The thickness of an iridescent film, in nanometres, where its image is 0.
    pub film_least: f32,
}

impl Default for Texturing {
    fn default() -> Texturing {
        Texturing {
            alpha: Alpha::Opaque,
            vertex_color: false,
            base_color: None,
            roughness: None,
            normal_scale: 1.0,
            coat_normal_scale: 1.0,
            follows_tangents: false,
            film_least: 100.0,
        }
    }
}

/// The images of a scene, and the materials that they and the colours of vertices vary.
#[derive(Clone, Debug, Default)]
pub struct Textures {
    pub images: Vec<Arc<Image>>,
    pub patterns: Vec<Pattern>,
    /// By row: the material, and its rows of `refs`.
    of: Vec<(MaterialId, Range<u32>)>,
    rows: Vec<Texturing>,
    refs: Vec<(Slot, TextureRef)>,
    /// The linear value of each code of 8 bits: sRGB's curve, then none.
    decode: Vec<[f32; 256]>,
}

/// A row of [`Textures`].
#[derive(Clone, Copy, Debug)]
pub struct TexturedMaterial<'a> {
    pub material: MaterialId,
    pub texturing: &'a Texturing,
    pub refs: &'a [(Slot, TextureRef)],
}

impl Textures {
    /// Adds an image, which several scenes may share.
    pub fn push_image(&mut self, image: Arc<Image>) -> ImageId {
        if self.decode.is_empty() {
            self.decode = decode_tables().to_vec();
        }
        self.images.push(image);
        ImageId(self.images.len() as u32 - 1)
    }

    /// Adds a pattern, which materials may share.
    pub fn push_pattern(&mut self, pattern: Pattern) -> PatternId {
        self.patterns.push(pattern);
        PatternId(self.patterns.len() as u32 - 1)
    }

    /// Returns a pattern.
    #[inline]
    pub fn pattern(&self, id: PatternId) -> &Pattern {
        &self.patterns[id.index()]
    }

    /// Says how a material is varied; a material that is not listed is the same everywhere.
    pub fn push(
        &mut self,
        material: MaterialId,
        texturing: Texturing,
        refs: &[(Slot, TextureRef)],
    ) {
        let first = self.refs.len() as u32;
        self.refs.extend_from_slice(refs);
        let at = self.of.partition_point(|(other, _)| *other <= material);
        self.of
            .insert(at, (material, first..self.refs.len() as u32));
        self.rows.insert(at, texturing);
    }

    /// Lists the materials that vary, by rising id.
    pub fn iter(&self) -> impl Iterator<Item = TexturedMaterial<'_>> {
        (0..self.of.len()).map(|i| self.row(i))
    }

    /// Returns how a material varies, if it does.
    pub fn of(&self, material: MaterialId) -> Option<TexturedMaterial<'_>> {
        let found = self.of.binary_search_by_key(&material, |(id, _)| *id);
        found.ok().map(|i| self.row(i))
    }

    fn row(&self, i: usize) -> TexturedMaterial<'_> {
        let (material, refs) = &self.of[i];
        TexturedMaterial {
            material: *material,
            texturing: &self.rows[i],
            refs: &self.refs[refs.start as usize..refs.end as usize],
        }
    }

    pub fn is_empty(&self) -> bool {
        self.of.is_empty()
    }

    /// Says whether an image scales what a material emits.
    pub fn has_emission(&self, material: MaterialId) -> bool {
        self.of(material).is_some_and(|row| row.has(Slot::Emission))
    }

    /// Says whether a material shines differently from place to place.
    pub fn varies_emission(&self, material: MaterialId) -> bool {
        let varies =
            |row: TexturedMaterial| row.has(Slot::Emission) || row.texturing.alpha != Alpha::Opaque;
        self.of(material).is_some_and(varies)
    }

    /// Returns a texel's channels, decoded to linear numbers: grey is repeated, and alpha is 1
    /// where there is none.
    #[inline]
    pub fn texel(&self, image: &Image, level: usize, x: u32, y: u32) -> [f32; 4] {
        image.texel(level, [x, y], &self.decode)
    }

    pub fn bytes(&self) -> usize {
        let images: usize = self.images.iter().map(|image| image.bytes()).sum();
        let ramps = self
            .patterns
            .iter()
            .map(|pattern| size_of_val(pattern.colors()));
        images
            + self.patterns.len() * size_of::<Pattern>()
            + ramps.sum::<usize>()
            + self.decode.len() * size_of::<[f32; 256]>()
            + self.of.len() * (size_of::<(MaterialId, Range<u32>)>() + size_of::<Texturing>())
            + self.refs.len() * size_of::<(Slot, TextureRef)>()
    }
}

impl TexturedMaterial<'_> {
    /// Lists the patterns of the material.
    pub fn patterns(&self) -> impl Iterator<Item = PatternId> {
        let Texturing {
            base_color,
            roughness,
            ..
        } = self.texturing;
        base_color.iter().chain(roughness).copied()
    }

    /// Says whether an image scales a number of the material.
    pub fn has(&self, slot: Slot) -> bool {
        self.refs.iter().any(|(of, _)| *of == slot)
    }
}

impl TextureRef {
    /// Returns a reference to an image as it is.
    pub fn plain(image: ImageId) -> TextureRef {
        TextureRef {
            image,
            uv_set: 0,
            wrap: [Wrap::Repeat; 2],
            nearest: false,
            transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        }
    }
}
