//! Environment light of a scene (EXT_lights_image_based).
//!
//! The six faces of level 0, which no roughness has blurred, become a map of longitude by latitude
//! with as many pixels along a quarter of its equator as a face has along its side. A pixel is the
//! mean of 2 by 2 directions in it, and each of these a bilinear mean within its face. Faces are
//! pictures as seen from within, upright, those of +y and −y with −z and +z upwards, which is what
//! the extension's flip of the usual cube maps makes of them.
//!
//! Smaller levels and the coefficients of irradiance stand for what paths find themselves.

use super::File;
use super::texture::Images;
use crate::ImportReport;
use crate::scene::{Environment, Image, Rgb, SceneBuilder, Textures};
use crate::shared::messages::one_line;
use crate::shared::texels::ImageUse;
use glam::{DQuat, DVec3};
use serde::Deserialize;
use serde_json::Value;
use std::f64::consts::PI;
use std::sync::Arc;

const NAME: &str = "EXT_lights_image_based";

/// The most pixels along a quarter of the map's equator. The sampled sky has no more.
const MOST_SIDE: u32 = 1024;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Light {
    #[serde(default = "upright")]
    rotation: [f64; 4],
    #[serde(default = "one")]
    intensity: f64,
    specular_images: Vec<[usize; 6]>,
}

fn upright() -> [f64; 4] {
    DQuat::IDENTITY.to_array()
}

fn one() -> f64 {
    1.0
}

/// Sets the environment of the scene to show, if the file has one. What is malformed is counted as
/// left out.
pub(super) fn import(
    file: &File,
    images: &mut Images,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) {
    let shown = file.root.scene.map_or(0, |scene| scene.value());
    let sources = &file.sources;
    let of_scene = sources.scenes.get(shown);
    let Some(used) = of_scene.and_then(|scene| scene.pointer(&format!("/extensions/{NAME}")))
    else {
        return;
    };
    match environment(used, &sources.extensions, images) {
        Ok(environment) => scene.environment(environment),
        Err(why) => report.add(&format!("environment light ({why})")),
    }
}

/// Reads an environment light. Fails with what is wrong.
fn environment(used: &Value, all: &Value, images: &mut Images) -> Result<Environment, String> {
    let lights = all.pointer(&format!("/{NAME}/lights"));
    let lights = lights.and_then(Value::as_array).map_or(&[][..], |l| &l[..]);
    let number = used.get("light").and_then(Value::as_u64);
    let number = number.ok_or("the scene names none")?;
    let light = lights.get(number as usize);
    let light = light.ok_or_else(|| format!("light {number} of {}", lights.len()))?;
    let light = Light::deserialize(light).map_err(|e| one_line(&e.to_string()))?;
    let turn = DQuat::from_array(light.rotation);
    if !(turn.length() > 0.0 && turn.is_finite()) {
        return Err("a rotation that is none".into());
    }
    let scale = light.intensity as f32;
    if !(scale >= 0.0 && scale.is_finite()) {
        return Err(format!("an intensity of {}", light.intensity));
    }
    let level = light.specular_images.first().ok_or("no images")?;
    let mut faces = Vec::with_capacity(6);
    for image in level {
        faces.push(images.image(*image, ImageUse::ColorAndAlpha)?);
    }
    let side = faces[0].size()[0];
    if faces.iter().any(|face| face.size() != [side; 2]) {
        return Err("faces that are not squares of one size".into());
    }
    let cube = Cube::of(faces);
    let height = 2 * side.min(MOST_SIDE);
    Ok(Environment {
        width: 2 * height,
        height,
        pixels: cube.resampled(height, turn.normalize().inverse()).into(),
        rotation: 0.0,
        scale: [scale; 3],
    })
}

/// A cube map.
struct Cube {
    faces: Vec<Arc<Image>>,
    textures: Textures,
}

impl Cube {
    fn of(faces: Vec<Arc<Image>>) -> Cube {
        let mut textures = Textures::default();
        for face in &faces {
            textures.push_image(face.clone());
        }
        Cube { faces, textures }
    }

    /// Returns the pixels of a map of longitude by latitude, of directions that are turned before
    /// they are looked up.
    fn resampled(&self, height: u32, turn: DQuat) -> Vec<Rgb> {
        /// Directions to a pixel along each axis.
        const FINE: u32 = 2;
        let count = f64::from(height * FINE);
        let at = |n: u32| (f64::from(n) + 0.5) / count;
        let mut pixels = Vec::with_capacity(2 * (height as usize).pow(2));
        for row in 0..height {
            for column in 0..2 * height {
                let mut sum = [0.0_f32; 3];
                for k in 0..FINE * FINE {
                    let [x, y] = [column * FINE + k % FINE, row * FINE + k / FINE];
                    let (sin, up) = libm::sincos(at(y) * PI);
                    let (right, ahead) = libm::sincos(at(x) * PI - PI);
                    let towards = DVec3::new(sin * right, up, -sin * ahead);
                    let found = self.radiance(turn * towards);
                    sum = std::array::from_fn(|k| sum[k] + found[k]);
                }
                pixels.push(sum.map(|x| x / (FINE * FINE) as f32));
            }
        }
        pixels
    }

    /// Returns the radiance from a direction.
    fn radiance(&self, towards: DVec3) -> Rgb {
        let DVec3 { x, y, z } = towards;
        let size = towards.abs();
        // The face, what is along its normal, and what is to the right and down from within.
        let (face, along, right, down) = if size.x >= size.y.max(size.z) {
            match x > 0.0 {
                true => (0, size.x, z, -y),
                false => (1, size.x, -z, -y),
            }
        } else if size.y >= size.z {
            match y > 0.0 {
                true => (2, size.y, -x, z),
                false => (3, size.y, -x, -z),
            }
        } else {
            match z > 0.0 {
                true => (4, size.z, -x, -y),
                false => (5, size.z, x, -y),
            }
        };
        let image = &self.faces[face];
        let [side, _] = image.size();
        let place = [right, down].map(|x| (x / along + 1.0) * 0.5 * f64::from(side) - 0.5);
        let place = place.map(|x| x.clamp(0.0, f64::from(side - 1)));
        let low = place.map(|x| x as u32);
        let part: [f32; 2] = [0, 1].map(|k| (place[k] - f64::from(low[k])) as f32);
        let texel = |more: [u32; 2]| {
            let [x, y] = [0, 1].map(|k| (low[k] + more[k]).min(side - 1));
            let [r, g, b, divisor] = self.textures.texel(image, 0, x, y);
            // RGBD: codes of alpha 0 would stand for no number.
            let divisor = divisor.max(1.0 / 255.0);
            [r, g, b].map(|c| c / divisor)
        };
        let mix = |a: Rgb, b: Rgb, t: f32| [0, 1, 2].map(|k| a[k] + (b[k] - a[k]) * t);
        let above = mix(texel([0, 0]), texel([1, 0]), part[0]);
        let below = mix(texel([0, 1]), texel([1, 1]), part[0]);
        mix(above, below, part[1])
    }
}
