//! Images of materials to the scene's textures.

use super::lower_pattern;
use super::schema;
use super::schema_pattern::ColorOrPattern;
use super::schema_texture::{AlphaMode, Filter, Texture, Wrap};
use super::source_spans::At;
use super::tree::{Source, quoted};
use crate::scene::{self, Alpha, MaterialId, SceneBuilder, Slot, TextureRef, Texturing};
use crate::shared::images::ImageStore;
use crate::shared::texels::{ImageUse, texture_transform};
use crate::{Folder, LoadError, LoadOptions};

/// The folder of a file, and the images read so far.
pub(super) struct ImageFiles<'i> {
    folder: Folder,
    images: &'i mut ImageStore,
}

impl ImageFiles<'_> {
    pub(super) fn new<'i>(
        source: &Source,
        options: &LoadOptions,
        images: &'i mut ImageStore,
    ) -> ImageFiles<'i> {
        ImageFiles {
            folder: Folder::new(source.path, options),
            images,
        }
    }
}

/// Says whether a material has images.
pub(super) fn has_textures(row: &schema::Material) -> bool {
    own_image(row).is_some()
        || row.base_color_texture.is_some()
        || row.metallic_roughness_texture.is_some()
        || row.emission_texture.is_some()
        || row.normal_texture.is_some()
        || row.vertex_colors == Some(true)
}

/// Returns the image that stands in place of a base colour.
fn own_image(row: &schema::Material) -> Option<(usize, &Texture)> {
    let At { at, value } = row.base_color.as_ref()?;
    match value {
        ColorOrPattern::Texture(texture) => Some((*at, texture)),
        ColorOrPattern::Color(_) | ColorOrPattern::Pattern(_) => None,
    }
}

/// Adds the images and patterns of a material. Fails for images that cannot be read.
pub(super) fn textures(
    source: &Source,
    row: &schema::Material,
    id: MaterialId,
    files: &mut ImageFiles,
    scene: &mut SceneBuilder,
) -> Result<(), LoadError> {
    let [pattern, roughness] = lower_pattern::patterns(source, row, scene)?;
    let has_patterns = pattern.is_some() || roughness.is_some();
    let has_color = own_image(row).is_some()
        || row.base_color_texture.is_some()
        || row.vertex_colors == Some(true);
    match (&row.alpha, &row.alpha_cutoff) {
        (Some(alpha), _) if !has_color => {
            let message = "alpha is what the alpha of an image does, and base_color has no image; give \
                           it one, or opacity instead";
            return Err(source.error(alpha.at, message));
        }
        (
            None
            | Some(At {
                value: AlphaMode::Blend,
                ..
            }),
            Some(cutoff),
        ) => {
            let message = "alpha_cutoff goes with alpha = \"mask\"";
            return Err(source.error(cutoff.at, message));
        }
        _ => {}
    }
    if let (None, Some(scale)) = (&row.normal_texture, &row.normal_scale) {
        return Err(source.error(scale.at, "normal_scale goes with normal_texture"));
    }
    if !has_textures(row) && !has_patterns {
        return Ok(());
    }
    let mut refs = Vec::new();
    let colors = match row.alpha {
        None => ImageUse::Color,
        Some(_) => ImageUse::ColorAndAlpha,
    };
    let own = own_image(row);
    if let (Some((at, _)), Some(_)) = (own, &row.base_color_texture) {
        let message =
            "base_color is an image, and base_color_texture another; leave out one of them";
        return Err(source.error(at, message));
    }
    let base_color = own.map(|(_, texture)| texture);
    let numbers = row.metallic_roughness_texture.as_ref();
    for (slot, texture, used) in [
        (
            Slot::BaseColor,
            base_color.or(row.base_color_texture.as_ref()),
            colors,
        ),
        (Slot::MetallicRoughness, numbers, ImageUse::Numbers),
        (
            Slot::Emission,
            row.emission_texture.as_ref(),
            ImageUse::Color,
        ),
        (Slot::Normal, row.normal_texture.as_ref(), ImageUse::Numbers),
    ] {
        if let Some(texture) = texture {
            refs.push((slot, one(source, texture, used, files, scene)?));
        }
    }
    let cutoff = row.alpha_cutoff.as_ref().map_or(0.5, |at| at.value);
    let texturing = Texturing {
        alpha: match row.alpha.as_ref().map(|at| at.value) {
            None => Alpha::Opaque,
            Some(AlphaMode::Blend) => Alpha::Blend,
            Some(AlphaMode::Mask) => Alpha::Mask(cutoff),
        },
        vertex_color: row.vertex_colors.unwrap_or(false),
        base_color: pattern,
        roughness,
        normal_scale: row.normal_scale.as_ref().map_or(1.0, |scale| scale.value),
        ..Texturing::default()
    };
    scene.texture(id, texturing, &refs);
    Ok(())
}

fn one(
    source: &Source,
    texture: &Texture,
    used: ImageUse,
    files: &mut ImageFiles,
    scene: &mut SceneBuilder,
) -> Result<TextureRef, LoadError> {
    let at = texture.file.at;
    if let Some(set) = texture.uv.as_ref().filter(|set| set.value != 0) {
        let message = format!(
            "uv = {}; native scenes keep one set of texture coordinates, 0: place a .glb by scene = \
             \"FILE\" to use its others",
            set.value
        );
        return Err(source.error(set.at, message));
    }
    let failed = |why: String| {
        let name = quoted(&texture.file.value);
        source.error(at, format!("the image {name} cannot be read: {why}"))
    };
    let path = files
        .folder
        .resolve(&texture.file.value)
        .map_err(|e| match e {
            LoadError::Read { source: why, .. } => failed(why.to_string()),
            other => other,
        })?;
    let found = files.images.file(&path, used, &texture.file.value);
    let image = scene.shared_image(found.map_err(|broken| failed(broken.why))?);
    let wrap = match texture.wrap {
        None | Some(Wrap::Repeat) => scene::Wrap::Repeat,
        Some(Wrap::Mirror) => scene::Wrap::Mirror,
        Some(Wrap::Clamp) => scene::Wrap::Clamp,
    };
    let transform = texture_transform(
        texture.scale.unwrap_or([1.0; 2]),
        texture.rotation.unwrap_or(0.0).to_radians(),
        texture.offset.unwrap_or([0.0; 2]),
    );
    if !transform.iter().flatten().all(|x| x.is_finite()) {
        let message = "the image's scale, rotation and offset must be finite";
        return Err(source.error(at, message));
    }
    Ok(TextureRef {
        wrap: [wrap; 2],
        nearest: matches!(texture.filter, Some(Filter::Nearest)),
        transform,
        ..TextureRef::plain(image)
    })
}
