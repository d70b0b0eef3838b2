//! The slab test: where rays are inside a box (Kay and Kajiya 1986).
//!
//! Conservative with a pad. A primitive test in floating point accepts rays
//! that pass its primitive by a few roundings of the coordinates involved, and
//! rounding the ray itself moves it as much. So each box is grown by
//! δ = 32·u·(the largest distance from the origin, or from the ray's, that this
//! tree has on the axis) + [`SKEW`]·(that of any axis), folded into the ray's
//! constants, at no cost per box.
//!
//! Where the arithmetic leaves its numbers' range, a ray's slab of that axis is
//! open and culls nothing: a direction so short that nothing is as small beside
//! it, planes at t's too large, or ones so close in t that the least denormal number counts
//! beside the pad. Below the least normal number δ is that.
//!
//! Monotone: t0 = fl(lo·inv + c₀) grows with lo however it is rounded, fused or
//! not; min and max are exact. So a box inside another has its interval inside
//! the other's.

use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::math::{Aabb32, Vec3};

/// What a pad has of the largest distance on any axis, whatever the precision: for
/// what rounding a placed object's ray in f64 looks like from the world, where an axis
/// may get its share of another's (docs/NUMERICS.md, "Boxes of structures"), and for
/// components that are taken as not quite zero.
pub const SKEW: f64 = 1e-11;

/// The constants of one packet of rays for the boxes of one tree.
#[derive(Clone, Copy, Debug)]
pub struct Slabs<L: Lanes> {
    inv: Vec3<L>,
    /// −(org + δ)·inv: for a box's lower planes.
    low: Vec3<L>,
    /// −(org − δ)·inv: for its upper planes.
    high: Vec3<L>,
}

impl<L: Lanes> Slabs<L> {
    /// Of rays that reach every box, wherever they are.
    #[inline(always)]
    pub fn open() -> Slabs<L> {
        let splat = |x: L::Scalar| Vec3::splat([x; 3]);
        let largest = L::Scalar::MAX;
        Slabs {
            inv: splat(L::Scalar::MIN_POSITIVE),
            low: -splat(largest),
            high: splat(largest),
        }
    }

    /// `bounds` must contain every box that will be asked about.
    #[inline(always)]
    pub fn new(org: Vec3<L>, dir: Vec3<L>, bounds: &Aabb32) -> Slabs<L> {
        // A direction component of (nearly) zero counts as 2^-60 of the largest
        // one: no division by zero and no 0·∞. That bends the ray, inside the
        // tree by less than 2^-59 of the largest reach of any axis.
        let tiny = dir.max_abs() * L::from_f64(8.673_617_379_884_035e-19);
        let least = L::splat(L::Scalar::MIN_POSITIVE);
        // Longer ones are infinite here.
        let finite = dir.max_abs().le(L::splat(L::Scalar::MAX));
        let wild = tiny.lt(least) | !finite;
        let pad = L::splat(L::Scalar::UNIT_ROUNDOFF) * L::from_f32(32.0);
        let reach = |org: L, lo: f32, hi: f32| {
            let (lo, hi) = (L::from_f32(lo), L::from_f32(hi));
            (lo - org).abs().max((hi - org).abs()).max(org.abs())
        };
        let reaches = [
            reach(org.x, bounds.min[0], bounds.max[0]),
            reach(org.y, bounds.min[1], bounds.max[1]),
            reach(org.z, bounds.min[2], bounds.max[2]),
        ];
        let skew = reaches[0].max(reaches[1]).max(reaches[2]) * L::from_f64(SKEW);
        let largest = L::splat(L::Scalar::MAX);
        // 128 of the least denormal numbers, that a t may be off by whatever its size.
        let finest = least * (L::splat(L::Scalar::UNIT_ROUNDOFF) * L::from_f32(256.0));
        // Boxes may have been cut off there.
        let is_cut = |k: usize| bounds.max[k] >= f32::MAX || bounds.min[k] <= -f32::MAX;
        let axis = |org: L, dir: L, reach: L, is_cut: bool| {
            let signed = L::select(dir.lt(L::zero()), -tiny, tiny);
            let dir = L::select(dir.abs().lt(tiny), signed, dir);
            let inv = L::from_f32(1.0) / dir;
            let delta = reach * pad + skew + least;
            let (low, high) = (-((org + delta) * inv), -((org - delta) * inv));
            // Not less than any product above; a plane is within twice the reach.
            let farthest = (reach * inv).abs() * L::from_f32(4.0);
            let indistinct = (delta * inv).abs().lt(finest);
            let open = wild | L::Mask::splat(is_cut) | farthest.gt(largest) | indistinct;
            // Finite, so that a product with an infinite plane is no NaN.
            (
                L::select(open, least, inv),
                L::select(open, -largest, low),
                L::select(open, largest, high),
            )
        };
        let (x, y, z) = (
            axis(org.x, dir.x, reaches[0], is_cut(0)),
            axis(org.y, dir.y, reaches[1], is_cut(1)),
            axis(org.z, dir.z, reaches[2], is_cut(2)),
        );
        Slabs {
            inv: Vec3::new(x.0, y.0, z.0),
            low: Vec3::new(x.1, y.1, z.1),
            high: Vec3::new(x.2, y.2, z.2),
        }
    }

    /// The interval of t inside the padded box; empty (enter > exit) outside.
    #[inline(always)]
    pub fn interval(&self, min: [f32; 3], max: [f32; 3]) -> (L, L) {
        let splat = |p: [f32; 3]| [L::from_f32(p[0]), L::from_f32(p[1]), L::from_f32(p[2])];
        self.interval_each(splat(min), splat(max))
    }

    /// A box of its own in each lane; the same bits as [`Slabs::interval`].
    #[inline(always)]
    pub fn interval_each(&self, min: [L; 3], max: [L; 3]) -> (L, L) {
        let axis = |lo: L, hi: L, inv: L, low: L, high: L| {
            let t0 = lo.mul_add(inv, low);
            let t1 = hi.mul_add(inv, high);
            (t0.min(t1), t0.max(t1))
        };
        let x = axis(min[0], max[0], self.inv.x, self.low.x, self.high.x);
        let y = axis(min[1], max[1], self.inv.y, self.low.y, self.high.y);
        let z = axis(min[2], max[2], self.inv.z, self.low.z, self.high.z);
        (x.0.max(y.0).max(z.0), x.1.min(y.1).min(z.1))
    }
}

impl<L: Lanes> Slabs<L> {
    /// (1/dir, for lower planes, for upper planes) of each axis: a plane at x is
    /// at t = x·inv + low as the lower side of a box, x·inv + high as the upper.
    #[inline(always)]
    pub fn planes(&self) -> [(L, L, L); 3] {
        [
            (self.inv.x, self.low.x, self.high.x),
            (self.inv.y, self.low.y, self.high.y),
            (self.inv.z, self.low.z, self.high.z),
        ]
    }

    /// One axis's constants: 1/dir, for lower planes, for upper planes.
    #[inline(always)]
    pub fn axis(&self, k: usize) -> (L, L, L) {
        (self.inv.axis(k), self.low.axis(k), self.high.axis(k))
    }
}
