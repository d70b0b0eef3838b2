//! A block of triangles seen from the one origin of a tile's rays.
//!
//! With p, q a triangle's corners from the origin, (p + q) × (q − p) = 2 p × q
//! is the normal of the plane through the origin and the edge: its product with
//! a ray's (u, v, 1) is the edge function. The products are differences without
//! FMA, so an edge shared by two triangles has exactly opposite normals in
//! them, and no ray of the tile slips between. det is the product with
//! (c − b) × (a − c), the triangle's own normal; T, the corner a times that
//! normal, is the same for all rays: the depth is T / det.

use super::bundle::{Bundle, Group};
use crate::accel::{Block, WIDE};
use crate::math::lanes::{Lanes, Mask, Register, max, min};

/// A block's triangles as numbers that every ray of the tile needs.
#[repr(C, align(64))]
pub(super) struct Edges {
    /// Normals of the edges a, b, c (each opposite to its corner) and of the
    /// plane, turned so that T ≥ 0; `[which][axis][slot]`.
    normal: [[[f32; WIDE]; 3]; 4],
    depth_times_det: [f32; WIDE],
    /// By how much an edge function may be wrong, at most, over all rays.
    margin: [f32; WIDE],
    /// The corners' least depth.
    pub nearest: [f32; WIDE],
    /// Triangles that may be in front of the origin.
    pub live: u32,
}

/// Rounding of an edge function, in units of reach · edge · steepest² · 2^-24.
///
/// Rounding corners relative to the origin moves each by 2u·reach at most per
/// axis: as if edges were moved, 2 · 2u · 3 edge · reach in the function. The
/// cross product and its evaluation round quantities of at most
/// 2 reach · edge a dozen times. Twice the sum of both.
const MARGIN: f32 = 96.0 * 0.5 * f32::EPSILON;

/// A depth T / det that equals the limit, though each is rounded: T may be a
/// rounding more than limit · det.
const TIES: f32 = 1.0 - 4.0 * f32::EPSILON;

impl Edges {
    #[inline(always)]
    pub fn new<L: Lanes, const S: usize>(
        block: &Block,
        bundle: &Bundle<L, S>,
        exact: bool,
    ) -> Edges {
        let [ka, kb, k] = bundle.frustum.axes;
        let [x, y, z] = bundle.org;
        let org = [Register::splat(x), Register::splat(y), Register::splat(z)];
        let sign = Register::splat(bundle.frustum.sign);
        let corner = |v: usize| {
            let at = |axis: usize| Register::load(&block.corner[v][axis]);
            [at(ka) - org[0], at(kb) - org[1], at(k) * sign - org[2]]
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
        let normals = [
            cross(plus(b, c), cb),
            cross(plus(c, a), ca),
            cross(plus(a, b), ab),
            cross(cb, ca),
        ];
        let plane = normals[3];
        let zero = Register::zero();
        let one = Register::from_f32(1.0);
        let depth = a[0].mul_add(plane[0], a[1].mul_add(plane[1], a[2] * plane[2]));
        let turn = <Register as Lanes>::select(depth.lt(zero), -one, one);
        let depth = depth.abs();
        let nearest = min(min(a[2], b[2]), c[2]);
        let farthest = max(max(a[2], b[2]), c[2]);
        let mut edges = Edges {
            normal: [[[0.0; WIDE]; 3]; 4],
            depth_times_det: [0.0; WIDE],
            margin: [0.0; WIDE],
            nearest: [0.0; WIDE],
            live: 0,
        };
        for which in 0..4 {
            for axis in 0..3 {
                (normals[which][axis] * turn).store(&mut edges.normal[which][axis]);
            }
        }
        depth.store(&mut edges.depth_times_det);
        nearest.store(&mut edges.nearest);
        let deepest = Register::splat(bundle.deepest());
        if exact {
            let largest = |p: [Register; 3]| max(max(p[0].abs(), p[1].abs()), p[2].abs());
            let edge = max(max(largest(ca), largest(cb)), largest(ab));
            let scale = MARGIN * bundle.reach * bundle.steepest * bundle.steepest;
            let margin = edge * Register::splat(scale) + Register::splat(f32::MIN_POSITIVE);
            // Which way a triangle faces is in doubt: nothing culls it.
            let doubt = depth.le(margin * edge);
            let infinite = Register::splat(f32::INFINITY);
            <Register as Lanes>::select(doubt, infinite, margin).store(&mut edges.margin);
            let slack = Register::splat(32.0 * f32::EPSILON * bundle.reach);
            let front = (farthest + slack).ge(zero) & (nearest - slack).le(deepest);
            edges.live = front.bits();
        } else {
            let front = depth.gt(zero) & farthest.ge(zero) & nearest.le(deepest);
            edges.live = front.bits();
        }
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

    /// Triangles that some ray of the group may meet: the greatest value of each
    /// edge function over the group's rectangle, and the depth.
    #[inline(always)]
    pub fn may_meet<L: Lanes>(&self, group: &Group<L>, exact: bool, reach: f32) -> u32 {
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
        let (least, limit) = if exact {
            let slack = 32.0 * f32::EPSILON * reach;
            (
                least + Register::load(&self.margin),
                Register::splat(group.deepest + slack),
            )
        } else {
            (least, Register::splat(group.deepest))
        };
        let meets = least.ge(Register::zero()) & nearest.le(limit);
        meets.bits() & self.live
    }

    /// One ray, widened by the margin, against all triangles: those that it may
    /// meet.
    #[inline(always)]
    pub fn may_meet_ray(&self, u: f32, v: f32) -> u32 {
        let (u, v) = (Register::splat(u), Register::splat(v));
        let value = |which: usize| {
            let n = self.normal(which);
            n[0].mul_add(u, n[1].mul_add(v, n[2]))
        };
        let least = min(min(value(0), value(1)), value(2));
        let meets = (least + Register::load(&self.margin)).ge(Register::zero());
        meets.bits() & self.live
    }

    /// One triangle against a group's rays: those inside, and T and det. That
    /// the triangle begins before the ray's limit is asked of each ray, and not
    /// only of the group: the answer must not depend on which rays make a group.
    /// Where a ray asks for its nearest hit, this passes a little more than what
    /// lies before the limit: whoever compares depths decides, ties included.
    #[inline(always)]
    pub fn rays<L: Lanes, const ANY: bool>(
        &self,
        slot: usize,
        group: &Group<L>,
    ) -> (L::Mask, L, L) {
        let value = |which: usize| {
            let n = &self.normal[which];
            let at = |axis: usize| L::from_f32(n[axis][slot]);
            at(0).mul_add(group.u, at(1).mul_add(group.v, at(2)))
        };
        let least = min(min(value(0), value(1)), value(2));
        let depth = self.depth_times_det[slot];
        let det = value(3);
        let early = L::from_f32(if ANY { depth } else { depth * TIES });
        let before = L::from_f32(self.nearest[slot]).le(group.limit);
        let inside = least.ge(L::zero()) & early.le(group.limit * det) & before;
        (inside, L::from_f32(depth), det)
    }

    /// One ray against all triangles: those met before `limit`, and T and det.
    #[inline(always)]
    pub fn triangles<const ANY: bool>(
        &self,
        u: f32,
        v: f32,
        limit: f32,
    ) -> (u32, Register, Register) {
        let (u, v) = (Register::splat(u), Register::splat(v));
        let value = |which: usize| {
            let n = self.normal(which);
            n[0].mul_add(u, n[1].mul_add(v, n[2]))
        };
        let least = min(min(value(0), value(1)), value(2));
        let depth = Register::load(&self.depth_times_det);
        let det = value(3);
        let limit = Register::splat(limit);
        let before = Register::load(&self.nearest).le(limit);
        let early = if ANY {
            depth
        } else {
            depth * Register::splat(TIES)
        };
        let inside = least.ge(Register::zero()) & early.le(limit * det) & before;
        (inside.bits() & self.live, depth, det)
    }
}
