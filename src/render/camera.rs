//! Camera rays. A world ray has an origin and a direction in f64; every precision, kernel
//! and replay starts from exactly these numbers.

use super::config::Grid;
use crate::math::Vec3;
use crate::math::lanes::Lanes;
use crate::scene::{Camera, Projection};
use glam::DVec3;

/// Maps positions in the picture to world rays.
#[derive(Clone, Copy, Debug)]
pub struct RayGenerator {
    camera: Camera,
    grid: Grid,
    width: f64,
    height: f64,
    aspect: f64,
}

impl RayGenerator {
    /// Takes `width` and `height` in pixels, or in rays for [`Grid::Corners`].
    pub fn new(camera: Camera, width: u32, height: u32, grid: Grid) -> RayGenerator {
        // There is one more corner than there are pixels in each direction.
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

    /// Returns origin and direction of the ray through pixel (`x`, `y`) at `offset` in
    /// [0, 1]² from the pixel's left and top edges. The direction is not unit: its
    /// component along the view axis is 1, so t is depth.
    pub fn ray(&self, x: u32, y: u32, offset: [f64; 2]) -> (DVec3, DVec3) {
        let (org, dir) = self.rays([x, y].map(f64::from), offset);
        (org.into(), dir.into())
    }

    /// Computes [`ray`](Self::ray) in lanes.
    #[inline(always)]
    pub fn rays<D: Lanes<Scalar = f64>>(
        &self,
        [x, y]: [D; 2],
        [dx, dy]: [D; 2],
    ) -> (Vec3<D>, Vec3<D>) {
        self.through(self.across(x, dx), self.up(y, dy))
    }

    /// Computes the horizontal distance from the view axis, at depth 1, of rays through
    /// the picture's columns; positive to the right.
    #[inline(always)]
    pub fn across<D: Lanes<Scalar = f64>>(&self, x: D, dx: D) -> D {
        let (one, two) = (D::splat(1.0), D::splat(2.0));
        let right = two * (x + self.within(dx)) / D::splat(self.width) - one;
        right * D::splat(self.aspect) * D::splat(self.half_height())
    }

    /// Computes the vertical distance from the view axis, at depth 1, of rays through
    /// the picture's rows; positive is up.
    #[inline(always)]
    pub fn up<D: Lanes<Scalar = f64>>(&self, y: D, dy: D) -> D {
        let (one, two) = (D::splat(1.0), D::splat(2.0));
        let up = one - two * (y + self.within(dy)) / D::splat(self.height);
        up * D::splat(self.half_height())
    }

    /// Returns the offset inside a pixel, which is 0 for a grid of corners.
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

    /// Returns origins and directions of the rays with these [`across`](Self::across)
    /// and [`up`](Self::up).
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

    /// Returns a point's depth along the view axis.
    pub fn depth(&self, point: DVec3) -> f64 {
        (point - self.camera.eye).dot(self.camera.forward)
    }
}
