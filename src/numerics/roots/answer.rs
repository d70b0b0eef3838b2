//! Answers of root solvers: roots, clusters, and whether they are complete.

use serde::Serialize;

/// A real root as an f64, with an error bound and its multiplicity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Root {
    /// The f64 nearest to the root, ties to even, so a function of the polynomial and the
    /// root alone; ± `f64::MAX` beyond the range of f64.
    pub t: f64,
    /// Upper bound of the distance between the root and `t`; infinite beyond the range of
    /// f64.
    pub error: f64,
    pub multiplicity: u32,
}

/// A closed interval in which a solver's arithmetic cannot tell one root from several or
/// none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cluster {
    pub low: f64,
    pub high: f64,
    pub parity: Parity,
}

/// Parity of the number of roots, counted with multiplicity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Parity {
    Even,
    Odd,
    Unknown,
}

/// Whether roots may be missing from an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Proof {
    /// Every requested root is in the answer or in one of its clusters.
    Complete,
    /// Every root in the answer is right, but roots may be missing.
    Open,
}

/// The roots of a polynomial in an interval.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Answer {
    /// The distinct roots, ascending.
    pub roots: Vec<Root>,
    /// The clusters, ascending.
    pub clusters: Vec<Cluster>,
    pub proof: Proof,
}

impl Answer {
    pub(super) fn empty(proof: Proof) -> Answer {
        Answer {
            roots: Vec::new(),
            clusters: Vec::new(),
            proof,
        }
    }

    pub(super) fn sort(&mut self) {
        self.roots.sort_by(|a, b| a.t.total_cmp(&b.t));
        self.clusters.sort_by(|a, b| a.low.total_cmp(&b.low));
    }
}

impl Root {
    /// Makes the root whose nearest f64 is `t`.
    pub(super) fn nearest(t: f64, multiplicity: u32) -> Root {
        // Half the larger of the gaps on both sides of `t`.
        let error = match t.abs() {
            f64::MAX => f64::INFINITY,
            size => 0.5 * (size.next_up() - size).max(f64::from_bits(2)),
        };
        Root {
            t,
            error,
            multiplicity,
        }
    }

    /// Makes the root 0, which is exact.
    pub(super) fn zero(multiplicity: u32) -> Root {
        Root {
            t: 0.0,
            error: 0.0,
            multiplicity,
        }
    }

    pub(super) fn mirrored(self) -> Root {
        Root { t: -self.t, ..self }
    }
}
