//! Figures of solids by random lines.
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

use super::body::{Body, Method};
use super::moments::{Symmetric, outer, plus};
use super::{Goal, Placed, root_of_squares};
use glam::DVec3;
use lanecast_engine::trace::TraceScratch;
use lanecast_picture::render::{Progress, mix, unit};
use rayon::prelude::*;
use std::sync::atomic::Ordering::Relaxed;

/// Number of independent estimates; their spread gives the error.
const REPETITIONS: u64 = 32;

/// Student's t of 31 degrees of freedom, two-sided, 95 %.
const STUDENT: f64 = 2.0395;

/// Number of lines without a hit after which the solid may be taken as empty.
pub(super) const LEAST_EMPTY: u64 = 1 << 18;

/// Lines of each repetition in the first round, whose figures serve only where time is
/// short, and the fewest for a meaningful spread of the repetitions.
const FIRST_LINES: u64 = 1 << 3;
const LEAST_LINES: u64 = 1 << 11;

/// If none of N lines hits, then with 95 % confidence fewer than 3 in N do.
const RULE_OF_THREE: f64 = 3.0;

pub struct Found {
    pub body: Body,
    pub lines: u64,
    pub is_fine: bool,
}

impl Goal {
    /// Returns whether `lines` without a hit put the goal out of reach: the hits still
    /// to be expected would leave a relative error of about 2 / √hits.
    pub(super) fn is_beyond(&self, lines: u64) -> bool {
        let hits = RULE_OF_THREE * self.most_lines as f64 / lines as f64;
        lines >= LEAST_EMPTY && hits * self.relative * self.relative < 4.0
    }
}

impl Placed<'_> {
    /// Returns the figures when the goal is reached or out of reach, or when time is up;
    /// `None` if it is up before there are any.
    pub(super) fn by_sampling(&self, goal: &Goal, progress: &Progress) -> Option<Found> {
        let mut sums = vec![Sums::default(); REPETITIONS as usize];
        let (mut from, mut to) = (0, FIRST_LINES);
        let mut last = None;
        loop {
            let added: Vec<Sums> = (0..REPETITIONS)
                .into_par_iter()
                .map(|r| self.repetition(r, from..to, goal, progress))
                .collect();
            if goal.is_stopped(progress) {
                return last;
            }
            for (sum, added) in sums.iter_mut().zip(&added) {
                sum.add(added);
            }
            let body = self.estimate(&sums, to);
            let lines = to * REPETITIONS;
            let is_fine = to >= LEAST_LINES && goal.is_reached(&body);
            let empty = sums.iter().all(|s| s.crossings == 0.0);
            let hopeless = empty && goal.is_beyond(lines);
            // The error falls at least as the root of the number of lines.
            let relative = (body.volume_error / body.volume).max(body.area_error / body.area);
            let share = (goal.relative / relative).min(1.0);
            let share = share * share * 100.0;
            progress
                .tiles_done
                .store(if share > 0.0 { share as u32 } else { 0 }, Relaxed);
            let found = Found {
                body,
                lines,
                is_fine,
            };
            if is_fine || hopeless || lines * 2 > goal.most_lines {
                return Some(found);
            }
            last = Some(found);
            (from, to) = (to, to * 2);
        }
    }

    fn repetition(
        &self,
        number: u64,
        lines: std::ops::Range<u64>,
        goal: &Goal,
        progress: &Progress,
    ) -> Sums {
        let seed = mix(goal.seed);
        let shift: [f64; 4] = std::array::from_fn(|k| unit(mix(seed ^ (number * 4 + k as u64))));
        let (center, half) = (self.bounds.center(), self.bounds.extent() * 0.5);
        let short = |x: f64| x / self.unit;
        let (mut sums, scratch) = (Sums::default(), &mut TraceScratch::default());
        for i in lines {
            if i % 64 == 0 {
                progress.rays.fetch_add(64, Relaxed);
                if goal.is_stopped(progress) {
                    break;
                }
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
                let middle = (across + dir * (0.5 * (enter + exit))) / self.unit;
                let weight = area * chord;
                sums.first += middle * weight;
                let own = outer(dir, weight * chord * chord / 12.0);
                sums.second = plus(sums.second, plus(outer(middle, weight), own));
            });
        }
        sums
    }

    /// Estimates the figures about the centre of the box; `lines` is the number of lines
    /// of each repetition.
    fn estimate(&self, sums: &[Sums], lines: u64) -> Body {
        let n = lines as f64;
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
        let methods = Body {
            method: Method::Sampling,
            area_method: Method::Sampling,
            ..Body::default()
        };
        if sums.iter().all(|s| s.crossings == 0.0) {
            // At most a square of the diagonal is crossed, over at most a diagonal's
            // length.
            let diagonal = (self.bounds.extent() / self.unit).length();
            let share = RULE_OF_THREE / (n * sums.len() as f64) * diagonal * diagonal;
            return Body {
                volume_error: share * diagonal,
                area_error: share * 4.0,
                ..methods
            };
        }
        let own = Body {
            volume,
            volume_error,
            area,
            area_error,
            ..methods
        };
        let whole: f64 = sums.iter().map(|s| s.volume).sum();
        if whole <= 0.0 {
            return own;
        }
        let first = sums.iter().fold(DVec3::ZERO, |m, s| m + s.first);
        let centroid = first / whole;
        // Errors of what is left of the moments about the found centroid.
        let centroid_errors = [0, 1, 2].map(|k| {
            let off = |s: &Sums| s.first[k] - s.volume * centroid[k];
            mean_and_error(&off).1 / volume
        });
        let central: [(f64, f64); 6] = std::array::from_fn(|k| {
            let [i, j] = super::moments::PAIRS[k];
            let square = |s: &Sums| {
                let mixed = s.first[i] * centroid[j] + s.first[j] * centroid[i];
                s.second[k] - mixed + s.volume * centroid[i] * centroid[j]
            };
            mean_and_error(&square)
        });
        Body {
            centroid,
            centroid_error: root_of_squares(centroid_errors.into_iter()),
            spread: central.map(|c| c.0),
            spread_error: central.iter().map(|c| c.1).fold(0.0, f64::max),
            ..own
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
    /// Moments about the centre of the box.
    first: DVec3,
    second: Symmetric,
}

impl Sums {
    fn add(&mut self, other: &Sums) {
        self.volume += other.volume;
        self.off += other.off;
        self.crossings += other.crossings;
        self.first += other.first;
        self.second = plus(self.second, other.second);
    }
}
