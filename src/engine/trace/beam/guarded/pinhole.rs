//! Of rays of one origin.
//!
//! Unlike in [`super::super::block`], edges come from the corners themselves, counted
//! from the tile's middle: relative to a far origin they would be rounded before the
//! difference, and the bounds would grow with the distance (docs/NUMERICS.md). That
//! neighbours then do not have exactly opposite edge functions does no harm: the bounds
//! are wider.

use super::{Certified, Extents, Line, UNIT};
use crate::accel::{Block, WIDE};
use crate::geom::triangle::{cross_with_size, plane_depth_times_det, plane_det};
use crate::math::lanes::{Lanes, Mask, Register, min};
use crate::trace::beam::leaf::GroupState;
use crate::trace::beam::local_frame::LocalLines;
use crate::trace::beam::rays::{Beam, RayGroup};

/// A block's triangles as every ray of one origin needs them, and by how much
/// rounding may have moved what comes of it.
#[repr(C, align(64))]
pub struct Edges {
    /// Normals of the edges a, b, c (each opposite to its corner), as they are
    /// counted from the tile's middle and grown by `margin` along the main axis, and
    /// of the plane as all kernels have it; `[which][axis][slot]`, turned so that
    /// T ≥ 0.
    normal: [[[f32; WIDE]; 3]; 4],
    /// Of edge functions, twice.
    margin: [f32; WIDE],
    /// T: the depth times det. For rays that ask for any hit, no more and no less.
    top: [f32; WIDE],
    early: [f32; WIDE],
    late: [f32; WIDE],
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
pub struct Candidates<L: Lanes> {
    possible: L::Mask,
    /// The least edge function, and the ray.
    least: L,
    /// For rays that ask for any hit.
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

        // Sheared along the tile's middle, and counted from it; depths are those from
        // the origin, as all kernels have them.
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
        let margin = extent * across.mul_add(splat(13.9 * UNIT), splat(bounds.edge));
        let margin = deep.mul_add(
            across.mul_add(splat(bounds.tilt), splat(bounds.turn)),
            margin,
        );
        let margin = margin + splat(f32::MIN_POSITIVE);
        // The plane as all kernels have it: its numbers are what t is reported by.
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
        // Which way the triangle faces is in doubt, or numbers leave the format (of a
        // product the bound is at least 10^-18 of it): then every decision is.
        let sized = Lanes::lt(margin, splat(1e17)) & Lanes::lt(det_size + top_size, splat(1e30));
        let sane = Lanes::gt(top, top_error) & sized;
        let infinite = splat(f32::INFINITY);
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
                    n += margin;
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
            // |T/D − T̂/D̂| ≤ (|T − T̂| + z |D − D̂|) / |D|, and 1/|D| is at most 4/3
            // of 1/D̂ = z/T̂. A little more than 4/3 for the roundings.
            let per_top = splat(1.35) / top;
            (per_top * top_error + splat(8.0 * UNIT)).store(&mut edges.fixed);
            (per_top * det_error).store(&mut edges.growing);
        }
        // One rounding of the difference, one of the origin.
        let (nearest, farthest) = (lowest - splat(bounds.depth), highest + splat(bounds.depth));
        lowest.store(&mut edges.lowest);
        nearest.store(&mut edges.nearest);
        farthest.store(&mut edges.farthest);
        let deepest = splat(beam.deepest());
        // What is no number is not left out, here and below.
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
        let [[u, du], [v, dv]] = lines.rect;
        let (u, du) = (Register::splat(u), Register::splat(du));
        let (v, dv) = (Register::splat(v), Register::splat(dv));
        let greatest = |which: usize| {
            let [x, y, z] = &self.normal[which];
            let n = [Register::load(x), Register::load(y), Register::load(z)];
            let spread = n[0].abs().mul_add(du, n[1].abs().mul_add(dv, n[2]));
            n[0].mul_add(u, n[1].mul_add(v, spread))
        };
        let least = min(min(greatest(0), greatest(1)), greatest(2));
        let late = Register::load(&self.nearest).gt(Register::splat(group.deepest));
        (!(least.lt(Register::zero()) | late)).bits() & self.live
    }

    /// Depths count from the origin.
    #[inline(always)]
    fn line<L: Lanes, M: Lanes>(&self, before: &GroupState<L>, pick: impl Fn(&L) -> M) -> Line<M> {
        let (group, lines) = (&*before.group, before.lines);
        Line {
            centred: [pick(&lines.u), pick(&lines.v)],
            slopes: [pick(&group.u), pick(&group.v)],
            start: [M::zero(); 2],
            least: pick(&before.nearest.least),
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
            // Divisions are dearer than this. Limits have more room than these
            // products and sums are rounded by.
            let [x, y, z] = plane;
            let [u, v] = line.slopes;
            det = at(x).mul_add(u, at(y).mul_add(v, at(z)));
            line.limit
                .mul_add(det + at(&self.det_error), -at(&self.early))
        } else {
            line.limit - at(&self.nearest)
        };
        Candidates {
            // One comparison for all. What is no number is left to the others, or in
            // doubt.
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
        // What kernels report of t comes from det in this order.
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
