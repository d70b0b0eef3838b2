//! Matrices that take values at nodes to scaled Bernstein coefficients.
//!
//! The nodes are Chebyshev's extreme points on [0, 1], both ends included. The inverse of
//! collocation at these nodes has a norm of 46 at degree 6, 733 at 10 and 1.2e7 at 24 in
//! the Bernstein basis, less than at other nodes (lemma F5,
//! docs/numerics/polynomials.md). In q = s / (1 − s), Lagrange's polynomial of node i,
//! times (1 + q)ⁿ, is Π ((1 − s_m) q − s_m) / (s_i − s_m) over the other nodes m. Its
//! coefficients are the scaled ones of [`super::lanes`]. They are computed in integers
//! for the f64 nodes and rounded once.

use crate::math::int::decoded;
use num_bigint::{BigInt, Sign};
use std::sync::OnceLock;

/// Nodes and matrix for polynomials of degree N − 1.
#[derive(Clone, Debug)]
pub struct Collocation {
    /// The N nodes s, ascending, from 0 to 1.
    pub nodes: Vec<f64>,
    /// The N×N matrix: row j, column i is the scaled coefficient j of Lagrange's
    /// polynomial of node i. The first row is 1, 0, …
    pub rows: Vec<Vec<f64>>,
    /// Factor from errors of values to errors of unscaled coefficients: the largest row
    /// sum of magnitudes of the unscaled matrix.
    pub norm: f64,
}

/// The largest number of nodes.
pub const MOST: usize = 25;

/// Returns the table of `n` nodes, computed once; panics unless 2 ≤ n ≤ [`MOST`].
pub fn collocation(n: usize) -> &'static Collocation {
    static ALL: [OnceLock<Collocation>; MOST + 1] = [const { OnceLock::new() }; MOST + 1];
    ALL[n].get_or_init(|| Collocation::compute(n))
}

impl Collocation {
    fn compute(count: usize) -> Collocation {
        let n = count - 1;
        let node = |j: usize| match j {
            0 => 0.0,
            j if j == n => 1.0,
            j => 0.5 - 0.5 * libm::cos(std::f64::consts::PI * j as f64 / n as f64),
        };
        let nodes: Vec<f64> = (0..count).map(node).collect();
        // The nodes times 2^POWER.
        let whole: Vec<BigInt> = nodes.iter().map(|s| integer(*s)).collect();
        let one = BigInt::from(1) << POWER;
        let mut rows = vec![vec![0.0; count]; count];
        for i in 0..count {
            let (mut product, mut divisor) = (vec![BigInt::from(1)], BigInt::from(1));
            for m in (0..count).filter(|m| *m != i) {
                let mut next = vec![BigInt::ZERO; product.len() + 1];
                for (k, c) in product.iter().enumerate() {
                    next[k] -= c * &whole[m];
                    next[k + 1] += c * (&one - &whole[m]);
                }
                product = next;
                divisor *= &whole[i] - &whole[m];
            }
            for (row, c) in rows.iter_mut().zip(&product) {
                row[i] = quotient(c, &divisor);
            }
        }
        let mut binomial = 1.0;
        let mut norm = 0.0_f64;
        for (j, row) in rows.iter().enumerate() {
            let sum: f64 = row.iter().map(|x| x.abs()).sum();
            norm = norm.max(sum / binomial);
            binomial = binomial * (n - j) as f64 / (j + 1) as f64;
        }
        Collocation {
            nodes,
            rows,
            norm: norm * (1.0 + 1e-12),
        }
    }
}

/// Every node is a multiple of 2^−POWER.
const POWER: u64 = 1100;

fn integer(s: f64) -> BigInt {
    let (m, power) = decoded(s);
    BigInt::from(m) << (POWER as i64 + i64::from(power)) as u64
}

/// Returns a / b to a little more than half a unit in the last place.
fn quotient(a: &BigInt, b: &BigInt) -> f64 {
    if a.sign() == Sign::NoSign {
        return 0.0;
    }
    // The quotient has 62 or 63 bits.
    let up = b.bits() as i64 - a.bits() as i64 + 62;
    let scaled = if up >= 0 {
        (a << up as u64) / b
    } else {
        a / (b << up.unsigned_abs())
    };
    let bits = i64::try_from(scaled).unwrap_or(i64::MAX);
    bits as f64 * 2.0_f64.powi(-up as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the scaled coefficients of f: Σ over nodes of a row times values.
    fn scaled(n: usize, f: impl Fn(f64) -> f64) -> Vec<f64> {
        let table = collocation(n);
        let values: Vec<f64> = table.nodes.iter().map(|s| f(*s)).collect();
        let row = |row: &Vec<f64>| row.iter().zip(&values).map(|(a, v)| a * v).sum();
        table.rows.iter().map(row).collect()
    }

    #[test]
    fn a_constant_gives_binomials() {
        for (n, binomials) in [(3, vec![1.0, 2.0, 1.0]), (5, vec![1.0, 4.0, 6.0, 4.0, 1.0])] {
            let found = scaled(n, |_| 1.0);
            for (a, b) in found.iter().zip(&binomials) {
                assert!((a - b).abs() < 1e-13, "{found:?}");
            }
        }
    }

    #[test]
    fn ends_are_interpolated_exactly() {
        for n in 2..=MOST {
            let table = collocation(n);
            let unit = |at: usize| (0..n).map(|i| if i == at { 1.0 } else { 0.0 }).collect();
            let (first, last): (Vec<f64>, Vec<f64>) = (unit(0), unit(n - 1));
            assert_eq!(table.rows[0], first);
            assert_eq!(table.rows[n - 1], last);
        }
    }

    #[test]
    fn powers_come_out() {
        // s³ at degree 6: scaled coefficients C(3, j − 3).
        let found = scaled(7, |s| s * s * s);
        let expected = [0.0, 0.0, 0.0, 1.0, 3.0, 3.0, 1.0];
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < 1e-12, "{found:?}");
        }
    }

    #[test]
    fn norms_are_those_of_chebyshev_nodes() {
        // The least known norm at degree 10 is some hundreds.
        assert!(collocation(11).norm > 100.0 && collocation(11).norm < 2000.0);
        assert!(collocation(25).norm < 1e8);
    }
}
