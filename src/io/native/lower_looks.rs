//! From the typed file to what is seen by: environment, camera, lights, materials.

use super::lower::{Result, not_one, not_zero};
use super::lower_pattern::{Holds, mean};
use super::schema;
use super::schema_light;
use super::schema_pattern::{ColorOrPattern, NumberOrPattern};
use super::source_spans::At;
use super::tree::{Source, quoted};
use crate::environment_map::{MAP_FORMATS, names_map, read_map};
use crate::scene::{Environment, Layers, Light, Lit, Material, Model, SceneBuilder};
use crate::{Folder, ImportReport, LoadError, LoadOptions};
use lanecast_light::sky::sky as clear_sky;

/// Adds an environment by a picture or a colour.
pub(super) fn environment(
    source: &Source,
    row: &At<schema_light::Environment>,
    (options, report): (&LoadOptions, &mut ImportReport),
    scene: &mut SceneBuilder,
) -> Result<()> {
    let At { at, value: row } = row;
    let scale = scale(source, &row.scale)?;
    let rotation = row.rotate_y.unwrap_or(0.0).to_radians();
    match (&row.file, &row.color) {
        (Some(file), None) => {
            let map = picture_of_sky(source, file, (options, report))?;
            scene.environment(Environment {
                width: map.width,
                height: map.height,
                pixels: map.pixels.into(),
                rotation,
                scale,
            });
            Ok(())
        }
        (None, Some(color)) if color.value.iter().any(|c| *c < 0.0) => {
            Err(source.error(color.at, "color must be 0 or greater"))
        }
        (None, Some(color)) => {
            let radiance = std::array::from_fn(|k| color.value[k] * scale[k]);
            scene.environment(Environment::uniform(radiance));
            Ok(())
        }
        (file, color) => {
            let given = [("file", file.is_some()), ("color", color.is_some())];
            Err(not_one(source, *at, "the environment", &given))
        }
    }
}

/// Adds a clear sky as the environment. Returns its sun, a light.
pub(super) fn sky(
    source: &Source,
    row: &At<schema_light::Sky>,
    scene: &mut SceneBuilder,
) -> Result<Light> {
    let sky = &row.value;
    let scale = scale(source, &sky.scale)?;
    let towards = not_zero(source, "sun_direction", &sky.sun_direction)?;
    if towards.y < 0.0 {
        return Err(source.error(
            sky.sun_direction.at,
            "sun_direction points below the horizon, and this sky is of the day; give it a y of 0 or more",
        ));
    }
    let ground = sky.ground.unwrap_or([0.3; 3]);
    let turbidity = match &sky.turbidity {
        None => 3.0,
        Some(given) if (1.7..=10.0).contains(&given.value) => given.value,
        Some(given) => {
            let message = format!("turbidity is {}; it must be from 1.7 to 10", given.value);
            return Err(source.error(given.at, message));
        }
    };
    let (map, mut sun) = clear_sky(towards.to_array(), turbidity, ground);
    scene.environment(Environment { scale, ..map });
    if let Light::Directional { irradiance, .. } = &mut sun {
        *irradiance = std::array::from_fn(|k| irradiance[k] * scale[k]);
    }
    Ok(sun)
}

/// Reads a factor of radiance.
fn scale(source: &Source, row: &Option<At<schema::Scale>>) -> Result<[f32; 3]> {
    let Some(scale) = row else {
        return Ok([1.0; 3]);
    };
    if scale.value.0.iter().any(|factor| *factor < 0.0) {
        return Err(source.error(scale.at, "scale must be 0 or greater"));
    }
    let factors = scale.value.0.map(|factor| factor as f32);
    if factors.iter().any(|factor| factor.is_infinite()) {
        return Err(source.error(
            scale.at,
            "scale is too large; at most 3e38 is possible here",
        ));
    }
    Ok(factors)
}

fn picture_of_sky(
    source: &Source,
    file: &At<String>,
    (options, report): (&LoadOptions, &mut ImportReport),
) -> Result<crate::environment_map::Map> {
    let refuse = |why: String| {
        let message = format!("the environment map {} {why}", quoted(&file.value));
        source.error(file.at, message)
    };
    let found = Folder::new(source.path, options).resolve(&file.value);
    let path = found.map_err(|e| match e {
        LoadError::Read { source: why, .. } => refuse(format!("cannot be read: {why}")),
        other => other,
    })?;
    if !names_map(&path) {
        return Err(refuse(format!(
            "is of no known format; known are {MAP_FORMATS}"
        )));
    }
    read_map(&path, report)
}

/// Puts lights into the group that is named, if any is.
pub(super) fn group(
    source: &Source,
    name: &Option<At<String>>,
    lights: impl IntoIterator<Item = Lit>,
    scene: &mut SceneBuilder,
) -> Result<()> {
    let Some(name) = name else {
        return Ok(());
    };
    // Other signs part the names of layers and channels in OpenEXR files.
    let fits = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    if name.value.is_empty() || !name.value.chars().all(fits) {
        let message = format!(
            "the group {} has to be of letters, digits, - and _, as it names layers of pictures",
            quoted(&name.value)
        );
        return Err(source.error(name.at, message));
    }
    // Names of channels, here with `light_` and `.R`, have at most 255 bytes in OpenEXR files.
    const LONGEST: usize = 240;
    if name.value.len() > LONGEST {
        let message = format!("a group's name has at most {LONGEST} letters");
        return Err(source.error(name.at, message));
    }
    if name.value == "ungrouped" {
        let message = "the group 'ungrouped' is that of lights without one; name it otherwise";
        return Err(source.error(name.at, message));
    }
    for lit in lights {
        scene.light_group(&name.value, lit);
    }
    Ok(())
}

pub(super) fn material(source: &Source, row: &schema::Material) -> Result<Material> {
    let usual = Material::default();
    let Model::MetallicRoughness {
        metallic,
        roughness,
    } = usual.model
    else {
        return Ok(usual);
    };
    // Kept as f32, which must not make 0 of it.
    if let Some(ior) = &row.ior {
        let why = match ior.value as f32 {
            0.0 if ior.value > 0.0 => Some("small; at least 1e-45"),
            f32::INFINITY => Some("large; at most 3e38"),
            _ => None,
        };
        if let Some(why) = why {
            let message = format!("{:e} is too {why} is possible here", ior.value);
            return Err(source.error(ior.at, message));
        }
    }
    Ok(Material {
        // No surface reflects more than it gets.
        base_color: match &row.base_color {
            None => usual.base_color,
            Some(At { at, value }) => match value {
                ColorOrPattern::Color(color) => color.map(|c| c.min(1.0)),
                ColorOrPattern::Pattern(row) => mean(source, (*at, row), Holds::Colors)?,
                ColorOrPattern::Texture(_) => [1.0; 3],
            },
        },
        emission: row.emission.unwrap_or(usual.emission),
        transmission: row.transmission.unwrap_or(usual.transmission),
        ior: row.ior.map_or(usual.ior, |ior| ior.value as f32),
        model: match &row.phong {
            Some(phong) => self::phong(source, row, phong)?,
            None => Model::MetallicRoughness {
                metallic: row.metallic.unwrap_or(metallic),
                roughness: match &row.roughness {
                    None => roughness,
                    Some(At { at, value }) => match value {
                        NumberOrPattern::Number(roughness) => *roughness,
                        NumberOrPattern::Pattern(row) => {
                            mean(source, (*at, row), Holds::Numbers)?[0]
                        }
                    },
                },
            },
        },
        layers: layers(row),
    })
}

/// Returns Phong's model, which has no metallic or roughness beside it.
fn phong(source: &Source, row: &schema::Material, phong: &At<schema::Phong>) -> Result<Model> {
    if row.metallic.is_some() || row.roughness.is_some() {
        let message = "phong is in place of metallic and roughness; leave out one or the other";
        return Err(source.error(phong.at, message));
    }
    let phong = &phong.value;
    Ok(Model::Phong {
        diffuse: phong.diffuse.unwrap_or_default(),
        specular: phong.specular.unwrap_or_default(),
        exponent: phong.exponent.unwrap_or(1.0),
        mirror: phong.mirror.unwrap_or_default(),
    })
}

fn layers(row: &schema::Material) -> Layers {
    let none = Layers::default();
    let attenuation = row.attenuation.as_ref();
    Layers {
        opacity: row.opacity.unwrap_or(none.opacity),
        unlit: row.unlit.unwrap_or(none.unlit),
        diffuse_roughness: row.diffuse_roughness.unwrap_or(none.diffuse_roughness),
        specular: row.specular.unwrap_or(none.specular),
        specular_color: row.specular_color.unwrap_or(none.specular_color),
        anisotropy: row.anisotropy.unwrap_or(none.anisotropy),
        anisotropy_rotation: row
            .anisotropy_rotation
            .map_or(none.anisotropy_rotation, f32::to_radians),
        clearcoat: row.clearcoat.unwrap_or(none.clearcoat),
        clearcoat_roughness: row.clearcoat_roughness.unwrap_or(none.clearcoat_roughness),
        sheen_color: row.sheen_color.unwrap_or(none.sheen_color),
        sheen_roughness: row.sheen_roughness.unwrap_or(none.sheen_roughness),
        diffuse_transmission: row
            .diffuse_transmission
            .unwrap_or(none.diffuse_transmission),
        diffuse_transmission_color: row
            .diffuse_transmission_color
            .unwrap_or(none.diffuse_transmission_color),
        iridescence: row.iridescence.unwrap_or(none.iridescence),
        iridescence_ior: row.iridescence_ior.unwrap_or(none.iridescence_ior),
        iridescence_thickness: row
            .iridescence_thickness
            .unwrap_or(none.iridescence_thickness),
        dispersion: row.dispersion.unwrap_or(none.dispersion),
        thin_walled: row.thin.unwrap_or(none.thin_walled),
        attenuation_color: attenuation.map_or(none.attenuation_color, |a| a.color),
        attenuation_distance: attenuation.map_or(none.attenuation_distance, |a| a.distance),
        priority: row.priority.unwrap_or(none.priority),
    }
}
