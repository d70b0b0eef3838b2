//! The oracle's own camera rays.

use crate::scene::{Calibration, Camera, FisheyeMapping, Projection};
use std::f64::consts::PI;

/// The points of the picture that rays pass through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grid {
    /// The centres of the pixels.
    Centers,
    /// The corners of a (W−1)×(H−1) grid, edges included.
    Corners,
}

/// A world ray, with the same numbers in every precision (docs/SPEC.md, S2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldRay {
    pub org: [f64; 3],
    pub dir: [f64; 3],
}

/// Returns the ray of column `x` and row `y` of a W×H picture, the top row first. Its direction is
/// NaN where the camera sees nothing.
pub fn camera_ray(
    camera: &Camera,
    [width, height]: [u32; 2],
    grid: Grid,
    [x, y]: [u32; 2],
) -> WorldRay {
    let (w, h, x, y) = (
        f64::from(width),
        f64::from(height),
        f64::from(x),
        f64::from(y),
    );
    let (sx, sy, aspect) = match grid {
        Grid::Centers => (-1.0 + (2.0 * x + 1.0) / w, 1.0 - (2.0 * y + 1.0) / h, w / h),
        Grid::Corners => {
            // A single column or row lies in the middle of the picture.
            let across = |i: f64, n: f64| if n > 1.0 { 2.0 * i / (n - 1.0) } else { 1.0 };
            let cells = |n: f64| f64::max(n - 1.0, 1.0);
            (-1.0 + across(x, w), 1.0 - across(y, h), cells(w) / cells(h))
        }
    };
    let (eye, forward) = (camera.eye.to_array(), camera.forward.to_array());
    let (right, up) = (camera.right.to_array(), camera.up.to_array());
    let moved = |from: [f64; 3], half: f64| -> [f64; 3] {
        std::array::from_fn(|k| from[k] + sx * aspect * half * right[k] + sy * half * up[k])
    };
    let seen = |[x, y, z]: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|k| x * right[k] + y * up[k] + z * forward[k])
    };
    let (org, dir) = match camera.projection {
        Projection::Perspective { half_height } => (eye, moved(forward, half_height)),
        Projection::Orthographic { half_height } => (moved(eye, half_height), forward),
        Projection::Calibrated(k) => {
            // From -1 to 1 over to OpenCV's pixels, whose centres are whole numbers.
            let pixel = |s: f64, axis: usize| 0.5 * (s + 1.0) * f64::from(k.size[axis]) - 0.5;
            let at = [pixel(sx, 0), pixel(-sy, 1)];
            let plane = [0, 1].map(|axis| (at[axis] - k.center[axis]) / k.focal[axis]);
            let [x, y] = undistorted(&k, plane);
            (eye, seen([x, -y, 1.0]))
        }
        Projection::Panorama => {
            let (longitude, latitude) = (sx * PI, 0.5 * sy * PI);
            let level = latitude.cos();
            let dir = [
                level * longitude.sin(),
                latitude.sin(),
                level * longitude.cos(),
            ];
            (eye, seen(dir))
        }
        Projection::Fisheye {
            half_angle,
            mapping,
        } => {
            let (x, y) = (sx * aspect, sy);
            let distance = x.hypot(y);
            let angle = match mapping {
                _ if distance > 1.0 => f64::NAN,
                FisheyeMapping::Equidistant => half_angle * distance,
                FisheyeMapping::Equisolid => 2.0 * ((0.5 * half_angle).sin() * distance).asin(),
            };
            let aside = match distance > 0.0 {
                true => angle.sin() / distance,
                false => half_angle,
            };
            (eye, seen([x * aside, y * aside, angle.cos()]))
        }
    };
    WorldRay { org, dir }
}

/// Returns the undistorted point of the plane at depth 1: follows it from the axis, along the
/// way of the distorted one, in small steps (differential correction), and ends where the map
/// folds.
fn undistorted(k: &Calibration, seen: [f64; 2]) -> [f64; 2] {
    const STEPS: usize = 64;
    let [k1, k2, p1, p2, k3] = k.distortion;
    // The map and its Jacobian by dual numbers (value, d/dx, d/dy).
    type Dual = [f64; 3];
    let add = |a: Dual, b: Dual| -> Dual { std::array::from_fn(|i| a[i] + b[i]) };
    let mul = |a: Dual, b: Dual| -> Dual {
        [
            a[0] * b[0],
            a[0] * b[1] + a[1] * b[0],
            a[0] * b[2] + a[2] * b[0],
        ]
    };
    let by = |c: f64, a: Dual| -> Dual { a.map(|x| c * x) };
    let map = |x: f64, y: f64| -> [Dual; 2] {
        let (x, y) = ([x, 1.0, 0.0], [y, 0.0, 1.0]);
        let (xx, yy, xy) = (mul(x, x), mul(y, y), mul(x, y));
        let r2 = add(xx, yy);
        let r4 = mul(r2, r2);
        let powers = add(by(k1, r2), add(by(k2, r4), by(k3, mul(r4, r2))));
        let radial = add([1.0, 0.0, 0.0], powers);
        [
            add(
                mul(x, radial),
                add(by(2.0 * p1, xy), by(p2, add(r2, by(2.0, xx)))),
            ),
            add(
                mul(y, radial),
                add(by(p1, add(r2, by(2.0, yy))), by(2.0 * p2, xy)),
            ),
        ]
    };
    let [mut x, mut y] = [0.0; 2];
    for step in 1..=STEPS {
        let part = step as f64 / STEPS as f64;
        for _ in 0..4 {
            let [u, v] = map(x, y);
            let determinant = u[1] * v[2] - u[2] * v[1];
            // Also where it is NaN.
            if !(determinant > 0.0 && u[1] > 0.0) {
                return [f64::NAN; 2];
            }
            let off = [u[0] - part * seen[0], v[0] - part * seen[1]];
            x -= (v[2] * off[0] - u[2] * off[1]) / determinant;
            y -= (u[1] * off[1] - v[1] * off[0]) / determinant;
        }
    }
    [x, y]
}
