//! Isolation of roots by subdivision in f64, certified (Lane and Riesenfeld 1981;
//! Descartes' rule on Bernstein coefficients, after Vincent).
//!
//! On an interval p is written as Σ bⱼ Bⱼ(s), 0 ≤ s ≤ 1. The open interval holds
//! as many roots, by multiplicity, as the bⱼ have changes of sign, or fewer by an
//! even number: without change there is none, with one change there is exactly
//! one, which is simple. Otherwise the interval is cut, by de Casteljau's averages.
//! One bound goes with all coefficients of an interval:
//!
//! - Conversion from powers: bⱼ = Σ C(j,i)/C(n,i) cᵢ has weights ≤ 1, and every term
//!   takes at most 4n + 4 roundings, so |error| ≤ (4n + 16) u Σ |cᵢ|.
//! - Halving: n averages one after the other, each rounding by u of at most the
//!   largest |bⱼ|, B: n u B more. Cutting at another ratio: 3 n u B more.
//!
//! A sign counts only beyond the bound. What stays open where all coefficients are
//! within the bound, or where the ends of intervals run out of bits, is *doubtful*.
//!
//! Positive t are covered by intervals of one octave, (11/16, 11/8] · 2^k, each with
//! its own power of two in the variable: then the bound is as small as the
//! polynomial is there, whether roots are of size 1e-300 or 1e300. (11/8, because
//! roots at powers of two are common, and a root at an interval's end is
//! doubtful.) Octaves in which one term outweighs all others have no root.

use super::polynomial::{MAX_DEGREE, Polynomial, times_power};
use crate::math::lanes::Scalar;

const U: f64 = f64::UNIT_ROUNDOFF;

/// The upper end of octaves, which has few bits.
const TOP: f64 = 1.375;

/// Numbers s · 2^k from `low` to `high`.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    pub low: f64,
    pub high: f64,
    pub k: i32,
    pub found: Found,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Found {
    /// Exactly one root, simple, between the ends, which are none. The sign at `low`.
    One(f64),
    /// Nobody knows.
    Doubt,
}

/// C(n, i) and what else a degree needs.
pub struct Binomials {
    of: Vec<f64>,
    /// (11/8)^i / C(n, i).
    weights: Vec<f64>,
}

impl Binomials {
    pub fn new(n: usize) -> Binomials {
        let mut of = vec![1.0; n + 1];
        for i in 0..n {
            of[i + 1] = of[i] * (n - i) as f64 / (i + 1) as f64;
        }
        let mut power = 1.0;
        let weight = |c: &f64| {
            let weight = power / c;
            power *= TOP;
            weight
        };
        let weights = of.iter().map(weight).collect();
        Binomials { of, weights }
    }
}

/// The positive roots of a polynomial with c₀ ≠ 0 between two numbers ≥ 0, and a
/// few beside these: ascending pieces, pairwise without common points but ends.
pub fn isolate(p: &Polynomial, from: f64, to: f64) -> Vec<Piece> {
    let n = p.degree();
    let mut pieces = Vec::new();
    if n == 0 {
        return pieces;
    }
    let binomials = Binomials::new(n);
    // 2^k from which there are no roots, and below which there are none.
    let mut k = p.root_bound();
    let lowest = p.root_bound_below();
    let (first, last) = (low_exponent(from), high_exponent(to));
    k = k.min(last);
    let floor = lowest.max(first) - 1;
    let (mut c, mut b) = (Vec::new(), Vec::new());
    while k > floor {
        p.scaled_into(k, &mut c);
        if outweighed(&c) {
            k -= 1;
            continue;
        }
        let error = binomials.convert(&c, &mut b);
        match changes(&b, error) {
            Some(0) => break,
            Some(1) => {
                pieces.push(Piece {
                    low: times_power(1.0, lowest.saturating_sub(k).max(-1000)),
                    high: TOP,
                    k,
                    found: Found::One(b[0].signum()),
                });
                break;
            }
            _ => {}
        }
        let at = pieces.len();
        octave(&b, error, k, &mut pieces);
        // Octaves come downwards, pieces of one upwards.
        pieces[at..].reverse();
        k -= 1;
    }
    pieces.reverse();
    pieces
}

/// Some k with 11/16 · 2^k ≤ x, or so low that it does not matter.
fn low_exponent(x: f64) -> i32 {
    match super::polynomial::exponent(x) {
        Some(e) if x < f64::INFINITY => e,
        Some(_) => 1 << 20,
        None => -(1 << 20),
    }
}

/// Some k with x ≤ 11/8 · 2^k.
fn high_exponent(x: f64) -> i32 {
    match super::polynomial::exponent(x) {
        Some(e) if x < f64::INFINITY => e + 1,
        Some(_) => 1 << 20,
        None => -(1 << 20),
    }
}

/// One term is larger than all others together, for 11/16 ≤ s ≤ 11/8.
fn outweighed(c: &[f64]) -> bool {
    let mut terms = [0.0; MAX_DEGREE + 1];
    let (mut power, mut largest) = (1.0, 0);
    for (i, c) in c.iter().enumerate() {
        terms[i] = c.abs() * power;
        power *= TOP;
        if terms[i] > terms[largest] {
            largest = i;
        }
    }
    // Against term j, terms before it weigh most at the lower end.
    let mut others = 0.0;
    for term in &terms[..largest] {
        others = 2.0 * (others + term);
    }
    // In the loop above term i has been doubled j − i times.
    for term in &terms[largest + 1..c.len()] {
        others += term;
    }
    others < 0.999 * terms[largest]
}

impl Binomials {
    /// Bernstein coefficients on 0 ≤ s ≤ 11/8, and the bound of their errors.
    fn convert(&self, c: &[f64], b: &mut Vec<f64>) -> f64 {
        let n = c.len() - 1;
        b.clear();
        let weighted = c.iter().zip(&self.weights).map(|(c, w)| c * w);
        b.extend(weighted);
        let size: f64 = b.iter().zip(&self.of).map(|(b, c)| (b * c).abs()).sum();
        for k in 1..=n {
            for j in (k..=n).rev() {
                b[j] += b[j - 1];
            }
        }
        (4.0 * n as f64 + 16.0) * U * 1.001 * size + super::eval::FLOOR
    }
}

/// Changes of sign, where these are certain.
pub fn changes(b: &[f64], error: f64) -> Option<u32> {
    let (mut count, mut last) = (0, 0.0);
    let mut certain = true;
    for b in b {
        if b.abs() <= error {
            certain = false;
            continue;
        }
        if b.signum() * last < 0.0 {
            count += 1;
        }
        last = b.signum();
    }
    if certain {
        return Some(count);
    }
    let most = most_changes(b, error);
    let ends = b[0].abs() > error && b[b.len() - 1].abs() > error;
    (ends && most == count).then_some(count)
}

/// Where signs within the error are as bad as they can be.
fn most_changes(b: &[f64], error: f64) -> u32 {
    // Most changes so far, with + or − at the end.
    let may = |b: f64, sign: f64| b.abs() <= error || b.signum() == sign;
    let start = |sign| may(b[0], sign).then_some(0);
    let (mut plus, mut minus): (Option<u32>, Option<u32>) = (start(1.0), start(-1.0));
    for b in &b[1..] {
        let best = |same: Option<u32>, other: Option<u32>| same.max(other.map(|x| x + 1));
        let next = (best(plus, minus), best(minus, plus));
        plus = next.0.filter(|_| may(*b, 1.0));
        minus = next.1.filter(|_| may(*b, -1.0));
    }
    plus.max(minus).unwrap_or(0)
}

/// A part of an octave.
struct Part {
    low: f64,
    high: f64,
    error: f64,
    b: Vec<f64>,
}

/// The upper half of [0, 11/8].
fn octave(b: &[f64], error: f64, k: i32, pieces: &mut Vec<Piece>) {
    let whole = Part {
        low: 0.0,
        high: 1.0,
        error,
        b: b.to_vec(),
    };
    let largest = b.iter().fold(0.0, |m: f64, b| m.max(b.abs()));
    let (_, upper) = cut(&whole, 0.5, largest);
    let mut stack = vec![upper];
    while let Some(part) = stack.pop() {
        let scaled = |found| Piece {
            low: part.low * TOP,
            high: part.high * TOP,
            k,
            found,
        };
        match changes(&part.b, part.error) {
            Some(0) => continue,
            Some(1) => {
                pieces.push(scaled(Found::One(part.b[0].signum())));
                continue;
            }
            _ => {}
        }
        let largest = part.b.iter().fold(0.0, |m: f64, b| m.max(b.abs()));
        // Four bits for a ratio, four for 11/8: then all ends are exact.
        let has_bits = part.high - part.low >= 2.0_f64.powi(-44);
        if has_bits && largest > 4.0 * part.error {
            let (lower, upper) = cut_clear(part, largest);
            stack.push(upper);
            stack.push(lower);
        } else {
            join(pieces, scaled(Found::Doubt), part.b[0].abs() <= part.error);
        }
    }
}

/// Doubtful pieces are one, unless p is certainly not 0 where they meet.
fn join(pieces: &mut Vec<Piece>, piece: Piece, low_is_open: bool) {
    match pieces.last_mut() {
        Some(last)
            if low_is_open
                && last.found == Found::Doubt
                && last.k == piece.k
                && last.high == piece.low =>
        {
            last.high = piece.high;
        }
        _ => pieces.push(piece),
    }
}

/// In the middle, or beside it where there might be a root.
fn cut_clear(part: Part, largest: f64) -> (Part, Part) {
    let halves = cut(&part, 0.5, largest);
    if halves.1.b[0].abs() > 2.0 * halves.1.error {
        return halves;
    }
    for ratio in [0.4375, 0.5625, 0.3125] {
        let parts = cut(&part, ratio, largest);
        if parts.1.b[0].abs() > 2.0 * parts.1.error {
            return parts;
        }
    }
    halves
}

/// Both parts of an interval.
fn cut(part: &Part, ratio: f64, largest: f64) -> (Part, Part) {
    let n = part.b.len() - 1;
    let mut upper = part.b.clone();
    let mut lower = Vec::with_capacity(n + 1);
    lower.push(upper[0]);
    for m in (1..=n).rev() {
        if ratio == 0.5 {
            for j in 0..m {
                upper[j] = 0.5 * (upper[j] + upper[j + 1]);
            }
        } else {
            for j in 0..m {
                upper[j] = (1.0 - ratio) * upper[j] + ratio * upper[j + 1];
            }
        }
        lower.push(upper[0]);
    }
    let roundings = if ratio == 0.5 { 1.0 } else { 3.0 };
    let error = part.error + roundings * n as f64 * U * 1.001 * largest;
    let at = part.low + (part.high - part.low) * ratio;
    let of = |low, high, b| Part {
        low,
        high,
        error,
        b,
    };
    (of(part.low, at, lower), of(at, part.high, upper))
}
