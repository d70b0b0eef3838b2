//! What expressions are made into: the operations that the parser asks for, of polynomials
//! (`polynomial.rs`) and of formulas (`formula.rs`).

use crate::geom::formula::{Real, Unary};
use crate::shared::rational::{NoConstant, Rational};
use num_bigint::Sign;

/// Of a constant, and of what is no polynomial.
pub(super) const MAX_EXPONENT: u32 = 4096;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operator {
    Sum,
    Difference,
    Product,
    Quotient,
    Power,
}

impl Operator {
    /// As messages call what it gives.
    pub(super) fn result(self) -> &'static str {
        match self {
            Operator::Sum => "sum",
            Operator::Difference => "difference",
            Operator::Product => "product",
            Operator::Quotient => "quotient",
            Operator::Power => "power",
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Function {
    /// Of one operand.
    Unary(Unary),
    /// Of two and more.
    Min,
    Max,
}

/// By name.
pub(super) const FUNCTIONS: [(&str, Function); 15] = [
    ("sqrt", Function::Unary(Unary::Sqrt)),
    ("abs", Function::Unary(Unary::Abs)),
    ("exp", Function::Unary(Unary::Exp)),
    ("ln", Function::Unary(Unary::Ln)),
    ("sin", Function::Unary(Unary::Sin)),
    ("cos", Function::Unary(Unary::Cos)),
    ("tan", Function::Unary(Unary::Tan)),
    ("asin", Function::Unary(Unary::Asin)),
    ("acos", Function::Unary(Unary::Acos)),
    ("atan", Function::Unary(Unary::Atan)),
    ("sinh", Function::Unary(Unary::Sinh)),
    ("cosh", Function::Unary(Unary::Cosh)),
    ("tanh", Function::Unary(Unary::Tanh)),
    ("min", Function::Min),
    ("max", Function::Max),
];

/// What cannot be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trouble {
    Constant(NoConstant),
    /// Larger than polynomials may have.
    Degree(u32),
    /// Not of polynomials.
    NotPolynomial,
    /// A number, and too large for one.
    LargeExponent,
    /// With x, y or z in it.
    NoExponent,
    /// A function has no value at this constant.
    Undefined,
}

impl From<NoConstant> for Trouble {
    fn from(why: NoConstant) -> Trouble {
        Trouble::Constant(why)
    }
}

pub(super) type Result<T> = std::result::Result<T, Trouble>;

/// Makes values of one kind.
pub(super) trait Make {
    type Value: Clone;

    fn constant(&mut self, value: Rational) -> Self::Value;
    fn coordinate(&mut self, axis: u8) -> Self::Value;
    fn negated(&mut self, a: Self::Value) -> Self::Value;
    fn binary(&mut self, operator: Operator, a: Self::Value, b: Self::Value)
    -> Result<Self::Value>;
    /// Of as many operands as it has, one at least.
    fn call(&mut self, function: Function, operands: Vec<Self::Value>) -> Result<Self::Value>;
}

/// Of constants: exact where roots and magnitudes are, else of the nearest f64.
pub(super) fn of_constants(function: Function, operands: &[&Rational]) -> Result<Rational> {
    let first = operands[0];
    let pick = |better: Sign| {
        let mut best = first;
        for other in &operands[1..] {
            if other.plus(&best.clone().negated())?.sign() == better {
                best = other;
            }
        }
        Ok(best.clone())
    };
    match function {
        Function::Min => pick(Sign::Minus),
        Function::Max => pick(Sign::Plus),
        Function::Unary(Unary::Sqrt) => Ok(first.root()?),
        Function::Unary(Unary::Abs) => Ok(first.clone().magnitude()),
        Function::Unary(function) => of_f64(first.rounded()?.unary(function)),
    }
}

/// A power of constants: exact where the exponent is whole, else of the nearest f64.
pub(super) fn power_of_constants(base: &Rational, exponent: &Rational) -> Result<Rational> {
    let whole = |exponent: &Rational| match exponent.as_exponent() {
        Some(exponent) if exponent > MAX_EXPONENT => Err(Trouble::LargeExponent),
        _ if exponent.is_large_exponent() => Err(Trouble::LargeExponent),
        exponent => Ok(exponent),
    };
    if let Some(exponent) = whole(exponent)? {
        return Ok(base.to_the(exponent)?);
    }
    if let Some(exponent) = whole(&exponent.clone().negated())? {
        return Ok(Rational::whole(1).over(&base.to_the(exponent)?)?);
    }
    of_f64(libm::pow(base.rounded()?, exponent.rounded()?))
}

fn of_f64(value: f64) -> Result<Rational> {
    if value.is_nan() {
        return Err(Trouble::Undefined);
    }
    if value.is_infinite() {
        return Err(NoConstant::TooLarge.into());
    }
    Ok(Rational::of(value))
}
