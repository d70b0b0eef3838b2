//! Bracketed Newton iteration between the roots of the derivatives (Yuksel,
//! *High-Performance Polynomial Root Finding for Graphics*, HPG 2022).
//!
//! Between neighbouring roots of its derivative a polynomial is monotone. So the signs at
//! both tell whether there is a root between them, and Newton's method with a bracket
//! finds it. The roots of the derivatives come the same way, from the derivative of
//! degree 1 upwards.
//!
//! In addition to the paper, a root of p' at which the sign of p is not certain is a
//! candidate: p may have a double root there, two roots or none. Signs of the derivatives
//! are not certified, and a wrong one loses critical points, so the answer is not proven
//! complete.

use super::answer::Proof;
use super::certify_candidates::{Candidate, Line};
use super::refine::approach;

/// Finds candidates in the interval of `line`; the proof is always [`Proof::Open`].
pub fn candidates(line: &Line) -> (Vec<Candidate>, Proof) {
    let n = line.degree();
    let mut c = Vec::with_capacity(n + 1);
    let mut critical: Vec<f64> = Vec::new();
    let mut ends = Vec::with_capacity(n + 2);
    for order in (0..n).rev() {
        scaled_derivative(&line.c, order, &mut c);
        ends.clear();
        ends.push(line.from);
        ends.extend(&critical);
        ends.push(line.to);
        if order == 0 {
            return (roots(line, &ends), Proof::Open);
        }
        critical.clear();
        let mut before = (ends[0], value(&c, ends[0]));
        for end in &ends[1..] {
            let here = (*end, value(&c, *end));
            if before.1 * here.1 < 0.0 {
                let sign = before.1.signum();
                critical.push(approach(&c, before.0, here.0, sign, f64::NAN));
            } else if here.1 == 0.0 && here.0 < line.to {
                critical.push(here.0);
            }
            before = here;
        }
        critical.dedup();
    }
    (Vec::new(), Proof::Open)
}

/// Computes the coefficients of p^(k) / k!.
fn scaled_derivative(c: &[f64], k: usize, to: &mut Vec<f64>) {
    to.clear();
    let mut binomial = 1.0;
    for i in k..c.len() {
        to.push(binomial * c[i]);
        binomial *= (i + 1) as f64 / (i + 1 - k) as f64;
    }
}

fn value(c: &[f64], x: f64) -> f64 {
    c.iter().rev().fold(0.0, |y, c| y * x + c)
}

/// Finds candidates for roots of p itself, by certain signs only.
fn roots(line: &Line, ends: &[f64]) -> Vec<Candidate> {
    let mut found = Vec::new();
    let mut before = (ends[0], line.certain_sign(ends[0]));
    if before.1 == 0.0 {
        found.push(Candidate::At(ends[0]));
    }
    for end in &ends[1..] {
        let here = (*end, line.certain_sign(*end));
        if here.1 == 0.0 {
            found.push(Candidate::At(*end));
        } else if before.1 * here.1 < 0.0 {
            let s = approach(&line.c, before.0, here.0, before.1, f64::NAN);
            found.push(Candidate::At(s));
        } else if before.1 == 0.0 {
            // The candidate at the uncertain end covers a root near it.
        }
        before = here;
    }
    found
}
