//! Guarded edge functions of rays of one direction (B11 to B13).
//!
//! Everything is sheared by the slopes that the rays share and relative to the beam's middle
//! line.

use super::{Certified, Extents, Line, UNIT};
use crate::accel::{Block, WIDE};
use crate::math::lanes::{Lanes, Mask, Register};
use crate::trace::beam::leaf::GroupState;
use crate::trace::beam::local_frame::LocalLines;
use crate::trace::beam::rays::{Beam, RayGroup};

/// A block's edge functions and planes with their error bounds.
#[repr(C, align(64))]
pub struct Edges {
    /// Coefficients of the edge functions a, b, c (each opposite to its corner) over (u, v, 1),
    /// the last grown by the error bound, of triangles seen edge-on by what B20 tells;
    /// `[which][axis][slot]`, turned so that det ≥ 0.
    normal: [[[f32; WIDE]; 3]; 3],
    /// Twice the error bound of edge functions (B11); infinite where no hit is certain.
    margin: [f32; WIDE],
    /// Coefficients of the depth over (u, v, 1).
    plane: [[f32; WIDE]; 3],
    /// Error bound of that depth (B12); infinite where there is none.
    slack: [f32; WIDE],
    /// Least and greatest depth of the corners, rounded outward.
    nearest: [f32; WIDE],
    farthest: [f32; WIDE],
    /// Error bound of a corner's depth (B12).
    off: f32,
    /// Triangles that may lie in front of the rays.
    live: u32,
}

/// Evaluated edge functions of some rays and triangles.
pub(in crate::trace::beam) struct Candidates<L: Lanes> {
    /// Lanes whose ray may hit the triangle before its limit.
    possible: L::Mask,
    /// Least edge function, not below the exact one.
    least: L,
    /// Depth in the triangle's plane.
    depth: L,
    line: Line<L>,
}

impl super::Edges for Edges {
    type Candidates<L: Lanes> = Candidates<L>;

    #[inline(always)]
    fn new<L: Lanes, const S: usize>(block: Block, beam: &Beam<L, S>, _any: bool) -> Edges {
        let splat = Register::splat;
        let centre = &beam.centre;
        let sign = splat(beam.frustum.sign);
        let turned = |[x, y, z]: [Register; 3]| [x, y, z * sign];
        let raw = block.columns(beam.frustum.axes).map(turned);
        let minus = |p: [Register; 3], q: [Register; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
        // Corners are sheared along the lines and relative to the middle one; depths are
        // relative to the near side of the tree.
        let point = centre.point.map(splat);
        let [slope_a, slope_b] = centre.slopes.map(|s| splat(-s));
        let base = splat(beam.org[2]);
        let sheared = |[x, y, z]: [Register; 3]| [slope_a.mul_add(z, x), slope_b.mul_add(z, y), z];
        let corner = |p: [Register; 3]| {
            let [x, y, _] = sheared(minus(p, point));
            [x, y, p[2] - base]
        };
        let [a, b, c] = raw.map(corner);
        let cb = sheared(minus(raw[2], raw[1]));
        let ac = sheared(minus(raw[0], raw[2]));
        let ba = sheared(minus(raw[1], raw[0]));
        let edge =
            |p: [Register; 3], q: [Register; 3]| [-q[1], q[0], q[1].mul_add(p[0], -(q[0] * p[1]))];
        let normals = [edge(b, cb), edge(c, ac), edge(a, ba)];
        let det = cb[0] * ac[1] - cb[1] * ac[0];
        let inverse = splat(-1.0) / det;
        let slope_x = (cb[1] * ac[2] - cb[2] * ac[1]) * inverse;
        let slope_y = (cb[2] * ac[0] - cb[0] * ac[2]) * inverse;
        let base = a[2] - slope_x * a[0] - slope_y * a[1];

        let bounds = &centre.bounds;
        let Extents {
            across,
            extent,
            deep,
            lowest,
            highest,
        } = Extents::new([a, b, c], bounds);
        // B11.
        let lines_off = across.mul_add(splat(10.6 * UNIT), splat(bounds.edge));
        let tilted = deep * splat(bounds.tilt);
        // Covers the underflow of products that are multiplied once more.
        let tiny = splat(f32::MIN_POSITIVE);
        let margin = extent.mul_add(lines_off, tilted.mul_add(across, tiny));
        let det_error = extent * extent.mul_add(splat(6.4 * UNIT), tilted) + tiny;
        // B12: the plane's slopes have the errors of products of sides over det, and three
        // roundings. A depth's error is theirs times the distance from a corner, and the
        // slopes times the errors of corners and lines.
        let over = slope_x.abs() + slope_y.abs();
        let sides = deep * extent.mul_add(splat(10.4 * UNIT), tilted + tilted);
        let slope_error = over.mul_add(det_error, sides + tiny);
        let slope_error = slope_error * (inverse.abs() * splat(2.1)) + over * splat(3.1 * UNIT);
        let slack = across.mul_add(splat(14.0 * UNIT), splat(bounds.edge));
        let slack = over.mul_add(slack, slope_error.mul_add(across, splat(bounds.tiny)));

        let (zero, one) = (Register::zero(), splat(1.0));
        let turn = <Register as Lanes>::select(det.lt(zero), -one, one);
        // Every decision is open if numbers leave the format. No hit is certain if the sign of
        // det is open.
        let largest = (extent + deep) * (across + splat(beam.reach));
        let sized = Lanes::lt(largest, splat(1e37));
        let sane = Lanes::gt(det.abs(), det_error) & sized;
        // B20.
        let edge_on = (det.abs() + det_error).mul_add(splat(1.0 + 16.0 * UNIT), margin);
        let infinite = splat(f32::INFINITY);
        let growth = <Register as Lanes>::select(sized, edge_on, infinite);
        let growth = <Register as Lanes>::select(sane, margin, growth);
        let margin = <Register as Lanes>::select(sane, margin, infinite);
        let clear = Lanes::gt(det.abs(), det_error + det_error) & sane;
        let slack = <Register as Lanes>::select(clear, slack, infinite);
        let off = bounds.depth;
        let mut edges = Edges {
            normal: [[[0.0; WIDE]; 3]; 3],
            margin: [0.0; WIDE],
            plane: [[0.0; WIDE]; 3],
            slack: [0.0; WIDE],
            nearest: [0.0; WIDE],
            farthest: [0.0; WIDE],
            off,
            live: 0,
        };
        for (which, normal) in normals.iter().enumerate() {
            for axis in 0..3 {
                let mut n = normal[axis] * turn;
                if axis == 2 {
                    n += growth;
                }
                n.store(&mut edges.normal[which][axis]);
            }
        }
        (margin + margin).store(&mut edges.margin);
        slope_x.store(&mut edges.plane[0]);
        slope_y.store(&mut edges.plane[1]);
        base.store(&mut edges.plane[2]);
        slack.store(&mut edges.slack);
        let (nearest, farthest) = (lowest - splat(off), highest + splat(off));
        nearest.store(&mut edges.nearest);
        farthest.store(&mut edges.farthest);
        let deepest = splat(beam.deepest());
        // NaN leaves no triangle out, here and below.
        edges.live = (!nearest.gt(deepest)).bits() & block.used();
        edges
    }

    #[inline(always)]
    fn live(&self) -> u32 {
        self.live
    }

    #[inline(always)]
    fn may_meet<L: Lanes>(&self, group: &RayGroup<L>, lines: &LocalLines<L>) -> u32 {
        super::may_meet(&self.normal, &self.nearest, group, lines) & self.live
    }

    /// The depth of a ray's start is rounded once, and in f64 before that (B13).
    #[inline(always)]
    fn line<L: Lanes, M: Lanes>(&self, state: &GroupState<L>, pick: impl Fn(&L) -> M) -> Line<M> {
        let (group, lines, starts) = (&*state.group, state.lines, state.starts);
        let depth = pick(&starts.depth);
        let slack = depth.abs() * M::from_f32(1.25 * UNIT) + M::from_f32(self.off * UNIT);
        Line {
            centred: [pick(&lines.u), pick(&lines.v)],
            slopes: [M::zero(); 2],
            start: [depth - slack, depth + slack],
            least: pick(&state.nearest.least),
            limit: pick(&group.limit),
        }
    }

    #[inline(always)]
    fn meet<L: Lanes>(
        &self,
        at: impl Fn(&[f32; WIDE]) -> L,
        line: &Line<L>,
        _any: bool,
    ) -> Candidates<L> {
        let [u, v] = line.centred;
        let value = |[x, y, z]: &[[f32; WIDE]; 3]| at(x).mul_add(u, at(y).mul_add(v, at(z)));
        let [a, b, c] = &self.normal;
        let least = value(a).min(value(b)).min(value(c));
        // The triangle that a ray has just left lies behind its start.
        let depth = value(&self.plane);
        let latest = (depth + at(&self.slack)).min(at(&self.farthest));
        let room = (line.limit - at(&self.nearest)).min(latest - line.start[0]);
        Candidates {
            // One comparison for all conditions; NaN stays possible.
            possible: !least.min(room).lt(L::zero()),
            least,
            depth,
            line: *line,
        }
    }

    #[inline(always)]
    fn possible<L: Lanes>(met: &Candidates<L>) -> L::Mask {
        met.possible
    }

    #[inline(always)]
    fn certify<L: Lanes>(
        &self,
        at: impl Fn(&[f32; WIDE]) -> L,
        met: &Candidates<L>,
        _any: bool,
    ) -> Certified<L> {
        let (depth, slack) = (met.depth, at(&self.slack));
        let (near, far) = (at(&self.nearest), at(&self.farthest));
        let known = slack.lt(L::from_f32(f32::INFINITY)) & depth.abs().lt(L::from_f32(1e37));
        let from = L::select(known, (depth - slack).max(near), near);
        let to = L::select(known, (depth + slack).min(far), far);
        let sure = met.possible & known & met.least.gt(at(&self.margin));
        Certified {
            sure: sure & from.gt(met.line.start[1]),
            depth,
            from,
            to,
        }
    }
}

#[cfg(test)]
mod tests;
