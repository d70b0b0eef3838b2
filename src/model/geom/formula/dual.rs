//! Dual numbers: forward automatic differentiation (Wengert 1964) in any arithmetic.

use super::{Real, Unary};

/// A value, and its derivatives along N directions.
#[derive(Clone, Copy, Debug)]
pub struct Dual<R, const N: usize> {
    pub value: R,
    pub slopes: [R; N],
}

impl<R: Real, const N: usize> Dual<R, N> {
    /// Makes a variable whose derivative along one direction is 1, and 0 along the others.
    pub fn variable(value: R, along: usize) -> Self {
        let rate = |k: usize| R::constant(if k == along { 1.0 } else { 0.0 });
        Dual {
            value,
            slopes: std::array::from_fn(rate),
        }
    }

    #[inline(always)]
    fn joined(self, other: Self, value: R, of: impl Fn(R, R) -> R) -> Self {
        let slope = |k: usize| of(self.slopes[k], other.slopes[k]);
        Dual {
            value,
            slopes: std::array::from_fn(slope),
        }
    }

    /// Applies the chain rule.
    #[inline(always)]
    fn followed(self, value: R, rate: R) -> Self {
        self.joined(self, value, |slope, _| rate.times(slope))
    }
}

impl<R: Real, const N: usize> Real for Dual<R, N> {
    #[inline]
    fn constant(x: f64) -> Self {
        Dual {
            value: R::constant(x),
            slopes: [R::constant(0.0); N],
        }
    }

    #[inline]
    fn plus(self, other: Self) -> Self {
        self.joined(other, self.value.plus(other.value), R::plus)
    }

    #[inline]
    fn minus(self, other: Self) -> Self {
        self.joined(other, self.value.minus(other.value), R::minus)
    }

    #[inline]
    fn times(self, other: Self) -> Self {
        let value = self.value.times(other.value);
        let slope = |a: R, b: R| a.times(other.value).plus(b.times(self.value));
        self.joined(other, value, slope)
    }

    #[inline]
    fn over(self, other: Self) -> Self {
        let value = self.value.over(other.value);
        let slope = |a: R, b: R| a.minus(b.times(value)).over(other.value);
        self.joined(other, value, slope)
    }

    #[inline]
    fn min(self, other: Self) -> Self {
        let less = self.value.minus(other.value);
        let value = self.value.min(other.value);
        self.joined(other, value, |a, b| less.choice(a, b))
    }

    #[inline]
    fn max(self, other: Self) -> Self {
        let less = self.value.minus(other.value);
        let value = self.value.max(other.value);
        self.joined(other, value, |a, b| less.choice(b, a))
    }

    fn power(self, exponent: u32) -> Self {
        let times = R::constant(f64::from(exponent));
        let rate = match exponent {
            0 | 1 => times,
            _ => times.times(self.value.power(exponent - 1)),
        };
        self.followed(self.value.power(exponent), rate)
    }

    fn unary(self, function: Unary) -> Self {
        let x = self.value;
        match function {
            Unary::Sin => return self.sin_cos()[0],
            Unary::Cos => return self.sin_cos()[1],
            _ => {}
        }
        let value = x.unary(function);
        let one = R::constant(1.0);
        let square = |y: R| y.power(2);
        let rate = match function {
            Unary::Abs => x.direction(),
            Unary::Sqrt => R::constant(0.5).over(value),
            Unary::Exp => value,
            Unary::Ln => one.over(x),
            Unary::Sin | Unary::Cos => one,
            Unary::Tan => one.plus(square(value)),
            Unary::Asin => one.over(one.minus(square(x)).unary(Unary::Sqrt)),
            Unary::Acos => R::constant(-1.0).over(one.minus(square(x)).unary(Unary::Sqrt)),
            Unary::Atan => one.over(one.plus(square(x))),
            Unary::Sinh => x.unary(Unary::Cosh),
            Unary::Cosh => x.unary(Unary::Sinh),
            Unary::Tanh => one.minus(square(value)),
        };
        self.followed(value, rate)
    }

    fn sin_cos(self) -> [Self; 2] {
        let [sin, cos] = self.value.sin_cos();
        let down = R::constant(0.0).minus(sin);
        [self.followed(sin, cos), self.followed(cos, down)]
    }

    fn direction(self) -> Self {
        self.followed(self.value.direction(), R::constant(0.0))
    }

    fn choice(self, below: Self, above: Self) -> Self {
        below.joined(
            above,
            self.value.choice(below.value, above.value),
            |a, b| self.value.choice(a, b),
        )
    }
}
