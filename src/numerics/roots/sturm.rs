//! Sturm's chain in f64 with error bounds, and isolation by bisection.
//!
//! Every coefficient of the chain carries an error bound through each division (lemma
//! Z12, docs/numerics/roots.md). A leading coefficient or a sign that is not certain ends
//! the chain; the rest is doubtful and decided in integers (`exact/chain.rs`). The chain
//! of a square-free polynomial ends in a constant that is not 0. So a chain that ends
//! with certainty proves that all roots are simple.

use super::bernstein::{Found, Piece};
use super::eval::FLOOR;
use super::polynomial::{Polynomial, exponent, times_power};
use crate::math::lanes::Scalar;

const U: f64 = f64::UNIT_ROUNDOFF;

/// A member of the chain: coefficients of magnitude at most about 1, and their error
/// bounds.
#[derive(Clone, Debug)]
struct Row {
    c: Vec<f64>,
    error: Vec<f64>,
}

impl Row {
    /// Multiplies by the power of two that makes the largest coefficient about 1.
    fn normalised(mut self) -> Row {
        let largest = self.c.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
        if let Some(e) = exponent(largest) {
            self.c.iter_mut().for_each(|c| *c = times_power(*c, -e));
            self.error
                .iter_mut()
                .for_each(|c| *c = times_power(*c, -e) + FLOOR);
        }
        self
    }

    /// Returns the sign at x as ±1 if it is certain. Lemma Z12, docs/numerics/roots.md.
    fn certain_sign(&self, x: f64) -> Option<f64> {
        let n = self.c.len() - 1;
        let (mut y, mut mu, mut off) = (self.c[n], 0.5 * self.c[n].abs(), self.error[n]);
        for i in (0..n).rev() {
            y = x * y + self.c[i];
            mu = x.abs() * mu + y.abs();
            off = x.abs() * off + self.error[i];
        }
        // Lemma Z12, docs/numerics/roots.md.
        let error = 2.0 * U * mu * 1.000_1 + off * 1.000_1 + FLOOR;
        (y.abs() > error).then(|| y.signum())
    }
}

/// Computes the chain; `None` if a leading coefficient is not certain.
fn chain(c: &[f64]) -> Option<Vec<Row>> {
    let first = Row {
        c: c.to_vec(),
        error: vec![FLOOR; c.len()],
    };
    let slope: Vec<f64> = (1..c.len()).map(|i| c[i] * i as f64).collect();
    let second = Row {
        // Lemma Z12, docs/numerics/roots.md.
        error: slope.iter().map(|c| U * c.abs() + FLOOR).collect(),
        c: slope,
    };
    let mut rows = vec![first, second.normalised()];
    while rows[rows.len() - 1].c.len() > 1 {
        let next = negative_remainder(&rows[rows.len() - 2], &rows[rows.len() - 1])?;
        rows.push(next.normalised());
    }
    let last = &rows[rows.len() - 1];
    (last.c[0].abs() > last.error[0]).then_some(rows)
}

/// Returns −a mod b with error bounds; `None` if a leading coefficient is not certain.
/// Lemma Z12, docs/numerics/roots.md.
fn negative_remainder(a: &Row, b: &Row) -> Option<Row> {
    let m = b.c.len() - 1;
    let (leading, off) = (b.c[m], b.error[m]);
    if !(leading.abs() > 4.0 * off) {
        return None;
    }
    let (mut c, mut error) = (a.c.clone(), a.error.clone());
    while c.len() > m {
        let top = c.len() - 1;
        let q = c[top] / leading;
        // Error of q from both coefficients and from rounding. Lemma Z12,
        // docs/numerics/roots.md.
        let q_error = (error[top] + q.abs() * off) / (leading.abs() - off) + 2.0 * U * q.abs();
        for j in 0..m {
            let i = top - m + j;
            let product = q * b.c[j];
            let next = c[i] - product;
            // Lemma Z12, docs/numerics/roots.md.
            error[i] += q_error * (b.c[j].abs() + b.error[j])
                + q.abs() * b.error[j]
                + 2.0 * U * (product.abs() + next.abs());
            error[i] *= 1.0 + 8.0 * U;
            c[i] = next;
        }
        c.pop();
        error.pop();
    }
    c.iter_mut().for_each(|c| *c = -*c);
    // The degree must drop by exactly one; otherwise it is not known.
    let top = c.len() - 1;
    (c[top].abs() > error[top]).then_some(Row { c, error })
}

/// Counts sign changes of the chain at x; `None` if a sign that matters is not certain.
/// The sign of a member between two of opposite signs does not matter.
fn changes(rows: &[Row], x: f64) -> Option<u32> {
    let (mut count, mut last) = (0, rows[0].certain_sign(x)?);
    let mut skipped = false;
    for row in &rows[1..] {
        match row.certain_sign(x) {
            None if skipped => return None,
            None => skipped = true,
            Some(sign) if skipped && sign == last => return None,
            Some(sign) => {
                count += u32::from(sign != last);
                last = sign;
                skipped = false;
            }
        }
    }
    (!skipped).then_some(count)
}

/// Counts the roots of a polynomial with c₀ ≠ 0 between two numbers ≥ 0 that are not
/// roots (Sturm's theorem). `None` if a sign is not certain.
pub fn count(p: &Polynomial, from: f64, to: f64) -> Option<u32> {
    if p.degree() == 0 {
        return Some(0);
    }
    let k = p.root_bound();
    let scaled = |t: f64| times_power(t, -k).min(1.0);
    let mut c = Vec::new();
    p.scaled_into(k, &mut c);
    let rows = chain(&c)?;
    Some(changes(&rows, scaled(from))? - changes(&rows, scaled(to))?)
}

/// Isolates positive roots, with the contract of [`super::bernstein::isolate`].
pub fn isolate(p: &Polynomial, from: f64, to: f64) -> Vec<Piece> {
    if p.degree() == 0 {
        return Vec::new();
    }
    let k = p.root_bound();
    let scaled = |t: f64| match t.is_finite() {
        true => times_power(t, -k).min(1.0),
        false => 1.0,
    };
    let (from, to) = (scaled(from), scaled(to));
    // Requested ends may be roots: take a slightly larger interval.
    let from = if from > 0.0 { from * 0.99 } else { 0.0 };
    // The upper end stays distinguishable from 0 at this scale.
    let to = (to * 1.01).clamp(1e-290, 1.0);
    if !(from < to) {
        return Vec::new();
    }
    // Truncate to few bits, so that ends are exact at every scale.
    let few = |x: f64| f64::from_bits(x.to_bits() & !((1 << 40) - 1));
    let (from, to) = (few(from), (few(to) * (1.0 + 2.0_f64.powi(-11))).min(1.0));
    let doubt = |low, high| Piece {
        low,
        high,
        k,
        found: Found::Doubt,
    };
    let mut c = Vec::new();
    p.scaled_into(k, &mut c);
    let Some(rows) = chain(&c) else {
        return vec![doubt(from, to)];
    };
    let (Some(low), Some(high)) = (changes(&rows, from), changes(&rows, to)) else {
        return vec![doubt(from, to)];
    };
    let mut pieces = Vec::new();
    let mut stack = vec![((from, low), (to, high))];
    while let Some((a, b)) = stack.pop() {
        match a.1 - b.1 {
            0 => continue,
            1 => {
                let sign = rows[0].certain_sign(a.0).unwrap_or(1.0);
                pieces.push(Piece {
                    found: Found::One {
                        sign_low: sign,
                        guess: f64::NAN,
                    },
                    ..doubt(a.0, b.0)
                });
                continue;
            }
            _ => {}
        }
        let middle = [0.5, 0.4375, 0.5625, 0.3125].iter().find_map(|ratio| {
            let x = a.0 + (b.0 - a.0) * ratio;
            (x > a.0 && x < b.0).then_some(())?;
            Some((x, changes(&rows, x)?))
        });
        match middle {
            Some(middle) => {
                stack.push((middle, b));
                stack.push((a, middle));
            }
            None => pieces.push(doubt(a.0, b.0)),
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lectures_cubic_has_its_counts() {
        let rows = chain(&[-1.0, 0.0, 3.0, 1.0]).unwrap();
        assert!(rows[3].c[0] > 0.0, "the last member is +9/4");
        let at = |t: f64| changes(&rows, t).unwrap();
        for (low, high, count) in [
            (0.0, 1.0, 1),
            (0.0, 1e9, 1),
            (-1e9, 1e9, 3),
            (-1.0, 0.0, 1),
            (-3.0, -2.0, 1),
        ] {
            assert_eq!(at(low) - at(high), count, "({low}, {high}]");
        }
        // The chain of (t − 1)² does not end in a certain constant.
        assert!(chain(&[1.0, -2.0, 1.0]).is_none());
    }
}
