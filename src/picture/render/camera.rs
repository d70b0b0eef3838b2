//! Camera rays. A world ray has an origin and a direction in f64; every precision, kernel
//! and replay starts from exactly these numbers.

mod project;

use super::config::Grid;
use crate::math::Vec3;
use crate::math::lanes::Lanes;
use crate::scene::{Calibration, Camera, FisheyeMapping, Lens, Projection};
use crate::shade::{Doubles, STEP, Singles};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

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
    /// [0, 1]² from the pixel's left and top edges. The direction of cameras with an image plane
    /// is not unit: its component along the view axis is 1, so t is depth. It is NaN where the
    /// camera sees nothing: outside a fisheye's circle, and behind the fold of a distortion.
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
        if let Projection::Calibrated(k) = &self.camera.projection {
            return calibrated(k, 0, self.width, x + self.within(dx));
        }
        let (one, two) = (D::splat(1.0), D::splat(2.0));
        let right = two * (x + self.within(dx)) / D::splat(self.width) - one;
        right * D::splat(self.aspect) * D::splat(self.half_height())
    }

    /// Computes the vertical distance from the view axis, at depth 1, of rays through
    /// the picture's rows; positive is up.
    #[inline(always)]
    pub fn up<D: Lanes<Scalar = f64>>(&self, y: D, dy: D) -> D {
        if let Projection::Calibrated(k) = &self.camera.projection {
            return D::zero() - calibrated(k, 1, self.height, y + self.within(dy));
        }
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

    /// Returns the place of a pixel's centre, in pixels from the picture's left upper corner.
    pub fn center(&self, x: u32, y: u32) -> [f64; 2] {
        [x, y].map(|c| f64::from(c) + self.within(0.5))
    }

    /// Returns the width of a pixel's cone at the eye, and how much wider it gets per unit of way.
    pub fn pixel_cone(&self) -> [f64; 2] {
        let across = 2.0 * self.half_height() / self.height;
        match self.camera.projection {
            Projection::Orthographic { .. } => [across, 0.0],
            Projection::Panorama => [0.0, PI / self.height],
            Projection::Fisheye { half_angle, .. } => [0.0, 2.0 * half_angle / self.height],
            _ => [0.0, across],
        }
    }

    fn half_height(&self) -> f64 {
        self.camera.projection.half_height()
    }

    /// Says whether some pixels may have no ray.
    pub fn has_blind_spots(&self) -> bool {
        match self.camera.projection {
            Projection::Perspective { .. }
            | Projection::Orthographic { .. }
            | Projection::Panorama => false,
            Projection::Calibrated(k) => k.distortion != [0.0; 5],
            Projection::Fisheye { .. } => true,
        }
    }

    /// Returns those of the first `count` lanes whose rays see something.
    pub fn seeing(&self, dir: &Vec3<Doubles>, count: usize) -> u32 {
        let all = (1 << count) - 1;
        match self.has_blind_spots() {
            false => all,
            true => {
                let x = dir.x.to_array();
                (0..count).fold(0, |rows, i| rows | u32::from(!x[i].is_nan()) << i)
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
            ..
        } = self.camera;
        let splat = |v: DVec3| Vec3::<D>::splat(v.to_array());
        let aside = |across: D, up: D| splat(right_axis) * across + splat(up_axis) * up;
        let bent = |bend: &dyn Fn([f64; 2]) -> [f64; 3]| {
            let [x, y, z] = lane_by_lane(across, up, bend);
            (splat(eye), splat(forward) * z + aside(x, y))
        };
        match &projection {
            Projection::Perspective { .. } => (splat(eye), splat(forward) + aside(across, up)),
            Projection::Orthographic { .. } => (splat(eye) + aside(across, up), splat(forward)),
            Projection::Calibrated(k) if k.distortion == [0.0; 5] => {
                (splat(eye), splat(forward) + aside(across, up))
            }
            Projection::Calibrated(k) => bent(&|[across, up]| match k.undistorted([across, -up]) {
                Some([x, y]) => [x, -y, 1.0],
                None => [f64::NAN; 3],
            }),
            Projection::Panorama => bent(&|at| around(at, self.aspect)),
            Projection::Fisheye {
                half_angle,
                mapping,
            } => bent(&|at| in_circle(at, *half_angle, *mapping)),
        }
    }

    /// Says whether the camera has a lens that blurs.
    pub fn has_lens(&self) -> bool {
        self.camera.lens.is_some_and(|lens| lens.radius > 0.0)
    }

    /// Moves the origins of rays over the lens, by a point of [0, 1)² for each, so that they
    /// still meet in the plane of focus. t stays depth.
    pub fn through_lens(
        &self,
        (org, dir): (Vec3<Doubles>, Vec3<Doubles>),
        [u, v]: [Singles; 2],
    ) -> (Vec3<Doubles>, Vec3<Doubles>) {
        let Some(lens) = self.camera.lens.filter(|lens| lens.radius > 0.0) else {
            return (org, dir);
        };
        let (u, v) = (u.to_array(), v.to_array());
        let at: [[f64; 2]; STEP] =
            std::array::from_fn(|i| on_lens(&lens, [f64::from(u[i]), f64::from(v[i])]));
        let [x, y] = [0, 1].map(|k| Doubles::load(&at.map(|at| at[k])));
        let splat = |v: DVec3| Vec3::<Doubles>::splat(v.to_array());
        let moved = splat(self.camera.right) * x + splat(self.camera.up) * y;
        (org + moved, dir - moved * Doubles::splat(1.0 / lens.focus))
    }

    /// Returns the width of a pixel where a point lies, in world units, near the view axis.
    pub fn pixel_width(&self, point: DVec3) -> f64 {
        let height = match self.camera.projection {
            Projection::Panorama => PI,
            Projection::Fisheye { half_angle, .. } => 2.0 * half_angle,
            _ => 2.0 * self.half_height(),
        };
        let height = height / self.height;
        match self.camera.projection.is_parallel() {
            true => height,
            false => height * (point - self.camera.eye).length(),
        }
    }

    /// Returns a point's depth along the view axis; its distance where there is no image plane.
    pub fn depth(&self, point: DVec3) -> f64 {
        let away = point - self.camera.eye;
        match self.camera.projection.has_plane() {
            true => away.dot(self.camera.forward),
            false => away.length(),
        }
    }
}

/// Returns how far to the right of the view axis, or below it, a position in a picture of `side`
/// pixels is seen at depth 1.
#[inline(always)]
fn calibrated<D: Lanes<Scalar = f64>>(k: &Calibration, axis: usize, side: f64, at: D) -> D {
    let scale = D::splat(f64::from(k.size[axis]) / side);
    // OpenCV's pixel 0 has its centre at 0, and its left edge at -1/2.
    (at * scale - D::splat(0.5 + k.center[axis])) / D::splat(k.focal[axis])
}

/// Maps positions in the picture to directions (right, up, ahead), one by one.
fn lane_by_lane<D: Lanes<Scalar = f64>>(
    across: D,
    up: D,
    map: &dyn Fn([f64; 2]) -> [f64; 3],
) -> [D; 3] {
    let mut at = [[0.0; STEP]; 2];
    across.store(&mut at[0]);
    up.store(&mut at[1]);
    let mut to = [[0.0; STEP]; 3];
    for i in 0..D::COUNT {
        let dir = map([at[0][i], at[1][i]]);
        (0..3).for_each(|k| to[k][i] = dir[k]);
    }
    to.map(|axis| D::load(&axis))
}

/// Returns the direction of a position in a panorama that is `aspect` times wider than high.
fn around([across, up]: [f64; 2], aspect: f64) -> [f64; 3] {
    let (sin_longitude, cos_longitude) = libm::sincos(across / aspect * PI);
    let (sin_latitude, cos_latitude) = libm::sincos(up * FRAC_PI_2);
    [
        cos_latitude * sin_longitude,
        sin_latitude,
        cos_latitude * cos_longitude,
    ]
}

/// Returns the direction of a position in a fisheye's circle of radius 1.
fn in_circle([across, up]: [f64; 2], half_angle: f64, mapping: FisheyeMapping) -> [f64; 3] {
    let distance = libm::sqrt(across * across + up * up);
    if distance > 1.0 {
        return [f64::NAN; 3];
    }
    if distance == 0.0 {
        return [0.0, 0.0, 1.0];
    }
    let angle = match mapping {
        FisheyeMapping::Equidistant => distance * half_angle,
        FisheyeMapping::Equisolid => 2.0 * libm::asin(distance * libm::sin(0.5 * half_angle)),
    };
    let (sin, cos) = libm::sincos(angle);
    [across * (sin / distance), up * (sin / distance), cos]
}

/// Returns a point of a lens, uniform over its opening, for a uniform point of [0, 1)².
fn on_lens(lens: &Lens, [u, v]: [f64; 2]) -> [f64; 2] {
    let turn = lens.rotation.to_radians();
    let [x, y] = match lens.blades {
        0 => {
            // The concentric map of Shirley and Chiu (1997), which keeps strata whole.
            let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
            let (radius, angle) = match a.abs() > b.abs() {
                true => (a, 0.25 * PI * (b / a)),
                false if b == 0.0 => (0.0, 0.0),
                false => (b, 0.25 * PI * (2.0 - a / b)),
            };
            let (sin, cos) = libm::sincos(angle + turn);
            [radius * cos, radius * sin]
        }
        blades => {
            // One of the triangles about the middle, and a point of it.
            let blade = u * f64::from(blades);
            let (number, along) = (blade.floor(), blade - blade.floor());
            let corner = |number: f64| {
                let (sin, cos) = libm::sincos(2.0 * PI * number / f64::from(blades) + turn);
                [cos, sin]
            };
            let (from, to) = (corner(number), corner(number + 1.0));
            let out = libm::sqrt(v);
            [0, 1].map(|k| out * (from[k] + along * (to[k] - from[k])))
        }
    };
    [x * lens.radius / lens.squeeze, y * lens.radius]
}

#[cfg(test)]
mod tests;
