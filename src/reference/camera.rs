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
/// folds: where its Jacobian is not positive definite, or the radial terms alone turn back.
fn undistorted(k: &Calibration, seen: [f64; 2]) -> [f64; 2] {
    /// The longest step, as a share of the way, and the shortest.
    const STEPS: [f64; 2] = [1.0 / 64.0, 1.0 / (1_u64 << 40) as f64];
    let corrected = |[mut x, mut y]: [f64; 2], part: f64| -> Option<[f64; 2]> {
        for _ in 0..6 {
            let [u, v] = distorted(k, x, y);
            let determinant = u[1] * v[2] - u[2] * v[1];
            // Also where it is NaN.
            let is_definite = determinant > 0.0 && u[1] > 0.0;
            let squared = x * x + y * y;
            if !(is_definite && grows(k.distortion, [0.0, squared], 0)) {
                return None;
            }
            let off = [u[0] - part * seen[0], v[0] - part * seen[1]];
            x -= (v[2] * off[0] - u[2] * off[1]) / determinant;
            y -= (u[1] * off[1] - v[1] * off[0]) / determinant;
        }
        let [u, v] = distorted(k, x, y);
        let off = [u[0] - part * seen[0], v[0] - part * seen[1]];
        (off[0].hypot(off[1]) < 1e-9 * (1.0 + seen[0].hypot(seen[1]))).then_some([x, y])
    };
    let (mut at, mut part, mut step) = ([0.0; 2], 0.0, STEPS[0]);
    while part < 1.0 {
        let next = f64::min(part + step, 1.0);
        match corrected(at, next) {
            Some(there) => (at, part, step) = (there, next, f64::min(2.0 * step, STEPS[0])),
            None if step > STEPS[1] => step *= 0.5,
            None => return [f64::NAN; 2],
        }
    }
    at
}

/// Computes OpenCV's map and its Jacobian by dual numbers: (value, d/dx, d/dy) of x and of y.
fn distorted(k: &Calibration, x: f64, y: f64) -> [[f64; 3]; 2] {
    type Dual = [f64; 3];
    let [k1, k2, p1, p2, k3] = k.distortion;
    let add = |a: Dual, b: Dual| -> Dual { std::array::from_fn(|i| a[i] + b[i]) };
    let mul = |a: Dual, b: Dual| -> Dual {
        [
            a[0] * b[0],
            a[0] * b[1] + a[1] * b[0],
            a[0] * b[2] + a[2] * b[0],
        ]
    };
    let by = |c: f64, a: Dual| -> Dual { a.map(|x| c * x) };
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
}

/// Says whether r (1 + k1 r² + k2 r⁴ + k3 r⁶) has a positive derivative for all squares of r
/// in an interval: halves it until a bound of the derivative's slope decides, 50 times at most.
fn grows(distortion: [f64; 5], [low, high]: [f64; 2], depth: u32) -> bool {
    let [k1, k2, _, _, k3] = distortion;
    let terms = |s: f64| [3.0 * k1 * s, 5.0 * k2 * s.powi(2), 7.0 * k3 * s.powi(3)];
    let middle = 0.5 * (low + high);
    let there = 1.0 + terms(middle).iter().sum::<f64>();
    // |d/ds| is at most this, for s grows.
    let slope = 3.0 * k1.abs() + 10.0 * k2.abs() * high + 21.0 * k3.abs() * high * high;
    if there > 0.5 * (high - low) * slope {
        return true;
    }
    there > 0.0
        && depth < 50
        && grows(distortion, [low, middle], depth + 1)
        && grows(distortion, [middle, high], depth + 1)
}
