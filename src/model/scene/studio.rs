//! A studio for scenes that bring no light: a soft sky, a large key light up to the camera's
//! left, a wide fill from its right, and a little light from below, as one environment map. It
//! has no size, so it serves scenes of any, and no shadow in it is black.

use super::{Camera, Environment, Rgb};
use glam::DVec3;
use std::f64::consts::PI;

const WIDTH: u32 = 256;
const HEIGHT: u32 = 128;

/// The radiance of the sky above, at the horizon and below.
const SKY: [f64; 3] = [0.5, 0.36, 0.22];

/// A soft light: its direction in the camera's axes (right, up, back), the radius of its disc
/// in radians, its softness as a share of the radius, and its radiance.
struct Soft {
    towards: [f64; 3],
    radius: f64,
    edge: f64,
    radiance: f64,
}

const LIGHTS: [Soft; 2] = [
    Soft {
        towards: [-0.75, 1.0, 0.75],
        radius: 0.42,
        edge: 0.35,
        radiance: 4.2,
    },
    Soft {
        towards: [1.0, 0.25, 0.45],
        radius: 0.7,
        edge: 0.8,
        radiance: 0.75,
    },
];

/// Returns the studio of a camera.
pub fn studio(camera: &Camera) -> Environment {
    let mut pixels = Vec::with_capacity((WIDTH * HEIGHT) as usize);
    for row in 0..HEIGHT {
        let polar = (f64::from(row) + 0.5) / f64::from(HEIGHT) * PI;
        for column in 0..WIDTH {
            let turn = ((f64::from(column) + 0.5) / f64::from(WIDTH) - 0.5) * 2.0 * PI;
            let (sin, cos) = libm::sincos(polar);
            let (x, z) = libm::sincos(turn);
            let towards = DVec3::new(sin * x, cos, -sin * z);
            pixels.push(radiance(camera, towards));
        }
    }
    Environment {
        width: WIDTH,
        height: HEIGHT,
        pixels: pixels.into(),
        rotation: 0.0,
        scale: [1.0; 3],
    }
}

/// Returns the studio's radiance from a unit direction.
fn radiance(camera: &Camera, towards: DVec3) -> Rgb {
    // The camera's up, level: the sky stays above where the camera looks down.
    let height = towards.y;
    let [above, level, below] = SKY;
    let sky = match height > 0.0 {
        true => level + (above - level) * height,
        false => level + (below - level) * smooth(-height * 4.0),
    };
    let level_back = {
        let back = -camera.forward;
        let flat = DVec3::new(back.x, 0.0, back.z);
        match flat.length() > 1e-3 {
            true => flat.normalize(),
            false => DVec3::Z,
        }
    };
    let right = DVec3::Y.cross(level_back);
    let soft = LIGHTS.iter().map(|light| {
        let [r, u, b] = light.towards;
        let axis = (right * r + DVec3::Y * u + level_back * b).normalize();
        let angle = libm::acos(towards.dot(axis).clamp(-1.0, 1.0));
        let inside = (light.radius - angle) / (light.radius * light.edge) + 0.5;
        light.radiance * smooth(inside)
    });
    [(sky + soft.sum::<f64>()) as f32; 3]
}

/// Rises smoothly from 0 to 1 between 0 and 1.
fn smooth(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_white_surface_is_lit_from_every_side_and_shows_at_most_white() {
        let camera = Camera::perspective(DVec3::new(3.0, 2.0, 4.0), DVec3::ZERO, DVec3::Y, 35.0);
        let map = studio(&camera);
        let normals = [
            DVec3::Y,
            -DVec3::Y,
            DVec3::X,
            -DVec3::X,
            DVec3::Z,
            -DVec3::Z,
        ];
        for normal in normals.into_iter().chain([-camera.forward]) {
            let [shown, _, _] = map.radiance_of_white(normal);
            assert!((0.2..1.05).contains(&shown), "{normal}: {shown}");
        }
    }
}
