//! Tapes and formulas as expressions, and whether these read back to the same steps.

use crate::geom::formula::{Binary, Formula, Step as FormulaStep};
use crate::geom::tape::{Step, Tape};
use crate::native::expression::{Parameters, Surface, surface};
use std::collections::HashMap;

/// Limit on the bytes of an expression, whose shared steps are written out at each use; that of
/// the parser.
const LONGEST: usize = 1 << 16;

/// An equation as text.
#[derive(Clone, Debug)]
pub(super) struct Equation {
    pub text: String,
    /// Whether it reads back to the same steps, in any order, so that every value has the same bits.
    pub is_same: bool,
}

/// Writes a polynomial; `None` if it is too long.
pub(super) fn of_tape(tape: &Tape) -> Option<Equation> {
    let mut all: Vec<String> = Vec::new();
    for step in tape.steps() {
        let of = |i: u32| &*all[i as usize];
        let text = match *step {
            Step::Coordinate(axis) => coordinate(axis),
            Step::Constant(value) => constant(value),
            Step::Sum(a, b) => format!("({} + {})", of(a), of(b)),
            Step::Difference(a, b) => format!("({} - {})", of(a), of(b)),
            Step::Product(a, b) if a == b => format!("{}^2", atom(of(a))),
            Step::Product(a, b) => format!("({}*{})", of(a), of(b)),
            Step::Scaled(a, by) => format!("({}*{})", constant(by), of(a)),
        };
        if text.len() > LONGEST {
            return None;
        }
        all.push(text);
    }
    let text = bare(all.pop()?);
    match surface(&text, &Parameters::new()) {
        Ok(Surface::Polynomial(read)) => {
            let mut known = HashMap::new();
            let [read, own] = [&read, tape].map(|tape| last_step(tape, &mut known));
            let is_same = read == own;
            Some(Equation { text, is_same })
        }
        _ => None,
    }
}

/// Numbers a tape's last step by what it computes, so that equal ones of several tapes have one
/// number.
fn last_step(tape: &Tape, known: &mut HashMap<(u8, u64, u64), u32>) -> u32 {
    let mut numbers: Vec<u32> = Vec::with_capacity(tape.steps().len());
    for step in tape.steps() {
        let of = |i: u32| numbers[i as usize];
        let step = match *step {
            Step::Sum(a, b) => Step::Sum(of(a).min(of(b)), of(a).max(of(b))),
            Step::Difference(a, b) => Step::Difference(of(a), of(b)),
            Step::Product(a, b) => Step::Product(of(a).min(of(b)), of(a).max(of(b))),
            Step::Scaled(a, by) => Step::Scaled(of(a), by),
            Step::Coordinate(_) | Step::Constant(_) => *step,
        };
        let next = known.len() as u32;
        numbers.push(*known.entry(step.key()).or_insert(next));
    }
    numbers.last().copied().unwrap_or(u32::MAX)
}

/// Writes a formula; `None` if it is too long.
pub(super) fn of_formula(formula: &Formula) -> Option<Equation> {
    let mut all: Vec<String> = Vec::new();
    for step in formula.steps() {
        let of = |i: u32| &*all[i as usize];
        let text = match *step {
            FormulaStep::Coordinate(axis) => coordinate(axis),
            FormulaStep::Constant(value) => constant(value),
            FormulaStep::Power(a, exponent) => format!("{}^{exponent}", atom(of(a))),
            FormulaStep::Unary(function, a) => format!("{}({})", function.name(), of(a)),
            FormulaStep::Binary(operator, a, b) => {
                let (a, b) = (of(a), of(b));
                match operator {
                    Binary::Sum => format!("({a} + {b})"),
                    Binary::Difference => format!("({a} - {b})"),
                    Binary::Product => format!("({a}*{b})"),
                    Binary::Quotient => format!("({a}/{b})"),
                    Binary::Min => format!("min({a}, {b})"),
                    Binary::Max => format!("max({a}, {b})"),
                }
            }
        };
        if text.len() > LONGEST {
            return None;
        }
        all.push(text);
    }
    let text = bare(all.pop()?);
    match surface(&text, &Parameters::new()) {
        Ok(Surface::Formula(read)) => {
            let is_same = read == *formula;
            Some(Equation { text, is_same })
        }
        _ => None,
    }
}

fn coordinate(axis: u8) -> String {
    ["x", "y", "z"][usize::from(axis)].into()
}

fn constant(value: f64) -> String {
    if value < 0.0 {
        format!("(-{:?})", -value)
    } else {
        format!("{value:?}")
    }
}

/// Puts what is a power already in parentheses.
fn atom(text: &str) -> String {
    match text.ends_with(')') && text.starts_with('(') || text.len() == 1 {
        true => text.into(),
        false => format!("({text})"),
    }
}

/// Takes the parentheses off a whole expression, which are its first and last character if they
/// belong together.
fn bare(text: String) -> String {
    let mut depth = 0;
    let closes = text.char_indices().find_map(|(i, c)| {
        depth += match c {
            '(' => 1,
            ')' => -1,
            _ => 0,
        };
        (depth == 0).then_some(i)
    });
    match text.starts_with('(') && closes == Some(text.len() - 1) {
        true => text[1..text.len() - 1].into(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expressions_come_back() {
        for text in [
            "x^2 + y^2 - 0.1*z",
            "(x^2 + 9/4*y^2 + z^2 - 1)^3 - x^2*z^3 - 9/80*y^2*z^3",
            "(x - y)^3*(x + 1e-9)",
            "sin(x)*cos(y) + sqrt(2)*z",
            "max(abs(x) - 1, y^3/(1 + x^2))",
            "(sin(x)^2)^3 - 2.5",
        ] {
            let written = match surface(text, &Parameters::new()).unwrap() {
                Surface::Polynomial(tape) => of_tape(&tape),
                Surface::Formula(formula) => of_formula(&formula),
            };
            assert!(written.is_some_and(|written| written.is_same), "{text}");
        }
    }
}
