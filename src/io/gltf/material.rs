//! Materials: metallic-roughness factors and four extensions.
//!
//! Textures are not imported, nor alpha between 0 and 1, but counted. What alpha hides for
//! certain, 0 with BLEND or less than the cutoff with MASK, is left out of meshes. The
//! scene's check refuses values out of range, and names the material.

use super::File;
use crate::ImportReport;
use crate::scene::{Material, MaterialId, Model, SceneBuilder};
use crate::shared::messages::one_line;
use gltf::json::material::AlphaMode;
use gltf::json::validation::Checked;

/// Adds one row per material of the file, in order, and returns their ids, `None` for those
/// of invisible surfaces.
pub(super) fn import(
    file: &File,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Vec<Option<MaterialId>> {
    let mut ids = Vec::with_capacity(file.root.materials.len());
    for source in &file.root.materials {
        let name = one_line(source.name.as_deref().unwrap_or_default());
        let material = convert(source, report);
        ids.push(material.map(|material| scene.material(&name, material)));
    }
    ids
}

/// Converts a material; `None` if it makes surfaces invisible.
fn convert(source: &gltf::json::Material, report: &mut ImportReport) -> Option<Material> {
    let pbr = &source.pbr_metallic_roughness;
    let [r, g, b, alpha] = pbr.base_color_factor.0;
    let cutoff = source.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0);
    // A texture's alpha is a factor of at most 1.
    match source.alpha_mode {
        Checked::Valid(AlphaMode::Blend) if alpha <= 0.0 => return None,
        Checked::Valid(AlphaMode::Mask) if alpha < cutoff => return None,
        Checked::Valid(AlphaMode::Opaque) => {}
        Checked::Valid(_) if alpha >= 1.0 && pbr.base_color_texture.is_none() => {}
        _ => report.add("alpha mode"),
    }
    let mut material =
        Material::metallic_roughness([r, g, b], pbr.metallic_factor.0, pbr.roughness_factor.0);
    material.emission = source.emissive_factor.0;
    let Some(extensions) = &source.extensions else {
        return Some(material);
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
    if extensions.unlit.is_some() {
        report.add("unlit material");
        material.model = Model::MetallicRoughness {
            metallic: 0.0,
            roughness: 1.0,
        };
    }
    Some(material)
}
