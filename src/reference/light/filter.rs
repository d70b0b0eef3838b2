//! Pixel filters by their formulas, sampled by importance. The model tabulates a profile as a
//! density that is linear between the ends of 512 cells from its edge to its centre; that
//! table is part of the filter's definition, and is inverted here in f64.

use std::f64::consts::PI;

const CELLS: usize = 512;

/// The model gives the last of so many samples to the filter's negative parts, and weighs the
/// later half of the others so that the weights of a period, and those of its first half, add up
/// to the number of samples.
const PERIOD: u32 = 16;

/// The profile of a pixel filter; lengths in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// The pixel's own square.
    Box,
    /// Standard deviation 0.5, cut at 1.5 and lowered to 0 there.
    Gaussian,
    /// Mitchell and Netravali 1988 with B = C = 1/3.
    Mitchell,
    /// Blackman and Harris' window of four terms, three pixels wide.
    BlackmanHarris,
}

impl Profile {
    fn radius(self) -> f64 {
        match self {
            Profile::Box => 0.5,
            Profile::Gaussian | Profile::BlackmanHarris => 1.5,
            Profile::Mitchell => 2.0,
        }
    }

    fn at(self, x: f64) -> f64 {
        match self {
            Profile::Box => 1.0,
            Profile::Gaussian => libm::exp(-2.0 * x * x) - libm::exp(-4.5),
            // Their equation 8, times 18.
            Profile::Mitchell if x < 1.0 => 21.0 * x.powi(3) - 36.0 * x.powi(2) + 16.0,
            Profile::Mitchell => -7.0 * x.powi(3) + 36.0 * x.powi(2) - 60.0 * x + 32.0,
            Profile::BlackmanHarris => {
                let term = |k: f64| libm::cos(2.0 * PI * k * (x + 1.5) / 3.0);
                0.35875 - 0.48829 * term(1.0) + 0.14128 * term(2.0) - 0.01168 * term(3.0)
            }
        }
    }
}

/// A pixel filter, ready to be sampled.
#[derive(Clone, Debug)]
pub struct Filter {
    profile: Profile,
    /// Ends of the cells by their distance from the centre, from the edge inwards, the
    /// profile's magnitude there, and the mass outside.
    ends: Vec<[f64; 3]>,
    /// The mass beyond the profile's zero, of a half.
    outer: f64,
}

impl Filter {
    pub fn new(profile: Profile) -> Filter {
        let radius = profile.radius();
        // Mitchell's outer cubic is −(7x − 8)(x − 2)².
        let lobe = match profile {
            Profile::Mitchell => 8.0 / 7.0,
            _ => radius,
        };
        let outside = (CELLS as f64 * (radius - lobe) / radius) as usize;
        let inside = CELLS - outside;
        let place = |i: usize| match i < outside {
            true => radius - (radius - lobe) * i as f64 / outside as f64,
            false => lobe * (CELLS - i) as f64 / inside as f64,
        };
        let (mut total, mut negative) = (0.0, 0.0);
        let mut ends: Vec<[f64; 3]> = Vec::new();
        for i in 0..=CELLS {
            let x = place(i);
            let value = profile.at(x).abs();
            if let Some([before, from, _]) = ends.last() {
                let mass = 0.5 * (from + value) * (before - x);
                total += mass;
                if *before > lobe {
                    negative += mass;
                }
            }
            ends.push([x, value, total]);
        }
        Filter {
            profile,
            ends,
            outer: if lobe < radius { negative } else { 0.0 },
        }
    }

    /// Returns the offsets from the pixel's centre of a sample with two numbers in [0, 1), and its
    /// weight.
    pub fn sample(&self, [u, v]: [f64; 2], sample: u32) -> ([f64; 2], f64) {
        let total = self.ends[CELLS][2];
        if self.outer == 0.0 {
            return ([u, v].map(|u| self.offset(u, [0.0, total])), 1.0);
        }
        // Of a whole profile of integral 1.
        let net = total - 2.0 * self.outer;
        let [a, b] = [total - self.outer, self.outer].map(|mass| mass / net);
        let (lobes, negative) = ([[self.outer, total], [0.0, self.outer]], 2.0 * a * b);
        let positive = a * a + b * b;
        let (half, number) = (0.5 * f64::from(PERIOD), sample % PERIOD);
        if number + 1 == PERIOD {
            let (u, x) = if u < 0.5 {
                (2.0 * u, 1)
            } else {
                (2.0 * u - 1.0, 0)
            };
            let at = [self.offset(u, lobes[x]), self.offset(v, lobes[1 - x])];
            return (at, -2.0 * half * negative);
        }
        let corners = b * b / positive;
        let (u, lobe) = match u < corners {
            true => (u / corners, 1),
            false => ((u - corners) / (1.0 - corners), 0),
        };
        let weight = match f64::from(number) < half {
            true => 1.0,
            false => (2.0 * half * positive - half) / (half - 1.0),
        };
        ([u, v].map(|u| self.offset(u, lobes[lobe])), weight)
    }

    /// Returns the offset along one axis for a number in [0, 1), between two masses from the edge.
    fn offset(&self, u: f64, [low, high]: [f64; 2]) -> f64 {
        if self.profile == Profile::Box {
            return u - 0.5;
        }
        let half = if u < 0.5 { u } else { 1.0 - u };
        let mass = low + 2.0 * half * (high - low);
        let after = self.ends.partition_point(|end| end[2] <= mass);
        let after = after.clamp(1, CELLS);
        let ([outer, from, before], [inner, to, _]) = (self.ends[after - 1], self.ends[after]);
        // ∫ of the line from the outer end is the mass: a t² + b t = c.
        let width = outer - inner;
        let (a, b, c) = (0.5 * (to - from) * width, from * width, mass - before);
        let root = (b * b + 4.0 * a * c).max(0.0).sqrt();
        let t = if c > 0.0 { 2.0 * c / (b + root) } else { 0.0 };
        let distance = outer - t.min(1.0) * width;
        if u < 0.5 { -distance } else { distance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_average_to_one() {
        let all = [
            Profile::Box,
            Profile::Gaussian,
            Profile::Mitchell,
            Profile::BlackmanHarris,
        ];
        for profile in all {
            let filter = Filter::new(profile);
            let of = |i: u32| {
                let number = f64::from(i / PERIOD);
                let u = (number + 0.5) / 2_000.0;
                filter.sample([u, (number * 0.618_033_988_75).fract()], i)
            };
            let (mut weights, mut places) = (0.0, 0.0);
            for ([x, y], weight) in (0..2_000 * PERIOD).map(of) {
                weights += weight;
                places += weight * (x + y);
            }
            let mean = weights / f64::from(2_000 * PERIOD);
            assert!((mean - 1.0).abs() < 1e-12, "{profile:?}: {mean}");
            let place = places / f64::from(2_000 * PERIOD);
            assert!(place.abs() < 2e-3, "{profile:?}: {place}");
        }
    }
}
