//! Materials: metallic-roughness factors and four extensions.
//!
//! Textures and alpha are not imported but counted. The scene's check refuses values out of
//! range, and names the material.

use super::File;
use crate::ImportReport;
use crate::scene::{Material, MaterialId, Model, SceneBuilder};
use crate::shared::messages::one_line;
use gltf::json::material::AlphaMode;
use gltf::json::validation::Checked;

/// Adds one row per material of the file, in order, and returns their ids.
pub(super) fn import(
    file: &File,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Vec<MaterialId> {
    let mut ids = Vec::with_capacity(file.root.materials.len());
    for source in &file.root.materials {
        let name = one_line(source.name.as_deref().unwrap_or_default());
        ids.push(scene.material(&name, convert(source, report)));
    }
    ids
}

/// Converts a material.
fn convert(source: &gltf::json::Material, report: &mut ImportReport) -> Material {
    let pbr = &source.pbr_metallic_roughness;
    let [r, g, b, _] = pbr.base_color_factor.0;
    let mut material =
        Material::metallic_roughness([r, g, b], pbr.metallic_factor.0, pbr.roughness_factor.0);
    material.emission = source.emissive_factor.0;
    if source.alpha_mode != Checked::Valid(AlphaMode::Opaque) {
        report.add("alpha mode");
    }
    let Some(extensions) = &source.extensions else {
        return material;
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
    material
}
