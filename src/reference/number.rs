//! Numbers that know their sign.
//!
//! Every formula of the judge is written once, over these. [`Approx`] is f64 with
//! a bound on its error, fast, and may not know a sign; [`Dyadic`] is exact and
//! always does. A formula is worked out with the first, and where a sign is in
//! doubt once more with the second. So every decision is that of exact
//! arithmetic.
//!
//! [`Approx`]: super::approx::Approx
//! [`Dyadic`]: super::dyadic::Dyadic

use super::dyadic::Dyadic;
use std::cmp::Ordering;

pub trait Number: Clone {
    /// What is said where the sign is not known.
    type Doubt;

    /// Of a finite number, exactly.
    fn of(x: f64) -> Self;
    fn plus(&self, other: &Self) -> Self;
    fn minus(&self, other: &Self) -> Self;
    fn times(&self, other: &Self) -> Self;

    /// Against zero.
    fn sign(&self) -> Result<Ordering, Self::Doubt>;
    /// For what only exact numbers can do.
    fn exactly(&self) -> Result<Dyadic, Self::Doubt>;

    fn zero() -> Self {
        Self::of(0.0)
    }

    fn squared(&self) -> Self {
        self.times(self)
    }

    /// The number, or its negative where `sign` is that of negative numbers.
    fn with_sign_of(&self, sign: Ordering) -> Self {
        match sign {
            Ordering::Less => Self::zero().minus(self),
            _ => self.clone(),
        }
    }
}

pub type Vector<N> = [N; 3];

pub fn vector<N: Number>(v: [f64; 3]) -> Vector<N> {
    v.map(N::of)
}

pub fn minus<N: Number>(a: &Vector<N>, b: &Vector<N>) -> Vector<N> {
    std::array::from_fn(|k| a[k].minus(&b[k]))
}

pub fn dot<N: Number>(a: &Vector<N>, b: &Vector<N>) -> N {
    let [x, y, z] = std::array::from_fn(|k| a[k].times(&b[k]));
    x.plus(&y).plus(&z)
}

pub fn cross<N: Number>(a: &Vector<N>, b: &Vector<N>) -> Vector<N> {
    std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        a[i].times(&b[j]).minus(&a[j].times(&b[i]))
    })
}
