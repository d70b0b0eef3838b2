//! Where points are seen: the way back from the world to the picture.

use super::RayGenerator;
use crate::scene::{FisheyeMapping, Projection};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

impl RayGenerator {
    /// Returns where a point is seen, in pixels from the picture's left upper corner, x to the right
    /// and y down; `None` of what is behind the camera, or in a direction without a pixel. The
    /// point may lie outside the picture.
    pub fn seen_at(&self, point: DVec3) -> Option<[f64; 2]> {
        let away = point - self.camera.eye;
        match self.camera.projection.is_parallel() {
            true => {
                let [x, y, _] = self.axes(away);
                Some(self.pixel([x, y]))
            }
            false => self.seen_along(away),
        }
    }

    /// Returns where infinitely far things in a direction are seen, as [`seen_at`](Self::seen_at)
    /// does. Parallel rays see none.
    pub fn seen_along(&self, dir: DVec3) -> Option<[f64; 2]> {
        let [x, y, z] = self.axes(dir);
        let round = || libm::hypot(x, y);
        let at = match self.camera.projection {
            Projection::Orthographic { .. } => return None,
            Projection::Perspective { .. } if z > 0.0 => [x / z, y / z],
            Projection::Calibrated(k) if z > 0.0 => {
                let at = [x / z, -y / z];
                if !k.is_before_fold(at) {
                    return None;
                }
                let [across, down] = k.distorted(at);
                [across, -down]
            }
            Projection::Perspective { .. } | Projection::Calibrated(_) => return None,
            Projection::Panorama => {
                let latitude = libm::atan2(y, libm::hypot(x, z));
                [libm::atan2(x, z) / PI * self.aspect, latitude / FRAC_PI_2]
            }
            Projection::Fisheye { .. } if round() == 0.0 => [0.0; 2],
            Projection::Fisheye {
                half_angle,
                mapping,
            } => {
                let angle = libm::atan2(round(), z);
                let distance = match mapping {
                    FisheyeMapping::Equidistant => angle / half_angle,
                    FisheyeMapping::Equisolid => {
                        libm::sin(0.5 * angle) / libm::sin(0.5 * half_angle)
                    }
                };
                [x, y].map(|c| c * (distance / round()))
            }
        };
        let pixel = self.pixel(at);
        pixel.iter().all(|c| c.is_finite()).then_some(pixel)
    }

    /// Returns the way in pixels from one place of the picture to another, x to the right and y
    /// down: in panoramas the shorter way around.
    pub fn way(&self, from: [f64; 2], to: [f64; 2]) -> [f64; 2] {
        let [x, y] = [0, 1].map(|k| to[k] - from[k]);
        match self.camera.projection {
            Projection::Panorama => [x - self.width * (x / self.width).round(), y],
            _ => [x, y],
        }
    }

    /// Returns a vector's parts to the right, up and ahead.
    fn axes(&self, v: DVec3) -> [f64; 3] {
        [self.camera.right, self.camera.up, self.camera.forward].map(|axis| v.dot(axis))
    }

    /// Returns the place of what [`across`](Self::across) and [`up`](Self::up) map to these.
    fn pixel(&self, [across, up]: [f64; 2]) -> [f64; 2] {
        if let Projection::Calibrated(k) = &self.camera.projection {
            let size = [self.width, self.height];
            let at = [across, -up];
            return [0, 1].map(|i| {
                let scale = f64::from(k.size[i]) / size[i];
                (at[i] * k.focal[i] + 0.5 + k.center[i]) / scale
            });
        }
        let half = self.half_height();
        [
            (across / (self.aspect * half) + 1.0) * 0.5 * self.width,
            (1.0 - up / half) * 0.5 * self.height,
        ]
    }
}
