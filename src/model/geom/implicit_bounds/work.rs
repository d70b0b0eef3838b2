//! What the search for bounds may cost, and what has been spent.

use super::values::{Forms, Sloped, Slopes, Values};
use crate::geom::Tape;
use crate::math::Interval;

/// Gradients cost so many times what values do: seven products for one.
const GRADIENT_COST: u64 = 6;
/// What an evaluation costs beside its steps, in steps.
const EVALUATION_COST: u64 = 8;

/// A tape, and how often it may still be evaluated.
pub(super) struct Work<'a> {
    pub tape: &'a Tape,
    /// In steps of tapes; of a part of the search.
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

    /// For so many evaluations.
    pub fn of_evaluations(tape: &Tape, evaluations: u64) -> Work<'_> {
        Work::new(tape, cost(tape).saturating_mul(evaluations))
    }

    /// Up to so many evaluations of what is left; see [`part`](Self::part).
    pub fn part_of_evaluations(&mut self, evaluations: u64) -> Work<'a> {
        self.part(cost(self.tape).saturating_mul(evaluations))
    }

    /// Up to `steps` of what is left, as a budget of its own; what of it is not spent
    /// comes back with [`give_back`](Self::give_back).
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

/// Of one evaluation.
fn cost(tape: &Tape) -> u64 {
    tape.steps().len() as u64 + EVALUATION_COST
}
