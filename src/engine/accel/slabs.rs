//! The slab test: the interval of t in which a ray is inside a box (Kay and Kajiya 1986).
//!
//! The test is conservative (docs/numerics/boxes.md, X1). A primitive's kernel in floating
//! point accepts rays that pass the primitive by a few roundings of the coordinates, and
//! rounding the ray moves it as far. So each box grows by δ = 32·u·reach + [`SKEW`]·(the
//! largest reach of any axis), where the reach of an axis is the largest distance that the
//! tree has from the coordinates' origin or from the ray's. δ is folded into the ray's
//! constants and costs nothing per box.
//!
//! Where the arithmetic leaves the format, the ray's slab of that axis is open and culls
//! nothing (X3). That is so if the direction is so short that 2⁻⁶⁰ of it is not normal, if a
//! plane's t would overflow, or if the pad, as a t, is so small that denormal numbers count
//! beside it. δ includes the least normal number.
//!
//! The test is monotone (X4): t0 = fl(lo·inv + c₀) grows with lo however it is rounded,
//! fused or not, and min and max are exact. So the interval of a box lies inside that of any
//! box around it.

use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::math::{Aabb32, Vec3};

/// The part of the pad that is relative to the largest reach of any axis, at every precision.
/// It covers the f64 rounding of a placed shape's object ray, which seen from the world may
/// carry a share of one axis to another (docs/numerics/boxes.md, X7), and direction
/// components that are replaced because they are nearly zero (X2).
pub const SKEW: f64 = 1e-11;

/// The constants of one packet of rays for the boxes of one tree.
#[derive(Clone, Copy, Debug)]
pub struct Slabs<L: Lanes> {
    inv: Vec3<L>,
    /// −(org + δ)·inv, for a box's lower planes.
    low: Vec3<L>,
    /// −(org − δ)·inv, for a box's upper planes.
    high: Vec3<L>,
}

impl<L: Lanes> Slabs<L> {
    /// Makes constants with which every box contains the whole ray.
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

    /// Makes the constants of a packet. `bounds` must contain every box that will be tested.
    #[inline(always)]
    pub fn new(org: Vec3<L>, dir: Vec3<L>, bounds: &Aabb32) -> Slabs<L> {
        // X2: a direction component of (nearly) zero counts as 2⁻⁶⁰ of the largest one, so
        // that nothing is divided by zero and 0·∞ does not occur. Inside the tree this bends
        // the ray by less than 2⁻⁵⁹ of the largest reach of any axis.
        let tiny = dir.max_abs() * L::from_f64(8.673_617_379_884_035e-19);
        let least = L::splat(L::Scalar::MIN_POSITIVE);
        // A longer direction is infinite in this format.
        let finite = dir.max_abs().le(L::splat(L::Scalar::MAX));
        let out_of_range = tiny.lt(least) | !finite;
        // X1.
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
        // X3: 128 times the least denormal number; half of one is the error of any t, whatever
        // its size.
        let finest = least * (L::splat(L::Scalar::UNIT_ROUNDOFF) * L::from_f32(256.0));
        // A box may have been cut off at the end of f32.
        let is_cut = |k: usize| bounds.max[k] >= f32::MAX || bounds.min[k] <= -f32::MAX;
        let axis = |org: L, dir: L, reach: L, is_cut: bool| {
            let signed = L::select(dir.lt(L::zero()), -tiny, tiny);
            let dir = L::select(dir.abs().lt(tiny), signed, dir);
            let inv = L::from_f32(1.0) / dir;
            let delta = reach * pad + skew + least;
            let (low, high) = (-((org + delta) * inv), -((org - delta) * inv));
            // X3: at least any product above, because a plane is within twice the reach.
            let farthest = (reach * inv).abs() * L::from_f32(4.0);
            let indistinct = (delta * inv).abs().lt(finest);
            let open = out_of_range | L::Mask::splat(is_cut) | farthest.gt(largest) | indistinct;
            // All constants are finite, so that the product with an infinite plane is no NaN.
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

    /// Returns the interval (enter, exit) of t inside the padded box; enter > exit if a ray
    /// misses it.
    #[inline(always)]
    pub fn interval(&self, min: [f32; 3], max: [f32; 3]) -> (L, L) {
        let splat = |p: [f32; 3]| [L::from_f32(p[0]), L::from_f32(p[1]), L::from_f32(p[2])];
        self.interval_each(splat(min), splat(max))
    }

    /// Returns the intervals of a different box in each lane, with the bits of
    /// [`Slabs::interval`].
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
    /// Returns (inv, low, high) of each axis: a plane at x is crossed at t = x·inv + low as the
    /// lower side of a box, and at x·inv + high as the upper side.
    #[inline(always)]
    pub fn planes(&self) -> [(L, L, L); 3] {
        [
            (self.inv.x, self.low.x, self.high.x),
            (self.inv.y, self.low.y, self.high.y),
            (self.inv.z, self.low.z, self.high.z),
        ]
    }

    /// Returns (inv, low, high) of one axis, as [`Slabs::planes`].
    #[inline(always)]
    pub fn axis(&self, k: usize) -> (L, L, L) {
        (self.inv.axis(k), self.low.axis(k), self.high.axis(k))
    }
}
