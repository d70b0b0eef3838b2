//! Camera rays. A world ray has an f64 origin and an f32 direction; every mode,
//! kernel and replay starts from these very numbers.

use super::config::Grid;
use crate::math::Vec3;
use crate::math::lanes::Lanes;
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
    pub fn ray(&self, x: u32, y: u32, offset: [f64; 2]) -> (DVec3, [f32; 3]) {
        let (org, dir) = self.rays([x, y].map(f64::from), offset);
        let dir = DVec3::from(dir).to_array();
        (org.into(), dir.map(|x| x as f32))
    }

    /// [`ray`](Self::ray) in lanes; directions are yet to be rounded to f32.
    #[inline(always)]
    pub fn rays<D: Lanes<Scalar = f64>>(
        &self,
        [x, y]: [D; 2],
        offset: [D; 2],
    ) -> (Vec3<D>, Vec3<D>) {
        let [dx, dy] = match self.grid {
            Grid::Centers => offset,
            Grid::Corners => [D::zero(), D::zero()],
        };
        let (one, two) = (D::splat(1.0), D::splat(2.0));
        let right = two * (x + dx) / D::splat(self.width) - one;
        let up = one - two * (y + dy) / D::splat(self.height);
        let aspect = D::splat(self.width / self.height);
        let Camera {
            eye,
            right: right_axis,
            up: up_axis,
            forward,
            projection,
        } = self.camera;
        let splat = |v: DVec3| Vec3::<D>::splat(v.to_array());
        let across = |half_height: f64| {
            let half_height = D::splat(half_height);
            splat(right_axis) * (right * aspect * half_height) + splat(up_axis) * (up * half_height)
        };
        match projection {
            Projection::Perspective { half_height } => {
                (splat(eye), splat(forward) + across(half_height))
            }
            Projection::Orthographic { half_height } => {
                (splat(eye) + across(half_height), splat(forward))
            }
        }
    }

    /// Depth along the view axis of a point.
    pub fn depth(&self, point: DVec3) -> f64 {
        (point - self.camera.eye).dot(self.camera.forward)
    }
}
