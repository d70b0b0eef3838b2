//! The number of roundings of a tape, and the magnitude above which none underflows (F1 and F4,
//! docs/numerics/polynomials.md).

use super::Step;
use crate::math::is_power_of_two;

/// The error of a tape in f64. Let S be the value of the same steps on magnitudes (constants
/// without signs, differences as sums) at (R, R', R''), each no less than the coordinate's
/// magnitude and `floor`. Then the computed value is off by at most ((1 + u)^count − 1)·S, and S
/// itself by less than that part of it (F1, docs/numerics/polynomials.md).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Roundings {
    /// A float, because squares of squares double it.
    pub count: f64,
    /// Infinite if there is no such magnitude.
    pub floor: f64,
}

/// The least that any step is at `floor`: an underflow loses 2⁻¹⁰⁷⁵, less than u/2²⁰ of this (F4,
/// docs/numerics/polynomials.md).
const LEAST: f64 = f64::from_bits(1 << 52) * (1u64 << 22) as f64;

impl Roundings {
    pub fn count(steps: &[Step]) -> Roundings {
        let mut counts: Vec<f64> = Vec::with_capacity(steps.len());
        for step in steps {
            let of = |i: u32| counts[i as usize];
            counts.push(match *step {
                Step::Coordinate(_) | Step::Constant(_) => 0.0,
                Step::Sum(a, b) | Step::Difference(a, b) => of(a).max(of(b)) + 1.0,
                Step::Product(a, b) => of(a) + of(b) + 1.0,
                // A product with a factor ≥ 1 does not underflow.
                Step::Scaled(a, by) if is_power_of_two(by.abs()) && by.abs() >= 1.0 => of(a),
                Step::Scaled(a, _) => of(a) + 1.0,
            });
        }
        let floors = (-120..=40).map(|k| f64::powi(2.0, 8 * k));
        Roundings {
            count: counts.last().copied().unwrap_or(0.0),
            floor: floors
                .clone()
                .find(|floor| stays(steps, *floor))
                .unwrap_or(f64::INFINITY),
        }
    }
}

/// Says whether no step on magnitudes is less than [`LEAST`] if all coordinates are `at`.
fn stays(steps: &[Step], at: f64) -> bool {
    let mut sizes: Vec<f64> = Vec::with_capacity(steps.len());
    steps.iter().all(|step| {
        let of = |i: u32| sizes[i as usize];
        let (size, may_underflow) = match *step {
            Step::Coordinate(_) => (at, false),
            Step::Constant(value) => (value.abs(), false),
            Step::Sum(a, b) | Step::Difference(a, b) => (of(a) + of(b), false),
            Step::Product(a, b) => (of(a) * of(b), of(a) != 0.0 && of(b) != 0.0),
            Step::Scaled(a, by) => (of(a) * by.abs(), of(a) != 0.0),
        };
        sizes.push(size);
        !may_underflow || size >= LEAST
    })
}
