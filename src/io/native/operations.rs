//! The operations that the parser of expressions asks for, implemented for polynomials in
//! `polynomial.rs` and for formulas in `formula.rs`.

use crate::geom::formula::{Real, Unary};
use crate::shared::rational::{NoConstant, Rational};
use num_bigint::Sign;

/// Limit on the exponents of constants and formulas; a polynomial has its limit on degree.
pub(super) const MAX_EXPONENT: u32 = 4096;

/// The binary operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operator {
    Sum,
    Difference,
    Product,
    Quotient,
    Power,
}

impl Operator {
    /// Names the result of the operator for messages.
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

/// The functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Function {
    /// A function of one operand.
    Unary(Unary),
    /// The least of two or more operands.
    Min,
    /// The greatest of two or more operands.
    Max,
}

/// The functions and their names.
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

/// The reasons why an operation has no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OperationError {
    /// A constant is out of range or does not exist.
    Constant(NoConstant),
    /// The polynomial has this degree, which is beyond the limit.
    Degree(u32),
    /// The result is no polynomial.
    NotPolynomial,
    /// The exponent is a number beyond the limit.
    LargeExponent,
    /// The exponent depends on x, y or z.
    NoExponent,
    /// The function has no value at this constant.
    Undefined,
}

impl From<NoConstant> for OperationError {
    fn from(why: NoConstant) -> OperationError {
        OperationError::Constant(why)
    }
}

pub(super) type Result<T> = std::result::Result<T, OperationError>;

/// A builder of values of one kind, polynomials or formulas.
pub(super) trait Operations {
    type Value: Clone;

    /// Makes a constant.
    fn constant(&mut self, value: Rational) -> Self::Value;
    /// Makes x, y or z.
    fn coordinate(&mut self, axis: u8) -> Self::Value;
    /// Makes −a.
    fn negated(&mut self, a: Self::Value) -> Self::Value;
    /// Applies an operator.
    fn binary(&mut self, operator: Operator, a: Self::Value, b: Self::Value)
    -> Result<Self::Value>;
    /// Applies a function to its operands, of which the parser has checked the number.
    fn call(&mut self, function: Function, operands: Vec<Self::Value>) -> Result<Self::Value>;
}

/// Applies a function to constants. Square roots and absolute values are as exact as
/// [`Rational`] keeps them, least and greatest values are exact, and other functions are
/// computed in f64 of the nearest f64.
pub(super) fn apply_to_constants(function: Function, operands: &[&Rational]) -> Result<Rational> {
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
        Function::Unary(function) => from_f64(first.rounded()?.unary(function)),
    }
}

/// Raises a constant to a constant power, exactly if the exponent is an integer, else in f64
/// of the nearest f64.
pub(super) fn power_of_constants(base: &Rational, exponent: &Rational) -> Result<Rational> {
    let whole = |exponent: &Rational| match exponent.as_exponent() {
        Some(exponent) if exponent > MAX_EXPONENT => Err(OperationError::LargeExponent),
        _ if exponent.is_large_exponent() => Err(OperationError::LargeExponent),
        exponent => Ok(exponent),
    };
    if let Some(exponent) = whole(exponent)? {
        return Ok(base.to_the(exponent)?);
    }
    if let Some(exponent) = whole(&exponent.clone().negated())? {
        return Ok(Rational::whole(1).over(&base.to_the(exponent)?)?);
    }
    from_f64(libm::pow(base.rounded()?, exponent.rounded()?))
}

/// Converts the result of a function of f64; fails if it is infinite or NaN.
fn from_f64(value: f64) -> Result<Rational> {
    if value.is_nan() {
        return Err(OperationError::Undefined);
    }
    if value.is_infinite() {
        return Err(NoConstant::TooLarge.into());
    }
    Ok(Rational::from_f64(value))
}
