//! Root finders compared: the roots they find, and their time.

use lanecast_io::KnownRoot;
use lanecast_numerics::roots::{
    Answer, Interval, Polynomial, Proof, Solver, SolverError, Want, solve,
};
use serde::Serialize;
use std::time::{Duration, Instant};

/// The result of one solver on one polynomial.
#[derive(Clone, Debug, Serialize)]
pub struct Trial {
    pub solver: &'static str,
    /// Number of distinct roots.
    pub roots: usize,
    pub clusters: usize,
    /// True if the solver proved that no root is missing.
    pub complete: bool,
    /// Time of one call, the best of several.
    pub nanoseconds: f64,
    /// Comparison with the known roots.
    #[serde(flatten)]
    pub tally: Option<Tally>,
}

/// Comparison of a solver's roots with the known roots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// Found with the right multiplicity, and within 10 · degree · `forward_bound` of
    /// the known root, or rounded correctly.
    pub found: usize,
    pub wrong_multiplicity: usize,
    /// Known roots inside a cluster.
    pub in_clusters: usize,
    pub lost: usize,
    /// Roots that the solver gives and the polynomial does not have.
    pub false_roots: usize,
}

impl Tally {
    pub fn new(answer: &Answer, known: &[KnownRoot], degree: usize) -> Tally {
        let mut tally = Tally::default();
        let mut left = answer.roots.clone();
        for root in known {
            let reach = 10.0 * degree as f64 * root.forward_bound;
            let off = |t: f64| (t - root.t).abs();
            let near = (0..left.len()).min_by(|a, b| off(left[*a].t).total_cmp(&off(left[*b].t)));
            match near.filter(|i| off(left[*i].t) <= reach) {
                Some(i) if left.remove(i).multiplicity == root.multiplicity => tally.found += 1,
                Some(_) => tally.wrong_multiplicity += 1,
                None => {
                    let mut clusters = answer.clusters.iter();
                    match clusters.any(|c| c.low <= root.t && root.t <= c.high) {
                        true => tally.in_clusters += 1,
                        false => tally.lost += 1,
                    }
                }
            }
        }
        tally.false_roots = left.len();
        tally
    }

    /// Returns the share of the known roots that are not found.
    pub fn missed(&self) -> f64 {
        let missed = (self.wrong_multiplicity + self.in_clusters + self.lost) as f64;
        missed / (self.found as f64 + missed)
    }

    pub fn add(&mut self, other: &Tally) {
        self.found += other.found;
        self.wrong_multiplicity += other.wrong_multiplicity;
        self.in_clusters += other.in_clusters;
        self.lost += other.lost;
        self.false_roots += other.false_roots;
    }
}

/// The results of one solver over several polynomials.
#[derive(Clone, Debug, Serialize)]
pub struct Total {
    pub solver: &'static str,
    pub polynomials: usize,
    pub roots: usize,
    pub clusters: usize,
    /// Sum over the polynomials.
    pub nanoseconds: f64,
    #[serde(flatten)]
    pub tally: Option<Tally>,
}

/// All solvers over the polynomials of one degree.
#[derive(Clone, Debug, Serialize)]
pub struct DegreeRow {
    pub degree: usize,
    pub solvers: Vec<Total>,
}

/// Sums the trials of each solver that has one.
pub fn totals<'t>(trials: impl Iterator<Item = &'t Trial> + Clone) -> Vec<Total> {
    let total = |solver: &Solver| {
        let mut total = Total {
            solver: solver.name(),
            polynomials: 0,
            roots: 0,
            clusters: 0,
            nanoseconds: 0.0,
            tally: None,
        };
        for trial in trials.clone().filter(|t| t.solver == total.solver) {
            total.polynomials += 1;
            total.roots += trial.roots;
            total.clusters += trial.clusters;
            total.nanoseconds += trial.nanoseconds;
            if let Some(tally) = &trial.tally {
                total.tally.get_or_insert_default().add(tally);
            }
        }
        (total.polynomials > 0).then_some(total)
    };
    Solver::ALL.iter().filter_map(total).collect()
}

/// Time budget of a trial.
const TIMED: Duration = Duration::from_micros(1500);

/// Returns a solver's answer, and its best time of several runs.
pub fn trial(
    p: &Polynomial,
    interval: &Interval,
    solver: Solver,
    known: Option<&[KnownRoot]>,
) -> Result<(Answer, Trial), SolverError> {
    let started = Instant::now();
    let mut best = f64::INFINITY;
    let answer = loop {
        let before = Instant::now();
        let answer = solve(p, interval, solver, Want::All, &[])?;
        best = best.min(before.elapsed().as_secs_f64());
        if started.elapsed() > TIMED {
            break answer;
        }
    };
    let trial = Trial {
        solver: solver.name(),
        roots: answer.roots.len(),
        clusters: answer.clusters.len(),
        complete: answer.proof == Proof::Complete,
        nanoseconds: (best * 1e9).round(),
        tally: known.map(|known| Tally::new(&answer, known, p.degree())),
    };
    Ok((answer, trial))
}
