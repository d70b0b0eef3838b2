//! Lights of nodes (KHR_lights_punctual).

use super::File;
use super::nodes::label;
use crate::math::Affine;
use crate::scene::{Falloff, Light, SceneBuilder};
use crate::shared::mesh_cleanup::unit;
use crate::{ImportReport, LoadError};
use glam::DVec3;
use gltf::json::extensions::scene::khr_lights_punctual::{self, Type as LightType};
use gltf::json::validation::Checked;
use std::f32::consts::FRAC_PI_4;

/// Adds the light of a node, if it has one; `worlds` are the times and places of its node, one if
/// it does not move.
pub(super) fn light(
    file: &File,
    node: usize,
    worlds: &[(f64, Affine)],
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let extensions = file.root.nodes[node].extensions.as_ref();
    let Some(id) = extensions.and_then(|e| e.khr_lights_punctual.as_ref()) else {
        return Ok(());
    };
    let id = id.light.value();
    let extensions = file.root.extensions.as_ref();
    let lights = extensions.and_then(|e| e.khr_lights_punctual.as_ref());
    let lights = lights.map_or(&[][..], |l| &l.lights);
    let Some(source) = lights.get(id) else {
        let message = format!("refers to light {id}, but there are {}", lights.len());
        return Err(file.invalid(&label(file, node), &message));
    };
    if source.range.is_some() {
        report.add("light range");
    }
    if source.type_ == Checked::Invalid {
        report.add("light of an unknown type");
        return Ok(());
    }
    let keys = worlds
        .iter()
        .map(|(at, world)| Some((*at, placed(source, world)?)));
    match keys.collect::<Option<Vec<_>>>() {
        None => report.add("light of a node scaled to nothing"),
        Some(keys) => {
            let id = scene.light(keys[0].1);
            if keys.len() > 1 {
                scene.move_light(id, &keys);
            }
        }
    }
    Ok(())
}

/// Places a light: a directional light shines along -z of its node, a point light from its origin,
/// a spot light from there along -z. `None` if a node scaled to nothing leaves no direction.
fn placed(source: &khr_lights_punctual::Light, world: &Affine) -> Option<Light> {
    let power = source.color.map(|c| c * source.intensity);
    let travels = || unit(DVec3::from_array(world.vector([0.0, 0.0, -1.0])));
    let position = DVec3::from_array(world.translation);
    match source.type_ {
        Checked::Valid(LightType::Directional) => Some(Light::Directional {
            direction: travels()?,
            irradiance: power,
            angle: 0.0,
        }),
        Checked::Valid(LightType::Spot) => {
            let cone = source.spot.as_ref();
            let outer = cone.map_or(FRAC_PI_4, |cone| cone.outer_cone_angle);
            Some(Light::Spot {
                position,
                direction: travels()?,
                intensity: power,
                inner: cone.map_or(0.0, |cone| f64::from(cone.inner_cone_angle)),
                outer: f64::from(outer),
                radius: 0.0,
            })
        }
        Checked::Valid(LightType::Point) => Some(Light::Point {
            position,
            intensity: power,
            falloff: Falloff::InverseSquare,
            radius: 0.0,
        }),
        Checked::Invalid => None,
    }
}
