//! Formulas: functions of x, y, z that are no polynomials, as tapes of steps with quotients,
//! roots, sines and so on.
//!
//! The last step is the function. A formula stands for its real value on f64 constants; where a
//! step has no value (the root of a negative number), the formula has none. Elementary functions
//! are those of the crate libm, in plain Rust, so that f64 values have the same bits on every
//! machine.

mod border;
mod bounds;
mod dual;
mod maker;
mod real;
mod search;

pub use border::{Border, border};
pub use bounds::bounds_of;
pub use dual::Dual;
pub use maker::Builder;
pub use real::{Range, Real};
pub use search::{Change, Search, SearchScratch, changes};

use crate::math::lanes::Lanes;
use crate::math::{Interval, Vec3};
use smallvec::{SmallVec, smallvec};

/// The most steps of one formula.
pub const MAX_STEPS: usize = 4096;

/// A function of one operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unary {
    Abs,
    Sqrt,
    Exp,
    Ln,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
}

impl Unary {
    /// Returns the name that scene files and POV-Ray have for the function.
    pub fn name(self) -> &'static str {
        match self {
            Unary::Abs => "abs",
            Unary::Sqrt => "sqrt",
            Unary::Exp => "exp",
            Unary::Ln => "ln",
            Unary::Sin => "sin",
            Unary::Cos => "cos",
            Unary::Tan => "tan",
            Unary::Asin => "asin",
            Unary::Acos => "acos",
            Unary::Atan => "atan",
            Unary::Sinh => "sinh",
            Unary::Cosh => "cosh",
            Unary::Tanh => "tanh",
        }
    }
}

/// A function of two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binary {
    Sum,
    /// The first operand minus the second.
    Difference,
    Product,
    Quotient,
    /// The lesser operand.
    Min,
    /// The greater operand.
    Max,
}

/// A step of a formula; its operands are numbers of earlier steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// The coordinate x, y or z: 0, 1 or 2.
    Coordinate(u8),
    Constant(f64),
    /// An operand to a whole power ≥ 2.
    Power(u32, u32),
    Unary(Unary, u32),
    Binary(Binary, u32, u32),
}

/// A function of x, y and z.
#[derive(Clone, Debug, PartialEq)]
pub struct Formula {
    steps: Vec<Step>,
}

impl Formula {
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    pub fn bytes(&self) -> usize {
        self.steps.len() * size_of::<Step>()
    }

    /// Makes a place for the value of each step.
    #[inline(always)]
    pub fn values<R: Real>(&self) -> Values<R> {
        smallvec![R::constant(0.0); self.steps.len()]
    }

    /// Evaluates the formula at a point in any arithmetic; `kept` gets the value of each
    /// step.
    #[inline(always)]
    pub fn evaluate<R: Real>(&self, at: &[R; 3], kept: &mut [R]) -> R {
        let kept = &mut kept[..self.steps.len()];
        for (i, step) in self.steps.iter().enumerate() {
            let of = |i: u32| kept[i as usize];
            kept[i] = match *step {
                Step::Coordinate(axis) => at[usize::from(axis)],
                Step::Constant(value) => R::constant(value),
                Step::Power(a, exponent) => of(a).power(exponent),
                Step::Unary(function, a) => of(a).unary(function),
                Step::Binary(operator, a, b) => of(a).binary(operator, of(b)),
            };
        }
        kept.last().copied().unwrap_or(R::constant(0.0))
    }
}

/// A value and its gradient.
type Sloped = Dual<f64, 3>;

/// The values of a formula's steps: on the stack, unless there are more than 64.
pub type Values<R> = SmallVec<[R; 64]>;

/// Evaluates a formula and its gradient at a point, in f64.
pub fn value_and_gradient(formula: &Formula, p: [f64; 3]) -> (f64, [f64; 3]) {
    gradient_with(formula, p, &mut formula.values())
}

fn gradient_with(formula: &Formula, p: [f64; 3], kept: &mut [Sloped]) -> (f64, [f64; 3]) {
    let at = std::array::from_fn(|axis| Dual::variable(p[axis], axis));
    let Dual { value, slopes } = formula.evaluate(&at, kept);
    (value, slopes)
}

/// Evaluates a formula and its gradient at one point per lane.
pub fn values_at<D: Lanes<Scalar = f64>>(formula: &Formula, p: Vec3<D>) -> (D, Vec3<D>) {
    let mut values = D::zero();
    let mut gradients = [[0.0; 3]; 16];
    let mut kept = formula.values();
    for (i, gradient) in gradients.iter_mut().enumerate().take(D::COUNT) {
        let (value, slopes) = gradient_with(formula, lane(&p, i), &mut kept);
        values = values.with_lane(i, value);
        *gradient = slopes;
    }
    (values, Vec3::of_lanes(|i| gradients[i]))
}

/// Bounds in each lane how much f may change within the rounding of the point's coordinates to f64
/// (V11, docs/numerics/level-sets.md).
pub fn blur_at<D: Lanes<Scalar = f64>>(formula: &Formula, p: Vec3<D>) -> D {
    let mut kept = formula.values();
    let mut blur = D::zero();
    for i in 0..D::COUNT {
        let at = lane(&p, i).map(|x| Range::new(Interval::around(x)));
        let values = formula.evaluate(&at, &mut kept).values;
        blur = blur.with_lane(i, values.width());
    }
    blur
}

fn lane<D: Lanes<Scalar = f64>>(p: &Vec3<D>, i: usize) -> [f64; 3] {
    [p.x.lane(i), p.y.lane(i), p.z.lane(i)]
}

#[cfg(test)]
mod tests;
