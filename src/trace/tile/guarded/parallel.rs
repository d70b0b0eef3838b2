//! Of rays of one direction.
//!
//! Everything is sheared by the slopes that the rays share, and counted from the
//! middle of the tile's lines. Edges come from the corners themselves, as with rays
//! of one origin.

use super::{Line, Settled, UNIT};
use crate::accel::{Block, WIDE};
use crate::math::lanes::{Lanes, Mask, Register, max, min};
use crate::trace::tile::bundle::{Bundle, Group};
use crate::trace::tile::parallel::Starts;

/// A block's triangles as every ray of one direction needs them, and by how much
/// rounding may have moved what comes of it.
#[repr(C, align(64))]
pub struct Edges {
    /// Normals of the edges a, b, c (each opposite to its corner) in the plane of
    /// lines, the last grown by `margin`; `[which][axis][slot]`, turned so that
    /// det ≥ 0.
    normal: [[[f32; WIDE]; 3]; 3],
    /// Of edge functions, twice.
    margin: [f32; WIDE],
    /// The depth over the plane of lines: along its axes, and where they start.
    plane: [[f32; WIDE]; 3],
    /// How far such a depth is off; infinite where it is not known.
    slack: [f32; WIDE],
    /// The corners' least and greatest depth, rounded outward.
    nearest: [f32; WIDE],
    farthest: [f32; WIDE],
    /// How far a corner's depth is off.
    off: f32,
    /// Triangles that may be in front of the rays.
    live: u32,
    /// The lines that `normal` counts from.
    middle: [f32; 2],
}

/// Some rays and triangles.
pub(in crate::trace::tile) struct Met<L: Lanes> {
    /// Lanes whose ray may meet the triangle before its limit.
    possible: L::Mask,
    /// The least edge function, not less than exact.
    least: L,
    line: Line<L>,
}

impl super::Edges for Edges {
    type Met<L: Lanes> = Met<L>;

    #[inline(always)]
    fn of<L: Lanes, const S: usize>(block: Block, bundle: &Bundle<L, S>) -> Edges {
        let splat = Register::splat;
        let shear = &bundle.shear;
        let sign = splat(bundle.frustum.sign);
        let turned = |[x, y, z]: [Register; 3]| [x, y, z * sign];
        let [a, b, c] = block.columns(bundle.frustum.axes);
        let raw = [turned(a), turned(b), turned(c)];
        let [slope_a, slope_b] = shear.slopes;
        let (slope_a, slope_b) = (splat(-slope_a), splat(-slope_b));
        let sheared = |[x, y, z]: [Register; 3]| [slope_a.mul_add(z, x), slope_b.mul_add(z, y), z];
        let minus = |p: [Register; 3], q: [Register; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
        let [x, y, z] = bundle.org;
        let org = [splat(x), splat(y), splat(z)];
        let middle = [splat(shear.middle[0]), splat(shear.middle[1])];
        let corner = |p: [Register; 3]| {
            let [x, y, z] = sheared(minus(p, org));
            [x - middle[0], y - middle[1], z]
        };
        let (a, b, c) = (corner(raw[0]), corner(raw[1]), corner(raw[2]));
        let (cb, ac, ba) = (
            minus(raw[2], raw[1]),
            minus(raw[0], raw[2]),
            minus(raw[1], raw[0]),
        );
        let sum = |p: [Register; 3]| p[0].abs() + p[1].abs() + p[2].abs();
        let longest = max(max(sum(cb), sum(ac)), sum(ba));
        let (cb, ac, ba) = (sheared(cb), sheared(ac), sheared(ba));
        let flat = |p: [Register; 3]| p[0].abs() + p[1].abs();
        let wide = max(max(flat(cb), flat(ac)), flat(ba));
        let edge = |p: [Register; 3], q: [Register; 3]| [-q[1], q[0], q[1] * p[0] - q[0] * p[1]];
        let normals = [edge(b, cb), edge(c, ac), edge(a, ba)];
        let det = cb[0] * ac[1] - cb[1] * ac[0];
        let inverse = splat(-1.0) / det;
        let slope_x = (cb[1] * ac[2] - cb[2] * ac[1]) * inverse;
        let slope_y = (cb[2] * ac[0] - cb[0] * ac[2]) * inverse;
        let base = a[2] - slope_x * a[0] - slope_y * a[1];

        // Sheared edges are off by 6.1u · longest, corners and lines together by
        // 13.3u · reach; and an edge function, of terms of at most wide · far, is
        // rounded eleven times with those of the middle.
        let reach = splat(bundle.reach);
        let away = |p: [Register; 3]| max(p[0].abs(), p[1].abs());
        let far = max(max(away(a), away(b)), away(c)) + splat(shear.spread);
        let place = reach * splat(14.0 * UNIT) + far * splat(16.0 * UNIT);
        let margin = wide * place + longest * (far * splat(12.5 * UNIT));
        // What products lose to underflow is multiplied once more.
        let tiny = splat(f32::MIN_POSITIVE);
        let margin = (wide + far).mul_add(tiny, margin + tiny);
        let det_error = longest * (wide * splat(19.0 * UNIT));
        let det_error = wide.mul_add(tiny, det_error + tiny);
        // The plane's slopes are off by four roundings of edges, over det, and
        // three of their own. A depth moves by that over the distance from a
        // corner, and by the slopes over what corners and lines are off.
        let steep = slope_x.abs() + slope_y.abs();
        let slope_error = longest * longest * splat(76.0 * UNIT) + tiny * splat(4.0);
        let slope_error = slope_error + steep * (det_error + det_error);
        let slope_error = slope_error * inverse.abs() + steep * splat(3.0 * UNIT);
        let slack = steep * (reach * splat(14.0 * UNIT) + far * splat(12.0 * UNIT));
        let slack = slack + slope_error * far + reach * splat(8.0 * UNIT) + tiny;

        let (zero, one) = (Register::zero(), splat(1.0));
        let turn = <Register as Lanes>::select(det.lt(zero), -one, one);
        // Which way the triangle faces is in doubt, or numbers leave the format:
        // then every decision is.
        let largest = (wide + longest) * (reach + far);
        let sane = Lanes::gt(det.abs(), det_error) & Lanes::lt(largest, splat(1e37));
        let margin = <Register as Lanes>::select(sane, margin, splat(f32::INFINITY));
        let clear = Lanes::gt(det.abs(), det_error + det_error);
        let slack = <Register as Lanes>::select(clear, slack, splat(f32::INFINITY));
        let off = bundle.reach * (1.25 * UNIT) + f32::MIN_POSITIVE;
        let mut edges = Edges {
            normal: [[[0.0; WIDE]; 3]; 3],
            margin: [0.0; WIDE],
            plane: [[0.0; WIDE]; 3],
            slack: [0.0; WIDE],
            nearest: [0.0; WIDE],
            farthest: [0.0; WIDE],
            off,
            live: 0,
            middle: shear.middle,
        };
        for (which, normal) in normals.iter().enumerate() {
            for axis in 0..3 {
                let mut n = normal[axis] * turn;
                if axis == 2 {
                    n += margin;
                }
                n.store(&mut edges.normal[which][axis]);
            }
        }
        (margin + margin).store(&mut edges.margin);
        slope_x.store(&mut edges.plane[0]);
        slope_y.store(&mut edges.plane[1]);
        base.store(&mut edges.plane[2]);
        slack.store(&mut edges.slack);
        let nearest = min(min(a[2], b[2]), c[2]) - splat(off);
        let farthest = max(max(a[2], b[2]), c[2]) + splat(off);
        nearest.store(&mut edges.nearest);
        farthest.store(&mut edges.farthest);
        let deepest = splat(bundle.deepest());
        edges.live = nearest.le(deepest).bits() & block.used();
        edges
    }

    #[inline(always)]
    fn live(&self) -> u32 {
        self.live
    }

    #[inline(always)]
    fn may_meet<L: Lanes>(&self, group: &Group<L>) -> u32 {
        let [[u, du], [v, dv]] = group.rect;
        let [middle_u, middle_v] = self.middle;
        let (u, du) = (Register::splat(u - middle_u), Register::splat(du));
        let (v, dv) = (Register::splat(v - middle_v), Register::splat(dv));
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

    /// The depth where a ray starts is rounded once; in f64 besides.
    #[inline(always)]
    fn line<L: Lanes>(&self, group: &Group<L>, starts: &Starts<L>) -> Line<L> {
        let slack = starts.depth.abs() * L::from_f32(1.25 * UNIT) + L::from_f32(self.off * UNIT);
        Line {
            u: starts.u,
            v: starts.v,
            start: [starts.depth - slack, starts.depth + slack],
            limit: group.limit,
        }
    }

    #[inline(always)]
    fn meet<L: Lanes>(&self, at: impl Fn(&[f32; WIDE]) -> L, line: &Line<L>) -> Met<L> {
        let value = |which: usize| {
            let [x, y, z] = &self.normal[which];
            at(x).mul_add(line.u, at(y).mul_add(line.v, at(z)))
        };
        let least = value(0).min(value(1)).min(value(2));
        let late = at(&self.nearest).gt(line.limit);
        let behind = at(&self.farthest).lt(line.start[0]);
        Met {
            possible: !(least.lt(L::zero()) | late | behind),
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
        let Line { u, v, start, .. } = met.line;
        let [x, y, z] = &self.plane;
        let depth = at(x).mul_add(u, at(y).mul_add(v, at(z)));
        let slack = at(&self.slack);
        let (near, far) = (at(&self.nearest), at(&self.farthest));
        let known = slack.lt(L::from_f32(f32::INFINITY)) & depth.abs().lt(L::from_f32(1e37));
        let from = L::select(known, (depth - slack).max(near), near);
        let to = L::select(known, (depth + slack).min(far), far);
        let sure = met.possible & known & met.least.gt(at(&self.margin));
        let [earliest, latest] = start;
        Settled {
            sure: sure & from.gt(latest),
            // As what a ray has just left.
            behind: to.lt(earliest),
            depth,
            from,
            to,
        }
    }
}
