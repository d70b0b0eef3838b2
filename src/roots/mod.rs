//! Real roots of polynomials in one variable.

mod answer;
mod auto;
mod bernstein;
mod eval;
mod exact;
mod interval;
mod polynomial;
mod refine;

pub use answer::{Answer, Cluster, Parity, Proof, Root};
pub use auto::{Want, roots};
pub use eval::{Approximate, Local, derivative, horner, local};
pub use interval::Interval;
pub use polynomial::{MAX_DEGREE, Polynomial, PolynomialError};
