//! Pixel filters by their formulas, sampled by importance. The model tabulates a profile as a
//! density that is linear between the ends of 512 cells from its edge to its centre; that
//! table is part of the filter's definition, and is inverted here in f64.

use std::f64::consts::PI;

const CELLS: usize = 512;

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
    /// The distance beyond which the profile is negative, and the weight of a sample.
    lobe: f64,
    weight: f64,
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
        let (mut total, mut net) = (0.0, 0.0);
        let mut ends: Vec<[f64; 3]> = Vec::new();
        for i in 0..=CELLS {
            let x = place(i);
            let value = profile.at(x).abs();
            if let Some([before, from, _]) = ends.last() {
                let mass = 0.5 * (from + value) * (before - x);
                total += mass;
                net += if *before > lobe { -mass } else { mass };
            }
            ends.push([x, value, total]);
        }
        Filter {
            profile,
            ends,
            lobe,
            weight: total / net,
        }
    }

    /// Returns the offset from the pixel's centre for a number in [0, 1), and the weight of a
    /// sample there.
    pub fn offset(&self, u: f64) -> (f64, f64) {
        if self.profile == Profile::Box {
            return (u - 0.5, 1.0);
        }
        let half = if u < 0.5 { u } else { 1.0 - u };
        let total = self.ends[CELLS][2];
        let mass = 2.0 * half * total;
        let after = self.ends.partition_point(|end| end[2] <= mass);
        let after = after.clamp(1, CELLS);
        let ([outer, from, before], [inner, to, _]) = (self.ends[after - 1], self.ends[after]);
        // ∫ of the line from the outer end is the mass: a t² + b t = c.
        let width = outer - inner;
        let (a, b, c) = (0.5 * (to - from) * width, from * width, mass - before);
        let root = (b * b + 4.0 * a * c).max(0.0).sqrt();
        let t = if c > 0.0 { 2.0 * c / (b + root) } else { 0.0 };
        let distance = outer - t.min(1.0) * width;
        let sign = if outer > self.lobe { -1.0 } else { 1.0 };
        let offset = if u < 0.5 { -distance } else { distance };
        (offset, sign * self.weight)
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
            let of = |i: u32| filter.offset((f64::from(i) + 0.5) / 20_000.0);
            let (mut weights, mut places) = (0.0, 0.0);
            for (offset, weight) in (0..20_000).map(of) {
                weights += weight;
                places += weight * offset;
            }
            assert!((weights / 20_000.0 - 1.0).abs() < 1e-3, "{profile:?}");
            assert!(places.abs() < 1e-6, "{profile:?}");
        }
    }
}
