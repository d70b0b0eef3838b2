//! The local frame of a beam: corners and lines relative to the beam's middle line.
//!
//! Rounding errors are then relative to the beam and to the triangle, not to the distance
//! from the eye. Only the rounding of the frame's point, and of its slopes over the tree's
//! depth, are relative to larger numbers (B1 to B5).

use super::rays::Beam;
use crate::math::Aabb32;
use crate::math::lanes::{Lanes, Scalar};

/// u, the unit roundoff of f32.
const UNIT: f32 = <f32 as Scalar>::UNIT_ROUNDOFF;

/// 16v: roundings of what is computed in f64 (B1).
const DOUBLE: f64 = 16.0 * <f64 as Scalar>::UNIT_ROUNDOFF;

/// The middle line of a beam, with the errors of what is relative to it. Coordinates are
/// along (a, b, k), k times the sign.
#[derive(Clone, Copy, Default)]
pub(super) struct LocalFrame {
    /// P: a point of the line, halfway down the tree.
    pub point: [f32; 3],
    /// s: slopes of the line along a and b over depth.
    pub slopes: [f32; 2],
    /// S: the greater of |slopes|.
    pub steep: f32,
    /// The part of a corner's error that is not relative to its distance from the line (B2).
    pub off: f32,
    /// λ: the part of a line's error that is not relative to the line (B4).
    pub line_off: f32,
    /// W: the greatest coordinate of the lines.
    pub wide: f32,
    /// H: the largest depth from `point` in the tree.
    pub half: f32,
    /// One direction: shift from a group's coordinates to local ones.
    shift: [f32; 2],
    pub bounds: Bounds,
}

/// Terms of error bounds that all triangles share (B2 to B12). Factors of sums of roundings
/// have 2 % more for the roundings of the bound itself.
#[derive(Clone, Copy, Default)]
pub(super) struct Bounds {
    /// Added to the distance of corners from the middle line (Λ): the lines' distance, and
    /// the corners' error.
    pub across: f32,
    /// Error of triangles' extents across (B7).
    pub extent: f32,
    /// Error of triangles' extents in depth (B7).
    pub deep: f32,
    /// Error of an edge function relative to the triangle's extent across (`edge`), in depth
    /// (`turn`), and to depth times Λ (`tilt`) (B6, B11).
    pub edge: f32,
    pub turn: f32,
    pub tilt: f32,
    /// Error of a corner's depth (B3, B12).
    pub depth: f32,
    /// One origin: error of the coordinates that T is computed from (B8).
    pub origin: f32,
    /// One origin: underflow of T. One direction: the part of a depth's error that does not
    /// depend on the triangle (B12).
    pub tiny: f32,
}

/// A group's lines relative to the local frame.
#[derive(Clone, Copy)]
pub(super) struct LocalLines<L: Lanes> {
    /// One origin: slopes. One direction: positions at the depth of `point`.
    pub u: L,
    pub v: L,
    /// Middle and half extent of u and of v, rounded outward.
    pub rect: [[f32; 2]; 2],
}

impl<L: Lanes> LocalLines<L> {
    pub fn none() -> Self {
        LocalLines {
            u: L::zero(),
            v: L::zero(),
            rect: [[0.0; 2]; 2],
        }
    }
}

impl LocalFrame {
    /// Returns the middle of the tree along k, rounded. Lines and corners share this number,
    /// so its rounding adds no error (B1).
    #[inline(always)]
    pub fn halfway(bounds: &Aabb32, k: usize, sign: f32) -> f32 {
        (0.5 * bounds.min[k] + 0.5 * bounds.max[k]) * sign
    }

    /// Places the frame on the line through `place` at the depth `halfway` with these slopes.
    /// `origin`: sum of the magnitudes that `place` was computed from.
    #[inline(always)]
    fn through(
        place: [f64; 2],
        halfway: f32,
        slopes: [f32; 2],
        (bounds, k): (&Aabb32, usize),
        origin: f64,
    ) -> LocalFrame {
        let point = [place[0] as f32, place[1] as f32, halfway];
        // β: distance of the beam's middle from the rounded point (B1).
        let beside = |i: usize| (place[i] - f64::from(point[i])).abs();
        let beside = beside(0) + beside(1);
        let sizes = origin + place[0].abs() + place[1].abs() + f64::from(halfway).abs();
        let steep = slopes[0].abs().max(slopes[1].abs());
        let half = (0.5 * bounds.max[k] - 0.5 * bounds.min[k]) * (1.0 + 8.0 * UNIT);
        let half = half + halfway.abs() * (2.0 * UNIT);
        // The constant part of a corner's error (B2).
        let off = steep * half * (3.2 * UNIT);
        let exact = (sizes * DOUBLE + beside * 1.01) as f32;
        LocalFrame {
            point,
            slopes,
            steep,
            off: off + exact + f32::MIN_POSITIVE,
            line_off: exact,
            half,
            ..LocalFrame::default()
        }
    }
}

impl<L: Lanes, const S: usize> Beam<L, S> {
    /// Sets the frame and the local lines of rays of one origin.
    #[inline(always)]
    pub fn centre_pinhole(&mut self, bounds: &Aabb32) {
        let [ka, kb, k] = self.frustum.axes;
        let sign = self.frustum.sign;
        let mut range = [[f32::INFINITY, f32::NEG_INFINITY]; 2];
        for group in &self.groups {
            for (range, [middle, half]) in range.iter_mut().zip(group.rect) {
                *range = [range[0].min(middle - half), range[1].max(middle + half)];
            }
        }
        let slopes = range.map(|[low, high]| 0.5 * low + 0.5 * high);
        let halfway = LocalFrame::halfway(bounds, k, sign);
        let org = self.exact_org;
        let depth = f64::from(halfway) - org[k] * f64::from(sign);
        let place = [
            org[ka] + f64::from(slopes[0]) * depth,
            org[kb] + f64::from(slopes[1]) * depth,
        ];
        let steep = f64::from(slopes[0].abs() + slopes[1].abs());
        let far = steep * (org[k].abs() + f64::from(halfway).abs());
        let origin = org[ka].abs() + org[kb].abs() + far;
        let mut centre = LocalFrame::through(place, halfway, slopes, (bounds, k), origin);
        let [a, b] = slopes.map(|s| -L::from_f32(s));
        let mut wide = 0.0_f32;
        for (group, lines) in self.groups.iter().zip(&mut self.lines) {
            // Directions in two parts: the difference of the first ones cancels, and is then
            // no larger than the second ones may be.
            let (dir, low, along) = (&group.dir, &group.low, group.along);
            let along_low = low.axis(k) * L::from_f32(sign);
            let inverse = L::from_f32(1.0) / along;
            let line = |slope: L, axis: usize| {
                let low = slope.mul_add(along_low, low.axis(axis));
                (slope.mul_add(along, dir.axis(axis)) + low) * inverse
            };
            (lines.u, lines.v) = (line(a, ka), line(b, kb));
            for (i, slope) in slopes.into_iter().enumerate() {
                let [middle, half] = group.rect[i];
                lines.rect[i] = [middle - slope, half];
                wide = wide.max((middle - slope).abs() + half);
            }
        }
        centre.wide = wide;
        // λ: the sum with the second parts and the rounded divisor, roundings of the second
        // parts, the product with a slope where there is no FMA, and the loss of directions
        // below 10⁻³⁰ (B4).
        let steepest = centre.steep + wide;
        let turned = 2.1 * wide + 8.0 * UNIT * (1.0 + steepest);
        let apart = if cfg!(target_feature = "fma") {
            0.0
        } else {
            1.1 * centre.steep
        };
        centre.line_off = (turned + apart) * UNIT + 3e-15;
        let LocalFrame { off, line_off, .. } = centre;
        let (far, tiny) = (self.reach, f32::MIN_POSITIVE);
        // ζ: roundings of the difference and of the origin (B3).
        let depth = 2.25 * UNIT * far + tiny;
        centre.bounds = Bounds {
            across: 1.02 * (wide * far + off),
            extent: 4.4 * off,
            deep: 2.0 * depth,
            edge: 1.02 * (off + wide * depth + line_off * far),
            turn: 2.1 * wide * off,
            tilt: UNIT * (6.3 * centre.steep + 25.0 * wide) + 2.1 * line_off,
            depth,
            origin: 1.25 * UNIT * self.origin,
            tiny: (3.0 * far + 1.0) * tiny,
        };
        self.centre = centre;
    }

    /// Sets the frame of rays of one direction. `middle`: offset of the middle ray from
    /// `self.org` along a and b, halfway down the tree. `origin`: sum of the magnitudes that
    /// lines were computed from. `slopes`: in f64.
    #[inline(always)]
    pub(super) fn centre_parallel(
        &mut self,
        middle: [f64; 2],
        slopes: [f64; 2],
        origin: f64,
        bounds: &Aabb32,
    ) {
        let k = self.frustum.axes[2];
        let halfway = LocalFrame::halfway(bounds, k, self.frustum.sign);
        let place = [
            f64::from(self.org[0]) + middle[0],
            f64::from(self.org[1]) + middle[1],
        ];
        let rounded = slopes.map(|s| s as f32);
        let mut centre = LocalFrame::through(place, halfway, rounded, (bounds, k), origin);
        // The slopes' rounding turns lines against corners (B11).
        centre.off += centre.steep * centre.half * (1.05 * UNIT);
        let down = f64::from(halfway) - f64::from(self.org[2]);
        centre.shift = [
            (slopes[0] * down - middle[0]) as f32,
            (slopes[1] * down - middle[1]) as f32,
        ];
        self.centre = centre;
    }

    /// Sets the local lines of rays of one direction.
    #[inline(always)]
    pub fn centre_groups(&mut self) {
        let mut wide = 0.0_f32;
        for (group, lines) in self.groups.iter().zip(&mut self.lines) {
            for (i, shift) in self.centre.shift.into_iter().enumerate() {
                let [middle, half] = group.rect[i];
                // The group's coordinates carry the rounding of all that they were
                // computed from.
                let half = half + self.shear.rounded(i);
                lines.rect[i] = [middle + shift, half];
                wide = wide.max((middle + shift).abs() + half);
            }
        }
        let (off, tiny) = (self.centre.off, f32::MIN_POSITIVE);
        // Depths are measured from the near side of the tree.
        let tree = 2.0 * self.centre.half;
        self.centre.wide = wide;
        self.centre.bounds = Bounds {
            across: 1.02 * (wide + off),
            extent: 4.4 * off,
            deep: 4.4 * UNIT * tree,
            edge: 2.1 * off,
            turn: 0.0,
            tilt: 6.3 * UNIT * self.centre.steep,
            depth: 1.25 * UNIT * self.reach + tiny,
            origin: 0.0,
            tiny: 6.4 * UNIT * tree + tiny,
        };
    }
}
