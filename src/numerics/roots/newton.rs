//! Newton's method with deflation, from starts that a neighbour may provide.
//!
//! Each root is divided out before the next is sought: from the constant coefficient
//! upwards if the root is larger than most, from the leading one downwards if it is
//! smaller (Peters and Wilkinson 1971). The starts are the given ones, then the last
//! root, then both ends of the root bound, then 0.
//!
//! The method fails in known ways, and reports only what it has proven. The iteration may
//! cycle or wander if the polynomial has complex roots. From a given start it finds some
//! root, not the nearest. Deflation perturbs the roots found later. Multiple roots are
//! approached linearly and end as clusters. A root that is not found is not reported, so
//! the answer is never proven complete.

use super::answer::Proof;
use super::certify_candidates::{Candidate, Line};
use super::eval::{derivative, horner};

/// Limit of steps from one start.
const STEPS: usize = 80;

/// Finds candidates from the starts; the proof is always [`Proof::Open`].
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
        // Iterate on the polynomial itself, since deflation has moved the root.
        let s = converged(&line.c, s).unwrap_or(s);
        found.push(Candidate::At(s));
        deflate(&mut c, s);
        last = s;
    }
    (found, Proof::Open)
}

/// Iterates until the step or the value is within rounding; `None` if it leaves
/// [−1.5, 1.5] or does not converge.
fn converged(c: &[f64], start: f64) -> Option<f64> {
    let mut x = start;
    for _ in 0..STEPS {
        let y = horner(c, x);
        let step = y.value / derivative(c, x);
        // Lemma Z13, docs/numerics/roots.md.
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

/// Divides the polynomial by (t − s) in place, without the remainder.
fn deflate(c: &mut Vec<f64>, s: f64) {
    let n = c.len() - 1;
    let large = s.abs().powi(n as i32) * c[n].abs() >= c[0].abs();
    if large && s != 0.0 {
        // Upwards: q₀ = −c₀ / s, qᵢ = (qᵢ₋₁ − cᵢ) / s.
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
