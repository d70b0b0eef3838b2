//! Builder of formulas: equal steps are stored once, and operations on constants are folded.

use super::{Binary, Formula, Real, Step, Unary};
use std::collections::HashMap;

/// Builds a formula step by step.
#[derive(Clone, Debug, Default)]
pub struct Builder {
    steps: Vec<Step>,
    known: HashMap<(u8, u8, u64, u32), u32>,
}

impl Builder {
    pub fn coordinate(&mut self, axis: u8) -> u32 {
        self.push(Step::Coordinate(axis))
    }

    pub fn constant(&mut self, value: f64) -> u32 {
        // −0 becomes +0, so that there is one zero.
        self.push(Step::Constant(value + 0.0))
    }

    pub fn unary(&mut self, function: Unary, a: u32) -> u32 {
        match self.value(a) {
            Some(a) => self.constant(a.unary(function)),
            None => self.push(Step::Unary(function, a)),
        }
    }

    pub fn binary(&mut self, operator: Binary, a: u32, b: u32) -> u32 {
        let values = (self.value(a), self.value(b));
        match (operator, values) {
            (_, (Some(a), Some(b))) => self.constant(a.binary(operator, b)),
            (Binary::Sum, (Some(0.0), _)) | (Binary::Product, (Some(1.0), _)) => b,
            (Binary::Sum | Binary::Difference, (_, Some(0.0))) => a,
            (Binary::Product | Binary::Quotient, (_, Some(1.0))) => a,
            (Binary::Product, _) if a == b => self.power(a, 2),
            _ => self.push(Step::Binary(operator, a, b)),
        }
    }

    /// Adds a whole power.
    pub fn power(&mut self, a: u32, exponent: u32) -> u32 {
        match (exponent, self.value(a)) {
            (0, _) => self.constant(1.0),
            (1, _) => a,
            (_, Some(value)) => self.constant(value.power(exponent)),
            _ => self.push(Step::Power(a, exponent)),
        }
    }

    /// Returns the value of a step that is a constant.
    pub fn value(&self, step: u32) -> Option<f64> {
        match self.steps[step as usize] {
            Step::Constant(value) => Some(value),
            _ => None,
        }
    }

    pub fn len(&self) -> usize {
        self.steps.len()
    }

    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// Returns the formula whose last step is `last`, without the steps that it does not need.
    pub fn finish(self, last: u32) -> Formula {
        let mut needed = vec![false; last as usize + 1];
        needed[last as usize] = true;
        for i in (0..=last as usize).rev().filter(|i| self.steps.len() > *i) {
            if needed[i] {
                for operand in operands(&self.steps[i]).into_iter().flatten() {
                    needed[operand as usize] = true;
                }
            }
        }
        let mut place = vec![0; last as usize + 1];
        let mut steps = Vec::new();
        for i in (0..=last as usize).filter(|i| needed[*i]) {
            place[i] = steps.len() as u32;
            let of = |operand: u32| place[operand as usize];
            steps.push(match self.steps[i] {
                Step::Power(a, exponent) => Step::Power(of(a), exponent),
                Step::Unary(function, a) => Step::Unary(function, of(a)),
                Step::Binary(operator, a, b) => Step::Binary(operator, of(a), of(b)),
                leaf => leaf,
            });
        }
        Formula { steps }
    }

    fn push(&mut self, step: Step) -> u32 {
        let next = self.steps.len() as u32;
        let place = *self.known.entry(key(&step)).or_insert(next);
        if place == next {
            self.steps.push(step);
        }
        place
    }
}

/// Returns a key that is the same for equal steps only.
fn key(step: &Step) -> (u8, u8, u64, u32) {
    match *step {
        Step::Coordinate(axis) => (0, axis, 0, 0),
        Step::Constant(value) => (1, 0, value.to_bits(), 0),
        Step::Power(a, exponent) => (2, 0, u64::from(a), exponent),
        Step::Unary(function, a) => (3, function as u8, u64::from(a), 0),
        Step::Binary(operator, a, b) => (4, operator as u8, u64::from(a), b),
    }
}

fn operands(step: &Step) -> [Option<u32>; 2] {
    match *step {
        Step::Coordinate(_) | Step::Constant(_) => [None; 2],
        Step::Power(a, _) | Step::Unary(_, a) => [Some(a), None],
        Step::Binary(_, a, b) => [Some(a), Some(b)],
    }
}
