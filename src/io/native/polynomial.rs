//! Builder of polynomial tapes that folds constants on the way.
//!
//! A value is factor · step + constant, where the step is one of a tape. So a value that is
//! multiplied by constants stays one step with one factor, a sum has one constant, and a
//! subtracted term becomes a difference. Factors and constants are folded as [`Rational`];
//! each is rounded to f64 once, when a sum or the end of the expression needs it as a step.

use super::operations::{
    Function, OperationError, Operations, Operator, Result, apply_to_constants, power_of_constants,
};
use crate::geom::tape::{Builder, MAX_DEGREE, Tape};
use crate::shared::rational::Rational;
use num_bigint::Sign;

/// A step of the tape and a bound on its degree.
#[derive(Clone, Copy, Debug)]
struct Part {
    step: u32,
    /// An upper bound of the step's degree.
    degree: u32,
}

/// A polynomial: factor · step + constant.
#[derive(Clone, Debug)]
pub(super) struct Value {
    /// The factor of the step, not 0.
    factor: Rational,
    /// The step; `None` if the polynomial is a constant.
    part: Option<Part>,
    constant: Rational,
}

impl Value {
    fn constant(constant: Rational) -> Value {
        Value {
            factor: Rational::whole(1),
            part: None,
            constant,
        }
    }

    /// The polynomial factor · step.
    fn multiple(factor: Rational, part: Part) -> Value {
        Value {
            factor,
            part: Some(part),
            constant: Rational::whole(0),
        }
    }

    /// Returns the constant; fails if the polynomial is none.
    fn as_constant(&self) -> Result<&Rational> {
        match self.part {
            None => Ok(&self.constant),
            Some(_) => Err(OperationError::NotPolynomial),
        }
    }

    fn negated(self) -> Value {
        Value {
            factor: self.factor.negated(),
            constant: self.constant.negated(),
            ..self
        }
    }
}

/// The builder of a polynomial tape.
#[derive(Debug, Default)]
pub(super) struct PolynomialBuilder {
    builder: Builder,
}

impl Operations for PolynomialBuilder {
    type Value = Value;

    fn constant(&mut self, value: Rational) -> Value {
        Value::constant(value)
    }

    fn coordinate(&mut self, axis: u8) -> Value {
        let step = self.builder.coordinate(axis);
        Value::multiple(Rational::whole(1), Part { step, degree: 1 })
    }

    fn negated(&mut self, a: Value) -> Value {
        a.negated()
    }

    fn binary(&mut self, operator: Operator, a: Value, b: Value) -> Result<Value> {
        match operator {
            Operator::Sum => self.sum(a, b),
            Operator::Difference => self.sum(a, b.negated()),
            Operator::Product => self.product(a, b),
            Operator::Quotient => self.quotient(a, &b),
            Operator::Power => {
                let exponent = b.as_constant()?;
                if let Ok(base) = a.as_constant() {
                    return Ok(Value::constant(power_of_constants(base, exponent)?));
                }
                match exponent.as_exponent() {
                    Some(exponent) => self.power(a, exponent),
                    None if exponent.is_large_exponent() => Err(OperationError::LargeExponent),
                    None => Err(OperationError::NotPolynomial),
                }
            }
        }
    }

    fn call(&mut self, function: Function, operands: Vec<Value>) -> Result<Value> {
        let constants: Result<Vec<&Rational>> = operands.iter().map(Value::as_constant).collect();
        Ok(Value::constant(apply_to_constants(function, &constants?)?))
    }
}

impl PolynomialBuilder {
    fn sum(&mut self, a: Value, b: Value) -> Result<Value> {
        let constant = a.constant.plus(&b.constant)?;
        let (factor, part) = match (a.part, b.part) {
            (Some(p), Some(q)) => match self.add_multiples((a.factor, p), (b.factor, q))? {
                Some((factor, part)) => (factor, Some(part)),
                None => (Rational::whole(1), None),
            },
            (None, part) => (b.factor, part),
            (part, None) => (a.factor, part),
        };
        Ok(Value {
            factor,
            part,
            constant,
        })
    }

    /// Multiplies; fails if the degree is beyond the limit.
    fn product(&mut self, a: Value, b: Value) -> Result<Value> {
        if a.part.is_none() {
            return self.scale(&a.constant, b);
        }
        if b.part.is_none() {
            return self.scale(&b.constant, a);
        }
        let (Some((c, p)), Some((d, q))) = (self.as_multiple(a)?, self.as_multiple(b)?) else {
            return Ok(Value::constant(Rational::whole(0)));
        };
        let degree = check_degree(p.degree.saturating_add(q.degree))?;
        let step = self.builder.product(p.step, q.step);
        Ok(Value::multiple(c.times(&d)?, Part { step, degree }))
    }

    /// Divides; fails unless `b` is a constant other than 0.
    fn quotient(&mut self, a: Value, b: &Value) -> Result<Value> {
        let inverse = Rational::whole(1).over(b.as_constant()?)?;
        self.scale(&inverse, a)
    }

    /// Raises to a power; fails if the degree is beyond the limit.
    fn power(&mut self, base: Value, exponent: u32) -> Result<Value> {
        if exponent == 1 {
            return Ok(base);
        }
        let multiple = self.as_multiple(base)?.filter(|_| exponent > 0);
        let Some((factor, part)) = multiple else {
            return Ok(Value::constant(Rational::whole(i64::from(exponent == 0))));
        };
        let degree = check_degree(part.degree.saturating_mul(exponent))?;
        let step = self.builder.power(part.step, exponent);
        Ok(Value::multiple(
            factor.to_the(exponent)?,
            Part { step, degree },
        ))
    }

    /// Ends the tape with a value; fails if a constant cannot be rounded to f64.
    pub(super) fn finish(mut self, value: Value) -> Result<Tape> {
        let last = match value.part {
            None => self.builder.constant(value.constant.rounded()?),
            Some(_) => match self.as_multiple(value)? {
                None => self.builder.constant(0.0),
                Some((factor, part)) if factor.is_one() => part.step,
                Some((factor, part)) if factor.clone().negated().is_one() => {
                    self.builder.negated(part.step)
                }
                Some((factor, part)) => {
                    let factor = self.builder.constant(factor.rounded()?);
                    self.builder.product(factor, part.step)
                }
            },
        };
        Ok(self.builder.finish(last))
    }

    /// Multiplies by a constant.
    fn scale(&mut self, by: &Rational, value: Value) -> Result<Value> {
        if value.part.is_none() {
            return Ok(Value::constant(value.constant.times(by)?));
        }
        if by.is_zero() {
            return Ok(Value::constant(Rational::whole(0)));
        }
        if by.is_one() {
            return Ok(value);
        }
        // A product of a constant and a sum stays a product, instead of a sum of products.
        match self.as_multiple(value)? {
            Some((factor, part)) => Ok(Value::multiple(factor.times(by)?, part)),
            None => Ok(Value::constant(Rational::whole(0))),
        }
    }

    /// Turns a value into a multiple of one step; `None` if it is 0.
    fn as_multiple(&mut self, value: Value) -> Result<Option<(Rational, Part)>> {
        let one = Part {
            step: self.builder.constant(1.0),
            degree: 0,
        };
        match value.part {
            None if value.constant.is_zero() => Ok(None),
            None => Ok(Some((value.constant, one))),
            Some(part) if value.constant.is_zero() => Ok(Some((value.factor, part))),
            Some(part) => self.add_multiples((value.factor, part), (value.constant, one)),
        }
    }

    /// Adds two multiples of steps; `None` if the sum is 0.
    fn add_multiples(
        &mut self,
        (c, p): (Rational, Part),
        (d, q): (Rational, Part),
    ) -> Result<Option<(Rational, Part)>> {
        if p.step == q.step {
            let factor = c.plus(&d)?;
            return Ok(Some((factor, p)).filter(|(factor, _)| !factor.is_zero()));
        }
        let signs = [c.sign(), d.sign()];
        let [c, d] = [c.magnitude(), d.magnitude()];
        let (common, p_step, q_step) = match c.equals(&d) {
            true => (c, p.step, q.step),
            false => (
                Rational::whole(1),
                self.product_step(&c, p.step)?,
                self.product_step(&d, q.step)?,
            ),
        };
        let step = match signs {
            [Sign::Minus, Sign::Plus] => self.builder.difference(q_step, p_step),
            [Sign::Plus, Sign::Minus] => self.builder.difference(p_step, q_step),
            _ => self.builder.sum(p_step, q_step),
        };
        if self.builder.value(step) == Some(0.0) {
            return Ok(None);
        }
        let common = match signs {
            [Sign::Minus, Sign::Minus] => common.negated(),
            _ => common,
        };
        let degree = p.degree.max(q.degree);
        Ok(Some((common, Part { step, degree })))
    }

    /// Makes the step factor · step.
    fn product_step(&mut self, factor: &Rational, step: u32) -> Result<u32> {
        if factor.is_one() {
            return Ok(step);
        }
        let factor = self.builder.constant(factor.rounded()?);
        Ok(self.builder.product(factor, step))
    }
}

/// Checks a degree against the limit.
fn check_degree(degree: u32) -> Result<u32> {
    match degree {
        0..=MAX_DEGREE => Ok(degree),
        _ => Err(OperationError::Degree(degree)),
    }
}
