//! Constructive solid geometry: solids made of solids by Boolean operators.
//!
//! Along a ray every operand is a list of boundaries, and the solid changes between inside
//! and outside only at these (Roth, *Ray Casting for Modeling Solids*, 1982). [`Program`]
//! evaluates the operators; [`Walk`] steps from boundary to boundary, and [`Restricted`]
//! evaluates many rays at a time. Boundaries at one t are one event: callers see the state
//! before and behind it, and never a state between. So the solid is the closure of its
//! interior, whatever the operator (docs/SPEC.md, S41 and S46).

mod program;
mod restricted;
mod walk;

pub use program::{Builder, Gate, Operator, Place, Program, State};
pub use restricted::Restricted;
pub use walk::{Boundary, Change, Walk};
