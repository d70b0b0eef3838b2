//! Numbers: lanes, vectors, exact arithmetic, error bounds ([`math`]), and real roots of
//! polynomials in one variable ([`roots`]).
//!
//! A part of Lanecast that may change with any version; the crate `lanecast` is what is
//! kept.

pub mod math;
pub mod roots;
