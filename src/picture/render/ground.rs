//! The colour of a ground that goes over into what is behind it.

use super::config::Backdrop;
use super::paths::STUDIO_BACKDROP;
use crate::scene::{Camera, Rgb, Tables, studio};
use glam::DVec3;

/// The albedo of a ground in a scene that is lit by its own lights.
const ALBEDO: f32 = 0.6;

/// The least and the greatest albedo of a ground that is to look like its backdrop.
const ALBEDOS: [f64; 2] = [0.02, 0.9];

/// Returns the albedo of a ground. In the studio the ground, where nothing stands on it, has the
/// radiance of the backdrop, so that no horizon shows.
pub fn ground_albedo(scene: &Tables, camera: &Camera, backdrop: Backdrop) -> Rgb {
    if !scene.is_dark() {
        return [ALBEDO; 3];
    }
    let behind = match backdrop {
        Backdrop::Color(color) => color,
        _ if scene.background != [0.0; 3] => scene.background,
        _ => STUDIO_BACKDROP,
    };
    let white = studio(camera).radiance_of_white(DVec3::Y);
    std::array::from_fn(|k| {
        let [least, most] = ALBEDOS;
        (f64::from(behind[k]) / white[k]).clamp(least, most) as f32
    })
}
