//! Refinement of an isolated root in every lane.

use super::parts::SLACK;
use super::{Nearest, Segment};
use crate::math::lanes::{Lanes, Mask};
use crate::roots::refine;

/// Limit of steps of Newton's method or bisection.
const STEPS: u32 = 40;

/// An isolating interval, an estimate of the root, and a number with the sign of p at
/// `low`.
pub(super) struct Bracket<L> {
    pub low: L,
    pub high: L,
    pub start: L,
    pub sign_low: L,
}

/// Refines an isolated root: correctly rounded if `ROUNDED`, else to the end of Newton's
/// method. Lemma Z8, docs/numerics/roots.md.
#[inline(always)]
pub(super) fn refined<L: Lanes<Scalar = f64>, const N: usize, const ROUNDED: bool>(
    segment: &Segment<L, N>,
    isolated: L::Mask,
    bracket: &Bracket<L>,
) -> Nearest<L> {
    let Bracket {
        low,
        high,
        start,
        sign_low,
    } = *bracket;
    let (zero, half, one) = (L::zero(), L::from_f64(0.5), L::from_f64(1.0));
    // The sign of p at t = ½ is that of the sum.
    let d = &segment.scaled;
    let middle = d[1..].iter().fold(d[0], |sum, d| sum + *d);
    let mut size = zero;
    for d in d {
        size = size + d.abs();
    }
    // Lemma Z8, docs/numerics/roots.md.
    let is_clear = middle
        .abs()
        .gt(size * L::from_f64(2.0 * N as f64 * f64::EPSILON));
    // In the upper half the polynomial is read backwards, in (1 − t) / t.
    let same = (middle.gt(zero) & sign_low.gt(zero)) | (middle.lt(zero) & sign_low.lt(zero));
    let straddles = low.lt(half) & high.gt(half);
    // If the sign at ½ is not clear, the root is near ½, and q or 1/q rounds to 1.
    let upper = (straddles & same & is_clear) | low.ge(half);
    let c: [L; N] = std::array::from_fn(|j| L::select(upper, d[N - 1 - j], d[j]));
    let ratio = |t: L| {
        let rest = one - t;
        L::select(upper, rest, t) / L::select(upper, t, rest)
    };
    let (a, b) = (ratio(low), ratio(high));
    let mut from = L::select(upper, b, a);
    let mut to = L::select(upper, a, b).min(one + half);
    let sign_from = L::select(upper, -sign_low, sign_low);
    // Newton's method, with bisection where it leaves the bracket.
    let mut x = ratio(start);
    let inside = x.gt(from) & x.lt(to);
    x = L::select(inside, x, half * (from + to));
    let mut going = isolated;
    for _ in 0..STEPS {
        let (mut y, mut slope) = (c[N - 1], zero);
        for c in c[..N - 1].iter().rev() {
            slope = x * slope + y;
            y = x * y + *c;
        }
        let before = (y.gt(zero) & sign_from.gt(zero)) | (y.lt(zero) & sign_from.lt(zero));
        from = L::select(before, x, from);
        to = L::select(before, to, x);
        let newton = x - y / slope;
        let inside = newton.ge(from) & newton.le(to);
        let next = L::select(inside, newton, half * (from + to));
        let moved = (next - x).abs();
        x = L::select(going, next, x);
        going = going & moved.gt(L::from_f64(refine::SETTLED) * next.abs());
        if going.none() {
            break;
        }
    }
    if !ROUNDED {
        return unrounded(segment, &c, (x, upper), isolated);
    }
    let found = refine::nearest(&c, x, isolated);
    let q = found.root;
    let t = L::select(upper, one, q) / (one + q);
    // Ends other than 0 and 1 are rounded. Lemma Z6, docs/numerics/roots.md.
    let slack = L::from_f64(SLACK);
    let after = low.eq(zero) | (low + slack).lt(t);
    let before = high.eq(one) | (t + slack).lt(high);
    // dp/dt is (1 − t)^(n−2) times the slope in q; read backwards, tⁿ⁻² times.
    let mut power = one;
    let base = L::select(upper, t, one - t);
    for _ in 0..N.saturating_sub(3) {
        power = power * base;
    }
    let slope = found.slope * if N > 2 { power } else { one / base };
    let two = L::from_f64(2.0);
    // Lemma Z8, docs/numerics/roots.md.
    let error = two * segment.error / slope + L::from_f64(2.0 * f64::EPSILON) * t;
    Nearest {
        t,
        error,
        hit: found.certain & after & before & q.gt(zero) & q.le(one),
        doubt: L::Mask::splat(false),
    }
}

/// Takes the end of Newton's method in q, or in 1/q where `upper`, as the root, and
/// bounds its error. Lemma Z8, docs/numerics/roots.md.
#[inline(always)]
fn unrounded<L: Lanes<Scalar = f64>, const N: usize>(
    segment: &Segment<L, N>,
    c: &[L; N],
    (q, upper): (L, L::Mask),
    isolated: L::Mask,
) -> Nearest<L> {
    let one = L::from_f64(1.0);
    let (mut y, mut slope, mut size) = (c[N - 1], L::zero(), c[N - 1].abs());
    for c in c[..N - 1].iter().rev() {
        slope = q * slope + y;
        y = q * y + *c;
        size = q * size + c.abs();
    }
    let stretch = one + q;
    // Each bⱼ is off by `error`, and Σ C(n, j) qʲ = (1 + q)ⁿ.
    let mut off = segment.error;
    for _ in 1..N {
        off = off * stretch;
    }
    // Lemma Z8, docs/numerics/roots.md.
    off = off + size * L::from_f64(2.0 * N as f64 * f64::EPSILON);
    let error = L::from_f64(1.5) * (y.abs() + off) / slope.abs();
    let t = L::select(upper, one, q) / stretch;
    Nearest {
        t,
        error: error / (stretch * stretch) + t * L::from_f64(4.0 * f64::EPSILON),
        hit: isolated & error.lt(one),
        doubt: L::Mask::splat(false),
    }
}
