//! The least root of a polynomial in (0, 1), one polynomial per lane. Surfaces are traced
//! with it.
//!
//! A polynomial of degree n is given by its scaled Bernstein coefficients dⱼ =
//! C(n, j) bⱼ. They are the coefficients of p in q = t/(1 − t): p(t) = (1 − t)ⁿ Σ dⱼ qʲ. So
//! subdivision works on the bⱼ, and Horner's scheme on the same polynomial, as well
//! conditioned as the Bernstein form. Read backwards, the dⱼ are the coefficients in
//! (1 − t)/t, and one of the two variables is in (0, 1].
//!
//! Isolation is Descartes subdivision (`bernstein.rs`) in lock-step: one tree for all
//! lanes, each with its own ends. An interval is cut between the first and the second
//! zero crossing of its control polygon, before which one root is expected. No interval
//! is examined twice: a lane continues with the right sibling of its interval. The
//! isolated root ends in the canonical refinement (`refine.rs`): q is the f64 nearest to
//! the root in q, or in 1/q where that is below 1, and t follows from it. So t depends on
//! the dⱼ alone.
//!
//! **Invariants.** A lane's result does not depend on other lanes, so every width gives
//! the same bits. A lane is *in doubt* if the coefficients' errors, or rounding, leave
//! its answer open; [`least_root`] gives its exact answer. Lemmas Z4 to Z9,
//! docs/numerics/roots.md.

mod parts;
mod refined;

pub use parts::Waiting;

use super::interval::Interval;
use super::polynomial::Polynomial;
use crate::math::lanes::{Lanes, Mask, Scalar};
use parts::{Part, SLACK, largest};
use refined::{Bracket, refined};

/// Polynomials of degree N − 1 on 0 ≤ t ≤ 1, one per lane.
#[derive(Clone, Copy, Debug)]
pub struct Segment<L, const N: usize> {
    /// Scaled Bernstein coefficients dⱼ = C(N − 1, j) · bⱼ.
    pub scaled: [L; N],
    /// Error bound of each bⱼ.
    pub error: L,
    /// Error bound of b₀ = p(0), at most `error`. p(0) may be known much better than the
    /// other coefficients.
    pub first: L,
}

/// The least root in (0, 1) of each lane.
#[derive(Clone, Copy, Debug)]
pub struct Nearest<L: Lanes> {
    /// The root in lanes of `hit`.
    pub t: L,
    /// Bound of how far rounding and, to first order and doubled, the coefficients'
    /// errors move `t`.
    pub error: L,
    /// Lanes with a certain least root, which is simple.
    pub hit: L::Mask,
    /// Undecided lanes, which include lanes with numbers that are not finite or beyond
    /// 1e300. Lanes of neither mask have no root.
    pub doubt: L::Mask,
}

/// Whether each lane has a root in (0, 1): lanes with a certain root, and undecided
/// lanes. Lanes of neither mask have no root.
#[derive(Clone, Copy, Debug)]
pub struct Existence<L: Lanes> {
    pub some: L::Mask,
    pub doubt: L::Mask,
}

/// Converts Σ cᵢ tⁱ, each cᵢ off by at most `error`: dⱼ = Σ C(n − i, j − i) cᵢ. Lemma Z4,
/// docs/numerics/roots.md.
#[inline(always)]
pub fn from_powers<L: Lanes<Scalar = f64>, const N: usize>(c: &[L; N], error: L) -> Segment<L, N> {
    // The polynomial is Σ cᵢ qⁱ (1 + q)^(n−i), up to the factor (1 − t)ⁿ.
    let weights = const { pascal::<N>() };
    let (mut size, mut d) = (L::zero(), [L::zero(); N]);
    for i in 0..N {
        size = size + c[i].abs();
        for j in 0..N - i {
            d[i + j] = d[i + j] + c[i] * L::from_f64(weights[N - 1 - i][j]);
        }
    }
    // Lemma Z4, docs/numerics/roots.md.
    let rounding = (N as f64 + 4.0) * f64::UNIT_ROUNDOFF;
    let error = error * L::from_f64(N as f64) + size * L::from_f64(rounding);
    Segment {
        scaled: d,
        error,
        first: error,
    }
}

/// Returns Pascal's triangle: C(n, j) in row n.
const fn pascal<const N: usize>() -> [[f64; N]; N] {
    let mut rows = [[1.0; N]; N];
    let mut n = 1;
    while n < N {
        let mut j = 1;
        while j < n {
            rows[n][j] = rows[n - 1][j - 1] + rows[n - 1][j];
            j += 1;
        }
        n += 1;
    }
    rows
}

impl<L: Lanes<Scalar = f64>, const N: usize> Segment<L, N> {
    /// Lanes whose numbers are finite and far from overflow; false for NaN.
    #[inline(always)]
    fn sound(&self) -> L::Mask {
        let mut size = self.error;
        for d in &self.scaled {
            size = size + d.abs();
        }
        size.lt(L::from_f64(1e300)) & self.error.ge(L::zero())
    }

    /// Makes the interval [0, 1] with unscaled coefficients. Lemma Z5,
    /// docs/numerics/roots.md.
    #[inline(always)]
    fn whole(&self, lanes: L::Mask) -> Part<L, N> {
        let inverse = const { inverse_binomials::<N>() };
        let b: [L; N] = std::array::from_fn(|j| self.scaled[j] * L::from_f64(inverse[j]));
        let rounding = L::from_f64(2.0 * f64::EPSILON) * largest(&b);
        Part {
            b,
            error: self.error + rounding + L::from_f64(super::eval::FLOOR),
            // `scaled[0]` is b₀ exactly, since C(n, 0) is 1.
            first: self.first,
            low: L::zero(),
            high: L::from_f64(1.0),
            lanes,
            depth: 0,
        }
    }

    /// Visits intervals from left to right. `look` returns the lanes in which an interval
    /// is still open; it is then cut in these.
    #[inline(always)]
    fn walk(
        &self,
        lanes: L::Mask,
        waiting: &mut Waiting<L>,
        mut look: impl FnMut(&mut Part<L, N>) -> L::Mask,
    ) {
        waiting.clear();
        let mut part = self.whole(lanes);
        loop {
            let open = look(&mut part);
            if open.any() {
                let at = part.place();
                part.cut(at, open, waiting);
                continue;
            }
            match waiting.pop() {
                Some(next) => part = next,
                None => return,
            }
        }
    }
}

const fn inverse_binomials<const N: usize>() -> [f64; N] {
    let mut row = pascal::<N>()[N - 1];
    let mut i = 0;
    while i < N {
        row[i] = 1.0 / row[i];
        i += 1;
    }
    row
}

/// Finds the least root of each lane in (0, 1), correctly rounded in q or 1/q.
#[inline(always)]
pub fn nearest<L: Lanes<Scalar = f64>, const N: usize>(
    segment: &Segment<L, N>,
    active: L::Mask,
    waiting: &mut Waiting<L>,
) -> Nearest<L> {
    least::<L, N, true>(segment, active, waiting)
}

/// Finds the least root of each lane as [`nearest`] does, except for the last bits: t is
/// where Newton's method ends, and `error` an estimate that [`leaves_between`] may prove.
/// Serves coefficients with errors, which matter more than rounding.
#[inline(always)]
pub fn nearly_nearest<L: Lanes<Scalar = f64>, const N: usize>(
    segment: &Segment<L, N>,
    active: L::Mask,
    waiting: &mut Waiting<L>,
) -> Nearest<L> {
    least::<L, N, false>(segment, active, waiting)
}

#[inline(always)]
fn least<L: Lanes<Scalar = f64>, const N: usize, const ROUNDED: bool>(
    segment: &Segment<L, N>,
    active: L::Mask,
    waiting: &mut Waiting<L>,
) -> Nearest<L> {
    let none = L::Mask::splat(false);
    let sound = segment.sound();
    let (mut isolated, mut doubt) = (none, active & !sound);
    let zero = L::zero();
    let mut found = Bracket {
        low: zero,
        high: zero,
        start: zero,
        sign_low: zero,
    };
    segment.walk(active & sound, waiting, |part| {
        // Lanes that have found their root need no further interval.
        part.lanes = part.lanes & !(isolated | doubt);
        if !part.lanes.any() {
            return none;
        }
        let changes = part.changes();
        let one = part.lanes & changes.certain & changes.some & !changes.several;
        if one.any() {
            let (first, _) = part.crossings();
            let guess = part.low + (part.high - part.low) * first;
            found = Bracket {
                low: L::select(one, part.low, found.low),
                high: L::select(one, part.high, found.high),
                start: L::select(one, guess, found.start),
                sign_low: L::select(one, part.b[0], found.sign_low),
            };
            isolated = isolated | one;
        }
        let open = part.lanes & !one & !(changes.certain & !changes.some);
        if open.any() {
            doubt = doubt | (open & part.hopeless());
        }
        open & !doubt
    });
    if !isolated.any() {
        return Nearest {
            t: L::zero(),
            error: L::zero(),
            hit: none,
            doubt,
        };
    }
    let refined = refined::<L, N, ROUNDED>(segment, isolated, &found);
    Nearest {
        t: refined.t,
        error: refined.error,
        hit: isolated & refined.hit,
        doubt: doubt | (isolated & !refined.hit),
    }
}

/// A simple root, the only one between `from` and `to`.
#[derive(Clone, Copy, Debug)]
pub struct Simple {
    pub t: f64,
    pub from: f64,
    pub to: f64,
}

/// Finds all roots of one polynomial in (0, 1), ascending, if all are certain, simple and
/// at least `room` from the ends of their isolating intervals. Otherwise returns `false`,
/// and `found` is meaningless.
pub fn all<const N: usize>(
    segment: &Segment<f64, N>,
    room: f64,
    waiting: &mut Waiting<f64>,
    found: &mut Vec<Simple>,
) -> bool {
    let lane = <f64 as Lanes>::Mask::splat(true);
    let none = <f64 as Lanes>::Mask::splat(false);
    if !segment.sound().any() {
        return false;
    }
    let mut is_certain = true;
    segment.walk(lane, waiting, |part| {
        let changes = part.changes();
        if (changes.certain & !changes.some).any() || !is_certain {
            return none;
        }
        if !(changes.certain & !changes.several).any() {
            is_certain = !part.hopeless().any();
            return <f64 as Lanes>::Mask::splat(is_certain);
        }
        let (first, _) = part.crossings();
        let bracket = Bracket {
            low: part.low,
            high: part.high,
            start: part.low + (part.high - part.low) * first,
            sign_low: part.b[0],
        };
        let root = refined::<f64, N, false>(segment, lane, &bracket);
        let (from, to) = (root.t - root.error, root.t + root.error);
        // Lemma Z6, docs/numerics/roots.md.
        let begins = from - SLACK - room > part.low;
        let ends = to + SLACK + room < part.high;
        is_certain = root.hit.any() && begins && ends;
        is_certain = is_certain && changes_between(segment, from, to).any();
        found.push(Simple {
            t: root.t,
            from,
            to,
        });
        none
    });
    is_certain
}

/// Decides whether each lane has a root in (0, 1).
#[inline(always)]
pub fn exists<L: Lanes<Scalar = f64>, const N: usize>(
    segment: &Segment<L, N>,
    active: L::Mask,
    waiting: &mut Waiting<L>,
) -> Existence<L> {
    let none = L::Mask::splat(false);
    let sound = segment.sound();
    let (mut some, mut doubt) = (none, active & !sound);
    segment.walk(active & sound, waiting, |part| {
        part.lanes = part.lanes & !some;
        if !part.lanes.any() {
            return none;
        }
        // There is a root between ends of certainly opposite signs.
        let (first, last) = (part.b[0], part.b[N - 1]);
        let (off, error) = (part.first, part.error);
        let opposite = (first.gt(off) & last.lt(-error)) | (first.lt(-off) & last.gt(error));
        some = some | (part.lanes & opposite);
        let changes = part.changes();
        let open = part.lanes & !some & !(changes.certain & !changes.some);
        if !open.any() {
            return none;
        }
        let hopeless = open & part.hopeless();
        doubt = doubt | hopeless;
        open & !hopeless
    });
    Existence {
        some,
        doubt: doubt & !some,
    }
}

/// Returns the lanes whose polynomial certainly has different signs at two places in
/// [0, 1].
#[inline(always)]
pub fn changes_between<L: Lanes<Scalar = f64>, const N: usize>(
    segment: &Segment<L, N>,
    low: L,
    high: L,
) -> L::Mask {
    let [above, below] = turns_between(segment, low, high);
    above | below
}

/// Returns the lanes of [`changes_between`] in which the sign at `low` is that of p(0).
/// If there is no root before some interval, one in it, and `low` in it, that root lies
/// between `low` and `high`.
#[inline(always)]
pub fn leaves_between<L: Lanes<Scalar = f64>, const N: usize>(
    segment: &Segment<L, N>,
    low: L,
    high: L,
) -> L::Mask {
    let [above, below] = turns_between(segment, low, high);
    let (first, zero) = (segment.scaled[0], L::zero());
    (above & first.gt(zero)) | (below & first.lt(zero))
}

/// Returns the lanes whose polynomial is certainly positive at `low` and negative at
/// `high`, and the lanes of the reverse.
#[inline(always)]
fn turns_between<L: Lanes<Scalar = f64>, const N: usize>(
    segment: &Segment<L, N>,
    low: L,
    high: L,
) -> [L::Mask; 2] {
    let one = L::from_f64(1.0);
    // Evaluate Σ dⱼ tʲ (1 − t)^(n−j) by Horner's scheme in two variables; no term cancels
    // in `size`. Three roundings a step, and those of 1 − t: lemma Z9,
    // docs/numerics/roots.md.
    let at = |t: L| {
        let rest = one - t;
        let (mut value, mut size, mut power) =
            (segment.scaled[N - 1], segment.scaled[N - 1].abs(), one);
        for d in segment.scaled[..N - 1].iter().rev() {
            power = power * rest;
            value = value * t + *d * power;
            size = size * t + d.abs() * power;
        }
        // Lemma Z9, docs/numerics/roots.md.
        let rounding = (5.0 * N as f64 + 2.0) * f64::UNIT_ROUNDOFF;
        let off = segment.error + size * L::from_f64(rounding) + L::from_f64(super::eval::FLOOR);
        (value, off)
    };
    let ((a, off_a), (b, off_b)) = (at(low), at(high));
    // At t = 0 the value is b₀.
    let off_a = L::select(low.eq(L::zero()), segment.first, off_a);
    [a.gt(off_a) & b.lt(-off_b), a.lt(-off_a) & b.gt(off_b)]
}

/// Returns the least root in (0, 1) of one lane's polynomial with exact coefficients, for
/// lanes in doubt: exact, with the bits that [`nearest`] gives where it is certain.
/// `None` if there is no root, if coefficients are not finite, or if all are 0.
pub fn least_root(scaled: &[f64]) -> Option<f64> {
    let of = |c: &[f64]| Polynomial::new(c).ok();
    let p = of(scaled)?;
    let lower = super::nearest(&p, &Interval::half_open(0.0, 1.0));
    if let Some(root) = lower {
        return Some(root.t / (1.0 + root.t));
    }
    let backwards: Vec<f64> = scaled.iter().rev().copied().collect();
    let upper = super::roots(&of(&backwards)?, &Interval::open(0.0, 1.0));
    upper.roots.last().map(|root| 1.0 / (1.0 + root.t))
}
