//! Tests of emitters: what is common to them.

mod bodies;
mod choice;
mod extremes;
mod irradiance;
mod many;
mod timing;
mod widths;

use super::{Body, Emitter, Emitters, LightSample, tree};
use glam::DVec3;
use lanecast_numerics::math::Vec3;
use std::f64::consts::{PI, TAU};

/// Numbers in [0, 1) for the choice, and two for the direction: Roberts' R3 sequence, whose
/// error falls nearly as 1/n.
pub fn numbers(i: u32) -> [f32; 3] {
    let g = 1.220_744_084_605_76_f64;
    [1, 2, 3].map(|k| {
        let x = (0.5 + f64::from(i) / g.powi(k)).fract();
        (x as f32).min(1.0 - f32::EPSILON / 2.0)
    })
}

/// Numbers in [0, 1) without any order.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 * (1.0 / 16_777_216.0)
    }

    /// A number in [−1, 1).
    pub fn signed(&mut self) -> f64 {
        f64::from(self.next()) * 2.0 - 1.0
    }

    /// A vector of the unit cube about 0.
    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.signed(), self.signed(), self.signed())
    }

    pub fn unit(&mut self) -> DVec3 {
        loop {
            let v = self.vector();
            if v.length() > 0.1 && v.length() < 1.0 {
                return v.normalize();
            }
        }
    }
}

pub fn white(body: Body) -> Emitter {
    Emitter {
        body,
        light: [1.0; 3],
    }
}

pub fn only(body: Body) -> Emitters {
    Emitters::new(vec![white(body)], None, [0.0; 3])
}

/// Samples one lane.
pub fn sample(emitters: &Emitters, point: DVec3, normal: DVec3, u: [f32; 3]) -> LightSample<f32> {
    let [pick, v, w] = u;
    emitters.sample::<f32>(point.into(), single(normal), true, pick, [v, w])
}

pub fn single(v: DVec3) -> Vec3<f32> {
    Vec3::new(v.x as f32, v.y as f32, v.z as f32)
}

/// Returns the vectors from a point to where a ray of unit direction meets a body.
pub fn crossings(body: &Body, point: DVec3, dir: DVec3) -> Vec<DVec3> {
    let flat = |corner: DVec3, u: DVec3, v: DVec3, triangle: bool| {
        let n = u.cross(v);
        let t = (corner - point).dot(n) / dir.dot(n);
        let at = point + dir * t - corner;
        let (a, b) = (at.cross(v).dot(n), u.cross(at).dot(n));
        let square = n.length_squared();
        let (a, b) = (a / square, b / square);
        let within = if triangle {
            a + b <= 1.0
        } else {
            a <= 1.0 && b <= 1.0
        };
        if t > 0.0 && a >= 0.0 && b >= 0.0 && within {
            vec![dir * t]
        } else {
            vec![]
        }
    };
    match *body {
        Body::Triangle([p, q, r]) => flat(p, q - p, r - p, true),
        Body::Rectangle { corner, u, v } => flat(corner, u, v, false),
        Body::Panel {
            corner,
            u,
            v,
            two_sided,
        } => match two_sided || dir.dot(u.cross(v)) < 0.0 {
            true => flat(corner, u, v, false),
            false => vec![],
        },
        Body::Disc {
            center,
            normal,
            radius,
            two_sided,
        } => {
            let t = (center - point).dot(normal) / dir.dot(normal);
            let within = (point + dir * t).distance(center) <= radius;
            let shines = two_sided || dir.dot(normal) < 0.0;
            if t > 0.0 && within && shines {
                vec![dir * t]
            } else {
                vec![]
            }
        }
        Body::Sphere { center, radius }
        | Body::Point {
            position: center,
            radius,
            ..
        } => {
            let to = center - point;
            let along = to.dot(dir);
            let inner = radius * radius - (to - dir * along).length_squared();
            let root = inner.max(0.0).sqrt();
            let both = [along - root, along + root];
            // From outside only the nearer one counts.
            let ts = if to.length() >= radius {
                &both[..1]
            } else {
                &both[1..]
            };
            let met = ts.iter().filter(|&&t| t > 0.0 && inner >= 0.0);
            met.map(|&t| dir * t).collect()
        }
        Body::Sun { towards, angle } => {
            let within = dir.angle_between(towards) <= angle;
            if within { vec![dir] } else { vec![] }
        }
        Body::Spot { .. } => vec![],
    }
}

/// A polar grid of directions about an axis, of equal solid angles.
pub struct Grid {
    axes: [DVec3; 3],
    versine: f64,
    rows: usize,
    columns: usize,
}

impl Grid {
    /// Covers the directions up to `angle` from the axis.
    pub fn new(axis: DVec3, angle: f64, rows: usize) -> Grid {
        let axis = axis.normalize();
        let (x, y) = axis.any_orthonormal_pair();
        Grid {
            axes: [x, y, axis],
            versine: 2.0 * (angle / 2.0).sin().powi(2),
            rows,
            columns: 2 * rows,
        }
    }

    pub fn len(&self) -> usize {
        self.rows * self.columns
    }

    pub fn cell(&self, dir: DVec3) -> usize {
        let [x, y, z] = self.axes;
        let dir = dir.normalize();
        let versine = 0.5 * (dir - z).length_squared();
        let turn = dir.dot(y).atan2(dir.dot(x)) / TAU;
        let turn = if turn < 0.0 { turn + 1.0 } else { turn };
        let row = (versine / self.versine * self.rows as f64) as usize;
        let column = (turn * self.columns as f64) as usize;
        assert!(versine < self.versine * 1.001, "outside the grid");
        row.min(self.rows - 1) * self.columns + column.min(self.columns - 1)
    }

    /// Integrates a density over each cell by the midpoints of `fine`² parts.
    pub fn integrals(&self, fine: usize, density: impl Fn(DVec3) -> f64) -> Vec<f64> {
        let [x, y, z] = self.axes;
        let parts = [self.rows * fine, self.columns * fine];
        let solid = TAU * self.versine / (parts[0] * parts[1]) as f64;
        let mut sums = vec![0.0; self.len()];
        for i in 0..parts[0] {
            let versine = (i as f64 + 0.5) / parts[0] as f64 * self.versine;
            let sin = (versine * (2.0 - versine)).sqrt();
            for j in 0..parts[1] {
                let (s, c) = ((j as f64 + 0.5) / parts[1] as f64 * TAU).sin_cos();
                let dir = x * (sin * c) + y * (sin * s) + z * (1.0 - versine);
                sums[i / fine * self.columns + j / fine] += density(dir) * solid;
            }
        }
        sums
    }
}

/// Returns the probability of counts at least as far from their expectation, by Pearson's chi²
/// in the normal approximation of Wilson and Hilferty; cells of fewer than 5 are pooled.
pub fn p_value(counts: &[u32], expected: &[f64]) -> f64 {
    let (mut chi, mut cells) = (0.0, 0);
    let (mut few, mut few_expected) = (0.0, 0.0);
    for (&count, &mean) in counts.iter().zip(expected) {
        if mean < 5.0 {
            few += f64::from(count);
            few_expected += mean;
        } else {
            chi += (f64::from(count) - mean).powi(2) / mean;
            cells += 1;
        }
    }
    if few_expected >= 5.0 {
        chi += (few - few_expected).powi(2) / few_expected;
        cells += 1;
    } else {
        assert!(few < 30.0, "{few} samples where none may be");
    }
    let free = f64::from(cells - 1);
    let spread = 2.0 / (9.0 * free);
    let z = ((chi / free).cbrt() - (1.0 - spread)) / spread.sqrt();
    0.5 * libm::erfc(z / 2.0_f64.sqrt())
}

/// Checks counts of samples in the cells of a grid against the density of them.
pub fn assert_follows(
    name: &str,
    emitters: &Emitters,
    point: DVec3,
    grid: &Grid,
    fine: usize,
    density: impl Fn(DVec3) -> f64,
) {
    let made = assert_share_follows(name, emitters, point, grid, fine, density);
    assert!(made > 0.9999, "{name}: {made}");
}

/// Checks counts of those samples that are made, and returns their share.
pub fn assert_share_follows(
    name: &str,
    emitters: &Emitters,
    point: DVec3,
    grid: &Grid,
    fine: usize,
    density: impl Fn(DVec3) -> f64,
) -> f64 {
    let count = 200_000;
    let mut random = Random(1);
    let mut counts = vec![0; grid.len()];
    let mut made = 0;
    for _ in 0..count {
        let u = [random.next(), random.next(), random.next()];
        let sample = sample(emitters, point, DVec3::ZERO, u);
        if sample.some {
            counts[grid.cell(sample.dir.into())] += 1;
            made += 1;
        }
    }
    let expected = grid.integrals(fine, density);
    let total: f64 = expected.iter().sum();
    let share = f64::from(made) / f64::from(count);
    let spread = (share * (1.0 - share) / f64::from(count)).sqrt();
    assert!(
        (total - share).abs() < 1e-3 + 3.0 * spread,
        "{name}: density sums to {total}, made {share}"
    );
    let expected: Vec<f64> = expected
        .iter()
        .map(|e| e * f64::from(made) / total)
        .collect();
    let p = p_value(&counts, &expected);
    assert!(p > 1e-4, "{name}: p = {p}");
    share
}

/// The cone about a body from a point: its axis and half angle.
pub fn cone(center: DVec3, radius: f64, point: DVec3) -> (DVec3, f64) {
    let to = center - point;
    if to.length() <= radius {
        (if to == DVec3::ZERO { DVec3::Z } else { to }, PI)
    } else {
        (to, (radius / to.length()).asin())
    }
}
