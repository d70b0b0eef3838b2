//! Mass properties of solids: volume, area, centroid and second moments.
//!
//! Each solid is measured by the most certain of four ways that applies ([`Method`]):
//! formulas of primitives under affine maps, the divergence theorem for closed meshes,
//! nested quadrature for CSG and implicit surfaces, and random lines where quadrature is
//! out of reach: solids with meshes as operands, and those whose boundaries have too many
//! pieces. Figures carry their errors; `Method` says what these are.

mod body;
mod closed;
mod extent;
mod kronrod;
pub mod moments;
mod placed;
mod quadrature;
mod sampling;
mod triangles;

#[cfg(test)]
mod tests;

pub use body::Method;
pub use extent::{Extent, extent};
pub use placed::{NoVolume, Placed};

use body::Body;
use glam::DVec3;
use lanecast_engine::trace::TraceScratch;
use lanecast_numerics::math::Affine;
use lanecast_picture::render::{Progress, mix, unit};
use moments::{Symmetric, mapped, outer, plus};
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Instant;

/// Figures in the scene's unit and its powers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Volume {
    pub volume: f64,
    pub volume_error: f64,
    /// How volume, centroid and second moments were found.
    pub method: Method,
    pub area: f64,
    pub area_error: f64,
    pub area_method: Method,
    /// World space; `None` without volume.
    pub centroid: Option<[f64; 3]>,
    /// Of the distance between `centroid` and the exact one.
    pub centroid_error: f64,
    /// Second moments about the centroid along world axes; `None` without volume, or where
    /// f64 cannot hold them.
    #[serde(skip)]
    pub spread: Option<Symmetric>,
    #[serde(skip)]
    pub spread_error: f64,
    pub lines: u64,
    /// Errors exceed the goal: the solid is too thin for the allowed number of lines, or
    /// the time was up.
    pub is_rough: bool,
}

impl Volume {
    fn is_finite(&self) -> bool {
        let figures = [
            self.volume,
            self.volume_error,
            self.area,
            self.area_error,
            self.centroid_error,
        ];
        let centroid = self.centroid.unwrap_or_default();
        figures.iter().chain(&centroid).all(|x| x.is_finite())
    }
}

/// The figures of a solid, in lengths of a unit of its size; also valid for the
/// smallest and largest solids, whose cubes f64 does not hold.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// About `center`.
    own: Body,
    /// In the scene's unit.
    center: DVec3,
    unit: f64,
    lines: u64,
    is_rough: bool,
}

impl Measured {
    /// Returns the figures under a similarity that scales by `scale`, or, with a scale of
    /// 1, a translation. Returns `None` where f64 cannot hold a figure.
    pub fn volume(&self, map: &Affine, scale: f64) -> Option<Volume> {
        let Body { volume, area, .. } = self.own;
        let unit = self.unit * scale;
        // The products are taken one factor at a time, so that no intermediate result
        // overflows if the final one does not.
        let power = |x: f64, n: u32| (0..n).fold(x, |x, _| x * unit);
        let error = |own: f64, n: u32| match own > 0.0 {
            true => power(own, n).max(f64::MIN_POSITIVE),
            false => power(own, n),
        };
        let placed = |p: DVec3| map.point((self.center + p * self.unit).to_array());
        // The roundings of the map and of the sum.
        let rounded = |p: &[f64; 3]| {
            let far = p.iter().chain(&map.translation).chain(self.center.as_ref());
            far.fold(0.0, |m: f64, x| m.max(x.abs())) * (16.0 * f64::EPSILON)
        };
        let centroid = (volume > 0.0).then(|| placed(self.own.centroid));
        let turn = map.linear().map(|c| DVec3::from_array(c) / scale);
        let spread = mapped(turn, &self.own.spread).map(|x| power(x, 5));
        let spread = (volume > 0.0 && spread.iter().all(|x| x.is_finite())).then_some(spread);
        let whole = Volume {
            volume: power(volume, 3),
            volume_error: error(self.own.volume_error, 3),
            method: self.own.method,
            area: power(area, 2),
            area_error: error(self.own.area_error, 2),
            area_method: self.own.area_method,
            centroid,
            centroid_error: match &centroid {
                Some(p) => self.own.centroid_error * unit + rounded(p),
                None => 0.0,
            },
            spread,
            // An entry of the turned matrix sums nine others.
            spread_error: error(self.own.spread_error, 5) * 3.0,
            lines: self.lines,
            is_rough: self.is_rough,
        };
        let same = |own: f64, whole: f64| own == 0.0 || whole.is_normal();
        let is_known = same(volume, whole.volume) && same(area, whole.area);
        (is_known && whole.is_finite()).then_some(whole)
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
    /// When to stop with what there is.
    pub deadline: Option<Instant>,
}

impl Default for Goal {
    fn default() -> Goal {
        Goal {
            relative: 5e-4,
            most_lines: 1 << 24,
            seed: 0,
            deadline: None,
        }
    }
}

impl Goal {
    fn is_reached(&self, body: &Body) -> bool {
        body.volume_error <= self.relative * body.volume
            && body.area_error <= self.relative * body.area
    }

    pub fn is_late(&self) -> bool {
        self.deadline.is_some_and(|end| Instant::now() >= end)
    }

    fn is_stopped(&self, progress: &Progress) -> bool {
        progress.is_cancelled() || self.is_late()
    }
}

/// Random lines against which quadrature is checked, and by how many half-widths of their
/// 95 % interval figures may be off: by chance, less than one in a million is.
const PLAUSIBLE_LINES: u64 = 1 << 14;
const PLAUSIBLE_WIDTHS: f64 = 4.0;

/// Lines that look for places where a closed mesh overlaps itself.
const CHECK_LINES: u64 = 1 << 11;

impl Placed<'_> {
    /// Measures the solid on the current rayon pool. Returns `None` if cancelled, or if
    /// time is up before there are figures.
    pub fn measure(&self, goal: &Goal, progress: &Progress) -> Option<Measured> {
        progress.start(100);
        let with = |own, center, lines, is_rough| Measured {
            own,
            center,
            unit: self.unit,
            lines,
            is_rough,
        };
        let linear = &self.world_from_object;
        if let Some(found) = closed::closed_form(self.scene, self.id, linear, self.unit) {
            let center = DVec3::from_array(linear.point(found.center.to_array()));
            return Some(with(found.body, center, 0, !goal.is_reached(&found.body)));
        }
        let center = self.bounds.center();
        if let Some(body) = self.by_divergence(goal, progress) {
            return Some(with(body, center, CHECK_LINES, !goal.is_reached(&body)));
        }
        let mut lines = 0;
        let mut best = None;
        if !self.has_meshes() {
            // Half of the time is left to sampling.
            let half = |end: Instant| {
                let now = Instant::now();
                now + end.saturating_duration_since(now) / 2
            };
            let own = Goal {
                deadline: goal.deadline.map(half),
                ..*goal
            };
            let found = self.by_quadrature(&own, goal.most_lines, progress);
            if let Some(found) = found.filter(|f| self.is_plausible(&f.body, goal, progress)) {
                if goal.is_reached(&found.body) {
                    return Some(with(found.body, center, found.lines, false));
                }
                lines += found.lines;
                best = Some(found.body);
            }
        }
        let found = match goal.is_stopped(progress) {
            true => None,
            false => self.by_sampling(goal, progress),
        };
        if progress.is_cancelled() {
            return None;
        }
        lines += found.as_ref().map_or(0, |found| found.lines);
        let of_sampling = found.map(|found| (found.body, found.is_fine));
        let (body, is_fine) = match (best, of_sampling) {
            (Some(body), Some((other, false))) if body.relative() <= other.relative() => {
                (body, false)
            }
            (Some(body), None) => (body, false),
            (_, sampled) => sampled?,
        };
        Some(with(body, center, lines, !is_fine))
    }

    /// Returns whether random lines agree with the figures of quadrature, to the accuracy of a
    /// few thousand lines: a feature that all nodes miss shows here.
    fn is_plausible(&self, body: &Body, goal: &Goal, progress: &Progress) -> bool {
        let few = Goal {
            most_lines: PLAUSIBLE_LINES,
            ..*goal
        };
        let Some(found) = self.by_sampling(&few, progress) else {
            return true;
        };
        let sampled = found.body;
        let near = |a: f64, b: f64, error: f64, width: f64| {
            (a - b).abs() <= error + PLAUSIBLE_WIDTHS * width
        };
        let (volume, area) = (sampled.volume, sampled.area);
        near(body.volume, volume, body.volume_error, sampled.volume_error)
            && near(body.area, area, body.area_error, sampled.area_error)
    }

    /// The figures of a closed mesh; `None` of other solids, and of a mesh that seems to
    /// overlap itself, where what is inside twice is outside (docs/SPEC.md, S42).
    fn by_divergence(&self, goal: &Goal, progress: &Progress) -> Option<Body> {
        let mesh = self.scene.meshes.row(self.mesh()?);
        let (center, half) = (self.bounds.center(), self.bounds.extent() * 0.5);
        let (mut turned, scratch) = ([false; 2], &mut TraceScratch::default());
        for i in 0..CHECK_LINES {
            if goal.is_stopped(progress) {
                break;
            }
            let random = |k: u64| unit(mix(mix(goal.seed) ^ (i * 6 + k))) * 2.0 - 1.0;
            let at = |k: u64| center + half * DVec3::new(random(k), random(k + 1), random(k + 2));
            let (org, to) = (at(0), at(3));
            if org != to {
                let dir = (to - org) / self.unit;
                self.ends(org, dir, scratch, |end| {
                    turned[usize::from(end.is_turned)] = true
                });
            }
        }
        if turned == [true; 2] {
            return None;
        }
        let linear = self.world_from_object.linear().map(DVec3::from_array);
        let place = |p: [f32; 3]| {
            let p = DVec3::from_array(p.map(f64::from)) + mesh.center;
            let there = linear[0] * p.x + linear[1] * p.y + linear[2] * p.z;
            (there - center) / self.unit
        };
        let corners = (0..mesh.triangles.len()).map(|i| mesh.corners(i).map(place));
        let mut body = triangles::body(corners)?;
        // Corners are rounded as they are placed.
        let far = self.bounds.max_abs() / self.unit * (8.0 * f64::EPSILON);
        body.volume_error += far * body.area;
        body.area_error += far * 8.0;
        if body.volume > 0.0 {
            body.centroid_error += far * (1.0 + body.area / body.volume);
        }
        body.spread_error += far * body.area;
        Some(body)
    }
}

impl Body {
    fn relative(&self) -> f64 {
        (self.volume_error / self.volume).max(self.area_error / self.area)
    }
}

/// Sums several solids as if none overlapped. Each comes with the number of its
/// measurement: errors of sampling with the same number are fully correlated, others are
/// independent; errors of all other methods are bounds, and add up. Returns `None` where
/// f64 cannot hold a sum.
pub fn together(all: &[(usize, Volume)]) -> Option<Volume> {
    if let [(_, one)] = all {
        return Some(*one);
    }
    let mut sum = Volume::default();
    let mut errors = BTreeMap::<usize, [f64; 2]>::new();
    let mut bounds = [0.0; 2];
    for (number, one) in all {
        sum.volume += one.volume;
        sum.area += one.area;
        sum.lines += one.lines;
        sum.is_rough |= one.is_rough;
        sum.method = sum.method.max(one.method);
        sum.area_method = sum.area_method.max(one.area_method);
        if one.method == Method::Sampling {
            let [volume, area] = errors.entry(*number).or_default();
            *volume += one.volume_error;
            *area += one.area_error;
        } else {
            bounds[0] += one.volume_error;
            bounds[1] += one.area_error;
        }
    }
    [sum.volume_error, sum.area_error] =
        [0, 1].map(|k| bounds[k] + root_of_squares(errors.values().map(|e| e[k])));
    if sum.volume > 0.0 {
        let centroid = |one: &Volume| one.centroid.map_or(DVec3::ZERO, DVec3::from_array);
        let whole = all
            .iter()
            .map(|(_, one)| centroid(one) * (one.volume / sum.volume))
            .sum::<DVec3>();
        sum.centroid = Some(whole.to_array());
        let mut spread = [0.0; 6];
        let mut is_known = true;
        for (_, one) in all {
            let arm = centroid(one) - whole;
            let share = one.volume / sum.volume;
            let off = one.volume_error / sum.volume;
            sum.centroid_error += one.centroid_error * share + off * arm.length();
            is_known &= one.spread.is_some() || one.volume == 0.0;
            let own = one.spread.unwrap_or_default();
            spread = plus(spread, plus(own, outer(arm, one.volume)));
            sum.spread_error += one.spread_error
                + one.volume_error * arm.length_squared()
                + 2.0 * one.volume * one.centroid_error * arm.length();
        }
        is_known &= spread.iter().all(|x| x.is_finite());
        sum.spread = is_known.then_some(spread);
    }
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
