//! The oracle's own camera rays.

use crate::scene::{Camera, Projection};

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

/// Returns the ray of column `x` and row `y` of a W×H picture, the top row first.
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
    let (org, dir) = match camera.projection {
        Projection::Perspective { half_height } => (eye, moved(forward, half_height)),
        Projection::Orthographic { half_height } => (moved(eye, half_height), forward),
    };
    WorldRay { org, dir }
}
