//! The walk along sorted boundaries of a CSG solid's operands.

use super::program::{Program, State};
use std::ops::ControlFlow;

/// A boundary of an operand on a ray.
#[derive(Clone, Copy, Debug)]
pub struct Boundary<T> {
    pub at: T,
    pub operand: u32,
    /// Whether the ray enters the operand there.
    pub enters: bool,
}

/// A boundary of the solid itself.
#[derive(Clone, Copy, Debug)]
pub struct Change<'b, T> {
    /// The operand's boundary that the solid's is taken from. Of several at one t it is the
    /// first, by operand, that changes the solid (S52); of several t in one event the first
    /// behind which the solid is what it is behind the event (S51).
    pub boundary: &'b Boundary<T>,
    /// Whether the ray enters the solid there.
    pub enters: bool,
}

/// The walk of one ray through a program. Storage is reused from ray to ray.
#[derive(Debug, Default)]
pub struct Walk {
    state: State,
}

impl Walk {
    /// Calls `visit` at the solid's boundaries, in the order of t, until it breaks off.
    /// `inside` lists the operands that the line is in before all boundaries. `boundaries`
    /// are sorted by t, and those at the `same` t by operand; neighbours may be `one` event
    /// although their t differ (S47). Returns whether the ray ends in the solid, unless
    /// `visit` broke off.
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
                // The solid changes here to what it is behind the event (S51).
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

    /// Says whether a ray is in the solid before it meets any boundary.
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
