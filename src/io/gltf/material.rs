//! Materials: metallic-roughness factors and the layers of the material extensions.
//!
//! Textures are not imported but counted, also where they hold the alpha of a surface. What
//! alpha hides for certain, 0 with BLEND or less than the cutoff with MASK, is left out of
//! meshes. The scene's check refuses values out of range, and names the material.

use super::File;
use crate::scene::{Layers, Material, MaterialId, Model, Rgb, SceneBuilder};
use crate::shared::messages::one_line;
use crate::{ImportReport, LoadError};
use gltf::json::material::AlphaMode;
use gltf::json::validation::Checked;
use serde::Deserialize;
use serde::de::DeserializeOwned;

/// Adds one row per material of the file, in order, and returns their ids, `None` for those
/// of invisible surfaces. Fails if an extension has a value of the wrong type.
pub(super) fn import(
    file: &File,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<Vec<Option<MaterialId>>, LoadError> {
    let mut ids = Vec::with_capacity(file.root.materials.len());
    for (row, source) in file.root.materials.iter().enumerate() {
        let name = one_line(source.name.as_deref().unwrap_or_default());
        let material = convert(source, report).map_err(|(extension, why)| {
            file.invalid(&format!("material {row}, {extension}"), &why)
        })?;
        ids.push(material.map(|material| scene.material(&name, material)));
    }
    Ok(ids)
}

/// The name of an extension, and what is wrong with it.
type Wrong = (&'static str, String);

/// Converts a material; `None` if it makes surfaces invisible.
fn convert(
    source: &gltf::json::Material,
    report: &mut ImportReport,
) -> Result<Option<Material>, Wrong> {
    let pbr = &source.pbr_metallic_roughness;
    let [r, g, b, alpha] = pbr.base_color_factor.0;
    let cutoff = source.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0);
    let mut opacity = 1.0;
    // A texture's alpha is a factor of at most 1.
    match source.alpha_mode {
        Checked::Valid(AlphaMode::Blend) if alpha <= 0.0 => return Ok(None),
        Checked::Valid(AlphaMode::Mask) if alpha < cutoff => return Ok(None),
        Checked::Valid(AlphaMode::Opaque) => {}
        Checked::Valid(AlphaMode::Blend) => opacity = alpha.min(1.0),
        Checked::Valid(AlphaMode::Mask) | Checked::Invalid => {}
    }
    let is_known = match source.alpha_mode {
        Checked::Valid(AlphaMode::Opaque) => true,
        Checked::Valid(_) => pbr.base_color_texture.is_none(),
        Checked::Invalid => false,
    };
    if !is_known {
        report.add("alpha mode");
    }
    let mut material =
        Material::metallic_roughness([r, g, b], pbr.metallic_factor.0, pbr.roughness_factor.0);
    material.emission = source.emissive_factor.0;
    material.layers.opacity = opacity;
    let Some(extensions) = &source.extensions else {
        return Ok(Some(material));
    };
    if let Some(strength) = &extensions.emissive_strength {
        material.emission = material.emission.map(|e| e * strength.emissive_strength.0);
    }
    if let Some(transmission) = &extensions.transmission {
        material.transmission = transmission.transmission_factor.0;
    }
    match &extensions.ior {
        // In this extension 0 means total reflection at all angles.
        Some(ior) if ior.ior.0 == 0.0 => report.add("index of refraction 0"),
        Some(ior) => material.ior = ior.ior.0,
        None => {}
    }
    if let Some(specular) = &extensions.specular {
        material.layers.specular = specular.specular_factor.0;
        material.layers.specular_color = specular.specular_color_factor.0;
    }
    layers(extensions, material.transmission, &mut material.layers)?;
    if extensions.unlit.is_some() {
        material.layers.unlit = true;
        // What an integrator without unlit surfaces shows.
        material.model = Model::MetallicRoughness {
            metallic: 0.0,
            roughness: 1.0,
        };
    }
    Ok(Some(material))
}

/// Factors of extensions that the crate `gltf` has no types for, or has them behind features.
/// Defaults are those of the extensions' specifications.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Volume {
    thickness_factor: f32,
    attenuation_distance: Option<f32>,
    attenuation_color: Option<Rgb>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Clearcoat {
    clearcoat_factor: f32,
    clearcoat_roughness_factor: f32,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Sheen {
    sheen_color_factor: Rgb,
    sheen_roughness_factor: f32,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Iridescence {
    iridescence_factor: f32,
    iridescence_ior: Option<f32>,
    /// The thickness where no texture says otherwise.
    iridescence_thickness_maximum: Option<f32>,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Anisotropy {
    anisotropy_strength: f32,
    anisotropy_rotation: f32,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Dispersion {
    dispersion: f32,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct DiffuseTransmission {
    diffuse_transmission_factor: f32,
    diffuse_transmission_color_factor: Option<Rgb>,
}

/// Fills the layers from the extensions. What transmits without a volume is thin-walled.
fn layers(
    extensions: &gltf::json::extensions::material::Material,
    transmission: f32,
    layers: &mut Layers,
) -> Result<(), Wrong> {
    /// Reads an extension; its defaults if the material does not have it.
    fn read<T: Default + DeserializeOwned>(
        extensions: &gltf::json::extensions::material::Material,
        name: &'static str,
    ) -> Result<T, Wrong> {
        match extensions.others.get(name) {
            Some(value) => T::deserialize(value).map_err(|e| (name, e.to_string())),
            None => Ok(T::default()),
        }
    }
    let clearcoat: Clearcoat = read(extensions, "KHR_materials_clearcoat")?;
    layers.clearcoat = clearcoat.clearcoat_factor;
    layers.clearcoat_roughness = clearcoat.clearcoat_roughness_factor;
    let sheen: Sheen = read(extensions, "KHR_materials_sheen")?;
    layers.sheen_color = sheen.sheen_color_factor;
    layers.sheen_roughness = sheen.sheen_roughness_factor;
    let film: Iridescence = read(extensions, "KHR_materials_iridescence")?;
    layers.iridescence = film.iridescence_factor;
    layers.iridescence_ior = film.iridescence_ior.unwrap_or(layers.iridescence_ior);
    let thickness = film.iridescence_thickness_maximum;
    layers.iridescence_thickness = thickness.unwrap_or(layers.iridescence_thickness);
    let stretch: Anisotropy = read(extensions, "KHR_materials_anisotropy")?;
    layers.anisotropy = stretch.anisotropy_strength;
    layers.anisotropy_rotation = stretch.anisotropy_rotation;
    layers.dispersion = read::<Dispersion>(extensions, "KHR_materials_dispersion")?.dispersion;
    let sheet: DiffuseTransmission = read(extensions, "KHR_materials_diffuse_transmission")?;
    layers.diffuse_transmission = sheet.diffuse_transmission_factor;
    let color = sheet.diffuse_transmission_color_factor;
    layers.diffuse_transmission_color = color.unwrap_or(layers.diffuse_transmission_color);
    let volume: Volume = read(extensions, "KHR_materials_volume")?;
    let transmits = transmission > 0.0 || layers.diffuse_transmission > 0.0;
    layers.thin_walled = transmits && volume.thickness_factor <= 0.0;
    if volume.thickness_factor > 0.0 {
        let (distance, color) = (volume.attenuation_distance, volume.attenuation_color);
        layers.attenuation_distance = distance.unwrap_or(layers.attenuation_distance);
        layers.attenuation_color = color.unwrap_or(layers.attenuation_color);
    }
    Ok(())
}
