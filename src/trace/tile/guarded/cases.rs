//! Tiles and triangles at random, of all sizes and from all distances.

use crate::accel::{Apart, WIDE};
use crate::geom::triangle::{Corners, canonical};
use crate::math::Aabb32;

/// Rays of a tile.
pub const RAYS: usize = 64;

/// Vigna's SplitMix64.
pub struct Random(pub u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ x >> 31
    }

    /// In [−1, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    fn vector(&mut self) -> [f64; 3] {
        [self.unit(), self.unit(), self.unit()]
    }

    /// 10 to a power in [low, high).
    fn size(&mut self, low: f64, high: f64) -> f64 {
        10.0_f64.powf(low + (high - low) * (0.5 + 0.5 * self.unit()))
    }
}

/// A block's triangles, and where rays are to pass.
pub struct Case {
    pub corners: [Corners; WIDE],
    pub bounds: Aabb32,
    /// On edges, at corners, inside, and beside.
    pub targets: [[f64; 3]; RAYS],
    /// From which the rays come, and how far away they begin.
    pub dir: [f64; 3],
    pub distance: f64,
}

impl Case {
    pub fn some(random: &mut Random) -> Case {
        let edge = random.size(-6.0, 0.0);
        let place = random.vector();
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
        // Of a mesh of some extent about its centre.
        let most = |k: usize| {
            let all = corners.iter().flatten();
            all.fold(1.0_f32, |most, corner| most.max(corner[k].abs()))
        };
        let most = [most(0), most(1), most(2)];
        Case {
            bounds: Aabb32 {
                min: most.map(|x| -x),
                max: most,
            },
            corners,
            targets,
            dir: random.vector(),
            distance: random.size(-1.0, 4.0) * edge.max(0.01),
        }
    }

    pub fn block(&self) -> Apart {
        let mut block = Apart {
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

/// How many tiles are asked.
pub fn tiles() -> usize {
    let set = std::env::var("LANECAST_CASES").ok();
    let pairs: usize = set.and_then(|n| n.parse().ok()).unwrap_or(1_000_000);
    pairs.div_ceil(RAYS * WIDE)
}

/// Edge functions by f64 from the corners as they are, over what the direction is along
/// its axis; and [a, b, c].
pub fn edges([a, b, c]: &Corners, org: [f64; 3], dir: [f64; 3], along: f64) -> ([f64; 3], f64) {
    let minus =
        |p: &[f32; 3], q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| f64::from(p[k]) - q[k]) };
    let cross = |p: [f64; 3], q: [f64; 3]| {
        [
            p[1] * q[2] - p[2] * q[1],
            p[2] * q[0] - p[0] * q[2],
            p[0] * q[1] - p[1] * q[0],
        ]
    };
    let dot = |p: [f64; 3], q: [f64; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let edge = |p: &[f32; 3], q: &[f32; 3]| cross(minus(p, org), minus(q, p.map(f64::from)));
    let normals = [edge(b, c), edge(c, a), edge(a, b)];
    let volume = dot(minus(a, org), normals[0]);
    (normals.map(|n| dot(n, dir) / along), volume)
}

/// The least of them, turned as `sign` says.
pub fn least(values: [f64; 3], sign: f64) -> f64 {
    let turned = values.map(|x| x * 1.0_f64.copysign(sign));
    turned.into_iter().fold(f64::INFINITY, f64::min)
}

/// What has been found out about bounds.
#[derive(Default)]
pub struct Tally {
    pub pairs: u64,
    pub sure: u64,
    pub missed: u64,
    pub doubts: u64,
    /// The worst of all errors, over its bound.
    pub worst: f64,
}

impl Tally {
    pub fn report(&self, what: &str) {
        let Tally {
            pairs,
            sure,
            missed,
            doubts,
            worst,
        } = self;
        println!(
            "{what}: of {pairs} pairs {sure} certain hits, {missed} certain misses, {doubts} in doubt; worst error {worst:.3} of its bound"
        );
        assert!(*sure > pairs / 1000 && *missed > pairs / 10, "{what}");
        assert!(*worst < 1.0, "{what}");
    }
}
