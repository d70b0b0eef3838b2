//! Numbers for ray tracing ([`math`]: lanes, vectors, affine maps, boxes, error bounds
//! and exact arithmetic) and real roots of polynomials in one variable ([`roots`]).
//!
//! This is an internal crate of Lanecast whose interface may change with any version. The
//! stable interface is that of the crate `lanecast`.

pub mod math;
pub mod roots;
