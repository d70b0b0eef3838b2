//! The oracle in integers of any length: the determinants of Möller and Trumbore (1997).

use super::Pair;
use crate::number::{Exact, decode};
use num_bigint::{BigInt, Sign};
use std::cmp::Ordering;

/// Of the line of a ray and a triangle: what is met, in exact arithmetic.
pub struct Truth {
    /// The edge functions.
    pub edges: [Exact; 3],
    pub hit: bool,
    /// T and D, both times the sign of D.
    top: Exact,
    bottom: Exact,
}

/// Integers with one power of two.
fn whole(numbers: &[f64]) -> (Vec<BigInt>, i64) {
    let numbers: Vec<Exact> = numbers.iter().map(|x| Exact::from(*x)).collect();
    let used = numbers.iter().filter(|d| d.integer.sign() != Sign::NoSign);
    let power = used.map(|d| d.power).min().unwrap_or(0);
    let whole = numbers.iter().map(|d| match d.integer.sign() {
        Sign::NoSign => BigInt::ZERO,
        _ => &d.integer << (d.power - power),
    });
    (whole.collect(), power)
}

fn determinant(x: &[BigInt], y: &[BigInt], z: &[BigInt]) -> BigInt {
    let minor = |i: usize, j: usize| &y[i] * &z[j] - &y[j] * &z[i];
    &x[0] * minor(1, 2) + &x[1] * minor(2, 0) + &x[2] * minor(0, 1)
}

impl Truth {
    pub fn of(case: &Pair) -> Truth {
        let mut points = case.org.to_vec();
        points.extend(case.corners.as_flattened().iter().map(|x| f64::from(*x)));
        let (points, power) = whole(&points);
        let (d, dir_power) = whole(&case.dir);
        let from_org =
            |i: usize| -> Vec<BigInt> { (0..3).map(|k| &points[3 * i + k] - &points[k]).collect() };
        let [a, b, c] = [1, 2, 3].map(from_org);
        let edges = [
            determinant(&d, &b, &c),
            determinant(&d, &c, &a),
            determinant(&d, &a, &b),
        ];
        let det: BigInt = edges.iter().sum();
        let volume = determinant(&a, &b, &c);
        let sign = det.sign();
        let inside = |e: &BigInt| e.sign() == sign || e.sign() == Sign::NoSign;
        let hit = sign != Sign::NoSign && edges.iter().all(inside);
        let (top, bottom) = match sign {
            Sign::Minus => (-volume, -det),
            _ => (volume, det),
        };
        let exact = |integer, power| Exact { integer, power };
        Truth {
            edges: edges.map(|e| exact(e, 2 * power + dir_power)),
            hit,
            top: exact(top, 3 * power),
            bottom: exact(bottom, 2 * power + dir_power),
        }
    }

    /// By t; both are hits.
    pub fn order(&self, other: &Truth) -> Ordering {
        let left = &self.top * &other.bottom;
        left.order(&(&other.top * &self.bottom))
    }

    pub fn order_with(&self, x: &Exact) -> Ordering {
        self.top.order(&(x * &self.bottom))
    }

    /// |t − x| · D, and x · D.
    pub fn distance(&self, x: f64, error: f64) -> (Exact, Exact) {
        let [x, error] = [x, error].map(|x| &Exact::from(x) * &self.bottom);
        ((&self.top - &x).abs(), error)
    }

    /// Whether x is the f64 nearest to t, the even one of two.
    pub fn rounds_to(&self, x: f64) -> bool {
        let positive = self.top.integer.sign() != Sign::Minus;
        let magnitude = Truth {
            edges: self.edges.clone(),
            hit: self.hit,
            top: self.top.abs(),
            bottom: self.bottom.clone(),
        };
        let even = x.to_bits() & 1 == 0;
        let below_next = |x: f64, even: bool| {
            let (m, p) = decode(x);
            let halfway = Exact {
                integer: BigInt::from(2 * m + 1),
                power: p - 1,
            };
            let order = magnitude.order_with(&halfway);
            order.is_lt() || order.is_eq() && even
        };
        let x = if positive { x } else { -x };
        x >= 0.0
            && (x == f64::INFINITY || below_next(x, even))
            && (x == 0.0 || !below_next(x.next_down(), !even))
    }
}
