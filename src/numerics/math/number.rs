//! What formulas of exact predicates are written in, once: f64 with a bound on
//! its error ([`Bounded`](super::bounds::Bounded)), twice its precision with a bound
//! ([`Twice`](super::twice::Twice)), and exact numbers
//! ([`Dyadic`](super::dyadic::Dyadic)).

use std::cmp::Ordering;

/// A number that is added, subtracted and multiplied, and whose sign may be known.
pub trait Number: Copy {
    /// Where numbers are kept.
    type Space: Copy;

    /// A finite number, exactly.
    fn of(space: Self::Space, x: f64) -> Self;
    fn plus(&self, other: &Self) -> Self;
    fn minus(&self, other: &Self) -> Self;
    fn times(&self, other: &Self) -> Self;

    /// Against zero; `None` where it is not known.
    fn sign(&self) -> Option<Ordering>;

    /// o + s·d − c: a coordinate of a ray's point, from another point.
    fn displaced(space: Self::Space, o: f64, s: f64, d: f64, c: f64) -> Self;

    #[inline(always)]
    fn squared(&self) -> Self {
        self.times(self)
    }

    #[inline(always)]
    fn doubled(&self) -> Self {
        self.plus(self)
    }
}

/// Numbers that decide what f64 with a bound on its error leaves open.
pub trait Sharp: Number {
    /// ± m · 2^power, m of 54 bits.
    fn scaled(space: Self::Space, m: u64, power: i32, negative: bool) -> Self;

    fn negated_if(&self, negate: bool) -> Self;

    /// Calls a function whose numbers are not needed beyond it.
    fn briefly<T>(space: Self::Space, f: impl FnOnce() -> T) -> T;
}

#[inline(always)]
pub fn dot<N: Number>(x: &[N; 3], y: &[N; 3]) -> N {
    let product = |k: usize| x[k].times(&y[k]);
    product(0).plus(&product(1)).plus(&product(2))
}

#[inline(always)]
pub fn cross<N: Number>(x: &[N; 3], y: &[N; 3]) -> [N; 3] {
    let minor = |i: usize, j: usize| x[i].times(&y[j]).minus(&x[j].times(&y[i]));
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

/// Or the negative of one: what is multiplied by it loses nothing within the range.
#[inline(always)]
pub fn is_power_of_two(x: f64) -> bool {
    const FRACTION: u64 = (1 << 52) - 1;
    x.is_normal() && x.to_bits() & FRACTION == 0
}
