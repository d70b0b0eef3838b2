//! Beams of one direction.
//!
//! Along the main axis k of the direction each ray is the line x = u + s_a·z, y = v + s_b·z,
//! with the slopes s that all rays share and depths z from the near side of the tree. A
//! shear by the slopes turns lines into points (u, v).
//!
//! These numbers are relative to the tree alone, so the other rays of a beam change no bit
//! of a ray's hit (tests/visibility/parallel.rs).

use super::local_frame::LocalFrame;
use super::rays::{Beam, LEAST_SLOPE, RelativeBox, SHORTEST, SOONEST, main_axis};
use crate::accel::Frustum;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::math::{Aabb32, Vec3};

/// The shear of a beam of one direction.
#[derive(Clone, Copy, Default)]
pub(super) struct Shear {
    /// d_a / |d_k| and d_b / |d_k|; at most 1.
    pub slopes: [f32; 2],
    /// Inverses of the slopes; of [`LEAST_SLOPE`] where these are smaller.
    inverse: [f32; 2],
    /// Padding of boxes along (a, b, k) (B16).
    pad: [f32; 3],
}

impl Shear {
    /// Bounds the error of a line's coordinate from the near side of the tree, along a (0)
    /// or b (1).
    #[inline(always)]
    pub fn rounded(&self, i: usize) -> f32 {
        self.pad[i] * 0.0625
    }

    /// Bounds the distance between a line and what f32 kernels make of it (B15).
    #[inline(always)]
    pub fn passing(&self) -> f64 {
        f64::from(self.pad[0]) + f64::from(self.pad[1])
    }
}

/// Starts of a group's rays of one direction.
#[derive(Clone, Copy)]
pub(super) struct LocalStarts<L: Lanes> {
    /// Rounded to the lanes' type; padding has the middle ray's.
    pub org: Vec3<L>,
    /// Depth of the start; negative in front of the tree.
    pub depth: L,
    /// Bound of the error of a depth that was converted from t (B17).
    pub slack: L,
}

/// Largest reach of a beam of one direction: beyond it, inverses of small slopes overflow.
const FARTHEST: f32 = 1e20;

impl<L: Lanes, const S: usize> Beam<L, S> {
    /// Loads rays of one direction; those that are not `alive` are replaced by the middle
    /// ray. Returns false if numbers leave the range of f32; the beam is then undefined. The
    /// result is the same at every width and for any set of finished rays of `all`.
    #[inline(always)]
    pub fn load_parallel(
        &mut self,
        org: impl Fn(usize) -> Vec3<L::Double>,
        dir: [f64; 3],
        all: &[L::Mask; S],
        alive: &[L::Mask; S],
        bounds: &Aabb32,
    ) -> bool {
        let narrow = |x: f64| L::Scalar::from_f64(x);
        let exact_dir = dir;
        let dir = [narrow(dir[0]), narrow(dir[1]), narrow(dir[2])];
        let (axes, sign) = main_axis(dir);
        let [ka, kb, k] = axes;
        let along = dir[k].to_f64().abs();
        let slope = |k: usize| (dir[k].to_f64() / along) as f32;
        let slopes = [slope(ka), slope(kb)];
        let Some(middle) = self.middle_of(alive) else {
            return false;
        };
        if !slopes.iter().all(|s| s.abs() <= 1.0) || along < SHORTEST {
            return false;
        }
        let here = org(middle / L::COUNT);
        let lane = middle % L::COUNT;
        let stand_in = [here.x.lane(lane), here.y.lane(lane), here.z.lane(lane)];
        let center = |k: usize| 0.5 * bounds.min[k] + 0.5 * bounds.max[k];
        let base = if sign < 0.0 {
            -bounds.max[k]
        } else {
            bounds.min[k]
        };
        let about = [center(ka), center(kb), base];
        if !about.iter().all(|x| x.is_finite()) {
            return false;
        }
        let depth_sign = f64::from(sign);
        let place = [
            f64::from(about[0]),
            f64::from(about[1]),
            f64::from(about[2]),
        ];
        let splat = |x: f64| L::Double::from_f64(x);
        let size = (0..3).fold(0.0_f32, |m, k| m.max(bounds.max[k] - bounds.min[k]));
        let mut lines = [[f32::INFINITY, f32::NEG_INFINITY]; 2];
        let mut spread = [0.0_f32; 3];
        // Slopes in f64: halfway down the tree lines are relative to the middle ray.
        let steady = [
            exact_dir[ka] / exact_dir[k].abs(),
            exact_dir[kb] / exact_dir[k].abs(),
        ];
        // The same rounded number that corners are relative to (B1).
        let halfway = f64::from(LocalFrame::halfway(bounds, k, sign)) - place[2];
        let mut first = f32::INFINITY;
        let inverse = slopes.map(|s| {
            1.0 / if s.abs() < LEAST_SLOPE {
                LEAST_SLOPE
            } else {
                s
            }
        });
        let relative = |org: &Vec3<L::Double>| {
            let a = org.axis(ka) - splat(place[0]);
            let b = org.axis(kb) - splat(place[1]);
            let depth = org.axis(k) * splat(depth_sign) - splat(place[2]);
            [a, b, depth]
        };
        let stand_in_place = {
            let [a, b, depth] = relative(&Vec3::splat(stand_in)).map(|x| x.lane(0));
            let down = halfway - depth;
            [a + steady[0] * down, b + steady[1] * down]
        };
        for (s, (all, alive)) in all.iter().zip(alive).enumerate() {
            let all = <L::Double as Lanes>::Mask::from_bits(all.bits());
            let alive = <L::Double as Lanes>::Mask::from_bits(alive.bits());
            let org = Vec3::select(all, org(s), Vec3::splat(stand_in));
            for (spread, x) in spread.iter_mut().zip(relative(&org)) {
                *spread = spread.max(x.abs().greatest() as f32);
            }
            let org = Vec3::select(alive, org, Vec3::splat(stand_in));
            let [a, b, depth] = relative(&org);
            let u = L::narrow(a - splat(f64::from(slopes[0])) * depth);
            let v = L::narrow(b - splat(f64::from(slopes[1])) * depth);
            let centred = &mut self.lines[s];
            let down = splat(halfway) - depth;
            let across = |x, i: usize| x + splat(steady[i]) * down - splat(stand_in_place[i]);
            centred.u = L::narrow(across(a, 0));
            centred.v = L::narrow(across(b, 1));
            let starts = &mut self.starts[s];
            starts.org = Vec3::new(L::narrow(org.x), L::narrow(org.y), L::narrow(org.z));
            starts.depth = L::narrow(depth);
            first = first.min(starts.depth.least().to_f64() as f32);
            // The depth of a t in the tree is a difference, rounded relative to the start
            // and to the tree (B17). It is kept per ray, since it decides.
            let extent = starts.depth.abs() + L::from_f32(size);
            starts.slack = extent * L::from_f32(8.0 * f32::EPSILON);
            let group = &mut self.groups[s];
            group.dir = Vec3::splat(dir);
            group.along = L::from_f64(along);
            group.set_lines(u, v, &mut lines);
            group.inv_u = u * L::from_f32(inverse[0]);
            group.inv_v = v * L::from_f32(inverse[1]);
        }
        // Largest distance along each axis, from the starts or the origin to the far side
        // of the tree.
        let mut reach = [0.0_f32; 3];
        for (i, reach) in reach.iter_mut().enumerate() {
            let side = if i == 2 { sign } else { 1.0 };
            let (low, high) = (bounds.min[axes[i]] * side, bounds.max[axes[i]] * side);
            let far = (low - about[i]).abs().max((high - about[i]).abs());
            *reach = far.max(about[i].abs()) + spread[i];
        }
        self.reach = reach[0].max(reach[1]).max(reach[2]);
        // NaN fails these comparisons.
        if !(self.reach < FARTHEST && along as f32 * SOONEST <= self.reach) {
            return false;
        }
        // Starts, slopes and lines are rounded a few times each, relative to these (B16); the
        // frustum adds its own pad.
        let sheared = [reach[0] + reach[2], reach[1] + reach[2], reach[2]];
        let pad = sheared.map(|r| r * (32.0 * f32::EPSILON) + f32::MIN_POSITIVE);
        let [u, v] = lines;
        let low = [about[0] + u[0], about[1] + v[0], base];
        let high = [about[0] + u[1], about[1] + v[1], base];
        let low = [low[0] - pad[0], low[1] - pad[1], low[2] - pad[2]];
        let high = [high[0] + pad[0], high[1] + pad[1], high[2] + pad[2]];
        let degenerate = slopes.map(|s| [s, s]);
        // Boxes that end before the first ray starts are culled.
        let floor = (first - 2.0 * pad[2]).max(0.0);
        self.frustum = Frustum::new(axes, sign, (low, high), floor, degenerate, bounds);
        self.org = about;
        self.steepest = 1.0;
        self.shear = Shear {
            slopes,
            inverse,
            // Twice, to include the pad of the frustum (B16).
            pad: sheared.map(|r| r * (64.0 * f32::EPSILON) + 2.0 * f32::MIN_POSITIVE),
        };
        self.parallel = true;
        // Slopes are at most 1, so a depth adds at most itself to a line.
        let origin = about.iter().zip(&reach).fold(0.0, |sum, (place, reach)| {
            sum + 2.0 * f64::from(place.abs()) + 2.0 * f64::from(*reach)
        });
        self.centre_parallel(stand_in_place, steady, origin, bounds);
        true
    }

    /// Returns the depths at which the line through (0, 0) crosses a padded box's planes.
    #[inline(always)]
    pub(super) fn sheared_box(&self, min: [f32; 3], max: [f32; 3]) -> RelativeBox {
        let [a, b, k] = self.frustum.axes;
        let (near, far) = if self.frustum.sign < 0.0 {
            (-max[k], -min[k])
        } else {
            (min[k], max[k])
        };
        let pad = self.shear.pad;
        let planes = |i: usize, low: f32, high: f32| {
            let inverse = self.shear.inverse[i];
            let low = (low - self.org[i] - pad[i]) * inverse;
            let high = (high - self.org[i] + pad[i]) * inverse;
            (low.min(high), low.max(high))
        };
        let (x0, x1) = planes(0, min[a], max[a]);
        let (y0, y1) = planes(1, min[b], max[b]);
        let (near, far) = (near - self.org[2] - pad[2], far - self.org[2] + pad[2]);
        RelativeBox([x0, x1, y0, y1, near.max(0.0), far])
    }

    /// Returns the rays of a group that may hit a box before their limits (B16).
    #[inline(always)]
    pub(super) fn reach_sheared(&self, s: usize, planes: &RelativeBox) -> L::Mask {
        let (group, starts) = (&self.groups[s], &self.starts[s]);
        let [x0, x1, y0, y1, near, far] = planes.0;
        let (x0, x1) = (L::from_f32(x0), L::from_f32(x1));
        let (y0, y1) = (L::from_f32(y0), L::from_f32(y1));
        let (u, v) = (group.inv_u, group.inv_v);
        let near = L::from_f32(near).max(starts.depth);
        let enter = (x0 - u).max(y0 - v).max(near);
        let exit = (x1 - u).min(y1 - v).min(L::from_f32(far));
        let slack = L::from_f32(1.0 + 8.0 * f32::EPSILON);
        enter.le(exit * slack) & enter.le(group.limit * slack)
    }
}
