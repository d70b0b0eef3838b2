//! Guarded edge functions of rays of one origin (B6 to B10).
//!
//! Unlike in [`super::super::block`], edges are differences of corners in the beam's local
//! frame: relative to a far origin corners would be rounded before the difference, and the
//! bounds would grow with the distance. Neighbours then do not have exactly opposite edge
//! functions, which is harmless because the bounds are wider.

use super::{Certified, Extents, Line, UNIT};
use crate::accel::{Block, WIDE};
use crate::geom::triangle::{cross_with_size, plane_depth_times_det, plane_det};
use crate::math::lanes::{Lanes, Mask, Register};
use crate::trace::beam::leaf::GroupState;
use crate::trace::beam::local_frame::LocalLines;
use crate::trace::beam::rays::{Beam, RayGroup};

/// A block's edge functions and planes with their error bounds.
#[repr(C, align(64))]
pub struct Edges {
    /// Normals of the edges a, b, c (each opposite to its corner) in the local frame, grown
    /// along the main axis by the error bound, of triangles seen edge-on by what B20 tells, and of
    /// the plane as all kernels have it; `[which][axis][slot]`, turned so that T ≥ 0.
    normal: [[[f32; WIDE]; 3]; 4],
    /// Twice the error bound of edge functions (B6); infinite where no hit is certain.
    margin: [f32; WIDE],
    /// T: the depth times det.
    top: [f32; WIDE],
    /// Lower and upper bound of T, for any-hit rays (B10).
    early: [f32; WIDE],
    late: [f32; WIDE],
    /// Error bound of det (B8).
    det_error: [f32; WIDE],
    /// A depth z has the error bound z · (`fixed` + z · `growing`), where det is more than
    /// four times its error (B9).
    fixed: [f32; WIDE],
    growing: [f32; WIDE],
    /// Least depth of the corners.
    lowest: [f32; WIDE],
    /// Least and greatest depth of the corners, rounded outward (B3).
    nearest: [f32; WIDE],
    farthest: [f32; WIDE],
    /// Triangles that may lie in front of the origin.
    live: u32,
}

/// Evaluated edge functions of some rays and triangles.
pub struct Candidates<L: Lanes> {
    /// Lanes whose ray may hit the triangle before its limit.
    possible: L::Mask,
    /// Least edge function, not below the exact one.
    least: L,
    /// det; any-hit rays only.
    det: L,
    line: Line<L>,
}

impl super::Edges for Edges {
    type Candidates<L: Lanes> = Candidates<L>;

    #[inline(always)]
    fn new<L: Lanes, const S: usize>(block: Block, beam: &Beam<L, S>, any: bool) -> Edges {
        let splat = Register::splat;
        let centre = &beam.centre;
        let sign = splat(beam.frustum.sign);
        let turned = |[x, y, z]: [Register; 3]| [x, y, z * sign];
        let raw = block.columns(beam.frustum.axes).map(turned);
        let minus = |p: [Register; 3], q: [Register; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
        let cb = minus(raw[2], raw[1]);
        let ac = minus(raw[0], raw[2]);
        let ba = minus(raw[1], raw[0]);

        // Corners are sheared along the middle line and relative to it; depths are relative
        // to the origin, as in all kernels.
        let point = centre.point.map(splat);
        let [slope_a, slope_b] = centre.slopes.map(|s| splat(-s));
        let org = beam.org.map(splat);
        let sheared = |[x, y, z]: [Register; 3]| [slope_a.mul_add(z, x), slope_b.mul_add(z, y), z];
        let corner = |p: [Register; 3]| {
            let [x, y, _] = sheared(minus(p, point));
            [x, y, p[2] - org[2]]
        };
        let [a, b, c] = raw.map(corner);
        let cross = |p: [Register; 3], q: [Register; 3]| {
            let term = |i: usize, j: usize| p[i].mul_add(q[j], -(p[j] * q[i]));
            [term(1, 2), term(2, 0), term(0, 1)]
        };
        let edge_a = cross(b, sheared(cb));
        let edge_b = cross(c, sheared(ac));
        let edge_c = cross(a, sheared(ba));

        let bounds = &centre.bounds;
        let Extents {
            across,
            extent,
            deep,
            lowest,
            highest,
        } = Extents::new([a, b, c], bounds);
        // B6.
        let margin = extent * across.mul_add(splat(13.9 * UNIT), splat(bounds.edge));
        let margin = deep.mul_add(
            across.mul_add(splat(bounds.tilt), splat(bounds.turn)),
            margin,
        );
        let margin = margin + splat(f32::MIN_POSITIVE);
        // T and det come from the plane as all kernels have it, since t is reported from it
        // (B8).
        let (plane, size) = cross_with_size(ac, ba);
        let seen = [raw[0][0] - org[0], raw[0][1] - org[1], a[2]];
        let top = plane_depth_times_det(seen, plane);
        let [u, v] = beam.widest.map(splat);
        let det_size = u.mul_add(size[0], v.mul_add(size[1], size[2]));
        let det_error = det_size.mul_add(splat(10.5 * UNIT), splat(f32::MIN_POSITIVE));
        let places = seen.map(|x| x.abs().mul_add(splat(8.5 * UNIT), splat(bounds.origin)));
        let top_size = places[1].mul_add(size[1], places[2] * size[2]);
        let top_size = places[0].mul_add(size[0], top_size);
        let top_error = top_size + splat(bounds.tiny);

        let (zero, one) = (Register::zero(), splat(1.0));
        let turn = <Register as Lanes>::select(top.lt(zero), -one, one);
        let top = top.abs();
        // Every decision is open if numbers leave the format (B10): a product's bound is at
        // least 10⁻¹⁸ of it. No hit is certain if the sign of T is open (B8).
        let sized = Lanes::lt(margin, splat(1e17)) & Lanes::lt(det_size + top_size, splat(1e30));
        let sane = Lanes::gt(top, top_error) & sized;
        let infinite = splat(f32::INFINITY);
        // B3.
        let (nearest, farthest) = (lowest - splat(bounds.depth), highest + splat(bounds.depth));
        let mut growth = <Register as Lanes>::select(sane, margin, infinite);
        let edge_on = sized & !sane & Lanes::gt(nearest, zero);
        if edge_on.any() {
            // B20.
            let most = (top + top_error) / nearest;
            let most = most.mul_add(splat(1.0 + 16.0 * UNIT), margin);
            growth = <Register as Lanes>::select(edge_on, most, growth);
        }
        let margin = <Register as Lanes>::select(sane, margin, infinite);
        let top_error = <Register as Lanes>::select(sane, top_error, infinite);
        let mut edges = Edges {
            normal: [[[0.0; WIDE]; 3]; 4],
            margin: [0.0; WIDE],
            top: [0.0; WIDE],
            early: [0.0; WIDE],
            late: [0.0; WIDE],
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
                    n += growth;
                }
                n.store(&mut edges.normal[which][axis]);
            }
        }
        (margin + margin).store(&mut edges.margin);
        top.store(&mut edges.top);
        (top - top_error).store(&mut edges.early);
        det_error.store(&mut edges.det_error);
        if any {
            (top + top_error).store(&mut edges.late);
        } else {
            // B9; 1.35 is 4/3 with room for the roundings here.
            let per_top = splat(1.35) / top;
            (per_top * top_error + splat(8.0 * UNIT)).store(&mut edges.fixed);
            (per_top * det_error).store(&mut edges.growing);
        }
        lowest.store(&mut edges.lowest);
        nearest.store(&mut edges.nearest);
        farthest.store(&mut edges.farthest);
        let deepest = splat(beam.deepest());
        // NaN leaves no triangle out, here and below.
        let beside = farthest.lt(zero) | nearest.gt(deepest);
        edges.live = (!beside).bits() & block.used();
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

    /// Rays start at depth 0.
    #[inline(always)]
    fn line<L: Lanes, M: Lanes>(&self, state: &GroupState<L>, pick: impl Fn(&L) -> M) -> Line<M> {
        let (group, lines) = (&*state.group, state.lines);
        Line {
            centred: [pick(&lines.u), pick(&lines.v)],
            slopes: [pick(&group.u), pick(&group.v)],
            start: [M::zero(); 2],
            least: pick(&state.nearest.least),
            limit: pick(&group.limit),
        }
    }

    #[inline(always)]
    fn meet<L: Lanes>(
        &self,
        at: impl Fn(&[f32; WIDE]) -> L,
        line: &Line<L>,
        any: bool,
    ) -> Candidates<L> {
        let [u, v] = line.centred;
        let value = |[x, y, z]: &[[f32; WIDE]; 3]| at(x).mul_add(u, at(y).mul_add(v, at(z)));
        let [a, b, c, plane] = &self.normal;
        let least = value(a).min(value(b)).min(value(c));
        let mut det = L::zero();
        let room = if any {
            // Products instead of a division; the limit has room for their roundings (B10).
            let [x, y, z] = plane;
            let [u, v] = line.slopes;
            det = at(x).mul_add(u, at(y).mul_add(v, at(z)));
            line.limit
                .mul_add(det + at(&self.det_error), -at(&self.early))
        } else {
            line.limit - at(&self.nearest)
        };
        Candidates {
            // One comparison for all conditions; NaN stays possible.
            possible: !least.min(room).lt(L::zero()),
            least,
            det,
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
        any: bool,
    ) -> Certified<L> {
        let (near, far) = (at(&self.nearest), at(&self.farthest));
        let sure = met.possible & met.least.gt(at(&self.margin));
        if any {
            let end = met.line.least;
            let before = at(&self.late).lt(end * (met.det - at(&self.det_error)));
            return Certified {
                sure: sure & (before | far.lt(end)),
                depth: near,
                from: near,
                to: near,
            };
        }
        // The order of operations by which all kernels compute det.
        let [x, y, z] = &self.normal[3];
        let det = plane_det([at(x), at(y), at(z)], met.line.slopes);
        let depth = at(&self.top) / det;
        let known = det.gt(at(&self.det_error) * L::from_f32(4.0));
        let error = depth * depth.mul_add(at(&self.growing), at(&self.fixed));
        Certified {
            sure,
            depth: depth.max(at(&self.lowest)),
            from: L::select(known, (depth - error).max(near), near),
            to: L::select(known, (depth + error).min(far), far),
        }
    }
}

#[cfg(test)]
mod tests;
