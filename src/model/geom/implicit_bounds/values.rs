//! Tapes evaluated in intervals.

use crate::geom::tape::Arithmetic;
use crate::math::Interval;

/// Interval arithmetic for a polynomial's values over a box.
pub(super) struct Values<'a>(pub &'a [Interval; 3]);

impl Arithmetic for Values<'_> {
    type Value = Interval;

    fn coordinate(&self, axis: usize) -> Interval {
        self.0[axis]
    }

    fn constant(&self, value: f64) -> Interval {
        Interval::point(value)
    }

    fn sum(&self, a: &Interval, b: &Interval) -> Interval {
        a.plus(b)
    }

    fn difference(&self, a: &Interval, b: &Interval) -> Interval {
        a.minus(b)
    }

    fn product(&self, a: &Interval, b: &Interval) -> Interval {
        a.times(b)
    }

    fn square(&self, a: &Interval) -> Interval {
        a.squared()
    }
}

/// Interval arithmetic for a polynomial's values and gradients over a box.
pub(super) struct Slopes<'a>(pub &'a [Interval; 3]);

/// Ranges of a step's value and gradient.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sloped {
    pub value: Interval,
    pub gradient: [Interval; 3],
}

impl Arithmetic for Slopes<'_> {
    type Value = Sloped;

    fn coordinate(&self, axis: usize) -> Sloped {
        let mut gradient = [Interval::ZERO; 3];
        gradient[axis] = Interval::new(1.0, 1.0);
        Sloped {
            value: self.0[axis],
            gradient,
        }
    }

    fn constant(&self, value: f64) -> Sloped {
        Sloped {
            value: Interval::point(value),
            gradient: [Interval::ZERO; 3],
        }
    }

    fn sum(&self, a: &Sloped, b: &Sloped) -> Sloped {
        Sloped {
            value: a.value.plus(&b.value),
            gradient: std::array::from_fn(|k| a.gradient[k].plus(&b.gradient[k])),
        }
    }

    fn difference(&self, a: &Sloped, b: &Sloped) -> Sloped {
        Sloped {
            value: a.value.minus(&b.value),
            gradient: std::array::from_fn(|k| a.gradient[k].minus(&b.gradient[k])),
        }
    }

    fn product(&self, a: &Sloped, b: &Sloped) -> Sloped {
        let slope = |k: usize| {
            let left = a.gradient[k].times(&b.value);
            left.plus(&b.gradient[k].times(&a.value))
        };
        Sloped {
            value: a.value.times(&b.value),
            gradient: std::array::from_fn(slope),
        }
    }

    fn square(&self, a: &Sloped) -> Sloped {
        let twice = a.value.plus(&a.value);
        Sloped {
            value: a.value.squared(),
            gradient: std::array::from_fn(|k| a.gradient[k].times(&twice)),
        }
    }
}

/// Interval arithmetic for the polynomial as a form in its graded coordinates: sums of different
/// degree in these are made homogeneous by powers of p, so that the value at x = u / p is
/// f(x)·p^degree.
pub(super) struct Forms<'a> {
    /// The u of graded axes, and the coordinates of the others.
    pub coordinates: &'a [Interval; 3],
    pub graded: [bool; 3],
    /// The factor p, ≥ 0.
    pub p: Interval,
}

/// The range of a step's values, and its degree in the graded coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Graded {
    pub value: Interval,
    degree: u32,
}

impl Forms<'_> {
    fn joined(&self, a: &Graded, b: &Graded, join: fn(&Interval, &Interval) -> Interval) -> Graded {
        let degree = a.degree.max(b.degree);
        let raised = |x: &Graded| match degree - x.degree {
            0 => x.value,
            by => x.value.times(&self.p.power(by)),
        };
        Graded {
            value: join(&raised(a), &raised(b)),
            degree,
        }
    }
}

impl Arithmetic for Forms<'_> {
    type Value = Graded;

    fn coordinate(&self, axis: usize) -> Graded {
        Graded {
            value: self.coordinates[axis],
            degree: u32::from(self.graded[axis]),
        }
    }

    fn constant(&self, value: f64) -> Graded {
        Graded {
            value: Interval::point(value),
            degree: 0,
        }
    }

    fn sum(&self, a: &Graded, b: &Graded) -> Graded {
        self.joined(a, b, Interval::plus)
    }

    fn difference(&self, a: &Graded, b: &Graded) -> Graded {
        self.joined(a, b, Interval::minus)
    }

    /// Multiplies two steps; the range is the whole line if degrees overflow.
    fn product(&self, a: &Graded, b: &Graded) -> Graded {
        match a.degree.checked_add(b.degree) {
            Some(degree) => Graded {
                value: a.value.times(&b.value),
                degree,
            },
            None => Graded {
                value: Interval::LINE,
                degree: u32::MAX,
            },
        }
    }

    fn square(&self, a: &Graded) -> Graded {
        let product = self.product(a, a);
        Graded {
            value: match product.degree {
                u32::MAX => Interval::LINE,
                _ => a.value.squared(),
            },
            ..product
        }
    }
}
