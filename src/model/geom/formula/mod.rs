//! Functions of x, y, z that are no polynomials, as steps: quotients, roots, sines and
//! so on of what polynomials are made of.
//!
//! The last step is the function. Its real value on f64 constants is what a formula *is*;
//! where a step has no value (the root of a negative number), neither has the whole.
//! Elementary functions are those of the crate libm, in plain Rust, so that a formula's
//! f64 values have the same bits on every machine.

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
pub use search::{Change, Search, changes};

use crate::math::lanes::Lanes;
use crate::math::{Interval, Vec3};
use std::cell::Cell;

/// Of one formula.
pub const MAX_STEPS: usize = 4096;

/// Of one operand.
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

/// Of two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binary {
    Sum,
    /// The first less the second.
    Difference,
    Product,
    Quotient,
    /// The lesser and the greater of two.
    Min,
    Max,
}

/// Operands are numbers of earlier steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// x, y or z: 0, 1 or 2.
    Coordinate(u8),
    Constant(f64),
    /// To a whole power, 2 at least.
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

    /// In any arithmetic; `kept` gets the value of each step.
    #[inline(always)]
    pub fn evaluate<R: Real>(&self, at: &[R; 3], kept: &mut Vec<R>) -> R {
        kept.clear();
        for step in &self.steps {
            let of = |i: u32| kept[i as usize];
            kept.push(match *step {
                Step::Coordinate(axis) => at[usize::from(axis)],
                Step::Constant(value) => R::constant(value),
                Step::Power(a, exponent) => of(a).power(exponent),
                Step::Unary(function, a) => of(a).unary(function),
                Step::Binary(operator, a, b) => of(a).binary(operator, of(b)),
            });
        }
        kept.last().copied().unwrap_or(R::constant(0.0))
    }
}

/// A value and its rates of change along the axes.
type Sloped = Dual<f64, 3>;

thread_local! {
    static KEPT: Cell<Option<Vec<Sloped>>> = const { Cell::new(None) };
    static BOUNDS: Cell<Option<Vec<Range>>> = const { Cell::new(None) };
}

/// In f64: the value and the gradient, at a point.
pub fn value_and_gradient(formula: &Formula, p: [f64; 3]) -> (f64, [f64; 3]) {
    let mut kept = KEPT.take().unwrap_or_default();
    let at = std::array::from_fn(|axis| Dual::variable(p[axis], axis));
    let Dual { value, slopes } = formula.evaluate(&at, &mut kept);
    KEPT.set(Some(kept));
    (value, slopes)
}

/// The same at a point a lane.
pub fn values_at<D: Lanes<Scalar = f64>>(formula: &Formula, p: Vec3<D>) -> (D, Vec3<D>) {
    let mut values = D::zero();
    let mut gradients = [[0.0; 3]; 16];
    for (i, gradient) in gradients.iter_mut().enumerate().take(D::COUNT) {
        let (value, slopes) = value_and_gradient(formula, lane(&p, i));
        values = values.with_lane(i, value);
        *gradient = slopes;
    }
    (values, Vec3::of_lanes(|i| gradients[i]))
}

/// Between which f lies, at most, at points that are rounded to f64: how far apart, in
/// each lane.
pub fn blur_at<D: Lanes<Scalar = f64>>(formula: &Formula, p: Vec3<D>) -> D {
    let mut kept = BOUNDS.take().unwrap_or_default();
    let mut blur = D::zero();
    for i in 0..D::COUNT {
        let at = lane(&p, i).map(|x| Range::of(Interval::around(x)));
        let values = formula.evaluate(&at, &mut kept).values;
        blur = blur.with_lane(i, values.width());
    }
    BOUNDS.set(Some(kept));
    blur
}

fn lane<D: Lanes<Scalar = f64>>(p: &Vec3<D>, i: usize) -> [f64; 3] {
    [p.x.lane(i), p.y.lane(i), p.z.lane(i)]
}

#[cfg(test)]
mod tests;
