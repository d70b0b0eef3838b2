//! Environment maps and how they are sampled.
//!
//! A map of longitude by latitude is resampled once to an octahedral one of equal areas
//! ([`octahedral`]), which needs no density of its own and few elementary functions. Its
//! radiance is bilinear between texels' centres. The sampling density is constant in each
//! texel, the mean of the bilinear function there, so it is 0 only where the radiance is
//! ([`quad_tree`]).
//!
//! With MIS compensation (Karlík, Šik, Vévoda, Skřivan and Křivánek 2019, "MIS
//! Compensation", section 5) the density is that of the radiance above its mean. What is left
//! to BSDF sampling is then what that samples well, and a smooth sky costs nothing. Such a
//! density is right only together with BSDF sampling.

mod octahedral;
mod quad_tree;
#[cfg(test)]
mod tests;

use lanecast_model::scene::{Environment, Rgb};
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::elementary::atan2;
use lanecast_numerics::math::lanes::{Lanes, f32x8};
use quad_tree::QuadTree;
use std::f32::consts::{PI, TAU};

/// The greatest number of octahedral texels to a side is 2 to this power.
const MOST_LEVELS: u32 = 12;
const LEAST_LEVELS: u32 = 7;
/// Samples of the map to a texel and axis.
const FINE: usize = 4;
/// A sky of which less than this part is above the mean is not sampled.
const LEAST_PART: f64 = 1e-3;

/// Which part of the radiance the sampling density follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compensation {
    /// What exceeds the mean; needs BSDF sampling beside it.
    Compensated,
    /// All of it.
    Plain,
}

/// An environment map, prepared for rendering.
#[derive(Clone, Debug)]
pub struct SkyMap {
    /// Texels to a side, a power of two.
    side: usize,
    /// (side + 2)² texels, row by row, with one more on each side.
    texels: Vec<Rgb>,
    /// None if nothing is worth sampling.
    density: Option<QuadTree>,
    /// The mean of what the density follows, over all directions and channels.
    sampled_mean: f32,
}

impl SkyMap {
    /// Resamples a map of longitude by latitude. Radiance that is negative, NaN or infinite
    /// counts as black.
    pub fn new(environment: &Environment, compensation: Compensation) -> SkyMap {
        // Texels as wide as the map's on its equator: side² = width²/π.
        let alike = libm::log2(f64::from(environment.width.max(1)) / 1.77).round() as u32;
        let levels = alike.clamp(LEAST_LEVELS, MOST_LEVELS);
        let side = 1_usize << levels;
        let source = Source::new(environment);
        let inner: Vec<Rgb> = (0..side)
            .flat_map(|y| (0..side).map(move |x| [x, y]))
            .map(|at| source.texel(side, at))
            .collect();
        let row = side + 2;
        let texels: Vec<Rgb> = (0..row * row)
            .map(|k| {
                let at = [k % row, k / row].map(|x| x as i64 - 1);
                let [x, y] = octahedral::wrapped(side as i64, at).map(|x| x as usize);
                inner[y * side + x]
            })
            .collect();
        let mut weights = means(side, &texels);
        let total: f64 = weights.iter().sum();
        if compensation == Compensation::Compensated {
            let mean = total / weights.len() as f64;
            weights.iter_mut().for_each(|w| *w = (*w - mean).max(0.0));
        }
        let sampled: f64 = weights.iter().sum();
        let worth = sampled > total * LEAST_PART;
        SkyMap {
            side,
            texels,
            sampled_mean: if worth {
                (sampled / weights.len() as f64) as f32
            } else {
                0.0
            },
            density: worth.then(|| QuadTree::new(levels, &weights)),
        }
    }

    /// Returns the mean radiance of what is sampled; 0 if nothing is.
    pub fn sampled_mean(&self) -> f32 {
        self.sampled_mean
    }

    /// Returns the bytes of the texels and their density.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.texels) + self.density.as_ref().map_or(0, QuadTree::bytes)
    }

    /// Returns the radiance from unit directions.
    #[inline(always)]
    pub fn radiance<L: Lanes<Scalar = f32>>(&self, dir: Vec3<L>) -> [L; 3] {
        self.radiance_at(octahedral::place(dir))
    }

    /// Returns the radiance from unit directions, and the density of [`SkyMap::sample`] over
    /// solid angle.
    #[inline(always)]
    pub fn radiance_and_pdf<L: Lanes<Scalar = f32>>(&self, dir: Vec3<L>) -> ([L; 3], L) {
        let place = octahedral::place(dir);
        let pdf = match &self.density {
            Some(density) => density.density(place) * L::splat(0.5 / TAU),
            None => L::zero(),
        };
        (self.radiance_at(place), pdf)
    }

    /// Maps points of the unit square to unit directions; meaningless if nothing is sampled.
    #[inline(always)]
    pub fn sample<L: Lanes<Scalar = f32>>(&self, u: [L; 2]) -> Vec3<L> {
        let place = self.density.as_ref().map_or(u, |density| density.sample(u));
        octahedral::direction(place)
    }

    #[inline(always)]
    fn radiance_at<L: Lanes<Scalar = f32>>(&self, place: [L; 2]) -> [L; 3] {
        let row = self.side + 2;
        // Texel k of the bordered map has its centre at k − ½.
        let [x, y] = place.map(|x| x * L::splat(self.side as f32) + L::splat(0.5));
        let [columns, rows] = [x, y].map(L::to_array);
        let most = self.side;
        let mut whole = [L::zero().to_array(); 2];
        let mut corners = [[L::zero().to_array(); 3]; 4];
        for lane in 0..L::COUNT {
            let x = (columns.as_ref()[lane] as usize).min(most);
            let y = (rows.as_ref()[lane] as usize).min(most);
            whole[0].as_mut()[lane] = x as f32;
            whole[1].as_mut()[lane] = y as f32;
            let at = y * row + x;
            for (corner, place) in corners.iter_mut().zip([at, at + 1, at + row, at + row + 1]) {
                for (channel, value) in corner.iter_mut().zip(self.texels[place]) {
                    channel.as_mut()[lane] = value;
                }
            }
        }
        let [fx, fy] = [
            x - L::load(whole[0].as_ref()),
            y - L::load(whole[1].as_ref()),
        ];
        std::array::from_fn(|c| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| L::load(corners[k][c].as_ref()));
            let (low, high) = (a + (b - a) * fx, c + (d - c) * fx);
            low + (high - low) * fy
        })
    }
}

/// Returns the mean of the bilinear function in each texel, over the channels too: weights
/// 1, 6, 1 by 1, 6, 1 of the texels around, over 64.
fn means(side: usize, texels: &[Rgb]) -> Vec<f64> {
    let row = side + 2;
    let gray = |k: usize| texels[k].iter().map(|&x| f64::from(x)).sum::<f64>() / 3.0;
    let across = |k: usize| gray(k - 1) + 6.0 * gray(k) + gray(k + 1);
    let texel = |k: usize| (across(k - row) + 6.0 * across(k) + across(k + row)) / 64.0;
    let place = |k: usize| (k / side + 1) * row + k % side + 1;
    (0..side * side).map(|k| texel(place(k))).collect()
}

/// A map of longitude by latitude, read bilinearly.
struct Source<'a> {
    environment: &'a Environment,
    sin_cos: [f32; 2],
}

impl Source<'_> {
    fn new(environment: &Environment) -> Source<'_> {
        let (sin, cos) = libm::sincos(environment.rotation);
        Source {
            environment,
            sin_cos: [sin as f32, cos as f32],
        }
    }

    /// Returns the mean over an octahedral texel.
    fn texel(&self, side: usize, [x, y]: [usize; 2]) -> Rgb {
        let unit = 1.0 / (side * FINE) as f32;
        let mut sum = [0.0; 3];
        for step in 0..FINE * FINE / 8 {
            let fine = |i: usize| step * 8 + i;
            let u = std::array::from_fn::<f32, 8, _>(|i| {
                ((x * FINE + fine(i) % FINE) as f32 + 0.5) * unit
            });
            let v = std::array::from_fn::<f32, 8, _>(|i| {
                ((y * FINE + fine(i) / FINE) as f32 + 0.5) * unit
            });
            let place = [u, v].map(|x| f32x8::load(&x));
            for at in self.places(octahedral::direction(place)) {
                let value = self.bilinear(at);
                sum.iter_mut().zip(value).for_each(|(sum, x)| *sum += x);
            }
        }
        let scale = self.environment.scale;
        std::array::from_fn(|c| {
            let mean = sum[c] / (FINE * FINE) as f32 * scale[c];
            if mean.is_finite() { mean.max(0.0) } else { 0.0 }
        })
    }

    /// Returns column and row of directions, in pixels from the map's left upper corner.
    fn places(&self, dir: Vec3<f32x8>) -> [[f32; 2]; 8] {
        let [sin, cos] = self.sin_cos.map(f32x8::splat);
        // The map turns from −z towards −x about +y, so directions turn back.
        let (x, z) = (dir.x * cos - dir.z * sin, dir.x * sin + dir.z * cos);
        let (half, turn) = (f32x8::splat(0.5), f32x8::splat(1.0 / TAU));
        let column = half + atan2(x, -z) * turn;
        let row = atan2((x * x + z * z).sqrt(), dir.y) * f32x8::splat(1.0 / PI);
        let Environment { width, height, .. } = *self.environment;
        let column = column * f32x8::splat(width as f32);
        let row = row * f32x8::splat(height as f32);
        let (column, row) = (Lanes::to_array(column), Lanes::to_array(row));
        std::array::from_fn(|i| [column[i], row[i]])
    }

    fn bilinear(&self, [column, row]: [f32; 2]) -> Rgb {
        let Environment { width, height, .. } = *self.environment;
        let (width, height) = (width as i64, height as i64);
        let [x, y] = [column, row].map(|x| x - 0.5);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let pixel = |x: i64, y: i64| {
            let (x, y) = (x.rem_euclid(width), y.clamp(0, height - 1));
            let value = self.environment.pixels[(y * width + x) as usize];
            value.map(|x| if x.is_finite() { x.max(0.0) } else { 0.0 })
        };
        let (x, y) = (x.floor() as i64, y.floor() as i64);
        let [a, b] = [pixel(x, y), pixel(x + 1, y)];
        let [c, d] = [pixel(x, y + 1), pixel(x + 1, y + 1)];
        std::array::from_fn(|k| {
            let (low, high) = (a[k] + (b[k] - a[k]) * fx, c[k] + (d[k] - c[k]) * fx);
            low + (high - low) * fy
        })
    }
}
