//! The middle of a tile, where f32 is at its best.
//!
//! Corners and lines are counted from a line amid the tile's own: what rounding
//! takes from them is then relative to the tile and to the triangle, not to the
//! way from the eye. Only a corner's place itself, and the slope of that line over
//! the tree's extent, cost bits that are relative to more (docs/NUMERICS.md).

use super::rays::Beam;
use crate::math::Aabb32;
use crate::math::lanes::{Lanes, Scalar};

/// u.
const UNIT: f32 = <f32 as Scalar>::UNIT_ROUNDOFF;

/// Of what is worked out in f64, sixteen roundings.
const DOUBLE: f64 = 16.0 * <f64 as Scalar>::UNIT_ROUNDOFF;

/// A line through a tile, and by how much what counts from it may be off. Along
/// (a, b, k), k times the sign.
#[derive(Clone, Copy, Default)]
pub(super) struct LocalFrame {
    /// A point of it, halfway down the tree.
    pub point: [f32; 3],
    /// What it goes along a and along b with depth.
    pub slopes: [f32; 2],
    /// The greater of |slopes|.
    pub steep: f32,
    /// Of how far a corner is off, the part that is not relative to its distance
    /// from the line.
    pub off: f32,
    /// Of how far a line is off, the part that is not relative to it.
    pub line_off: f32,
    /// The greatest of the lines' numbers.
    pub wide: f32,
    /// The largest depth from `point` in the tree.
    pub half: f32,
    /// Parallel: from a group's own numbers to those counted from here.
    shift: [f32; 2],
    pub bounds: Bounds,
}

/// What the errors of all triangles share (docs/NUMERICS.md). Everything that
/// multiplies a sum of roundings has 2 % for those of the bound itself.
#[derive(Clone, Copy, Default)]
pub(super) struct Bounds {
    /// To the distance of corners from the middle line: how far lines are from it, and
    /// how far the corners are off.
    pub across: f32,
    /// To the extents of triangles, across and in depth: how far off these are.
    pub extent: f32,
    pub deep: f32,
    /// Of an edge function, over the triangle's extent across; over that in depth; and
    /// that over the distance, too.
    pub edge: f32,
    pub turn: f32,
    pub tilt: f32,
    /// Of a corner's depth.
    pub depth: f32,
    /// Of one origin, to the coordinates that T is worked out from.
    pub origin: f32,
    /// Of T, what products lose to underflow; of one direction, of a depth all that
    /// does not depend on the triangle.
    pub tiny: f32,
}

/// A group's lines as they are counted from the middle.
#[derive(Clone, Copy)]
pub(super) struct LocalLines<L: Lanes> {
    /// Of one origin, slopes; of one direction, places at `point`'s depth.
    pub u: L,
    pub v: L,
    /// Middle and half extent of u, then of v, not rounded inward.
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
    /// Halfway down the tree along k, or nearly: lines and corners count from this
    /// number as it is rounded here.
    #[inline(always)]
    pub fn halfway(bounds: &Aabb32, k: usize, sign: f32) -> f32 {
        (0.5 * bounds.min[k] + 0.5 * bounds.max[k]) * sign
    }

    /// The line through `place` at the depth `halfway` with these slopes. `origin`:
    /// the sum of the sizes of all numbers that `place` comes from.
    #[inline(always)]
    fn through(
        place: [f64; 2],
        halfway: f32,
        slopes: [f32; 2],
        (bounds, k): (&Aabb32, usize),
        origin: f64,
    ) -> LocalFrame {
        let point = [place[0] as f32, place[1] as f32, halfway];
        // By this the tile's middle passes beside the point.
        let beside = |i: usize| (place[i] - f64::from(point[i])).abs();
        let beside = beside(0) + beside(1);
        let sizes = origin + place[0].abs() + place[1].abs() + f64::from(halfway).abs();
        let steep = slopes[0].abs().max(slopes[1].abs());
        let half = (0.5 * bounds.max[k] - 0.5 * bounds.min[k]) * (1.0 + 8.0 * UNIT);
        let half = half + halfway.abs() * (2.0 * UNIT);
        // Slope times depth is rounded with the depth, across, and as a product.
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
    /// Counts the lines of one origin from their middle. `placed`: directions have
    /// been rounded to f32 after they were turned.
    #[inline(always)]
    pub fn centre_pinhole(&mut self, placed: bool, bounds: &Aabb32) {
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
            let (dir, along) = (&group.dir, group.along);
            let inverse = L::from_f32(1.0) / along;
            lines.u = a.mul_add(along, dir.axis(ka)) * inverse;
            lines.v = b.mul_add(along, dir.axis(kb)) * inverse;
            for (i, slope) in slopes.into_iter().enumerate() {
                let [middle, half] = group.rect[i];
                lines.rect[i] = [middle - slope, half];
                wide = wide.max((middle - slope).abs() + half);
            }
        }
        centre.wide = wide;
        // Two roundings of a direction; of its product with a slope, where there
        // is no FMA; and what directions of less than 10^-30 lose.
        let steepest = centre.steep + wide;
        let turned = if placed { 2.2 * steepest } else { 0.0 };
        let apart = if cfg!(target_feature = "fma") {
            0.0
        } else {
            1.1 * centre.steep
        };
        centre.line_off = (turned + apart) * UNIT + 3e-15;
        let LocalFrame { off, line_off, .. } = centre;
        let (far, tiny) = (self.reach, f32::MIN_POSITIVE);
        // One rounding of the difference, one of the origin.
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

    /// Counts lines of one direction from the one at `middle`: how far along a and
    /// b it is from `self.org` where it passes halfway down the tree. `origin`: the
    /// sum of the sizes of all numbers that lines come from; `slopes`: in f64.
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
        // What the slopes' rounding turns the lines by.
        centre.off += centre.steep * centre.half * (1.05 * UNIT);
        let down = f64::from(halfway) - f64::from(self.org[2]);
        centre.shift = [
            (slopes[0] * down - middle[0]) as f32,
            (slopes[1] * down - middle[1]) as f32,
        ];
        self.centre = centre;
    }

    /// Where the groups' lines of one direction lie, counted from their middle.
    #[inline(always)]
    pub fn centre_groups(&mut self) {
        let mut wide = 0.0_f32;
        for (group, lines) in self.groups.iter().zip(&mut self.lines) {
            for (i, shift) in self.centre.shift.into_iter().enumerate() {
                let [middle, half] = group.rect[i];
                // The group's numbers are rounded relative to all that they come
                // from.
                let half = half + self.shear.rounded(i);
                lines.rect[i] = [middle + shift, half];
                wide = wide.max((middle + shift).abs() + half);
            }
        }
        let (off, tiny) = (self.centre.off, f32::MIN_POSITIVE);
        // Depths count from the near side of the tree.
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
