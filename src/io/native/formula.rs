//! Builder of formulas, for expressions that are no polynomials.

use super::operations::{
    Function, MAX_EXPONENT, OperationError, Operations, Operator, Result, apply_to_constants,
    power_of_constants,
};
use crate::geom::formula::{Binary, Builder, Formula, Unary};
use crate::shared::rational::Rational;

/// A constant, or a step of the formula.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Constant(Rational),
    Step {
        step: u32,
        /// Whether the value is a polynomial in x, y and z.
        is_polynomial: bool,
    },
}

/// The builder of a formula.
#[derive(Debug, Default)]
pub(super) struct FormulaBuilder {
    builder: Builder,
}

impl FormulaBuilder {
    /// Ends the formula with a value; `None` if the value is a polynomial.
    pub(super) fn finish(self, value: &Value) -> Option<Formula> {
        match value {
            Value::Step {
                step,
                is_polynomial: false,
            } => Some(self.builder.finish(*step)),
            _ => None,
        }
    }

    /// Returns the step of a value and whether it is a polynomial; a constant becomes a step.
    fn step(&mut self, value: &Value) -> Result<(u32, bool)> {
        Ok(match value {
            Value::Constant(constant) => (self.builder.constant(constant.rounded()?), true),
            Value::Step {
                step,
                is_polynomial,
            } => (*step, *is_polynomial),
        })
    }

    /// Applies an operator of formulas.
    fn apply_binary(&mut self, operator: Binary, a: &Value, b: &Value) -> Result<Value> {
        let ((a, first), (b, second)) = (self.step(a)?, self.step(b)?);
        let step = self.builder.binary(operator, a, b);
        let is_whole = match operator {
            Binary::Min | Binary::Max => false,
            Binary::Quotient => self.builder.value(b).is_some(),
            _ => true,
        };
        Ok(Value::Step {
            step,
            is_polynomial: first && second && is_whole,
        })
    }

    /// Applies a function of one operand.
    fn apply_unary(&mut self, function: Unary, a: &Value) -> Result<Value> {
        let (a, _) = self.step(a)?;
        Ok(Value::Step {
            step: self.builder.unary(function, a),
            is_polynomial: false,
        })
    }

    /// Raises to a constant power. If the exponent is neither an integer nor 1/2, the result
    /// is e^(exponent · ln base).
    fn power(&mut self, base: &Value, exponent: &Rational) -> Result<Value> {
        let negative = exponent.clone().negated();
        let whole = [exponent, &negative].map(|x| x.as_exponent());
        let is_large = [exponent, &negative].iter().any(|x| x.is_large_exponent());
        let (step, is_polynomial) = self.step(base)?;
        match whole {
            _ if is_large => Err(OperationError::LargeExponent),
            [Some(exponent), _] | [_, Some(exponent)] if exponent > MAX_EXPONENT => {
                Err(OperationError::LargeExponent)
            }
            [Some(exponent), _] => Ok(Value::Step {
                step: self.builder.power(step, exponent),
                is_polynomial,
            }),
            [_, Some(exponent)] => {
                let step = self.builder.power(step, exponent);
                let one = Value::Constant(Rational::whole(1));
                let power = Value::Step {
                    step,
                    is_polynomial,
                };
                self.apply_binary(Binary::Quotient, &one, &power)
            }
            _ if exponent.equals(&Rational::from_f64(0.5)) => self.apply_unary(Unary::Sqrt, base),
            _ => {
                let log = self.apply_unary(Unary::Ln, base)?;
                let exponent = Value::Constant(exponent.clone());
                let product = self.apply_binary(Binary::Product, &exponent, &log)?;
                self.apply_unary(Unary::Exp, &product)
            }
        }
    }
}

impl Operations for FormulaBuilder {
    type Value = Value;

    fn constant(&mut self, value: Rational) -> Value {
        Value::Constant(value)
    }

    fn coordinate(&mut self, axis: u8) -> Value {
        Value::Step {
            step: self.builder.coordinate(axis),
            is_polynomial: true,
        }
    }

    fn negated(&mut self, a: Value) -> Value {
        match a {
            Value::Constant(value) => Value::Constant(value.negated()),
            Value::Step {
                step,
                is_polynomial,
            } => {
                let zero = self.builder.constant(0.0);
                Value::Step {
                    step: self.builder.binary(Binary::Difference, zero, step),
                    is_polynomial,
                }
            }
        }
    }

    fn binary(&mut self, operator: Operator, a: Value, b: Value) -> Result<Value> {
        if let (Value::Constant(a), Value::Constant(b)) = (&a, &b) {
            return Ok(Value::Constant(match operator {
                Operator::Sum => a.plus(b)?,
                Operator::Difference => a.plus(&b.clone().negated())?,
                Operator::Product => a.times(b)?,
                Operator::Quotient => a.over(b)?,
                Operator::Power => power_of_constants(a, b)?,
            }));
        }
        match (operator, &b) {
            (Operator::Sum, _) => self.apply_binary(Binary::Sum, &a, &b),
            (Operator::Difference, _) => self.apply_binary(Binary::Difference, &a, &b),
            (Operator::Product, _) => self.apply_binary(Binary::Product, &a, &b),
            (Operator::Quotient, Value::Constant(by)) => {
                // This fails if the divisor is 0.
                Rational::whole(1).over(by)?;
                self.apply_binary(Binary::Quotient, &a, &b)
            }
            (Operator::Quotient, _) => self.apply_binary(Binary::Quotient, &a, &b),
            (Operator::Power, Value::Constant(exponent)) => self.power(&a, exponent),
            (Operator::Power, _) => Err(OperationError::NoExponent),
        }
    }

    fn call(&mut self, function: Function, operands: Vec<Value>) -> Result<Value> {
        let constant = |value: &'_ Value| match value {
            Value::Constant(value) => Some(value.clone()),
            Value::Step { .. } => None,
        };
        let constants: Option<Vec<Rational>> = operands.iter().map(constant).collect();
        if let Some(constants) = constants {
            let constants: Vec<&Rational> = constants.iter().collect();
            return Ok(Value::Constant(apply_to_constants(function, &constants)?));
        }
        let operator = match function {
            Function::Unary(function) => return self.apply_unary(function, &operands[0]),
            Function::Min => Binary::Min,
            Function::Max => Binary::Max,
        };
        let mut best = operands[0].clone();
        for other in &operands[1..] {
            best = self.apply_binary(operator, &best, other)?;
        }
        Ok(best)
    }
}
