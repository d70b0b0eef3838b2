//! Default lights for scenes without their own, which follow the camera: a headlight, and a weaker
//! key light from its upper left, which shows the shapes. Together they give a white Lambert
//! surface that faces the camera a radiance of 0.9.

use super::{Camera, Light};
use std::f64::consts::PI;

/// The radiance of a white surface that faces the camera.
const FACING_RADIANCE: f64 = 0.9;
/// The headlight's share of that radiance.
const HEADLIGHT: f64 = 0.65;
/// The direction of the key light's source: to the camera's left, up, and back.
const KEY: [f64; 3] = [-0.6, 0.7, 0.75];

/// Returns the default lights of a camera.
pub fn default_lights(camera: &Camera) -> Vec<Light> {
    let [left, up, back] = KEY;
    let to_key = camera.right * left + camera.up * up - camera.forward * back;
    let cosine = back / to_key.length();
    let full = FACING_RADIANCE * PI;
    let light = |direction, irradiance: f64| Light::Directional {
        direction,
        irradiance: [irradiance as f32; 3],
        angle: 0.0,
    };
    vec![
        light(camera.forward, full * HEADLIGHT),
        light(-to_key, full * (1.0 - HEADLIGHT) / cosine),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_white_surface_that_faces_the_camera_shows_0_9() {
        let camera = Camera::perspective(DVec3::new(1.0, 2.0, 3.0), DVec3::ZERO, DVec3::Y, 35.0);
        let radiance: f64 = default_lights(&camera)
            .iter()
            .map(|light| match light {
                Light::Directional {
                    direction,
                    irradiance,
                    ..
                } => f64::from(irradiance[0]) * direction.normalize().dot(camera.forward) / PI,
                _ => panic!("the default lights are far away"),
            })
            .sum();
        assert!((radiance - 0.9).abs() < 1e-6, "{radiance}");
    }
}
