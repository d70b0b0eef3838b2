//! Of rays of one origin.
//!
//! Unlike in [`super::super::block`], edges come from the corners themselves:
//! relative to a far origin they would be rounded before the difference, and the
//! bounds would grow with the distance (docs/NUMERICS.md). That neighbours then do
//! not have exactly opposite edge functions does no harm: the bounds are wider.

use super::{Line, Settled, UNIT};
use crate::accel::{Block, WIDE};
use crate::geom::triangle::{cross_with_size, plane_depth_times_det, plane_det};
use crate::math::lanes::{Lanes, Mask, Register, max, min};
use crate::trace::tile::bundle::{Bundle, Group};
use crate::trace::tile::parallel::Starts;

/// A block's triangles as every ray of one origin needs them, and by how much
/// rounding may have moved what comes of it.
#[repr(C, align(64))]
pub struct Edges {
    /// Normals of the edges a, b, c (each opposite to its corner), grown by
    /// `margin` along the main axis, and of the plane; `[which][axis][slot]`,
    /// turned so that T ≥ 0.
    normal: [[[f32; WIDE]; 3]; 4],
    /// Of edge functions, twice.
    margin: [f32; WIDE],
    /// T: the depth times det; and no more than that.
    top: [f32; WIDE],
    early: [f32; WIDE],
    det_error: [f32; WIDE],
    /// A depth z is off by z · (`fixed` + z · `growing`), where det is more than
    /// four times its error.
    fixed: [f32; WIDE],
    growing: [f32; WIDE],
    /// The corners' least depth; and that and the greatest, rounded outward.
    lowest: [f32; WIDE],
    nearest: [f32; WIDE],
    farthest: [f32; WIDE],
    /// Triangles that may be in front of the origin.
    live: u32,
}

/// Lanes whose ray may meet the triangle before its limit.
pub struct Met<L: Lanes> {
    possible: L::Mask,
    /// The least edge function, and the ray.
    least: L,
    line: Line<L>,
}

impl super::Edges for Edges {
    type Met<L: Lanes> = Met<L>;

    #[inline(always)]
    fn of<L: Lanes, const S: usize>(block: Block, bundle: &Bundle<L, S>) -> Edges {
        let splat = Register::splat;
        let sign = splat(bundle.frustum.sign);
        let turned = |[x, y, z]: [Register; 3]| [x, y, z * sign];
        let [a, b, c] = block.columns(bundle.frustum.axes);
        let raw = [turned(a), turned(b), turned(c)];
        let org = [
            splat(bundle.org[0]),
            splat(bundle.org[1]),
            splat(bundle.org[2]),
        ];
        let minus = |p: [Register; 3], q: [Register; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
        let [a, b, c] = [minus(raw[0], org), minus(raw[1], org), minus(raw[2], org)];
        let (cb, ac, ba) = (
            minus(raw[2], raw[1]),
            minus(raw[0], raw[2]),
            minus(raw[1], raw[0]),
        );
        let (plane, size) = cross_with_size(ac, ba);
        let (edge_a, size_a) = cross_with_size(b, cb);
        let (edge_b, size_b) = cross_with_size(c, ac);
        let (edge_c, size_c) = cross_with_size(a, ba);

        // Magnitudes of a product with any ray's (u, v, 1).
        let [u, v] = bundle.widest;
        let (u, v) = (splat(u), splat(v));
        let product = |p: [Register; 3]| u.mul_add(p[0], v.mul_add(p[1], p[2]));
        let sum = |p: [Register; 3]| p[0].abs() + p[1].abs() + p[2].abs();
        let origin = splat(bundle.origin);
        let wide = splat(bundle.steepest);
        let largest = max(max(product(size_a), product(size_b)), product(size_c));
        let longest = max(max(sum(cb), sum(ac)), sum(ba));
        let tiny = splat(f32::MIN_POSITIVE);
        // Roundings of an edge function's terms: of a corner relative to the
        // origin, of an edge, of a product, of a difference; three of the slopes,
        // three of the sum. And those of the origin.
        let margin = largest * splat(10.5 * UNIT) + longest * (origin * wide * splat(2.25 * UNIT));
        let margin = margin + tiny;
        let det_error = product(size) * splat(10.5 * UNIT) + tiny;
        let reach = [a[0].abs(), a[1].abs(), a[2].abs()];
        let top_size = reach[0].mul_add(size[0], reach[1].mul_add(size[1], reach[2] * size[2]));
        let top_error = top_size * splat(8.5 * UNIT) + sum(size) * (origin * splat(1.25 * UNIT));
        // What products lose to underflow is multiplied once more.
        let top_error = (reach[0] + reach[1] + reach[2]).mul_add(tiny, top_error + tiny);

        let (zero, one) = (Register::zero(), splat(1.0));
        let top = plane_depth_times_det(a, plane);
        let turn = <Register as Lanes>::select(top.lt(zero), -one, one);
        let top = top.abs();
        // Which way the triangle faces is in doubt, or numbers leave the format:
        // then every decision is.
        let sane = Lanes::gt(top, top_error) & Lanes::lt(largest + top_size, splat(1e37));
        let infinite = splat(f32::INFINITY);
        let margin = <Register as Lanes>::select(sane, margin, infinite);
        let top_error = <Register as Lanes>::select(sane, top_error, infinite);
        let mut edges = Edges {
            normal: [[[0.0; WIDE]; 3]; 4],
            margin: [0.0; WIDE],
            top: [0.0; WIDE],
            early: [0.0; WIDE],
            det_error: [0.0; WIDE],
            fixed: [0.0; WIDE],
            growing: [0.0; WIDE],
            lowest: [0.0; WIDE],
            nearest: [0.0; WIDE],
            farthest: [0.0; WIDE],
            live: 0,
        };
        let normals = [edge_a, edge_b, edge_c, plane];
        for which in 0..4 {
            for axis in 0..3 {
                let mut n = normals[which][axis] * turn;
                if which < 3 && axis == 2 {
                    n += margin;
                }
                n.store(&mut edges.normal[which][axis]);
            }
        }
        (margin + margin).store(&mut edges.margin);
        top.store(&mut edges.top);
        (top - top_error).store(&mut edges.early);
        det_error.store(&mut edges.det_error);
        // |T/D − T̂/D̂| ≤ (|T − T̂| + z |D − D̂|) / |D|, and 1/|D| is at most 4/3 of
        // 1/D̂ = z/T̂. A little more than 4/3 for the roundings.
        let per_top = splat(1.35) / top;
        (per_top * top_error + splat(8.0 * UNIT)).store(&mut edges.fixed);
        (per_top * det_error).store(&mut edges.growing);
        // One rounding of the difference, one of the origin.
        let off = splat(bundle.reach * (2.25 * UNIT) + f32::MIN_POSITIVE);
        let lowest = min(min(a[2], b[2]), c[2]);
        let nearest = lowest - off;
        let farthest = max(max(a[2], b[2]), c[2]) + off;
        lowest.store(&mut edges.lowest);
        nearest.store(&mut edges.nearest);
        farthest.store(&mut edges.farthest);
        let deepest = splat(bundle.deepest());
        let front = farthest.ge(zero) & nearest.le(deepest);
        edges.live = front.bits() & block.used();
        edges
    }

    #[inline(always)]
    fn live(&self) -> u32 {
        self.live
    }

    #[inline(always)]
    fn may_meet<L: Lanes>(&self, group: &Group<L>) -> u32 {
        let [[u, du], [v, dv]] = group.rect;
        let (u, du) = (Register::splat(u), Register::splat(du));
        let (v, dv) = (Register::splat(v), Register::splat(dv));
        let greatest = |which: usize| {
            let [x, y, z] = &self.normal[which];
            let n = [Register::load(x), Register::load(y), Register::load(z)];
            let spread = n[0].abs().mul_add(du, n[1].abs().mul_add(dv, n[2]));
            n[0].mul_add(u, n[1].mul_add(v, spread))
        };
        let least = min(min(greatest(0), greatest(1)), greatest(2));
        let before = Register::load(&self.nearest).le(Register::splat(group.deepest));
        // An infinite margin may have made it no number.
        let beside = least.lt(Register::zero());
        (!beside & before).bits() & self.live
    }

    /// Depths count from the origin.
    #[inline(always)]
    fn line<L: Lanes>(&self, group: &Group<L>, _starts: &Starts<L>) -> Line<L> {
        Line {
            u: group.u,
            v: group.v,
            start: [L::zero(); 2],
            limit: group.limit,
        }
    }

    #[inline(always)]
    fn meet<L: Lanes>(&self, at: impl Fn(&[f32; WIDE]) -> L, line: &Line<L>) -> Met<L> {
        let Line { u, v, limit, .. } = *line;
        let value = |which: usize| {
            let [x, y, z] = &self.normal[which];
            at(x).mul_add(u, at(y).mul_add(v, at(z)))
        };
        let least = value(0).min(value(1)).min(value(2));
        let det = value(3);
        let late = at(&self.early).gt(limit * (det + at(&self.det_error)));
        let out = least.lt(L::zero()) | late | at(&self.nearest).gt(limit);
        Met {
            possible: !out,
            least,
            line: *line,
        }
    }

    #[inline(always)]
    fn possible<L: Lanes>(met: &Met<L>) -> L::Mask {
        met.possible
    }

    #[inline(always)]
    fn settle<L: Lanes>(&self, at: impl Fn(&[f32; WIDE]) -> L, met: &Met<L>) -> Settled<L> {
        let (near, far) = (at(&self.nearest), at(&self.farthest));
        // What kernels report of t comes from det in this order.
        let [x, y, z] = &self.normal[3];
        let det = plane_det([at(x), at(y), at(z)], [met.line.u, met.line.v]);
        let depth = at(&self.top) / det;
        let known = det.gt(at(&self.det_error) * L::from_f32(4.0));
        let error = depth * depth.mul_add(at(&self.growing), at(&self.fixed));
        let from = L::select(known, (depth - error).max(near), near);
        let sure = met.possible & known & met.least.gt(at(&self.margin));
        Settled {
            sure: sure & from.gt(L::zero()),
            behind: L::Mask::splat(false),
            depth: depth.max(at(&self.lowest)),
            from,
            to: L::select(known, (depth + error).min(far), far),
        }
    }
}
