//! Interval halving: Moore's exclusion test (1966), with Taylor's expansion about the
//! middle of an interval as the enclosure.
//!
//! With p(m + h) = Σ aⱼ hʲ and |h| ≤ r, there is no root if |a₀| > Σ_{j≥1} |aⱼ| rʲ. p is
//! monotone if |a₁| r > Σ_{j≥2} j |aⱼ| rʲ; then the signs at the ends tell whether there
//! is a root, and bisection finds it. Other intervals are halved until the variation of p
//! over the interval is within the error of its coefficients. That error is 4n u Σ |cᵢ|
//! (|m| + r)ⁱ for all aⱼ rʲ together: each cᵢ goes through at most 2n sums and products
//! to each of them (lemma Z11, docs/numerics/roots.md).
//!
//! The answer is complete. The method is slow, and slower the closer roots lie.

use super::answer::Proof;
use super::certify_candidates::{Candidate, Line};
use crate::math::lanes::Scalar;

/// Limit of the number of intervals that are examined.
const NODES: usize = 50_000;

/// Finds candidates that cover all roots in the interval of `line`; the proof is always
/// [`Proof::Complete`].
pub fn candidates(line: &Line) -> (Vec<Candidate>, Proof) {
    let n = line.degree();
    let mut found = Vec::new();
    let mut stack = vec![(line.from, line.to)];
    let mut a = vec![0.0; n + 1];
    let mut nodes = 0;
    while let Some((low, high)) = stack.pop() {
        let (m, r) = (low + 0.5 * (high - low), 0.5 * (high - low) * 1.000_001);
        nodes += 1;
        if nodes > NODES {
            found.push(Candidate::Doubtful(low, high));
            continue;
        }
        a.copy_from_slice(&line.c);
        for i in 0..n {
            for j in (i..n).rev() {
                a[j] += m * a[j + 1];
            }
        }
        let size = line
            .c
            .iter()
            .rev()
            .fold(0.0, |y, c| y * (m.abs() + r) + c.abs());
        // Lemma Z11, docs/numerics/roots.md.
        let error = 4.0 * n as f64 * f64::UNIT_ROUNDOFF * size * 1.001 + 1e-300;
        let (mut power, mut rest, mut bend) = (1.0, 0.0, 0.0);
        for (j, a) in a.iter().enumerate().skip(1) {
            power *= r;
            rest += a.abs() * power;
            if j > 1 {
                bend += j as f64 * a.abs() * power;
            }
        }
        if a[0].abs() > rest + error {
            continue;
        }
        if a[1].abs() * r > bend + n as f64 * error {
            found.extend(bisected(line, low, high));
            continue;
        }
        // Lemma Z11, docs/numerics/roots.md.
        let narrow = r <= 4.0 * f64::EPSILON * m.abs() || r < 1e-290;
        if rest <= 4.0 * error || narrow {
            found.push(Candidate::Doubtful(low, high));
            continue;
        }
        stack.push((m, high));
        stack.push((low, m));
    }
    (found, Proof::Complete)
}

/// Bisects an interval on which p is monotone, as far as signs are certain; `None` if
/// there is no root.
fn bisected(line: &Line, mut low: f64, mut high: f64) -> Option<Candidate> {
    let (first, last) = (line.certain_sign(low), line.certain_sign(high));
    if first == last && first != 0.0 {
        return None;
    }
    loop {
        let middle = low + 0.5 * (high - low);
        if middle <= low || middle >= high {
            break;
        }
        match line.certain_sign(middle) {
            0.0 => break,
            sign if sign == first => low = middle,
            sign if sign == last => high = middle,
            // Neither end has this sign for certain, so the bracket cannot shrink.
            _ => break,
        }
    }
    Some(Candidate::Within(low, high))
}
