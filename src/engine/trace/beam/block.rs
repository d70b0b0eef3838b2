//! Edge functions of a block of triangles that all rays of a beam share, without bounds.
//!
//! One origin: with p, q a triangle's corners relative to the origin, (p + q) × (q − p) =
//! 2 p × q is the normal of the plane through the origin and the edge. Its product with a
//! ray's (u, v, 1) is the edge function. Cross products are differences without FMA, so two
//! triangles have exactly opposite normals at a shared edge, and no ray of the beam passes
//! between them. det is the product with (a − c) × (b − a), the triangle's normal. T, the
//! corner a times that normal, is the same for all rays; the depth is T / det.
//!
//! One direction: with corners sheared, a ray is a point (u, v). Edge functions are the same
//! products of (p, 1) and (q, 1). det is the same for all rays, and the depth is linear in
//! (u, v). It is clamped to the depths of the corners, since it is inaccurate for triangles
//! that are nearly edge-on.

use super::parallel::LocalStarts;
use super::rays::{Beam, Projection, RayGroup};
use crate::accel::{Block, WIDE};
use crate::geom::triangle::{plane_depth_times_det, plane_det, plane_normal};
use crate::math::lanes::{Lanes, Mask, Register, max, min};

/// A block's edge functions and planes.
#[repr(C, align(64))]
pub(super) struct Edges {
    /// Normals of the edges a, b, c (each opposite to its corner) and of the
    /// plane, turned so that T ≥ 0; `[which][axis][slot]`. Along one direction,
    /// turned so that det ≥ 0, and in place of the plane's the depth.
    normal: [[[f32; WIDE]; 3]; 4],
    /// T. One origin only.
    depth_times_det: [f32; WIDE],
    /// T times [`TIES`], compared with limit · det.
    early: [f32; WIDE],
    /// Least depth of the corners.
    pub nearest: [f32; WIDE],
    /// Greatest depth of the corners.
    pub farthest: [f32; WIDE],
    /// Box of the corners along a and b, grown by [`CLEAR`]: `[axis][low/high]`. Closest hits
    /// of one origin only.
    around: [[[f32; WIDE]; 2]; 2],
    /// Triangles that may lie in front of the rays.
    pub live: u32,
}

/// Factor of T in comparisons with limit · det (B19): ties of rounded depths pass. Any-hit
/// rays do not need it.
const TIES: f32 = 1.0 - 4.0 * f32::EPSILON;

/// Relative distance from a triangle's box within which a hit need not be clamped to it
/// (B18): see [`super::commit`].
const CLEAR: f32 = 8.0 * 0.5 * f32::EPSILON;

impl Edges {
    #[inline(always)]
    pub fn new<P: Projection, L: Lanes, const S: usize>(
        block: Block,
        beam: &Beam<L, S>,
        any: bool,
    ) -> Edges {
        let [x, y, z] = beam.org;
        let org = [Register::splat(x), Register::splat(y), Register::splat(z)];
        let sign = Register::splat(beam.frustum.sign);
        let [slope_a, slope_b] = beam.shear.slopes;
        let (slope_a, slope_b) = (Register::splat(-slope_a), Register::splat(-slope_b));
        let [a, b, c] = block.columns(beam.frustum.axes);
        let turned = |[x, y, z]: [Register; 3]| [x, y, z * sign];
        let raw = [turned(a), turned(b), turned(c)];
        let corner = |v: usize| {
            let [x, y, z] = raw[v];
            let (x, y, z) = (x - org[0], y - org[1], z - org[2]);
            if P::PARALLEL {
                [slope_a.mul_add(z, x), slope_b.mul_add(z, y), z]
            } else {
                [x, y, z]
            }
        };
        let (a, b, c) = (corner(0), corner(1), corner(2));
        let minus = |p: [Register; 3], q: [Register; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
        let plus = |p: [Register; 3], q: [Register; 3]| [p[0] + q[0], p[1] + q[1], p[2] + q[2]];
        let cross = |p: [Register; 3], q: [Register; 3]| {
            [
                p[1] * q[2] - p[2] * q[1],
                p[2] * q[0] - p[0] * q[2],
                p[0] * q[1] - p[1] * q[0],
            ]
        };
        let (ca, cb, ab) = (minus(a, c), minus(c, b), minus(b, a));
        // Twice the cross product of (p, 1) and (q, 1).
        let flat = |p: [Register; 3], q: [Register; 3]| {
            [-(q[1] + q[1]), q[0] + q[0], p[0] * q[1] - p[1] * q[0]]
        };
        let edge = |p: [Register; 3], q: [Register; 3]| {
            if P::PARALLEL { flat(p, q) } else { cross(p, q) }
        };
        let plane = if P::PARALLEL {
            cross(cb, ca)
        } else {
            plane_normal(minus(raw[0], raw[2]), minus(raw[1], raw[0]))
        };
        let zero = Register::zero();
        let one = Register::from_f32(1.0);
        let depth = plane_depth_times_det(a, plane);
        let scale = if P::PARALLEL { plane[2] } else { depth };
        let turn = <Register as Lanes>::select(scale.lt(zero), -one, one);
        let last = if P::PARALLEL {
            let inverse = turn / plane[2];
            [-plane[0] * inverse, -plane[1] * inverse, depth * inverse]
        } else {
            plane
        };
        let normals = [
            edge(plus(b, c), cb),
            edge(plus(c, a), ca),
            edge(plus(a, b), ab),
            last,
        ];
        let scale = scale.abs();
        let nearest = min(min(a[2], b[2]), c[2]);
        let farthest = max(max(a[2], b[2]), c[2]);
        let mut edges = Edges {
            normal: [[[0.0; WIDE]; 3]; 4],
            depth_times_det: [0.0; WIDE],
            early: [0.0; WIDE],
            nearest: [0.0; WIDE],
            farthest: [0.0; WIDE],
            around: [[[0.0; WIDE]; 2]; 2],
            live: 0,
        };
        for which in 0..4 {
            for axis in 0..3 {
                (normals[which][axis] * turn).store(&mut edges.normal[which][axis]);
            }
        }
        if !P::PARALLEL {
            scale.store(&mut edges.depth_times_det);
            let ties = if any { 1.0 } else { TIES };
            (scale * Register::splat(ties)).store(&mut edges.early);
        }
        farthest.store(&mut edges.farthest);
        nearest.store(&mut edges.nearest);
        let deepest = Register::splat(beam.deepest());
        if !P::PARALLEL && !any {
            for axis in 0..2 {
                let low = min(min(a[axis], b[axis]), c[axis]);
                let high = max(max(a[axis], b[axis]), c[axis]);
                let slack = max(low.abs(), high.abs()) * Register::splat(CLEAR);
                (low - slack).store(&mut edges.around[axis][0]);
                (high + slack).store(&mut edges.around[axis][1]);
            }
        }
        let mut front = scale.gt(zero) & farthest.ge(zero) & nearest.le(deepest);
        if P::PARALLEL {
            let sum = last[0].abs() + last[1].abs() + last[2].abs();
            front = front & sum.lt(Register::splat(f32::INFINITY));
        }
        edges.live = front.bits();
        edges
    }

    #[inline(always)]
    fn normal(&self, which: usize) -> [Register; 3] {
        let n = &self.normal[which];
        [
            Register::load(&n[0]),
            Register::load(&n[1]),
            Register::load(&n[2]),
        ]
    }

    /// Returns the triangles that some ray of the group may hit, by the greatest value of
    /// each edge function over the group's rectangle and by depth.
    #[inline(always)]
    pub fn may_meet<L: Lanes>(&self, group: &RayGroup<L>) -> u32 {
        let [[u, du], [v, dv]] = group.rect;
        let (u, du) = (Register::splat(u), Register::splat(du));
        let (v, dv) = (Register::splat(v), Register::splat(dv));
        let greatest = |which: usize| {
            let n = self.normal(which);
            let spread = n[0].abs().mul_add(du, n[1].abs().mul_add(dv, n[2]));
            n[0].mul_add(u, n[1].mul_add(v, spread))
        };
        let least = min(min(greatest(0), greatest(1)), greatest(2));
        let nearest = Register::load(&self.nearest);
        // NaN, where products leave f32, rules nothing out.
        let beside = least.lt(Register::zero()) | nearest.gt(Register::splat(group.deepest));
        (!beside).bits() & self.live
    }

    /// Computes the depths of hits of one triangle, and the rays that hit it clearly within
    /// its box.
    #[inline(always)]
    pub fn depths<L: Lanes>(
        &self,
        slot: usize,
        depth: L,
        det: L,
        group: &RayGroup<L>,
    ) -> (L, L::Mask) {
        let at = |column: &[f32; WIDE]| L::from_f32(column[slot]);
        let z = (depth / det).max(at(&self.nearest));
        let (x, y) = (group.u * z, group.v * z);
        let [[a0, a1], [b0, b1]] = &self.around;
        let shallow = z.le(at(&self.farthest));
        let clear = x.ge(at(a0)) & x.le(at(a1)) & y.ge(at(b0)) & y.le(at(b1)) & shallow;
        (z, clear)
    }

    /// [`Edges::depths`] of one ray and all triangles.
    #[inline(always)]
    pub fn depths_of_ray(
        &self,
        depth: Register,
        det: Register,
        (u, v): (f32, f32),
    ) -> (Register, u32) {
        let z = max(depth / det, Register::load(&self.nearest));
        let (x, y) = (Register::splat(u) * z, Register::splat(v) * z);
        let [[a0, a1], [b0, b1]] = &self.around;
        let (a0, a1) = (Register::load(a0), Register::load(a1));
        let (b0, b1) = (Register::load(b0), Register::load(b1));
        let shallow = z.le(Register::load(&self.farthest));
        let clear = x.ge(a0) & x.le(a1) & y.ge(b0) & y.le(b1) & shallow;
        (z, clear.bits())
    }

    /// Tests one triangle against a group's rays. Returns the rays that hit it, with T and
    /// det, or along one direction with the depth and zero.
    ///
    /// Each ray is compared with its own limit, not only with the group's, so that the answer
    /// does not depend on which rays form a group. For closest hits a little more than what
    /// lies before the limit passes (B19); comparing depths then decides, ties included.
    #[inline(always)]
    pub fn rays<P: Projection, L: Lanes>(
        &self,
        slot: usize,
        group: &RayGroup<L>,
        starts: &LocalStarts<L>,
    ) -> (L::Mask, L, L) {
        let value = |which: usize| {
            let n = &self.normal[which];
            let at = |axis: usize| L::from_f32(n[axis][slot]);
            at(0).mul_add(group.u, at(1).mul_add(group.v, at(2)))
        };
        let least = min(min(value(0), value(1)), value(2));
        let nearest = L::from_f32(self.nearest[slot]);
        if P::PARALLEL {
            let z = max(min(value(3), L::from_f32(self.farthest[slot])), nearest);
            let inside = least.ge(L::zero()) & z.gt(starts.depth) & z.le(group.limit);
            return (inside, z, L::zero());
        }
        let depth = L::from_f32(self.depth_times_det[slot]);
        let at = |axis: usize| L::from_f32(self.normal[3][axis][slot]);
        let det = plane_det([at(0), at(1), at(2)], [group.u, group.v]);
        let early = L::from_f32(self.early[slot]);
        let before = nearest.le(group.limit);
        let inside = least.ge(L::zero()) & early.le(group.limit * det) & before;
        (inside, depth, det)
    }

    /// Tests one ray against all triangles. Returns those hit before `limit`, and the numbers
    /// that [`Edges::rays`] returns. `start` is a depth.
    #[inline(always)]
    pub fn triangles<P: Projection>(
        &self,
        (u, v): (f32, f32),
        start: f32,
        limit: f32,
    ) -> (u32, Register, Register) {
        let (u, v) = (Register::splat(u), Register::splat(v));
        let value = |which: usize| {
            let n = self.normal(which);
            n[0].mul_add(u, n[1].mul_add(v, n[2]))
        };
        let least = min(min(value(0), value(1)), value(2));
        let limit = Register::splat(limit);
        let nearest = Register::load(&self.nearest);
        if P::PARALLEL {
            let z = max(min(value(3), Register::load(&self.farthest)), nearest);
            let behind = z.gt(Register::splat(start));
            let inside = least.ge(Register::zero()) & behind & z.le(limit);
            return (inside.bits() & self.live, z, Register::zero());
        }
        let depth = Register::load(&self.depth_times_det);
        let det = plane_det(self.normal(3), [u, v]);
        let before = nearest.le(limit);
        let early = Register::load(&self.early);
        let inside = least.ge(Register::zero()) & early.le(limit * det) & before;
        (inside.bits() & self.live, depth, det)
    }
}
