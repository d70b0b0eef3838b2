//! The equal-area map between the unit square and the sphere: Clarberg 2008, "Fast
//! Equal-Area Mapping of the (Hemi)Sphere using SIMD".
//!
//! The octahedron's upper half (z ≥ 0) is the square's inner diamond, its lower half the four
//! corners. Areas of the square are solid angles over 4π.

use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::elementary::{atan2, sin_cos_turns};
use lanecast_numerics::math::lanes::Lanes;
use std::f32::consts::FRAC_2_PI;

/// Returns the unit direction at a place of the square.
#[inline(always)]
pub fn direction<L: Lanes<Scalar = f32>>(place: [L; 2]) -> Vec3<L> {
    let (zero, one, two) = (L::zero(), L::splat(1.0), L::splat(2.0));
    let [u, v] = place.map(|x| two * x - one);
    let (a, b) = (u.abs(), v.abs());
    let inside = one - (a + b);
    let r = one - inside.abs();
    // The azimuth within its quadrant is π/4 · (1 + (|v| − |u|)/r).
    let slant = (b - a) / r.max(L::splat(1e-30));
    let (sin, cos) = sin_cos_turns((slant + one) * L::splat(0.125));
    let square = r * r;
    let z = one - square;
    let radius = r * (two - square).max(zero).sqrt();
    Vec3::new(
        signed(radius * cos, u),
        signed(radius * sin, v),
        signed(z, inside),
    )
}

/// Returns the place of a unit direction in the square.
#[inline(always)]
pub fn place<L: Lanes<Scalar = f32>>(dir: Vec3<L>) -> [L; 2] {
    let (zero, one, half) = (L::zero(), L::splat(1.0), L::splat(0.5));
    let Vec3 { x, y, z } = dir.abs();
    // √(1 − z), without its cancellation near the poles.
    let r = ((x * x + y * y) / (one + z)).sqrt().min(one);
    let b = r * (atan2(y, x) * L::splat(FRAC_2_PI)).min(one);
    let a = r - b;
    let below = dir.z.lt(zero);
    let (a, b) = (L::select(below, one - b, a), L::select(below, one - a, b));
    [signed(a, dir.x), signed(b, dir.y)].map(|x| (x + one) * half)
}

/// Returns x, negated where `like` is negative.
#[inline(always)]
fn signed<L: Lanes<Scalar = f32>>(x: L, like: L) -> L {
    L::select(like.lt(L::zero()), -x, x)
}

/// Returns the texel that lies at a place of a map of n² texels with one more on each side:
/// across an edge the map goes on from the edge's other half.
pub fn wrapped(n: i64, [x, y]: [i64; 2]) -> [i64; 2] {
    let fold = |x: i64, y: i64| match x {
        x if x < 0 => (-1 - x, n - 1 - y),
        x if x >= n => (2 * n - 1 - x, n - 1 - y),
        x => (x, y),
    };
    let (x, y) = fold(x, y);
    let (y, x) = fold(y, x);
    [x, y]
}
