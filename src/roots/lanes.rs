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

use super::interval::Interval;
use super::polynomial::Polynomial;
use super::refine;
use crate::math::lanes::{Lanes, Mask, Scalar};

/// Cuts, one inside another, before a lane is in doubt.
const DEPTH: u32 = 40;

/// What ends of intervals are off by, in t: two roundings a cut.
const SLACK: f64 = 2.0 * DEPTH as f64 * f64::EPSILON;

/// Steps of Newton's method, or of halving.
const STEPS: u32 = 40;

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

/// Intervals that wait, of any degree; one for each thread, so that nothing allocates.
#[derive(Clone, Debug)]
pub struct Waiting<L: Lanes> {
    /// Of each interval its coefficients, and four numbers.
    values: Vec<L>,
    marks: Vec<(L::Mask, u32)>,
}

impl<L: Lanes> Default for Waiting<L> {
    fn default() -> Self {
        Waiting {
            values: Vec::new(),
            marks: Vec::new(),
        }
    }
}

impl<L: Lanes> Waiting<L> {
    fn clear(&mut self) {
        self.values.clear();
        self.marks.clear();
    }

    #[inline(always)]
    fn push<const N: usize>(&mut self, part: &Part<L, N>) {
        self.values.extend_from_slice(&part.b);
        let rest = [part.error, part.first, part.low, part.high];
        self.values.extend_from_slice(&rest);
        self.marks.push((part.lanes, part.depth));
    }

    #[inline(always)]
    fn pop<const N: usize>(&mut self) -> Option<Part<L, N>> {
        let (lanes, depth) = self.marks.pop()?;
        let at = self.values.len() - (N + 4);
        let values = &self.values[at..];
        let part = Part {
            b: std::array::from_fn(|j| values[j]),
            error: values[N],
            first: values[N + 1],
            low: values[N + 2],
            high: values[N + 3],
            lanes,
            depth,
        };
        self.values.truncate(at);
        Some(part)
    }
}

#[derive(Clone, Copy, Debug)]
struct Part<L: Lanes, const N: usize> {
    b: [L; N],
    error: L,
    /// Of b[0].
    first: L,
    low: L,
    high: L,
    lanes: L::Mask,
    depth: u32,
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
                let (left, right) = part.cut(part.place(), open);
                waiting.push(&right);
                part = left;
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

#[inline(always)]
fn largest<L: Lanes, const N: usize>(b: &[L; N]) -> L {
    b[1..].iter().fold(b[0].abs(), |m, b| m.max(b.abs()))
}

/// Changes of sign of the coefficients: whether they are known, and how many.
struct Changes<L: Lanes> {
    certain: L::Mask,
    some: L::Mask,
    several: L::Mask,
}

impl<L: Lanes<Scalar = f64>, const N: usize> Part<L, N> {
    #[inline(always)]
    fn changes(&self) -> Changes<L> {
        let (error, negative) = (self.error, -self.error);
        let mut above = self.b[0].gt(self.first);
        let mut below = self.b[0].lt(-self.first);
        let mut certain = above | below;
        let (mut some, mut several) = (L::Mask::splat(false), L::Mask::splat(false));
        for b in &self.b[1..] {
            let (next_above, next_below) = (b.gt(error), b.lt(negative));
            let change = (above & next_below) | (below & next_above);
            several = several | (some & change);
            some = some | change;
            certain = certain & (next_above | next_below);
            (above, below) = (next_above, next_below);
        }
        Changes {
            certain,
            some,
            several,
        }
    }

    /// Where the control polygon crosses 0 first, and then, of the width of the
    /// interval; the latter 1 if it does not.
    #[inline(always)]
    fn crossings(&self) -> (L, L) {
        let zero = L::zero();
        let (mut first, mut second) = (L::from_f64(1.0), L::from_f64(1.0));
        let (mut is_first, mut is_second) = (L::Mask::splat(true), L::Mask::splat(false));
        let width = 1.0 / (N as f64 - 1.0);
        let mut before = self.b[0];
        for (j, b) in self.b.iter().enumerate().skip(1) {
            let change = (before.lt(zero) & b.ge(zero)) | (before.ge(zero) & b.lt(zero));
            let at = (before / (before - *b) + L::from_f64(j as f64 - 1.0)) * L::from_f64(width);
            first = L::select(is_first & change, at, first);
            second = L::select(is_second & change, at, second);
            is_second = (is_second & !change) | (is_first & change);
            is_first = is_first & !change;
            before = *b;
        }
        (first, second)
    }

    /// Both sides of a place between 0 and 1 of the width. Each of n rows takes
    /// three roundings of at most four times the largest coefficient.
    #[inline(always)]
    fn cut(&self, at: L, lanes: L::Mask) -> (Part<L, N>, Part<L, N>) {
        let (mut left, mut right) = (*self, *self);
        for m in (1..N).rev() {
            for j in 0..m {
                let b = right.b[j];
                right.b[j] = b + at * (right.b[j + 1] - b);
            }
            left.b[N - m] = right.b[0];
        }
        let rounding = 5.01 * (N as f64 - 1.0) * f64::UNIT_ROUNDOFF;
        let error = self.error + L::from_f64(rounding) * largest(&self.b);
        let middle = self.low + (self.high - self.low) * at;
        (left.error, right.error) = (error, error);
        // The left one keeps it.
        right.first = error;
        (left.high, right.low) = (middle, middle);
        (left.lanes, right.lanes) = (lanes, lanes);
        (left.depth, right.depth) = (self.depth + 1, self.depth + 1);
        (left, right)
    }

    /// Where to cut, so that one root is likely to lie before.
    #[inline(always)]
    fn place(&self) -> L {
        let (first, second) = self.crossings();
        let middle = L::from_f64(0.5) * (first + second);
        middle.max(L::from_f64(0.0625)).min(L::from_f64(0.9375))
    }

    /// Lanes in which nothing more is to be had from cutting.
    #[inline(always)]
    fn hopeless(&self) -> L::Mask {
        if self.depth >= DEPTH {
            return L::Mask::splat(true);
        }
        largest(&self.b).le(L::from_f64(4.0) * self.error)
    }
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
/// an estimate that [`changes_between`] may prove. For coefficients that have errors,
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
    (a.gt(off_a) & b.lt(-off_b)) | (a.lt(-off_a) & b.gt(off_b))
}

/// Two ends with one root between them, a guess of it, and the sign of p at `low`.
struct Bracket<L> {
    low: L,
    high: L,
    start: L,
    sign_low: L,
}

/// The root that has been isolated.
#[inline(always)]
fn refined<L: Lanes<Scalar = f64>, const N: usize, const ROUNDED: bool>(
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
    // The sign of p at t = ½.
    let d = &segment.scaled;
    let middle = d[1..].iter().fold(d[0], |sum, d| sum + *d);
    let mut size = zero;
    for d in d {
        size = size + d.abs();
    }
    let is_clear = middle
        .abs()
        .gt(size * L::from_f64(2.0 * N as f64 * f64::EPSILON));
    // Upper half: the polynomial backwards, in (1 − t) / t.
    let same = (middle.gt(zero) & sign_low.gt(zero)) | (middle.lt(zero) & sign_low.lt(zero));
    let straddles = low.lt(half) & high.gt(half);
    // Where that is not clear the root is ½, nearly, and q or 1/q rounds to 1.
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
    // Newton's method, and halving where it leaves the bracket.
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
    // Ends but 0 and 1 are rounded.
    let slack = L::from_f64(SLACK);
    let after = low.eq(zero) | (low + slack).lt(t);
    let before = high.eq(one) | (t + slack).lt(high);
    // dp/dt = (1 − t)^(n−2) · slope in q; backwards the same with t.
    let mut power = one;
    let base = L::select(upper, t, one - t);
    for _ in 0..N.saturating_sub(3) {
        power = power * base;
    }
    let slope = found.slope * if N > 2 { power } else { one / base };
    let two = L::from_f64(2.0);
    let error = two * segment.error / slope + L::from_f64(2.0 * f64::EPSILON) * t;
    Nearest {
        t,
        error,
        hit: found.certain & after & before & q.gt(zero) & q.le(one),
        doubt: L::Mask::splat(false),
    }
}

/// From where Newton's method in q, or where `upper` in 1/q, has ended.
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
    // Each bⱼ is off by `error`, and Σ C(n, j) qʲ is a power.
    let mut off = segment.error;
    for _ in 1..N {
        off = off * stretch;
    }
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
