//! Stepping through an operand's boundaries in the order of t.

use super::program::{Program, State};
use std::ops::ControlFlow;

/// An end of what a ray has in an operand.
#[derive(Clone, Copy, Debug)]
pub struct Boundary<T> {
    pub at: T,
    pub operand: u32,
    /// The ray comes in there.
    pub enters: bool,
}

/// A boundary of the solid itself.
#[derive(Clone, Copy, Debug)]
pub struct Change<'b, T> {
    /// That of an operand: of several at one t the first that counts, by number; of
    /// several t in one event the first behind which the solid is as behind them all.
    pub boundary: &'b Boundary<T>,
    /// The ray comes into the solid there.
    pub enters: bool,
}

/// One ray's way through a program. Reused from ray to ray.
#[derive(Debug, Default)]
pub struct Walk {
    state: State,
}

impl Walk {
    /// Calls `visit` at the solid's boundaries, in order, until it has seen enough.
    /// `inside`: operands that the ray has always been in. `boundaries` stand in the
    /// order of t, those at the `same` t by number of operand; neighbours may be
    /// `one` event although their t differ. Returns whether the ray is in the solid
    /// in the end, unless `visit` broke off.
    pub fn run<'b, T, B>(
        &mut self,
        program: &Program,
        inside: impl IntoIterator<Item = u32>,
        boundaries: &'b [Boundary<T>],
        (same, one): (impl Fn(&T, &T) -> bool, impl Fn(&T, &T) -> bool),
        mut visit: impl FnMut(Change<'b, T>) -> ControlFlow<B>,
    ) -> ControlFlow<B, bool> {
        let state = &mut self.state;
        program.start(state);
        for operand in inside {
            program.flip(state, operand, true);
        }
        let mut is_inside = program.is_inside(state);
        for event in boundaries.chunk_by(|a, b| one(&a.at, &b.at)) {
            let before = is_inside;
            let mut found = None;
            for together in event.chunk_by(|a, b| same(&a.at, &b.at)) {
                let start = is_inside;
                let mut first = None;
                for boundary in together {
                    program.flip(state, boundary.operand, boundary.enters);
                    is_inside = program.is_inside(state);
                    if is_inside != start {
                        first = first.or(Some(boundary));
                    }
                }
                // There it truly becomes what it is behind the event.
                if is_inside != start && is_inside != before {
                    found = found.or(first);
                }
            }
            let enters = is_inside;
            if let Some(boundary) = found.filter(|_| enters != before) {
                visit(Change { boundary, enters })?;
            }
        }
        ControlFlow::Continue(is_inside)
    }

    /// Whether a ray is in the solid before it meets any boundary.
    pub fn starts_inside(
        &mut self,
        program: &Program,
        inside: impl IntoIterator<Item = u32>,
    ) -> bool {
        program.start(&mut self.state);
        for operand in inside {
            program.flip(&mut self.state, operand, true);
        }
        program.is_inside(&self.state)
    }
}
