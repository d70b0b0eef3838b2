//! Volume, area and centroid of solids, by random lines.
//!
//! Lines through a solid's box have all directions and positions, distributed by a
//! low-discrepancy sequence (Roberts' R sequence in four dimensions). The length of a
//! line inside the solid is a sample of its volume, and each boundary that it crosses
//! is a sample of its surface (Cauchy and Crofton; Santaló, Integral Geometry and
//! Geometric Probability, 1976): for lines with density 1 per area across their
//! direction, the chords sum up to the volume and the crossings to half the area. The
//! error is estimated from independent repetitions with shifted sequences. If 2^18
//! lines hit nothing, and the expected number of hits of the remaining lines could not
//! reach the goal, the measurement ends with volume 0 and an absolute error.

mod placed;

#[cfg(test)]
mod tests;

pub use placed::{NoVolume, Placed};

use crate::render::{Progress, mix, unit};
use crate::trace::TraceScratch;
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;

/// Number of independent estimates; their spread gives the error.
const REPETITIONS: u64 = 32;

/// Student's t of 31 degrees of freedom, two-sided, 95 %.
const STUDENT: f64 = 2.0395;

/// Number of lines without a hit after which the solid may be taken as empty.
const LEAST_EMPTY: u64 = 1 << 18;

/// If none of N lines hits, then with 95 % confidence fewer than 3 in N do.
const RULE_OF_THREE: f64 = 3.0;

/// Volume, area and centroid, in the scene's unit, its square and its cube.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Volume {
    pub volume: f64,
    /// Half-width of the 95 % confidence interval of the volume.
    pub volume_error: f64,
    pub area: f64,
    pub area_error: f64,
    /// World space; `None` without volume.
    pub centroid: Option<[f64; 3]>,
    pub lines: u64,
    /// Errors exceed the goal: the solid is too thin for the allowed number of lines.
    pub is_rough: bool,
}

impl Volume {
    /// Converts a volume in lengths of `unit` to the scene's unit. Returns `None` where
    /// f64 cannot hold a figure.
    fn of_units(self, unit: f64) -> Option<Volume> {
        // The products are taken one factor at a time, so that no intermediate result
        // overflows if the final one does not.
        let square = |x: f64| x * unit * unit;
        let cube = |x: f64| x * unit * unit * unit;
        let error = |own: f64, whole: f64| match own > 0.0 {
            true => whole.max(f64::MIN_POSITIVE),
            false => whole,
        };
        let whole = Volume {
            volume: cube(self.volume),
            volume_error: error(self.volume_error, cube(self.volume_error)),
            area: square(self.area),
            area_error: error(self.area_error, square(self.area_error)),
            ..self
        };
        let same = |own: f64, whole: f64| own == 0.0 || whole.is_normal();
        let is_known = same(self.volume, whole.volume) && same(self.area, whole.area);
        (is_known && whole.is_finite()).then_some(whole)
    }

    fn is_finite(&self) -> bool {
        let figures = [self.volume, self.volume_error, self.area, self.area_error];
        let centroid = self.centroid.unwrap_or_default();
        figures.iter().chain(&centroid).all(|x| x.is_finite())
    }
}

/// The figures of a solid, in lengths of a unit of its size; also valid for the
/// smallest and largest solids, whose cubes f64 does not hold.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// The figures; only the centroid is in the scene's unit.
    own: Volume,
    unit: f64,
}

impl Measured {
    /// Returns the figures with all lengths scaled by `scale`, and the centroid mapped
    /// by `place`. Returns `None` where f64 cannot hold a figure.
    pub fn volume(&self, scale: f64, place: impl Fn([f64; 3]) -> [f64; 3]) -> Option<Volume> {
        let placed = Volume {
            centroid: self.own.centroid.map(place),
            ..self.own
        };
        placed.of_units(self.unit * scale)
    }
}

/// The accuracy to reach, and the effort allowed for it.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// Relative errors of volume and area.
    pub relative: f64,
    /// Maximum number of lines per solid.
    pub most_lines: u64,
    pub seed: u64,
}

impl Default for Goal {
    fn default() -> Goal {
        Goal {
            relative: 5e-4,
            most_lines: 1 << 24,
            seed: 0,
        }
    }
}

impl Goal {
    /// Returns whether `lines` without a hit put the goal out of reach: the hits still
    /// to be expected would leave a relative error of about 2 / √hits.
    fn is_beyond(&self, lines: u64) -> bool {
        let hits = RULE_OF_THREE * self.most_lines as f64 / lines as f64;
        lines >= LEAST_EMPTY && hits * self.relative * self.relative < 4.0
    }
}

impl Placed<'_> {
    /// Measures the solid on the current rayon pool. Returns `None` if cancelled.
    pub fn measure(&self, goal: &Goal, progress: &Progress) -> Option<Measured> {
        let mut sums = vec![Sums::default(); REPETITIONS as usize];
        // The first round has enough lines for a meaningful spread of the repetitions.
        let (mut from, mut to) = (0, 1 << 11);
        loop {
            let added: Vec<Sums> = (0..REPETITIONS)
                .into_par_iter()
                .map(|r| self.repetition(r, from..to, goal.seed, progress))
                .collect();
            if progress.is_cancelled() {
                return None;
            }
            for (sum, added) in sums.iter_mut().zip(&added) {
                sum.add(added);
            }
            let found = self.estimate(&sums, to);
            let fine = found.volume_error <= goal.relative * found.volume
                && found.area_error <= goal.relative * found.area;
            let empty = sums.iter().all(|s| s.crossings == 0.0);
            let hopeless = empty && goal.is_beyond(to * REPETITIONS);
            if fine || hopeless || to * 2 * REPETITIONS > goal.most_lines {
                let own = Volume {
                    is_rough: !fine,
                    ..found
                };
                let unit = self.unit;
                return Some(Measured { own, unit });
            }
            (from, to) = (to, to * 2);
        }
    }

    fn repetition(
        &self,
        number: u64,
        lines: std::ops::Range<u64>,
        seed: u64,
        progress: &Progress,
    ) -> Sums {
        let shift: [f64; 4] =
            std::array::from_fn(|k| unit(mix(mix(seed) ^ (number * 4 + k as u64))));
        let (center, half) = (self.bounds.center(), self.bounds.extent() * 0.5);
        let short = |x: f64| x / self.unit;
        let (mut sums, scratch) = (Sums::default(), &mut TraceScratch::default());
        for i in lines {
            if i % 1024 == 0 && progress.is_cancelled() {
                break;
            }
            let at: [f64; 4] = std::array::from_fn(|k| {
                let x = shift[k] + STEPS[k] * i as f64;
                x - libm::floor(x)
            });
            // Half of all directions suffice: a line has no orientation.
            let (z, turn) = (at[0], at[1] * std::f64::consts::TAU);
            let radius = (1.0 - z * z).max(0.0).sqrt();
            let (sin, cos) = libm::sincos(turn);
            let dir = DVec3::new(radius * cos, radius * sin, z);
            let (u, v) = dir.any_orthonormal_pair();
            // The box's projection lies inside this rectangle.
            let [a, b] = [u, v].map(|axis| half.dot(axis.abs()));
            let across = u * (a * (2.0 * at[2] - 1.0)) + v * (b * (2.0 * at[3] - 1.0));
            let area = 4.0 * short(a) * short(b);
            self.spans(center + across, dir, scratch, |enter, exit, off| {
                let chord = short(exit - enter);
                sums.volume += area * chord;
                sums.off += area * short(off);
                sums.crossings += 2.0 * area;
                let middle = across + dir * (0.5 * (enter + exit));
                sums.moment += middle / self.unit * (area * chord);
            });
        }
        sums
    }

    /// Estimates the figures; `lines` is the number of lines of each repetition.
    fn estimate(&self, sums: &[Sums], lines: u64) -> Volume {
        let (n, center) = (lines as f64, self.bounds.center());
        let mean_and_error = |of: &dyn Fn(&Sums) -> f64| {
            let values: Vec<f64> = sums.iter().map(|s| of(s) / n).collect();
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            let away = root_of_squares(values.iter().map(|x| x - mean));
            let deviation = away / (count - 1.0).sqrt();
            (mean, STUDENT * deviation / count.sqrt())
        };
        let (volume, spread) = mean_and_error(&|s| s.volume);
        let volume_error = spread + mean_and_error(&|s| s.off).0;
        // A crossing, summed over all directions, counts half the area.
        let (area, area_error) = mean_and_error(&|s| 2.0 * s.crossings);
        let moment = sums.iter().fold(DVec3::ZERO, |m, s| m + s.moment);
        let whole: f64 = sums.iter().map(|s| s.volume).sum();
        if sums.iter().all(|s| s.crossings == 0.0) {
            // At most a square of the diagonal is crossed, over at most a diagonal's
            // length.
            let diagonal = (self.bounds.extent() / self.unit).length();
            let share = RULE_OF_THREE / (n * sums.len() as f64) * diagonal * diagonal;
            return Volume {
                volume_error: share * diagonal,
                area_error: share * 4.0,
                lines: lines * sums.len() as u64,
                ..Volume::default()
            };
        }
        Volume {
            volume,
            volume_error,
            area,
            area_error,
            centroid: (whole > 0.0).then(|| (center + moment / whole * self.unit).to_array()),
            lines: lines * sums.len() as u64,
            is_rough: false,
        }
    }
}

/// Powers of the reciprocal root of x⁵ = x + 1.
const STEPS: [f64; 4] = [
    0.856_674_883_854_502_9,
    0.733_891_856_627_126_1,
    0.628_706_721_037_808_6,
    0.538_597_257_223_612_3,
];

/// Sums over lines, in lengths of the solid's unit.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    volume: f64,
    /// Bound on the rounding error of `volume`.
    off: f64,
    crossings: f64,
    /// First moment about the centre of the box.
    moment: DVec3,
}

impl Sums {
    fn add(&mut self, other: &Sums) {
        self.volume += other.volume;
        self.off += other.off;
        self.crossings += other.crossings;
        self.moment += other.moment;
    }
}

/// Sums several solids as if none overlapped. Each comes with the number of its
/// measurement: errors with the same number are fully correlated, others are
/// independent. Returns `None` where f64 cannot hold a sum.
pub fn together(all: &[(usize, Volume)]) -> Option<Volume> {
    let mut sum = Volume::default();
    let mut errors = BTreeMap::<usize, [f64; 2]>::new();
    for (number, one) in all {
        sum.volume += one.volume;
        sum.area += one.area;
        sum.lines += one.lines;
        sum.is_rough |= one.is_rough;
        let [volume, area] = errors.entry(*number).or_default();
        *volume += one.volume_error;
        *area += one.area_error;
    }
    [sum.volume_error, sum.area_error] =
        [0, 1].map(|k| root_of_squares(errors.values().map(|e| e[k])));
    sum.centroid = (sum.volume > 0.0).then(|| {
        let share = |one: &Volume| {
            let centroid = one.centroid.map_or(DVec3::ZERO, DVec3::from_array);
            centroid * (one.volume / sum.volume)
        };
        all.iter()
            .map(|(_, one)| share(one))
            .sum::<DVec3>()
            .to_array()
    });
    sum.is_finite().then_some(sum)
}

/// Returns the root of the sum of squares; no square overflows or underflows.
fn root_of_squares(numbers: impl Iterator<Item = f64> + Clone) -> f64 {
    let largest = numbers.clone().fold(0.0, |m: f64, x| m.max(x.abs()));
    // Scaling by a power of two is exact.
    let power = libm::scalbn(1.0, libm::ilogb(largest.max(f64::MIN_POSITIVE)));
    let square = |x: f64| (x / power) * (x / power);
    power * numbers.map(square).sum::<f64>().sqrt()
}
