//! Random cases of triangles and rays, of all sizes and distances.

use crate::accel::{UnindexedBlock, WIDE};
use crate::geom::triangle::{Corners, canonical};
use crate::math::Aabb32;
use crate::trace::test_random::Random;

/// Number of rays of a case.
pub const RAYS: usize = 64;

/// A block of triangles, and targets of rays.
pub struct Case {
    pub corners: [Corners; WIDE],
    pub bounds: Aabb32,
    /// Points on edges, at corners, inside, and beside triangles.
    pub targets: [[f64; 3]; RAYS],
    pub dir: [f64; 3],
    /// Distance of the rays' origin.
    pub distance: f64,
}

impl Case {
    /// Makes a random case.
    pub fn some(random: &mut Random) -> Case {
        let edge = random.size(-6.0, 0.0);
        let off_centre = random.size(-1.0, 1.0);
        let place = random.vector().map(|x| x * off_centre);
        let flat = random.vector().map(|x| if x > 0.6 { 1e-3 } else { 1.0 });
        let around = |random: &mut Random, size: f64| -> [f64; 3] {
            let at = random.vector();
            std::array::from_fn(|k| place[k] + at[k] * size)
        };
        let corners: [Corners; WIDE] = std::array::from_fn(|_| {
            let middle = around(random, 4.0 * edge);
            let corner = |random: &mut Random| -> [f32; 3] {
                let at = random.vector();
                std::array::from_fn(|k| (middle[k] + at[k] * edge * flat[k]) as f32)
            };
            canonical([corner(random), corner(random), corner(random)])
        });
        // Triangles that are hardly more than a line, or that the rays pass edge-on.
        let dir = random.vector();
        let thin = random.below(4);
        let corners = corners.map(|[a, b, c]| {
            let along = match thin {
                0 => std::array::from_fn(|k| f64::from(b[k]) - f64::from(a[k])),
                1 => dir.map(|x| x * edge),
                _ => return [a, b, c],
            };
            let (share, off) = (2.0 * random.unit(), edge * random.size(-9.0, -5.0));
            let off = if random.unit() > 0.0 { off } else { 0.0 };
            let mut at = |k: usize| f64::from(a[k]) + along[k] * share + off * random.unit();
            canonical([a, b, std::array::from_fn(|k| at(k) as f32)])
        });
        let spread = edge * random.size(-1.0, 1.5);
        let targets = std::array::from_fn(|i| {
            let [a, b, c] = corners[random.below(WIDE)].map(|p| p.map(f64::from));
            let mix = |p: [f64; 3], q: [f64; 3], x: f64| -> [f64; 3] {
                std::array::from_fn(|k| p[k] + (q[k] - p[k]) * x)
            };
            let share = 0.5 + 0.5 * random.unit();
            match i % 4 {
                0 => mix(a, b, share),
                1 => c,
                2 => mix(a, mix(b, c, share), 0.5 + 0.5 * random.unit()),
                _ => around(random, spread),
            }
        });
        // The mesh's box is larger than the triangles, or not.
        let mut bounds = Aabb32 {
            min: corners[0][0],
            max: corners[0][0],
        };
        for k in 0..3 {
            let grown = (random.unit() > 0.0).then(|| random.size(-6.0, 1.0) as f32);
            for corner in corners.iter().flatten() {
                bounds.min[k] = bounds.min[k].min(corner[k]);
                bounds.max[k] = bounds.max[k].max(corner[k]);
            }
            if random.unit() > 0.0 {
                bounds.min[k] -= grown.unwrap_or(0.0);
            }
            bounds.max[k] += grown.unwrap_or(0.0);
        }
        Case {
            bounds,
            corners,
            targets,
            dir,
            distance: random.size(-1.0, 4.0) * edge.max(0.01),
        }
    }

    /// Returns the triangles as a block.
    pub fn block(&self) -> UnindexedBlock {
        let mut block = UnindexedBlock {
            corner: [[[0.0; WIDE]; 3]; 3],
            source: std::array::from_fn(|slot| slot as u32),
        };
        for (slot, corners) in self.corners.iter().enumerate() {
            for (which, corner) in corners.iter().enumerate() {
                for k in 0..3 {
                    block.corner[which][k][slot] = corner[k];
                }
            }
        }
        block
    }
}

/// Returns the number of cases to test.
pub fn count() -> usize {
    let set = std::env::var("LANECAST_CASES").ok();
    let pairs: usize = set.and_then(|n| n.parse().ok()).unwrap_or(1_000_000);
    pairs.div_ceil(RAYS * WIDE)
}
