//! Newton's method with deflation, from a start that a neighbour may give.
//!
//! A root is divided out before the next is sought: from the constant coefficient
//! upwards where the root is larger than most, from the leading one downwards where
//! it is smaller (Peters and Wilkinson 1971). Starts: those given, then the last
//! root, then both ends of the root bound, then 0.
//!
//! It fails in known ways, and says only what it has proven: the iteration may
//! cycle or wander where the polynomial has complex roots; from a given start it
//! goes to some root, not the nearest; deflation spoils the roots that come later;
//! roots that are not simple are approached linearly, and end as clusters. What is
//! not found is not reported, so the answer is never known to be complete.

use super::answer::Proof;
use super::eval::{derivative, horner};
use super::settle::{Candidate, Line};

/// Steps from one start.
const STEPS: usize = 80;

pub fn candidates(line: &Line, starts: &[f64]) -> (Vec<Candidate>, Proof) {
    let mut c = line.c.clone();
    let mut found = Vec::new();
    let mut last = 1.0;
    let given = starts.iter().filter(|s| s.abs() <= 1.0);
    let mut given: Vec<f64> = given.copied().collect();
    while c.len() > 1 {
        let from = [given.pop(), Some(last), Some(1.0), Some(-1.0), Some(0.0)];
        let Some(s) = from.iter().flatten().find_map(|s| converged(&c, *s)) else {
            break;
        };
        // On the polynomial itself: deflation has moved the root.
        let s = converged(&line.c, s).unwrap_or(s);
        found.push(Candidate::At(s));
        deflate(&mut c, s);
        last = s;
    }
    (found, Proof::Open)
}

fn converged(c: &[f64], start: f64) -> Option<f64> {
    let mut x = start;
    for _ in 0..STEPS {
        let y = horner(c, x);
        let step = y.value / derivative(c, x);
        if !y.certain() || step.abs() <= f64::EPSILON * x.abs() {
            return Some(x);
        }
        x -= step;
        if !(x.abs() <= 1.5) {
            return None;
        }
    }
    None
}

fn deflate(c: &mut Vec<f64>, s: f64) {
    let n = c.len() - 1;
    let large = s.abs().powi(n as i32) * c[n].abs() >= c[0].abs();
    if large && s != 0.0 {
        // q₀ = −c₀ / s, qᵢ = (qᵢ₋₁ − cᵢ) / s.
        let mut q = 0.0;
        for c in c.iter_mut().take(n) {
            q = (q - *c) / s;
            *c = q;
        }
        c.pop();
    } else {
        for i in (0..n).rev() {
            c[i] += s * c[i + 1];
        }
        c.remove(0);
    }
}
