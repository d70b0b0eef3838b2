//! Real roots of polynomials in one variable.
//!
//! A polynomial is its f64 coefficients, which are exact numbers. [`solve`] asks one
//! of several solvers for its roots in an interval; [`Solver::Auto`] and
//! [`Solver::Sturm`] promise the exact number of distinct roots with their
//! multiplicities, [`Solver::Bernstein`] and [`Solver::Halving`] that nothing is
//! missing, the others that what they give is right.
//!
//! **Invariants.** Every root that any solver gives is the f64 nearest to a root of
//! the polynomial, so its bits do not depend on solver, interval or start. What a
//! solver cannot separate is a [`Cluster`]. No solver panics, loops without end or
//! allocates without end.
//!
//! docs/ROOTS.md says which solver when, and what they cost. tests/roots.rs holds
//! them against certified roots and against Sturm's theorem in fractions.

mod algebraic;
mod answer;
mod bernstein;
mod bracketed;
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
mod settle;
mod side;
mod sturm;

pub use algebraic::{RealRoots, real_roots};
pub use answer::{Answer, Cluster, Parity, Proof, Root};
pub use eval::{Approximate, Local, derivative, horner, local};
pub use interval::Interval;
pub use polynomial::{MAX_DEGREE, Polynomial, PolynomialError};

use schemars::JsonSchema;
use serde::Deserialize;
use side::{Doubts, Method};
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

    /// The highest degree that it takes, where it does not take all.
    pub fn most(self) -> Option<usize> {
        (self == Solver::Closed).then_some(closed::MOST)
    }

    /// The exact number of roots with their multiplicities.
    pub fn is_exact(self) -> bool {
        matches!(self, Solver::Auto | Solver::Sturm)
    }
}

/// How many roots are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Want {
    All,
    /// The least one.
    Nearest,
}

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

/// The roots of a polynomial in an interval. `starts` are guesses from a neighbour or
/// an earlier answer, the last of them first; solvers may use them, and no bit of a
/// root depends on them.
pub fn solve(
    p: &Polynomial,
    interval: &Interval,
    solver: Solver,
    want: Want,
    starts: &[f64],
) -> Result<Answer, SolverError> {
    let certified = |isolate, doubts| side::roots(p, interval, want, Method { isolate, doubts });
    let mut answer = match solver {
        Solver::Auto => certified(bernstein::isolate, Doubts::Descartes),
        Solver::Sturm => certified(sturm::isolate, Doubts::Chain),
        Solver::Bernstein => certified(bernstein::isolate, Doubts::Report),
        Solver::Halving => settle::settle(p, interval, halving::candidates),
        Solver::Bracketed => settle::settle(p, interval, bracketed::candidates),
        Solver::Newton => settle::settle(p, interval, |line| {
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
            settle::settle(p, interval, closed::candidates)
        }
    };
    if want == Want::Nearest {
        answer.roots.truncate(1);
    }
    Ok(answer)
}

/// How many roots are in (low, high], where the solver can tell without finding them and
/// f64 is certain: by [`Solver::Sturm`] from two counts of signs. Of an interval above 0.
pub fn count(p: &Polynomial, interval: &Interval, solver: Solver) -> Option<u32> {
    let (from, to) = (interval.from(), interval.to());
    let is_asked = solver == Solver::Sturm && from >= 0.0 && interval.is_sound();
    if !is_asked || p.coefficients()[0] == 0.0 {
        return None;
    }
    sturm::count(p, from, to)
}

/// All roots in an interval, by [`Solver::Auto`].
pub fn roots(p: &Polynomial, interval: &Interval) -> Answer {
    let method = Method {
        isolate: bernstein::isolate,
        doubts: Doubts::Descartes,
    };
    side::roots(p, interval, Want::All, method)
}

/// The least root in an interval, by [`Solver::Auto`].
pub fn nearest(p: &Polynomial, interval: &Interval) -> Option<Root> {
    let method = Method {
        isolate: bernstein::isolate,
        doubts: Doubts::Descartes,
    };
    let answer = side::roots(p, interval, Want::Nearest, method);
    answer.roots.first().copied()
}
