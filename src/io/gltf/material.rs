//! Materials: metallic-roughness factors and the layers of the material extensions, with their
//! textures.
//!
//! What alpha hides for certain, 0 with BLEND or less than the cutoff with MASK, is left out of
//! meshes. Occlusion is light that paths find themselves, so its textures are left out. The
//! scene's check refuses values out of range, and names the material.

use super::File;
use super::environment;
use super::texture::Images;
use super::variant::material_in;
use crate::scene::{
    Alpha, Layers, Material, MaterialId, Model, Rgb, SceneBuilder, Slot, TextureRef, Texturing,
};
use crate::shared::images::ImageStore;
use crate::shared::messages::one_line;
use crate::shared::texels::ImageUse;
use crate::{Folder, ImportReport, LoadError};
use gltf::json::material::AlphaMode;
use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

/// A material of the file.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Imported {
    /// `None` for invisible surfaces.
    pub id: Option<MaterialId>,
    /// The number of sets of texture coordinates that its textures refer to.
    pub sets: u8,
    /// The set that tangents are made of, where a normal map or a stretch needs them.
    pub tangent_set: Option<u8>,
    /// Whether colours of vertices scale it.
    pub vertex_color: bool,
}

/// The materials of a file, in order, and that of primitives that have colours of vertices and
/// name no material.
pub(super) struct Materials {
    pub rows: Vec<Imported>,
    pub unnamed: Imported,
}

/// Adds one row per material of the file, in order. Fails if an extension has a value of the
/// wrong type.
pub(super) fn import(
    file: &File,
    (folder, store): (&Folder, &mut ImageStore),
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<Materials, LoadError> {
    let (colored, unnamed_colored) = with_vertex_colors(file);
    let mut images = Images::new(file, folder, store);
    let mut rows = Vec::with_capacity(file.root.materials.len());
    for (row, source) in file.root.materials.iter().enumerate() {
        let name = one_line(source.name.as_deref().unwrap_or_default());
        let material = convert(source).map_err(|(extension, why)| {
            file.invalid(&format!("material {row}, {extension}"), &why)
        })?;
        let Some(material) = material else {
            rows.push(Imported::default());
            continue;
        };
        if ior_is_zero(source) {
            report.add("index of refraction 0");
        }
        let json = file.sources.materials.get(row).unwrap_or(&Value::Null);
        // What an invalid mode means nobody knows; it is counted below.
        let is_opaque = source.alpha_mode == Checked::Valid(AlphaMode::Opaque);
        let mut textured = textures(json, is_opaque, &mut images, scene, report);
        // Nothing is scaled that is 0.
        textured
            .refs
            .retain(|(slot, _)| *slot != Slot::Emission || material.emission != [0.0; 3]);
        let texturing = Texturing {
            alpha: alpha(
                source,
                &material,
                textured.has_alpha || colored[row],
                report,
            ),
            vertex_color: colored[row],
            normal_scale: number(json, "/normalTexture/scale").unwrap_or(1.0),
            coat_normal_scale: number(json, &format!("{COAT_NORMAL}/scale")).unwrap_or(1.0),
            follows_tangents: material.layers.anisotropy > 0.0,
            film_least: number(json, FILM_LEAST).unwrap_or(100.0),
            ..Texturing::default()
        };
        let id = scene.material(&name, material);
        if !textured.refs.is_empty() || colored[row] || texturing.follows_tangents {
            scene.texture(id, texturing, &textured.refs);
        }
        // The specification asks for the same set in all three, if they need tangents.
        let of_slot = |slot: Slot| textured.refs.iter().find(|(of, _)| *of == slot);
        let bent = of_slot(Slot::Normal).or(of_slot(Slot::ClearcoatNormal));
        let bent = bent.or(of_slot(Slot::Anisotropy)).map(|(_, of)| of.uv_set);
        let tangent_set = bent.or(texturing.follows_tangents.then_some(0));
        let tangent_set = tangent_set.filter(|_| needs_tangents(&textured.refs, &texturing));
        let sets = textured.refs.iter().map(|(_, of)| of.uv_set + 1);
        let sets = sets.chain(tangent_set.map(|set| set + 1));
        rows.push(Imported {
            id: Some(id),
            sets: sets.max().unwrap_or(0).max(u8::from(file.keeps_uvs)),
            tangent_set,
            vertex_color: colored[row],
        });
    }
    let unnamed = unnamed_colored.then(|| {
        let id = scene.material("", Material::metallic_roughness([1.0; 3], 0.0, 1.0));
        let texturing = Texturing {
            vertex_color: true,
            ..Texturing::default()
        };
        scene.texture(id, texturing, &[]);
        Imported {
            id: Some(id),
            vertex_color: true,
            ..Imported::default()
        }
    });
    let mut unnamed = unnamed.unwrap_or_default();
    unnamed.sets = u8::from(file.keeps_uvs);
    environment::import(file, &mut images, scene, report);
    Ok(Materials { rows, unnamed })
}

/// Says whether meshes of a material need tangents.
fn needs_tangents(refs: &[(Slot, TextureRef)], texturing: &Texturing) -> bool {
    let is_bent = |slot: Slot| matches!(slot, Slot::Normal | Slot::ClearcoatNormal);
    texturing.follows_tangents || refs.iter().any(|(slot, _)| is_bent(*slot))
}

/// Says of each material whether primitives of it have colours of vertices, and whether some do
/// that have no material.
fn with_vertex_colors(file: &File) -> (Vec<bool>, bool) {
    let mut colored = vec![false; file.root.materials.len()];
    let mut unnamed = false;
    for primitive in file.root.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        if !primitive
            .attributes
            .contains_key(&Checked::Valid(Semantic::Colors(0)))
        {
            continue;
        }
        let varied = file
            .variant
            .and_then(|variant| material_in(primitive, variant));
        match varied.or(primitive.material.map(|id| id.value())) {
            None => unnamed = true,
            Some(id) => {
                if let Some(colored) = colored.get_mut(id) {
                    *colored = true;
                }
            }
        }
    }
    (colored, unnamed)
}

/// The textures of a material.
struct Textured {
    refs: Vec<(Slot, TextureRef)>,
    /// Whether that of the base colour has alpha.
    has_alpha: bool,
}

/// Where a material's textures stand, and what they scale.
const TEXTURES: [(&str, Slot); 17] = [
    ("/pbrMetallicRoughness/baseColorTexture", Slot::BaseColor),
    (
        "/pbrMetallicRoughness/metallicRoughnessTexture",
        Slot::MetallicRoughness,
    ),
    ("/emissiveTexture", Slot::Emission),
    ("/normalTexture", Slot::Normal),
    (
        "/extensions/KHR_materials_specular/specularTexture",
        Slot::Specular,
    ),
    (
        "/extensions/KHR_materials_specular/specularColorTexture",
        Slot::SpecularColor,
    ),
    (
        "/extensions/KHR_materials_clearcoat/clearcoatTexture",
        Slot::Clearcoat,
    ),
    (
        "/extensions/KHR_materials_clearcoat/clearcoatRoughnessTexture",
        Slot::ClearcoatRoughness,
    ),
    (COAT_NORMAL, Slot::ClearcoatNormal),
    (
        "/extensions/KHR_materials_sheen/sheenColorTexture",
        Slot::SheenColor,
    ),
    (
        "/extensions/KHR_materials_sheen/sheenRoughnessTexture",
        Slot::SheenRoughness,
    ),
    (
        "/extensions/KHR_materials_transmission/transmissionTexture",
        Slot::Transmission,
    ),
    (
        "/extensions/KHR_materials_iridescence/iridescenceTexture",
        Slot::Iridescence,
    ),
    (
        "/extensions/KHR_materials_iridescence/iridescenceThicknessTexture",
        Slot::IridescenceThickness,
    ),
    (
        "/extensions/KHR_materials_anisotropy/anisotropyTexture",
        Slot::Anisotropy,
    ),
    (
        "/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionTexture",
        Slot::DiffuseTransmission,
    ),
    (
        "/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorTexture",
        Slot::DiffuseTransmissionColor,
    ),
];

/// Textures that are not imported.
const UNREAD: [(&str, &str); 2] = [
    ("/occlusionTexture", "occlusion texture"),
    (
        "/extensions/KHR_materials_volume/thicknessTexture",
        "thickness texture",
    ),
];

const COAT_NORMAL: &str = "/extensions/KHR_materials_clearcoat/clearcoatNormalTexture";

const FILM_LEAST: &str = "/extensions/KHR_materials_iridescence/iridescenceThicknessMinimum";

fn number(json: &Value, place: &str) -> Option<f32> {
    let number = json.pointer(place).and_then(Value::as_f64);
    number.map(|x| x as f32).filter(|x| x.is_finite())
}

/// Reads the textures of a material, which alpha does nothing to if it is opaque.
fn textures(
    json: &Value,
    is_opaque: bool,
    images: &mut Images,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Textured {
    let mut all = Textured {
        refs: Vec::new(),
        has_alpha: false,
    };
    for (place, slot) in TEXTURES {
        let Some(info) = json.pointer(place) else {
            continue;
        };
        let used = match slot {
            Slot::BaseColor if !is_opaque => ImageUse::ColorAndAlpha,
            slot if slot.is_color() => ImageUse::Color,
            _ => ImageUse::Numbers,
        };
        if let Some((texture, has_alpha)) = images.read(info, used, scene, report) {
            all.refs.push((slot, texture));
            all.has_alpha |= slot == Slot::BaseColor && has_alpha;
        }
    }
    for (place, what) in UNREAD {
        report.add_many(what, usize::from(json.pointer(place).is_some()));
    }
    all
}

/// Returns what alpha does where it varies. Where it does not, `opacity` says it all.
fn alpha(
    source: &gltf::json::Material,
    material: &Material,
    varies: bool,
    report: &mut ImportReport,
) -> Alpha {
    let [.., factor] = source.pbr_metallic_roughness.base_color_factor.0;
    let cutoff = source.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0);
    match source.alpha_mode {
        Checked::Valid(AlphaMode::Blend) if varies && material.layers.opacity > 0.0 => Alpha::Blend,
        Checked::Valid(AlphaMode::Mask) if varies && cutoff > 0.0 => Alpha::Mask(cutoff / factor),
        Checked::Valid(_) => Alpha::Opaque,
        Checked::Invalid => {
            report.add("alpha mode");
            Alpha::Opaque
        }
    }
}

fn ior_is_zero(source: &gltf::json::Material) -> bool {
    let extensions = source.extensions.as_ref();
    let ior = extensions.and_then(|all| all.ior.as_ref());
    ior.is_some_and(|ior| ior.ior.0 == 0.0)
}

/// The name of an extension, and what is wrong with it.
type Wrong = (&'static str, String);

/// Converts a material; `None` if it makes surfaces invisible.
fn convert(source: &gltf::json::Material) -> Result<Option<Material>, Wrong> {
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
        Some(ior) if ior.ior.0 != 0.0 => material.ior = ior.ior.0,
        _ => {}
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
