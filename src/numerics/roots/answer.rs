//! What a solver says.

use serde::Serialize;

/// A real root.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Root {
    /// The f64 nearest to it, ties to even: a function of the polynomial and the
    /// root alone. Of a root beyond the range of f64, ± f64::MAX.
    pub t: f64,
    /// It is no farther than this from `t`; infinite beyond the range of f64.
    pub error: f64,
    pub multiplicity: u32,
}

/// Where a solver's arithmetic cannot tell one root from several, or from none.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Cluster {
    pub low: f64,
    pub high: f64,
    pub parity: Parity,
}

/// Of the number of roots, each as often as its multiplicity says.
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
    /// All roots asked for are in it, or in one of its clusters.
    Complete,
    /// What is in it is right; the method does not show that nothing is missing.
    Open,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Answer {
    /// Ascending, each distinct root once.
    pub roots: Vec<Root>,
    /// Ascending.
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
    /// The root that `t` is the nearest f64 to.
    pub(super) fn nearest(t: f64, multiplicity: u32) -> Root {
        // Half the larger of the gaps beside it.
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

    /// 0, which is one exactly.
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
