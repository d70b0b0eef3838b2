//! Constructive solid geometry: solids made of solids by Boolean operators.
//!
//! Along a ray every operand is a list of boundaries, and the solid changes
//! between in and out only at these (Roth, Ray Casting for Modeling Solids, 1982).
//! [`Program`] says how; [`Walk`] steps from boundary to boundary, and [`Restricted`]
//! does so for many rays at a time. Boundaries at
//! one t are one event: whoever asks sees the state before and after it, and
//! never a point between. That makes the answer regular (the closure of its
//! interior) whatever the operator.

mod program;
mod restricted;
mod walk;

pub use program::{Builder, Gate, Operator, Place, Program, State};
pub use restricted::Restricted;
pub use walk::{Boundary, Change, Walk};
