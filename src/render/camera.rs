//! Camera rays. A world ray has an f64 origin and an f32 direction; every mode,
//! kernel and replay starts from these very numbers.

use super::config::Grid;
use crate::scene::{Camera, Projection};
use glam::DVec3;

/// Turns positions on the picture into rays.
#[derive(Clone, Copy, Debug)]
pub struct RayGenerator {
    camera: Camera,
    grid: Grid,
    width: f64,
    height: f64,
}

impl RayGenerator {
    /// `width` and `height` in pixels, or in rays where the grid is of corners.
    pub fn new(camera: Camera, width: u32, height: u32, grid: Grid) -> RayGenerator {
        // Of corners there is one more than of pixels.
        let pixels = |n: u32| match grid {
            Grid::Centers => f64::from(n),
            Grid::Corners => f64::from(n.max(2) - 1),
        };
        RayGenerator {
            camera,
            grid,
            width: pixels(width),
            height: pixels(height),
        }
    }

    /// Origin and direction (not unit: its part along the view axis is 1, so t
    /// is depth) through a pixel, at an offset in [0, 1]² from its left and top
    /// edges.
    #[inline]
    pub fn ray(&self, x: u32, y: u32, offset: [f64; 2]) -> (DVec3, [f32; 3]) {
        let [dx, dy] = match self.grid {
            Grid::Centers => offset,
            Grid::Corners => [0.0, 0.0],
        };
        let right = 2.0 * (f64::from(x) + dx) / self.width - 1.0;
        let up = 1.0 - 2.0 * (f64::from(y) + dy) / self.height;
        let aspect = self.width / self.height;
        let Camera {
            eye,
            right: right_axis,
            up: up_axis,
            forward,
            projection,
        } = self.camera;
        let across = |half_height: f64| {
            right_axis * (right * aspect * half_height) + up_axis * (up * half_height)
        };
        match projection {
            Projection::Perspective { half_height } => {
                let dir = forward + across(half_height);
                (eye, dir.to_array().map(|x| x as f32))
            }
            Projection::Orthographic { half_height } => (
                eye + across(half_height),
                forward.to_array().map(|x| x as f32),
            ),
        }
    }

    /// Depth along the view axis of a point.
    pub fn depth(&self, point: DVec3) -> f64 {
        (point - self.camera.eye).dot(self.camera.forward)
    }
}
