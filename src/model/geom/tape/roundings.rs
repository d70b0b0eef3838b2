//! How many roundings a tape takes, and above which numbers none of them underflows.

use super::Step;
use crate::math::is_power_of_two;

/// Of a tape in f64, whose steps are taken one after another. With S the value of the
/// same steps of magnitudes (constants without signs, differences as sums) at (R, R', R''),
/// which are no less than the coordinates' own and `floor`, what is computed is off by no
/// more than ((1 + u)^count − 1)·S, and S itself loses less than that part of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Roundings {
    /// A number, for squares of squares double it.
    pub count: f64,
    /// Infinite where there is none such.
    pub floor: f64,
}

/// At `floor` no step is smaller: what underflows is off by 2^−1075, which is less than
/// u/2^20 of this.
const LEAST: f64 = f64::from_bits(1 << 52) * (1u64 << 22) as f64;

impl Roundings {
    pub fn of(steps: &[Step]) -> Roundings {
        let mut counts: Vec<f64> = Vec::with_capacity(steps.len());
        for step in steps {
            let of = |i: u32| counts[i as usize];
            counts.push(match *step {
                Step::Coordinate(_) | Step::Constant(_) => 0.0,
                Step::Sum(a, b) | Step::Difference(a, b) => of(a).max(of(b)) + 1.0,
                Step::Product(a, b) => of(a) + of(b) + 1.0,
                // What is made larger does not underflow.
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

/// Whether no step of magnitudes is less than [`LEAST`] where all coordinates are `at`.
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
