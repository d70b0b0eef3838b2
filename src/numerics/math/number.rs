//! The arithmetic in which exact predicates are written once: f64 with an error bound
//! ([`ErrorBounded`](super::bounds::ErrorBounded)), double-double with an error bound
//! ([`DoubleDouble`](super::double_double::DoubleDouble)), and exact numbers
//! ([`Dyadic`](super::dyadic::Dyadic)).

use std::cmp::Ordering;

/// A number with sum, difference and product whose sign may be certain.
pub trait Number: Copy {
    /// The storage of the numbers; `()` if they need none.
    type Space: Copy;

    /// Converts a finite f64, exactly.
    fn of(space: Self::Space, x: f64) -> Self;
    fn plus(&self, other: &Self) -> Self;
    fn minus(&self, other: &Self) -> Self;
    fn times(&self, other: &Self) -> Self;

    /// Returns the sign where it is certain.
    fn sign(&self) -> Option<Ordering>;

    /// Computes o + s·d − c: a coordinate of a ray's point relative to a point c.
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

/// A number with exact signs, which decides what [`ErrorBounded`](super::bounds::ErrorBounded)
/// leaves open: `Equal` means that the number is 0.
pub trait ExactSign: Number {
    /// Returns ± m · 2^power, exactly; m has at most 54 bits.
    fn scaled(space: Self::Space, m: u64, power: i32, negative: bool) -> Self;

    fn negated_if(&self, negate: bool) -> Self;

    /// Calls a function and gives back the storage of the numbers it made. The result
    /// must not hold such numbers.
    fn briefly<T>(space: Self::Space, f: impl FnOnce() -> T) -> T;
}

/// Dot product: (x₀y₀ + x₁y₁) + x₂y₂.
#[inline(always)]
pub fn dot<N: Number>(x: &[N; 3], y: &[N; 3]) -> N {
    let product = |k: usize| x[k].times(&y[k]);
    product(0).plus(&product(1)).plus(&product(2))
}

/// Cross product by differences of products.
#[inline(always)]
pub fn cross<N: Number>(x: &[N; 3], y: &[N; 3]) -> [N; 3] {
    let minor = |i: usize, j: usize| x[i].times(&y[j]).minus(&x[j].times(&y[i]));
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

/// Whether x is ± a normal power of two, by which products are exact unless they leave
/// the range.
#[inline(always)]
pub fn is_power_of_two(x: f64) -> bool {
    const FRACTION: u64 = (1 << 52) - 1;
    x.is_normal() && x.to_bits() & FRACTION == 0
}
