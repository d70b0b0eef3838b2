//! Certification of candidates of the solvers without a proof of their own.
//!
//! Halving, Newton, closed forms and bracketed Newton give candidates. The canonical
//! refinement proves a candidate to be a root. A candidate that it cannot prove becomes a
//! cluster: an interval around it at whose ends the sign of p is certain in f64.

use super::answer::{Answer, Cluster, Parity, Proof, Root};
use super::eval::horner;
use super::exact::{self, Point};
use super::interval::Interval;
use super::polynomial::{Polynomial, times_power};
use super::refine::{Certified, certified};
use std::cmp::Ordering;

/// A polynomial with c₀ ≠ 0 scaled as p(2^k s), so that all roots have |s| < 1, and the
/// ends of the requested interval in s, within [−1, 1].
pub struct Line {
    /// The unscaled polynomial.
    pub p: Polynomial,
    pub k: i32,
    /// The coefficients of p(2^k s), the largest about 1.
    pub c: Vec<f64>,
    pub from: f64,
    pub to: f64,
}

/// A place in s where there may be a root.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Candidate {
    /// A possible root near a number, unless p is certainly not 0 there.
    At(f64),
    /// At most one root between two numbers.
    Within(f64, f64),
    /// Any number of roots between two numbers.
    Doubtful(f64, f64),
}

impl Line {
    /// Scales a polynomial and an interval.
    pub fn new(p: Polynomial, interval: &Interval) -> Line {
        let k = p.root_bound();
        let mut c = Vec::new();
        p.scaled_into(k, &mut c);
        let end = |t: f64| match t.is_finite() {
            // An end that underflows at this scale lies between 0 and all roots.
            true => times_power(t, -k).clamp(-1.0, 1.0),
            false => t.signum(),
        };
        Line {
            p,
            k,
            c,
            from: end(interval.from()),
            to: end(interval.to()),
        }
    }

    pub fn degree(&self) -> usize {
        self.p.degree()
    }

    /// Returns the sign of p at s as ±1 if it is certain, else 0.
    pub fn certain_sign(&self, s: f64) -> f64 {
        let at = horner(&self.c, s);
        if at.certain() { at.value.signum() } else { 0.0 }
    }
}

/// Certifies the candidates that `find` returns for p without the root 0, and adds the
/// root 0.
pub fn certify(
    p: &Polynomial,
    interval: &Interval,
    find: impl FnOnce(&Line) -> (Vec<Candidate>, Proof),
) -> Answer {
    let mut answer = Answer::empty(Proof::Complete);
    if !interval.is_sound() {
        return answer;
    }
    let (rest, zeros) = p.without_zero();
    if zeros > 0 && interval.holds(|end| 0.0_f64.total_cmp(&(end + 0.0))) {
        answer.roots.push(Root::zero(zeros));
    }
    if rest.degree() == 0 {
        return answer;
    }
    let line = Line::new(rest, interval);
    let (candidates, proof) = find(&line);
    answer.proof = proof;
    let mut scratch = Vec::new();
    for candidate in candidates {
        let (low, high) = match candidate {
            Candidate::At(s) => (s, s),
            Candidate::Within(low, high) | Candidate::Doubtful(low, high) => (low, high),
        };
        // Whether the proven root is the candidate's only one. It says nothing about
        // other roots between the two numbers, or beyond them.
        let is_it = |found: &Certified| match candidate {
            Candidate::At(_) => true,
            Candidate::Within(..) => {
                let s = times_power(found.s, found.k - line.k);
                // Lemma Z13, docs/numerics/roots.md.
                let room = s.abs() * (4.0 * f64::EPSILON);
                (low - room..=high + room).contains(&s)
            }
            Candidate::Doubtful(..) => false,
        };
        let middle = low + 0.5 * (high - low);
        let found = certified(&line.p, middle, line.k, &mut scratch);
        if let Some(found) = found.filter(is_it) {
            let t = found.t();
            let known = answer.roots.iter().any(|root| root.t == t);
            if !known && interval.holds(|end| against(&line.p, t, end)) {
                answer.roots.push(Root::nearest(t, 1));
            }
            continue;
        }
        let certainly_none = |s: f64| line.certain_sign(s) != 0.0;
        if matches!(candidate, Candidate::At(s) if certainly_none(s)) {
            continue;
        }
        answer.clusters.extend(cluster(&line, low, high, interval));
    }
    merge(&mut answer);
    answer
}

/// Compares a simple root, whose nearest f64 is t, with an end, exactly.
fn against(p: &Polynomial, t: f64, end: f64) -> Ordering {
    if t != end {
        return t.total_cmp(&end);
    }
    let integers = exact::integers(p);
    let at = Point::of(end, 0);
    // The sign of the slope tells whether p rises or falls through the root.
    let slope = exact::sign_at(&exact::derivative(&integers), &at);
    match (exact::sign_at(&integers, &at), slope) {
        (Ordering::Equal, _) => Ordering::Equal,
        (sign, slope) if sign == slope => Ordering::Less,
        _ => Ordering::Greater,
    }
}

/// Widens an interval until p has a certain sign at both ends; `None` if it misses the
/// requested interval.
fn cluster(line: &Line, mut low: f64, mut high: f64, interval: &Interval) -> Option<Cluster> {
    // Lemma Z13, docs/numerics/roots.md.
    let start = low.abs().max(high.abs()).max(1e-290) * f64::EPSILON;
    let mut step = start;
    while line.certain_sign(low) == 0.0 && low > -2.0 {
        low -= step;
        step *= 2.0;
    }
    step = start;
    while line.certain_sign(high) == 0.0 && high < 2.0 {
        high += step;
        step *= 2.0;
    }
    let parity = match line.certain_sign(low) * line.certain_sign(high) {
        0.0 => Parity::Unknown,
        1.0 => Parity::Even,
        _ => Parity::Odd,
    };
    let t = |s: f64| times_power(s, line.k).clamp(-f64::MAX, f64::MAX);
    let (low, high) = (t(low).next_down(), t(high).next_up());
    let meets = high >= interval.from() && low <= interval.to();
    meets.then_some(Cluster { low, high, parity })
}

/// Merges overlapping clusters, and drops roots inside a cluster.
fn merge(answer: &mut Answer) {
    answer.sort();
    let mut merged: Vec<Cluster> = Vec::new();
    for cluster in answer.clusters.drain(..) {
        match merged.last_mut() {
            Some(last) if cluster.low <= last.high => {
                if cluster.high > last.high {
                    last.parity = Parity::Unknown;
                    last.high = cluster.high;
                }
            }
            _ => merged.push(cluster),
        }
    }
    let inside = |root: &Root| merged.iter().any(|c| c.low <= root.t && root.t <= c.high);
    answer.roots.retain(|root| !inside(root));
    answer.clusters = merged;
}
