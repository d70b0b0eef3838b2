//! Figures of solids by nested quadrature over lines along the three axes.
//!
//! A line along an axis is inside the solid along chords, which give volume and moments; a
//! plane of such lines is integrated, and a pencil of such planes ([`super::kronrod`]).
//! Panels are cut where the sequence of faces that a line meets changes, and those of
//! planes where the sequence of sequences does. The ends of operands' boxes are cut at
//! from the start.
//!
//! Each axis gives the volume and the moments by itself, so the three check each other: a
//! feature that falls between the nodes of one axis is seen by the others. The area is the
//! sum over the axes of ∫|n_k|, where n is the unit normal where a line along axis k meets
//! the surface: an element of area projects to n_k² of itself in this way, and the three
//! squares sum to 1. Unlike the projection of one axis, it has no poles at silhouettes.

use super::body::{Body, Method};
use super::kronrod::{FIGURES, Figures, Sample, Tolerance, integrate};
use super::moments::{PAIRS, outer, plus};
use super::placed::End;
use super::{Goal, Placed};
use glam::DVec3;
use lanecast_engine::trace::{ScratchPool, TraceScratch};
use lanecast_numerics::math::unit;
use lanecast_picture::render::Progress;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

/// Relative tolerance of the first round. As panels are mostly better than their tolerance
/// by two digits, it often reaches the goal.
const FIRST_ROUND: f64 = 1e-2;

/// Lines of the first round at most; what takes more is left to sampling.
const MOST_AT_FIRST: u64 = 1 << 21;

/// The most ends of operands' boxes along an axis that are cut at from the start.
const MOST_SPLITS: usize = 64;

/// Factor on the error of areas, of which each axis gives another part, so that nothing
/// checks their estimates.
const AREA_MARGIN: f64 = 4.0;

/// Panels along an axis at least, of equal width.
const LEAST_PANELS: u32 = 4;

pub struct Found {
    pub body: Body,
    pub lines: u64,
}

/// Lines so far, and whether to give up.
struct Effort<'a> {
    goal: &'a Goal,
    progress: &'a Progress,
    lines: AtomicU64,
    most: u64,
    is_over: AtomicBool,
    scratch: ScratchPool<TraceScratch>,
}

impl Effort<'_> {
    /// Counts a line; says whether to go on.
    fn goes_on(&self) -> bool {
        let lines = self.lines.fetch_add(1, Relaxed);
        if lines.is_multiple_of(64) {
            self.progress.rays.fetch_add(64, Relaxed);
            if lines > self.most || self.goal.is_stopped(self.progress) {
                self.is_over.store(true, Relaxed);
            }
        }
        !self.is_over.load(Relaxed)
    }
}

impl Placed<'_> {
    /// Returns the best figures that `most` lines, and the time that the goal allows, give;
    /// `None` if there are none.
    pub(super) fn by_quadrature(
        &self,
        goal: &Goal,
        most: u64,
        progress: &Progress,
    ) -> Option<Found> {
        let mut effort = Effort {
            goal,
            progress,
            lines: AtomicU64::new(0),
            most: most.min(MOST_AT_FIRST),
            is_over: AtomicBool::new(false),
            scratch: ScratchPool::default(),
        };
        let boxes = self.operand_boxes();
        let half = self.bounds.extent() * 0.5 / self.unit;
        // An empty intersection has an empty box.
        if !(half.is_finite() && half.cmpgt(DVec3::ZERO).all()) {
            return None;
        }
        // What counts as 1, until the figures are known.
        let (mut volume, mut area) = (
            8.0 * half.x * half.y * half.z,
            4.0 * (half.x * half.y + half.y * half.z + half.z * half.x),
        );
        let mut found: Option<Found> = None;
        let finer = [goal.relative, 0.1 * goal.relative].into_iter();
        let rounds = [FIRST_ROUND]
            .into_iter()
            .chain(finer.filter(|r| *r < FIRST_ROUND));
        for (round, relative) in rounds.enumerate() {
            progress.tiles_done.store(10 + 20 * round as u32, Relaxed);
            let size = half.max_element();
            let mut scale = [volume * size * size; FIGURES];
            scale[0] = volume;
            scale[1..4].fill(volume * size);
            scale[10] = area / 3.0;
            let axes = [0, 1, 2].map(|axis| self.along(axis, &boxes, (&scale, relative), &effort));
            let lines = effort.lines.load(Relaxed);
            if effort.is_over.load(Relaxed) {
                break;
            }
            let mut body = self.joined(&axes);
            if let Some(before) = &found {
                // Where the rounds differ by more than the estimates say, these are wrong.
                let off = (body.volume - before.body.volume).abs();
                if off > before.body.volume_error {
                    body.volume_error += 0.1 * off;
                }
                let off = (body.area - before.body.area).abs();
                if off > before.body.area_error {
                    body.area_error += 0.1 * off;
                }
            }
            if body.volume <= body.volume_error {
                found = None;
                continue;
            }
            (volume, area) = (body.volume, body.area);
            let is_fine = goal.is_reached(&body);
            found = Some(Found { body, lines });
            if is_fine {
                break;
            }
            // Another round takes several times as long.
            if lines > most / 4 {
                break;
            }
            effort.most = most;
        }
        found
    }

    /// Integrates over all lines along an axis.
    fn along(
        &self,
        axis: usize,
        boxes: &[lanecast_numerics::math::Aabb],
        (scale, relative): (&Figures, f64),
        effort: &Effort,
    ) -> Sample {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let center = self.bounds.center();
        let half = self.bounds.extent() * 0.5 / self.unit;
        let local = |x: f64, k: usize| (x - center[k]) / self.unit;
        let splits = |k: usize, within: &dyn Fn(&lanecast_numerics::math::Aabb) -> bool| {
            let mut all: Vec<f64> = boxes
                .iter()
                .filter(|b| within(b))
                .flat_map(|b| [local(b.min[k], k), local(b.max[k], k)])
                .filter(|x| x.abs() < half[k])
                .collect();
            all.sort_by(f64::total_cmp);
            all.dedup_by(|a, b| *a - *b < 1e-12 * half[k]);
            if all.len() > MOST_SPLITS {
                let step = all.len().div_ceil(MOST_SPLITS);
                all = all.into_iter().step_by(step).collect();
            }
            let even = (1..LEAST_PANELS)
                .map(|i| half[k] * (2.0 * f64::from(i) / f64::from(LEAST_PANELS) - 1.0));
            if (all.len() as u32) < LEAST_PANELS {
                all.extend(even);
                all.sort_by(f64::total_cmp);
                all.dedup_by(|a, b| *a - *b < 1e-3 * half[k]);
            }
            all.insert(0, -half[k]);
            all.push(half[k]);
            all
        };
        let inner = Tolerance {
            scale,
            relative: relative * 0.1,
            is_parallel: false,
        };
        let plane = |x: f64, hints: &[f64]| -> Sample {
            if effort.is_over.load(Relaxed) {
                return Sample::default();
            }
            let world = center[u] + x * self.unit;
            let meets = |b: &lanecast_numerics::math::Aabb| b.min[u] <= world && world <= b.max[u];
            let line = |y: f64, _: &[f64]| self.line(axis, [x, y], effort);
            integrate(&line, &splits(v, &meets), &inner, hints)
        };
        let outer = Tolerance {
            scale,
            relative,
            is_parallel: true,
        };
        integrate(&plane, &splits(u, &|_| true), &outer, &[])
    }

    /// The figures of one line.
    fn line(&self, axis: usize, [x, y]: [f64; 2], effort: &Effort) -> Sample {
        let mut sample = Sample::default();
        if !effort.goes_on() {
            return sample;
        }
        let (u, v, w) = ((axis + 1) % 3, (axis + 2) % 3, axis);
        let mut org = self.bounds.center();
        org[u] += x * self.unit;
        org[v] += y * self.unit;
        let dir = DVec3::AXES[w];
        let mut since = None;
        let visit = |end: &End| {
            let t = self.position(&end.root);
            let face = u64::from(end.operand) << 1 | u64::from(end.enters);
            let face = face ^ end.root.face_number().rotate_left(17);
            let sum = (sample.signature ^ face).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            sample.signature = sum ^ sum >> 29;
            let normal = unit(self.normal(end, t.value));
            if normal[w].is_finite() {
                sample.values[10] += normal[w].abs();
            }
            let at = t.value / self.unit;
            if end.enters {
                since = Some((at, t.error));
            } else if let Some((enter, error)) = since.take() {
                let chord = at - enter;
                let middle = 0.5 * (at + enter);
                let mut p = DVec3::ZERO;
                (p[u], p[v], p[w]) = (x, y, middle);
                sample.values[0] += chord;
                sample.errors[0] += (error + t.error) / self.unit;
                for k in 0..3 {
                    sample.values[1 + k] += chord * p[k];
                }
                for (k, [i, j]) in PAIRS.into_iter().enumerate() {
                    let own = if i == w && j == w {
                        chord * chord / 12.0
                    } else {
                        0.0
                    };
                    sample.values[4 + k] += chord * (p[i] * p[j] + own);
                }
            }
        };
        effort
            .scratch
            .with(|scratch| self.ends(org, dir, scratch, visit));
        sample
    }

    /// Joins the integrals of the three axes.
    fn joined(&self, axes: &[Sample; 3]) -> Body {
        // The best of three. Its error counts its distance from the nearer of the others
        // twice: where the estimates are too small, nothing else shows it.
        let best = |k: usize| {
            let mut order = [0, 1, 2];
            order.sort_by(|a, b| axes[*a].errors[k].total_cmp(&axes[*b].errors[k]));
            let value = axes[order[0]].values[k];
            let off = |i: usize| (axes[order[i]].values[k] - value).abs();
            (value, axes[order[0]].errors[k] + 2.0 * off(1).min(off(2)))
        };
        let (volume, volume_error) = best(0);
        let first = [1, 2, 3].map(best);
        let second: [(f64, f64); 6] = std::array::from_fn(|k| best(4 + k));
        let first_error = first.iter().map(|f| f.1).sum::<f64>();
        let centroid = DVec3::from_array(first.map(|f| f.0)) / volume;
        let spread = plus(second.map(|s| s.0), outer(centroid, -volume));
        // Nothing checks an axis' part of the area. What it misses, it misses of the volume as
        // well, and of that the others tell.
        let area_error = axes.iter().map(|axis| {
            let off = (axis.values[0] - volume).abs();
            let known = axis.errors[0] + volume_error;
            let missed = if off > known { off / volume } else { 0.0 };
            AREA_MARGIN * (axis.errors[10] + missed * axis.values[10])
        });
        let area_error = area_error.sum();
        let second_error = second.iter().map(|s| s.1).fold(0.0, f64::max);
        Body {
            volume,
            volume_error,
            area: axes.iter().map(|a| a.values[10]).sum(),
            area_error,
            centroid,
            centroid_error: (first_error + volume_error * centroid.length()) / volume,
            spread,
            spread_error: second_error
                + 2.0 * first_error * centroid.length()
                + volume_error * centroid.length_squared(),
            method: Method::Quadrature,
            area_method: Method::Quadrature,
        }
    }
}
