//! The least root of a polynomial in (0, 1), one polynomial a lane: what surfaces
//! are traced with.
//!
//! A polynomial of degree n comes as its scaled Bernstein coefficients dⱼ = C(n, j)
//! bⱼ. They are the numbers of p in t/(1 − t): with q = t/(1 − t), p(t) = (1 − t)ⁿ
//! Σ dⱼ qʲ. So subdivision works on the bⱼ, and Horner's scheme on the same
//! polynomial as well conditioned as that; read backwards, it is p in (1 − t)/t,
//! and one of the two is in (0, 1].
//!
//! Isolation is Descartes subdivision ([`super::bernstein`]) in lock-step: one tree
//! for all lanes, each with its own ends. An interval is cut where its control
//! polygon says that one root lies before: between its first and second crossing
//! of 0. What the tree has seen is not seen again: a lane goes on to the right
//! sibling of where it is. The isolated root ends in the canonical refinement
//! ([`super::refine`]): q is the f64 nearest to the root in q, or in 1/q where that
//! is below 1, and t follows from it. So t depends on the dⱼ alone.
//!
//! **Invariants.** A lane's result depends on nothing in other lanes, so every width
//! gives the same bits. A lane is *in doubt* where the coefficients' errors, or
//! rounding, do not settle it; [`least_root`] is its exact answer.

mod parts;
mod refined;

pub use parts::Waiting;

use super::interval::Interval;
use super::polynomial::Polynomial;
use crate::math::lanes::{Lanes, Mask, Scalar};
use parts::{Part, SLACK, largest};
use refined::{Bracket, refined};

/// Polynomials of degree N − 1 on 0 ≤ t ≤ 1.
#[derive(Clone, Copy, Debug)]
pub struct Segment<L, const N: usize> {
    /// C(N − 1, j) · bⱼ.
    pub scaled: [L; N],
    /// What each bⱼ may be off by.
    pub error: L,
    /// What b₀ may be off by, no more than `error`: it is p(0), which may be known
    /// much better than the others.
    pub first: L,
}

#[derive(Clone, Copy, Debug)]
pub struct Nearest<L: Lanes> {
    /// Where there is one.
    pub t: L,
    /// What rounding, and to first order (doubled) the error of the coefficients,
    /// may move `t` by.
    pub error: L,
    /// Lanes with a certain least root, which is simple.
    pub hit: L::Mask,
    /// Lanes that are not settled, also where numbers are not finite or beyond 1e300.
    /// The others have no root.
    pub doubt: L::Mask,
}

#[derive(Clone, Copy, Debug)]
pub struct Existence<L: Lanes> {
    pub some: L::Mask,
    pub doubt: L::Mask,
}

/// From Σ cᵢ tⁱ, each cᵢ off by at most `error`: dⱼ = Σ C(n − i, j − i) cᵢ.
#[inline(always)]
pub fn from_powers<L: Lanes<Scalar = f64>, const N: usize>(c: &[L; N], error: L) -> Segment<L, N> {
    // Σ cᵢ qⁱ (1 + q)^(n−i).
    let weights = const { pascal::<N>() };
    let (mut size, mut d) = (L::zero(), [L::zero(); N]);
    for i in 0..N {
        size = size + c[i].abs();
        for j in 0..N - i {
            d[i + j] = d[i + j] + c[i] * L::from_f64(weights[N - 1 - i][j]);
        }
    }
    let rounding = (N as f64 + 4.0) * f64::UNIT_ROUNDOFF;
    let error = error * L::from_f64(N as f64) + size * L::from_f64(rounding);
    Segment {
        scaled: d,
        error,
        first: error,
    }
}

/// C(n, j) in row n.
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
    /// Lanes whose numbers are finite and stay so.
    #[inline(always)]
    fn sound(&self) -> L::Mask {
        let mut size = self.error;
        for d in &self.scaled {
            size = size + d.abs();
        }
        size.lt(L::from_f64(1e300)) & self.error.ge(L::zero())
    }

    #[inline(always)]
    fn whole(&self, lanes: L::Mask) -> Part<L, N> {
        let inverse = const { inverse_binomials::<N>() };
        let b: [L; N] = std::array::from_fn(|j| self.scaled[j] * L::from_f64(inverse[j]));
        let rounding = L::from_f64(2.0 * f64::EPSILON) * largest(&b);
        Part {
            b,
            error: self.error + rounding + L::from_f64(super::eval::FLOOR),
            // C(n, 0) is 1.
            first: self.first,
            low: L::zero(),
            high: L::from_f64(1.0),
            lanes,
            depth: 0,
        }
    }

    /// Looks at intervals from left to right, and into the halves of those that are
    /// still open in some lanes, which `look` says.
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

/// The least root of each lane in (0, 1).
#[inline(always)]
pub fn nearest<L: Lanes<Scalar = f64>, const N: usize>(
    segment: &Segment<L, N>,
    active: L::Mask,
    waiting: &mut Waiting<L>,
) -> Nearest<L> {
    least::<L, N, true>(segment, active, waiting)
}

/// The same, but for the last bits of t: it is where Newton's method ends, and `error`
/// an estimate that [`leaves_between`] may prove. For coefficients that have errors,
/// which matter more.
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
        // Lanes that have their root need no more.
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

/// All roots of one polynomial in (0, 1), ascending, if all are certain and simple, and
/// alone within `room` besides. `false`: that is not so, and `found` says nothing.
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

/// Whether there is a root in (0, 1).
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
        // Ends of opposite signs have a root between.
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

/// Lanes whose polynomial certainly has different signs at two places in [0, 1].
#[inline(always)]
pub fn changes_between<L: Lanes<Scalar = f64>, const N: usize>(
    segment: &Segment<L, N>,
    low: L,
    high: L,
) -> L::Mask {
    let [above, below] = turns_between(segment, low, high);
    above | below
}

/// The same, and the sign at the first place is still that of p(0). With no root before
/// some interval, one in it, and the first place in it, that root is between the two.
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

/// Lanes whose polynomial is certainly positive at one place and negative at the other,
/// and the reverse.
#[inline(always)]
fn turns_between<L: Lanes<Scalar = f64>, const N: usize>(
    segment: &Segment<L, N>,
    low: L,
    high: L,
) -> [L::Mask; 2] {
    let one = L::from_f64(1.0);
    // Σ dⱼ tʲ (1 − t)^(n−j), by Horner's scheme in two variables; no term cancels in
    // `size`. Three roundings a step, and those of 1 − t.
    let at = |t: L| {
        let rest = one - t;
        let (mut value, mut size, mut power) =
            (segment.scaled[N - 1], segment.scaled[N - 1].abs(), one);
        for d in segment.scaled[..N - 1].iter().rev() {
            power = power * rest;
            value = value * t + *d * power;
            size = size * t + d.abs() * power;
        }
        let rounding = (5.0 * N as f64 + 2.0) * f64::UNIT_ROUNDOFF;
        let off = segment.error + size * L::from_f64(rounding) + L::from_f64(super::eval::FLOOR);
        (value, off)
    };
    let ((a, off_a), (b, off_b)) = (at(low), at(high));
    // There it is b₀.
    let off_a = L::select(low.eq(L::zero()), segment.first, off_a);
    [a.gt(off_a) & b.lt(-off_b), a.lt(-off_a) & b.gt(off_b)]
}

/// The least root in (0, 1) of the very polynomial that a lane has, for lanes in
/// doubt: exact, and with the bits that [`nearest`] gives where it is certain. `None`
/// also where coefficients are not finite, or all are 0.
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
