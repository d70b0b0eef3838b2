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
    aspect: f64,
}

impl RayGenerator {
    /// `width` and `height` in pixels, or in rays where the grid is of corners.
    pub fn new(camera: Camera, width: u32, height: u32, grid: Grid) -> RayGenerator {
        // Of corners there is one more than of pixels.
        let pixels = |n: u32| match grid {
            Grid::Centers => f64::from(n),
            Grid::Corners => f64::from(n.max(2) - 1),
        };
        let (width, height) = (pixels(width), pixels(height));
        RayGenerator {
            camera,
            grid,
            width,
            height,
            aspect: width / height,
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
        [dx, dy]: [D; 2],
    ) -> (Vec3<D>, Vec3<D>) {
        self.through(self.across(x, dx), self.up(y, dy))
    }

    /// How far to the right of the view axis rays go through columns of the picture, a
    /// unit ahead.
    #[inline(always)]
    pub fn across<D: Lanes<Scalar = f64>>(&self, x: D, dx: D) -> D {
        let (one, two) = (D::splat(1.0), D::splat(2.0));
        let right = two * (x + self.within(dx)) / D::splat(self.width) - one;
        right * D::splat(self.aspect) * D::splat(self.half_height())
    }

    /// How far up they go through rows.
    #[inline(always)]
    pub fn up<D: Lanes<Scalar = f64>>(&self, y: D, dy: D) -> D {
        let (one, two) = (D::splat(1.0), D::splat(2.0));
        let up = one - two * (y + self.within(dy)) / D::splat(self.height);
        up * D::splat(self.half_height())
    }

    /// Corners have no inside.
    #[inline(always)]
    fn within<D: Lanes<Scalar = f64>>(&self, offset: D) -> D {
        match self.grid {
            Grid::Centers => offset,
            Grid::Corners => D::zero(),
        }
    }

    fn half_height(&self) -> f64 {
        match self.camera.projection {
            Projection::Perspective { half_height } | Projection::Orthographic { half_height } => {
                half_height
            }
        }
    }

    /// Rays that are so far [across](Self::across) and [up](Self::up).
    #[inline(always)]
    pub fn through<D: Lanes<Scalar = f64>>(&self, across: D, up: D) -> (Vec3<D>, Vec3<D>) {
        let Camera {
            eye,
            right: right_axis,
            up: up_axis,
            forward,
            projection,
        } = self.camera;
        let splat = |v: DVec3| Vec3::<D>::splat(v.to_array());
        let aside = splat(right_axis) * across + splat(up_axis) * up;
        match projection {
            Projection::Perspective { .. } => (splat(eye), splat(forward) + aside),
            Projection::Orthographic { .. } => (splat(eye) + aside, splat(forward)),
        }
    }

    /// Depth along the view axis of a point.
    pub fn depth(&self, point: DVec3) -> f64 {
        (point - self.camera.eye).dot(self.camera.forward)
    }
}
