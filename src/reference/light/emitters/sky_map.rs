//! Environment maps: the model resamples a map of longitude by latitude to an octahedral one
//! of equal areas (Clarberg 2008) of 4 × 4 samples a texel, which is read bilinearly, and
//! samples it by hierarchical warping (Clarberg et al. 2005) of each texel's mean above the
//! mean of all (Karlík et al. 2019). This is that model in f64.

use super::super::bsdf::Color;
use crate::scene::Environment;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// Samples of the map to a texel and axis.
const FINE: usize = 4;

/// Of a texel, numbers are left out above this, so that rounding does not leave it.
const WITHIN: f64 = 1.0 - 1.0 / 1024.0;

pub struct SkyMap {
    side: usize,
    /// Row by row.
    texels: Vec<Color>,
    /// Sums of the weights of 1, 4, 16 … texels, row by row; the last are single ones. None
    /// if nothing is worth sampling.
    levels: Option<Vec<Vec<f64>>>,
    /// The mean of what is sampled.
    pub sampled_mean: f64,
}

impl SkyMap {
    pub fn new(map: &Environment) -> SkyMap {
        let alike = libm::log2(f64::from(map.width.max(1)) / 1.77).round() as u32;
        let levels = alike.clamp(7, 12);
        let side = 1_usize << levels;
        let texels = (0..side * side).map(|k| texel(map, side, [k % side, k / side]));
        let mut sky = SkyMap {
            side,
            texels: texels.collect(),
            levels: None,
            sampled_mean: 0.0,
        };
        let all: Vec<f64> = (0..side * side).map(|k| sky.mean_in(k)).collect();
        let total: f64 = all.iter().sum();
        let mean = total / all.len() as f64;
        let above: Vec<f64> = all.iter().map(|w| (w - mean).max(0.0)).collect();
        let sampled: f64 = above.iter().sum();
        // Of a smooth sky nothing is worth sampling.
        if sampled > total * 1e-3 {
            sky.sampled_mean = sampled / above.len() as f64;
            sky.levels = Some(pyramid(side, above));
        }
        sky
    }

    /// Returns a texel; across an edge the map goes on from the edge's other half.
    fn texel(&self, x: i64, y: i64) -> Color {
        let n = self.side as i64;
        let fold = |x: i64, y: i64| match x {
            x if x < 0 => (-1 - x, n - 1 - y),
            x if x >= n => (2 * n - 1 - x, n - 1 - y),
            x => (x, y),
        };
        let (x, y) = fold(x, y);
        let (y, x) = fold(y, x);
        self.texels[(y * n + x) as usize]
    }

    /// The mean of the bilinear function over texel k and the channels: along each axis the
    /// neighbours count ⅛ each.
    fn mean_in(&self, k: usize) -> f64 {
        let at = [k % self.side, k / self.side].map(|x| x as i64);
        let mut sum = 0.0;
        for (dy, wy) in [(-1, 0.125), (0, 0.75), (1, 0.125)] {
            for (dx, wx) in [(-1, 0.125), (0, 0.75), (1, 0.125)] {
                let color = self.texel(at[0] + dx, at[1] + dy);
                sum += wx * wy * color.iter().sum::<f64>() / 3.0;
            }
        }
        sum
    }

    pub fn radiance(&self, dir: DVec3) -> Color {
        let [x, y] = place(dir).map(|x| x * self.side as f64 - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let corner = |i: i64, j: i64| self.texel(x0 as i64 + i, y0 as i64 + j);
        let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
        std::array::from_fn(|k| {
            let (low, high) = (a[k] + (b[k] - a[k]) * fx, c[k] + (d[k] - c[k]) * fx);
            low + (high - low) * fy
        })
    }

    /// Returns the density of [`SkyMap::sample`] over solid angle.
    pub fn pdf(&self, dir: DVec3) -> f64 {
        let Some(levels) = &self.levels else {
            return 0.0;
        };
        let cell = |x: f64| ((x * self.side as f64) as usize).min(self.side - 1);
        let [x, y] = place(dir).map(cell);
        let share = levels[levels.len() - 1][y * self.side + x] / levels[0][0];
        share * (self.side * self.side) as f64 / (4.0 * PI)
    }

    /// Maps a point of the unit square to a unit direction.
    pub fn sample(&self, [mut u, mut v]: [f64; 2]) -> DVec3 {
        let (mut x, mut y) = (0, 0);
        for (level, sums) in self.levels.iter().flatten().enumerate().skip(1) {
            let side = 1_usize << level;
            let at = |i: usize, j: usize| sums[(2 * y + j) * side + 2 * x + i];
            let rows = [at(0, 0) + at(1, 0), at(0, 1) + at(1, 1)];
            let down = choose(&mut v, rows);
            let right = choose(&mut u, [at(0, down), at(1, down)]);
            (x, y) = (2 * x + right, 2 * y + down);
        }
        let within = |x: usize, u: f64| (x as f64 + u.min(WITHIN)) / self.side as f64;
        direction([within(x, u), within(y, v)])
    }
}

/// Chooses one of two parts and stretches what is left of the number.
fn choose(u: &mut f64, [a, b]: [f64; 2]) -> usize {
    // As f32 rounds it: a share of 1 leaves no second part.
    let share = if a + b > 0.0 { a / (a + b) } else { 0.5 };
    let second = *u >= share;
    *u = match second {
        true => (*u - share) / (1.0 - share),
        false => *u / share,
    };
    *u = u.clamp(0.0, 1.0);
    usize::from(second)
}

/// Sums 1, 4, 16 … of the cells, the whole first.
fn pyramid(side: usize, cells: Vec<f64>) -> Vec<Vec<f64>> {
    let mut levels = vec![cells];
    let mut side = side;
    while side > 1 {
        let below = &levels[levels.len() - 1];
        let half = side / 2;
        let sum = |k: usize| {
            let at = 2 * (k / half) * side + 2 * (k % half);
            below[at] + below[at + 1] + below[at + side] + below[at + side + 1]
        };
        levels.push((0..half * half).map(sum).collect());
        side = half;
    }
    levels.reverse();
    levels
}

/// Returns the unit direction at a place of the square (Clarberg 2008, figure 4).
fn direction(place: [f64; 2]) -> DVec3 {
    let [u, v] = place.map(|x| 2.0 * x - 1.0);
    let d = 1.0 - (u.abs() + v.abs());
    let r = 1.0 - d.abs();
    let angle = match r > 0.0 {
        true => ((v.abs() - u.abs()) / r + 1.0) * FRAC_PI_4,
        false => FRAC_PI_4,
    };
    let across = r * (2.0 - r * r).max(0.0).sqrt();
    let (s, c) = libm::sincos(angle);
    DVec3::new(
        (across * c).copysign(u),
        (across * s).copysign(v),
        (1.0 - r * r).copysign(d),
    )
}

/// Returns the place of a unit direction in the square.
fn place(dir: DVec3) -> [f64; 2] {
    let DVec3 { x, y, z } = dir.abs();
    let r = ((x * x + y * y) / (1.0 + z)).sqrt().min(1.0);
    let b = r * libm::atan2(y, x) / FRAC_PI_2;
    let a = r - b;
    let (a, b) = match dir.z < 0.0 {
        true => (1.0 - b, 1.0 - a),
        false => (a, b),
    };
    [a.copysign(dir.x), b.copysign(dir.y)].map(|x| 0.5 * (x + 1.0))
}

/// Returns the mean of a map over an octahedral texel.
fn texel(map: &Environment, side: usize, [x, y]: [usize; 2]) -> Color {
    let mut sum = [0.0; 3];
    let fine = |x: usize, i: usize| ((x * FINE + i) as f64 + 0.5) / (side * FINE) as f64;
    for j in 0..FINE {
        for i in 0..FINE {
            let value = bilinear(map, direction([fine(x, i), fine(y, j)]));
            sum = std::array::from_fn(|k| sum[k] + value[k]);
        }
    }
    std::array::from_fn(|k| {
        let mean = sum[k] / (FINE * FINE) as f64 * f64::from(map.scale[k]);
        if mean.is_finite() { mean.max(0.0) } else { 0.0 }
    })
}

/// Reads a map of longitude by latitude bilinearly.
fn bilinear(map: &Environment, dir: DVec3) -> Color {
    let (sin, cos) = libm::sincos(map.rotation);
    // The map turns from −z towards −x about +y, so directions turn back.
    let (x, z) = (dir.x * cos - dir.z * sin, dir.x * sin + dir.z * cos);
    let column = (0.5 + libm::atan2(x, -z) / TAU) * f64::from(map.width) - 0.5;
    let row = libm::acos(dir.y.clamp(-1.0, 1.0)) / PI * f64::from(map.height) - 0.5;
    let (width, height) = (i64::from(map.width), i64::from(map.height));
    let pixel = |x: i64, y: i64| {
        let at = y.clamp(0, height - 1) * width + x.rem_euclid(width);
        let value = map.pixels[at as usize].map(f64::from);
        value.map(|x| if x.is_finite() { x.max(0.0) } else { 0.0 })
    };
    let (x0, y0) = (column.floor(), row.floor());
    let (fx, fy) = (column - x0, row - y0);
    let (x, y) = (x0 as i64, y0 as i64);
    let [a, b, c, d] = [
        pixel(x, y),
        pixel(x + 1, y),
        pixel(x, y + 1),
        pixel(x + 1, y + 1),
    ];
    std::array::from_fn(|k| {
        let (low, high) = (a[k] + (b[k] - a[k]) * fx, c[k] + (d[k] - c[k]) * fx);
        low + (high - low) * fy
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_directions_are_inverse() {
        for i in 0..40 {
            for j in 0..40 {
                let at = [i, j].map(|x| (f64::from(x) + 0.5) / 40.0);
                let dir = direction(at);
                assert!((dir.length() - 1.0).abs() < 1e-12);
                let back = place(dir);
                assert!((back[0] - at[0]).abs() + (back[1] - at[1]).abs() < 1e-9);
            }
        }
    }
}
