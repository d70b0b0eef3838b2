//! Meshes from formulas, of any size: the work of growth measurements.
//!
//! The displaced sphere that the peers' figures are made with: a sphere of
//! latitudes and longitudes, its radius waved by two products of sines, one
//! coarse and one fine. Elementary functions come from the crate `libm`, so the
//! mesh is the same on every machine.

use crate::io::TriangleSet;
use std::f64::consts::{PI, TAU};

/// The size whose count of triangles is nearest to what is asked for:
/// longitudes, latitudes. Twice as many longitudes as latitudes, so that
/// triangles at the equator are half squares.
pub fn sphere_size(triangles: u64) -> (u32, u32) {
    // 4·down·(down − 1) triangles.
    let down = 0.5 + (0.25 + triangles as f64 * 0.25).sqrt();
    let down = (down.round() as u32).max(2);
    (2 * down, down)
}

/// `2·across·(down − 1)` triangles; the poles are one vertex each.
pub fn displaced_sphere(across: u32, down: u32) -> TriangleSet {
    let vertices = across as usize * (down as usize - 1) + 2;
    let mut positions = Vec::with_capacity(vertices);
    positions.push(waved([0.0, 1.0, 0.0]));
    for j in 1..down {
        let (sin, cos) = libm::sincos(PI * f64::from(j) / f64::from(down));
        for i in 0..across {
            let (z, x) = libm::sincos(TAU * f64::from(i) / f64::from(across));
            positions.push(waved([sin * x, cos, sin * z]));
        }
    }
    positions.push(waved([0.0, -1.0, 0.0]));

    let last = positions.len() as u32 - 1;
    let ring = |j: u32, i: u32| 1 + (j - 1) * across + i % across;
    let mut triangles = Vec::with_capacity(2 * across as usize * (down as usize - 1));
    triangles.extend((0..across).map(|i| [0, ring(1, i + 1), ring(1, i)]));
    // In the peers' order: of each ring the upper triangles, then the lower ones.
    for j in 1..down - 1 {
        let upper = |i| [ring(j, i), ring(j, i + 1), ring(j + 1, i)];
        let lower = |i| [ring(j, i + 1), ring(j + 1, i + 1), ring(j + 1, i)];
        triangles.extend((0..across).map(upper));
        triangles.extend((0..across).map(lower));
    }
    triangles.extend((0..across).map(|i| [last, ring(down - 1, i), ring(down - 1, i + 1)]));
    TriangleSet {
        positions,
        triangles,
    }
}

fn waved(p: [f64; 3]) -> [f32; 3] {
    let sin = libm::sin;
    let [x, y, z] = p;
    let coarse = sin(9.0 * x + 1.0) * sin(8.0 * y) * sin(10.0 * z + 2.0);
    let fine = sin(31.0 * x) * sin(29.0 * y + 1.0) * sin(33.0 * z);
    let radius = 1.0 + 0.05 * coarse + 0.02 * fine;
    p.map(|x| (x * radius) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn sizes_are_near_what_is_asked_for() {
        for asked in [1000, 10_000, 1_000_000, 10_000_000] {
            let (across, down) = sphere_size(asked);
            let made = 2 * u64::from(across) * u64::from(down - 1);
            assert!(made.abs_diff(asked) as f64 <= 0.04 * asked as f64, "{made}");
        }
        assert_eq!(sphere_size(0), (4, 2));
        // The peers' mesh.
        assert_eq!(sphere_size(1_046_528), (1024, 512));
    }

    #[test]
    fn closed_and_the_size_of_a_sphere() {
        let (across, down) = sphere_size(5000);
        let set = displaced_sphere(across, down);
        assert_eq!(set.triangles.len() as u32, 2 * across * (down - 1));
        // Every edge once in each direction.
        let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
        for t in &set.triangles {
            for k in 0..3 {
                let [a, b] = [t[k], t[(k + 1) % 3]];
                assert_ne!(a, b);
                *edges.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
            }
        }
        assert_eq!(edges.len() * 2, set.triangles.len() * 3);
        assert!(edges.values().all(|sum| *sum == 0));
        for p in &set.positions {
            let radius = p.iter().map(|x| x * x).sum::<f32>().sqrt();
            assert!((0.93..1.07).contains(&radius), "{radius}");
        }
    }

    /// The mesh that the peers' generator writes: its size, some vertices, the
    /// order of its triangles.
    #[test]
    fn the_peers_mesh() {
        let set = displaced_sphere(1024, 512);
        assert_eq!(set.positions.len(), 523_266);
        assert_eq!(set.triangles.len(), 1_046_528);
        for (row, position) in [
            (0, [0.0, 1.037_850_3, 0.0]),
            (123_456, [-0.630_291_5, 0.741_626_1, -0.256_555_77]),
            (400_000, [-0.480_150_64, -0.735_524_5, -0.474_294_16]),
        ] {
            for (own, peer) in set.positions[row].iter().zip(position) {
                let difference: f32 = own - peer;
                assert!(difference.abs() < 1e-6, "{row}");
            }
        }
        assert_eq!(set.triangles[1024], [1, 2, 1025]);
        assert_eq!(set.triangles[500_000], [249_122, 250_146, 250_145]);
        assert_eq!(set.triangles.last(), Some(&[523_265, 523_264, 522_241]));
    }
}
