//! Expressions that are no polynomials into formulas.

use super::make::{
    Function, MAX_EXPONENT, Make, Operator, Result, Trouble, of_constants, power_of_constants,
};
use crate::geom::formula::{Binary, Builder, Formula, Unary};
use crate::shared::rational::Rational;

#[derive(Clone, Debug)]
pub(super) enum Value {
    Constant(Rational),
    Step {
        step: u32,
        /// In x, y and z.
        is_polynomial: bool,
    },
}

/// Makes the steps.
#[derive(Debug, Default)]
pub(super) struct Maker {
    builder: Builder,
}

impl Maker {
    /// `None`: it is a polynomial.
    pub(super) fn finish(self, value: &Value) -> Option<Formula> {
        match value {
            Value::Step {
                step,
                is_polynomial: false,
            } => Some(self.builder.finish(*step)),
            _ => None,
        }
    }

    fn step(&mut self, value: &Value) -> Result<(u32, bool)> {
        Ok(match value {
            Value::Constant(constant) => (self.builder.constant(constant.rounded()?), true),
            Value::Step {
                step,
                is_polynomial,
            } => (*step, *is_polynomial),
        })
    }

    fn joined(&mut self, operator: Binary, a: &Value, b: &Value) -> Result<Value> {
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

    fn of_one(&mut self, function: Unary, a: &Value) -> Result<Value> {
        let (a, _) = self.step(a)?;
        Ok(Value::Step {
            step: self.builder.unary(function, a),
            is_polynomial: false,
        })
    }

    /// By a constant exponent; of one that is not whole e^(exponent · ln base).
    fn power(&mut self, base: &Value, exponent: &Rational) -> Result<Value> {
        let negative = exponent.clone().negated();
        let whole = [exponent, &negative].map(|x| x.as_exponent());
        let is_large = [exponent, &negative].iter().any(|x| x.is_large_exponent());
        let (step, is_polynomial) = self.step(base)?;
        match whole {
            _ if is_large => Err(Trouble::LargeExponent),
            [Some(exponent), _] | [_, Some(exponent)] if exponent > MAX_EXPONENT => {
                Err(Trouble::LargeExponent)
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
                self.joined(Binary::Quotient, &one, &power)
            }
            _ if exponent.equals(&Rational::of(0.5)) => self.of_one(Unary::Sqrt, base),
            _ => {
                let log = self.of_one(Unary::Ln, base)?;
                let exponent = Value::Constant(exponent.clone());
                let product = self.joined(Binary::Product, &exponent, &log)?;
                self.of_one(Unary::Exp, &product)
            }
        }
    }
}

impl Make for Maker {
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
            (Operator::Sum, _) => self.joined(Binary::Sum, &a, &b),
            (Operator::Difference, _) => self.joined(Binary::Difference, &a, &b),
            (Operator::Product, _) => self.joined(Binary::Product, &a, &b),
            (Operator::Quotient, Value::Constant(by)) => {
                // That it is not 0 is seen to.
                Rational::whole(1).over(by)?;
                self.joined(Binary::Quotient, &a, &b)
            }
            (Operator::Quotient, _) => self.joined(Binary::Quotient, &a, &b),
            (Operator::Power, Value::Constant(exponent)) => self.power(&a, exponent),
            (Operator::Power, _) => Err(Trouble::NoExponent),
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
            return Ok(Value::Constant(of_constants(function, &constants)?));
        }
        let operator = match function {
            Function::Unary(function) => return self.of_one(function, &operands[0]),
            Function::Min => Binary::Min,
            Function::Max => Binary::Max,
        };
        let mut best = operands[0].clone();
        for other in &operands[1..] {
            best = self.joined(operator, &best, other)?;
        }
        Ok(best)
    }
}
