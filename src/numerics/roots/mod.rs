//! Real roots of polynomials in one variable.
//!
//! A polynomial is its f64 coefficients, which are exact numbers. [`solve`] calls one of
//! several solvers for the roots in an interval. [`Solver::Auto`] and [`Solver::Sturm`]
//! guarantee the exact number of distinct roots with their multiplicities.
//! [`Solver::Bernstein`] and [`Solver::Halving`] guarantee that no root is missing. The
//! others guarantee only that the roots they return are right.
//!
//! **Invariants.** Every root that any solver returns is the f64 nearest to a root of the
//! polynomial, so its bits do not depend on solver, interval or start. Roots that a
//! solver cannot separate form a [`Cluster`]. No solver panics, loops endlessly or
//! allocates without limit.
//!
//! docs/ROOTS.md says which solver to use when, and what they cost. tests/kernels/roots/
//! compares them with certified roots and with Sturm's theorem in fractions.

mod algebraic;
mod answer;
mod bernstein;
mod bracketed;
mod certify_candidates;
mod certify_isolated;
mod closed;
pub mod collocation;
mod eval;
mod exact;
mod halving;
mod interval;
pub mod lanes;
mod newton;
mod polynomial;
mod refine;
mod sturm;

pub use algebraic::{RealRoots, real_roots};
pub use answer::{Answer, Cluster, Parity, Proof, Root};
pub use eval::{Approximate, Local, derivative, horner, local};
pub use interval::Interval;
pub use polynomial::{MAX_DEGREE, Polynomial, PolynomialError};

use certify_isolated::{Doubts, Method};
use schemars::JsonSchema;
use serde::Deserialize;
use thiserror::Error;

/// A way to find roots; in scene files and on the command line by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Solver {
    /// Subdivision in f64, and integers where that is in doubt.
    #[default]
    Auto,
    /// Interval halving with Taylor bounds.
    Halving,
    /// Newton's method with deflation.
    Newton,
    /// Sturm's chain in f64, and in integers where that is in doubt.
    Sturm,
    /// Formulas, to degree 4.
    Closed,
    /// Newton's method between the roots of the derivatives.
    Bracketed,
    /// Subdivision in f64, with clusters where that is in doubt.
    Bernstein,
}

impl Solver {
    pub const ALL: [Solver; 7] = [
        Solver::Auto,
        Solver::Halving,
        Solver::Newton,
        Solver::Sturm,
        Solver::Closed,
        Solver::Bracketed,
        Solver::Bernstein,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Solver::Auto => "auto",
            Solver::Halving => "halving",
            Solver::Newton => "newton",
            Solver::Sturm => "sturm",
            Solver::Closed => "closed",
            Solver::Bracketed => "bracketed",
            Solver::Bernstein => "bernstein",
        }
    }

    /// Returns the highest degree that the solver takes; `None` if it takes all.
    pub fn most(self) -> Option<usize> {
        (self == Solver::Closed).then_some(closed::MOST)
    }

    /// Whether the solver guarantees the exact number of roots with their multiplicities.
    pub fn is_exact(self) -> bool {
        matches!(self, Solver::Auto | Solver::Sturm)
    }
}

/// The requested roots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Want {
    All,
    /// The least root.
    Nearest,
}

/// The reason why a solver cannot be applied.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum SolverError {
    #[error(
        "solver '{}' has no formula for degree {degree}; at most {most}, or choose auto",
        solver.name()
    )]
    Degree {
        solver: Solver,
        degree: usize,
        most: usize,
    },
}

/// Finds the roots of a polynomial in an interval. `starts` are estimates from a
/// neighbour or an earlier answer, of which the last is tried first. Solvers may use
/// them; no bit of a root depends on them. Fails only if the solver has no formula for
/// the degree.
pub fn solve(
    p: &Polynomial,
    interval: &Interval,
    solver: Solver,
    want: Want,
    starts: &[f64],
) -> Result<Answer, SolverError> {
    let certified =
        |isolate, doubts| certify_isolated::roots(p, interval, want, Method { isolate, doubts });
    let mut answer = match solver {
        Solver::Auto => certified(bernstein::isolate, Doubts::Descartes),
        Solver::Sturm => certified(sturm::isolate, Doubts::Chain),
        Solver::Bernstein => certified(bernstein::isolate, Doubts::Report),
        Solver::Halving => certify_candidates::certify(p, interval, halving::candidates),
        Solver::Bracketed => certify_candidates::certify(p, interval, bracketed::candidates),
        Solver::Newton => certify_candidates::certify(p, interval, |line| {
            let scaled = |t: &f64| polynomial::times_power(*t, -line.k);
            let starts: Vec<f64> = starts.iter().map(scaled).collect();
            newton::candidates(line, &starts)
        }),
        Solver::Closed => {
            let degree = p.without_zero().0.degree();
            if degree > closed::MOST {
                let most = closed::MOST;
                return Err(SolverError::Degree {
                    solver,
                    degree,
                    most,
                });
            }
            certify_candidates::certify(p, interval, closed::candidates)
        }
    };
    if want == Want::Nearest {
        answer.roots.truncate(1);
    }
    Ok(answer)
}

/// Counts the roots in (low, high] without finding them, by [`Solver::Sturm`] from two
/// counts of sign changes. `None` for other solvers, if `low` < 0 or p(0) = 0, or if f64
/// is not certain of the count.
pub fn count(p: &Polynomial, interval: &Interval, solver: Solver) -> Option<u32> {
    let (from, to) = (interval.from(), interval.to());
    let is_asked = solver == Solver::Sturm && from >= 0.0 && interval.is_sound();
    if !is_asked || p.coefficients()[0] == 0.0 {
        return None;
    }
    sturm::count(p, from, to)
}

/// Finds all roots in an interval, by [`Solver::Auto`].
pub fn roots(p: &Polynomial, interval: &Interval) -> Answer {
    let method = Method {
        isolate: bernstein::isolate,
        doubts: Doubts::Descartes,
    };
    certify_isolated::roots(p, interval, Want::All, method)
}

/// Finds the least root in an interval, by [`Solver::Auto`].
pub fn nearest(p: &Polynomial, interval: &Interval) -> Option<Root> {
    let method = Method {
        isolate: bernstein::isolate,
        doubts: Doubts::Descartes,
    };
    let answer = certify_isolated::roots(p, interval, Want::Nearest, method);
    answer.roots.first().copied()
}
