//! The budget of a search for bounds.

use super::values::{Forms, Sloped, Slopes, Values};
use crate::geom::Tape;
use crate::math::Interval;

/// The cost of a gradient relative to that of a value: seven products instead of one.
const GRADIENT_COST: u64 = 6;
/// The overhead of an evaluation, in steps.
const EVALUATION_COST: u64 = 8;

/// A tape, and the budget for its evaluations.
pub(super) struct Work<'a> {
    pub tape: &'a Tape,
    /// The steps that are left for this part of the search.
    left: u64,
}

impl<'a> Work<'a> {
    pub fn new(tape: &'a Tape, steps: u64) -> Work<'a> {
        Work { tape, left: steps }
    }

    pub fn is_spent(&self) -> bool {
        self.left == 0
    }

    pub fn left(&self) -> u64 {
        self.left
    }

    /// Makes a budget of so many evaluations.
    pub fn of_evaluations(tape: &Tape, evaluations: u64) -> Work<'_> {
        Work::new(tape, cost(tape).saturating_mul(evaluations))
    }

    /// Takes up to so many evaluations out of this budget; see [`part`](Self::part).
    pub fn part_of_evaluations(&mut self, evaluations: u64) -> Work<'a> {
        self.part(cost(self.tape).saturating_mul(evaluations))
    }

    /// Takes up to `steps` out of this budget as one of its own; [`give_back`](Self::give_back)
    /// returns what is not spent.
    pub fn part(&mut self, steps: u64) -> Work<'a> {
        let part = steps.min(self.left);
        self.left -= part;
        Work::new(self.tape, part)
    }

    pub fn give_back(&mut self, part: Work) {
        self.left += part.left;
    }

    pub fn values(&mut self, region: &[Interval; 3]) -> Interval {
        self.spend(1);
        self.tape.evaluate(&Values(region))
    }

    pub fn slopes(&mut self, region: &[Interval; 3]) -> Sloped {
        self.spend(GRADIENT_COST);
        self.tape.evaluate(&Slopes(region))
    }

    pub fn forms(&mut self, forms: &Forms) -> Interval {
        self.spend(1);
        self.tape.evaluate(forms).value
    }

    fn spend(&mut self, times: u64) {
        self.left = self.left.saturating_sub(cost(self.tape) * times);
    }
}

/// Returns the cost of one evaluation.
fn cost(tape: &Tape) -> u64 {
    tape.steps().len() as u64 + EVALUATION_COST
}
