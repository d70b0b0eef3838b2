//! Numbers whose sign is either known or reported as undecided.
//!
//! Every formula of the oracle is written once, generic over [`Number`]
//! (docs/numerics/oracle.md, O1). [`Approx`] is f64 with a bound on its error: it is fast,
//! and its sign may be undecided. [`Dyadic`] is exact, and its sign is always known. A
//! formula is evaluated with the first type, and where a sign is undecided again with the
//! second. So every decision is that of exact arithmetic.
//!
//! [`Approx`]: super::approx::Approx
//! [`Dyadic`]: super::dyadic::Dyadic

use super::dyadic::Dyadic;
use std::cmp::Ordering;

/// A number with sums, differences and products, and a sign.
pub trait Number: Clone {
    /// The error that reports an undecided sign.
    type Undecided;

    /// Converts a finite f64, exactly.
    fn from_f64(x: f64) -> Self;
    fn plus(&self, other: &Self) -> Self;
    fn minus(&self, other: &Self) -> Self;
    fn times(&self, other: &Self) -> Self;

    /// Compares the number with zero.
    fn sign(&self) -> Result<Ordering, Self::Undecided>;
    /// Returns the exact number, for operations that only exact numbers have.
    fn exactly(&self) -> Result<Dyadic, Self::Undecided>;

    fn zero() -> Self {
        Self::from_f64(0.0)
    }

    fn squared(&self) -> Self {
        self.times(self)
    }

    /// Returns the number, or its negative if `sign` is that of negative numbers.
    fn with_sign_of(&self, sign: Ordering) -> Self {
        match sign {
            Ordering::Less => Self::zero().minus(self),
            _ => self.clone(),
        }
    }
}

/// A vector or point of such numbers.
pub type Vector<N> = [N; 3];

/// Converts a vector of finite f64, exactly.
pub fn vector<N: Number>(v: [f64; 3]) -> Vector<N> {
    v.map(N::from_f64)
}

/// Returns a − b.
pub fn minus<N: Number>(a: &Vector<N>, b: &Vector<N>) -> Vector<N> {
    std::array::from_fn(|k| a[k].minus(&b[k]))
}

/// Returns a · b.
pub fn dot<N: Number>(a: &Vector<N>, b: &Vector<N>) -> N {
    let [x, y, z] = std::array::from_fn(|k| a[k].times(&b[k]));
    x.plus(&y).plus(&z)
}

/// Returns a × b.
pub fn cross<N: Number>(a: &Vector<N>, b: &Vector<N>) -> Vector<N> {
    std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        a[i].times(&b[j]).minus(&a[j].times(&b[i]))
    })
}
