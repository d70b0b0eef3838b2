//! Certified isolation of roots by subdivision in f64 (Lane and Riesenfeld 1981;
//! Descartes' rule of signs on Bernstein coefficients, after Vincent).
//!
//! On an interval p is written as Σ bⱼ Bⱼ(s), 0 ≤ s ≤ 1. The number of roots in the open
//! interval, counted with multiplicity, is the number of sign changes of the bⱼ, or less
//! by an even number. Without a sign change there is no root; with one there is exactly
//! one, which is simple. Otherwise de Casteljau's scheme cuts the interval. One error
//! bound holds for all coefficients of an interval (lemma Z10, docs/numerics/roots.md):
//!
//! - Conversion from powers: bⱼ = Σ C(j,i)/C(n,i) cᵢ has weights ≤ 1, and every term
//!   takes at most 4n + 4 roundings, so |error| ≤ (4n + 16) u Σ |cᵢ|.
//! - Bisection: n averages in sequence, each rounding by u of the largest |bⱼ|, B, add
//!   n u B. A cut at another ratio adds 3 n u B.
//!
//! A sign counts only beyond the bound. If all coefficients are within the bound, they
//! are computed anew from the powers with twice the digits, since the expansion at an end
//! of the interval loses only what cancels there. An interval that is still open, or
//! whose ends run out of bits, is *doubtful*.
//!
//! Positive t are covered by one-octave intervals (11/16, 11/8] · 2^k, each with its own
//! power of two in the variable. So the bound is proportional to the size of the
//! polynomial there, whether roots are of size 1e-300 or 1e300. The ends have the factor
//! 11/8 because roots at powers of two are common, and a root at an interval's end is
//! doubtful. An octave in which one term outweighs all others has no root.

use super::eval::sum_error;
use super::polynomial::{MAX_DEGREE, Polynomial, times_power};
use crate::math::lanes::Scalar;
use std::sync::OnceLock;

const U: f64 = f64::UNIT_ROUNDOFF;

/// Upper end of an octave; it has few bits, so that ends of intervals are exact.
const TOP: f64 = 1.375;

/// The numbers s · 2^k for s from `low` to `high`, and what the isolation found there.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    pub low: f64,
    pub high: f64,
    pub k: i32,
    pub found: Found,
}

/// What the isolation proved about a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Found {
    /// Exactly one root, simple, strictly between the ends.
    One {
        /// Sign of p at `low`, ±1.
        sign_low: f64,
        /// Estimate of the root, between the ends; NaN if there is none.
        guess: f64,
    },
    /// Any number of roots.
    Doubt,
}

/// Tables of one degree n.
struct Binomials {
    /// C(n, i) by i.
    of: Vec<f64>,
    /// (11/8)^i / C(n, i) by i.
    weights: Vec<f64>,
}

impl Binomials {
    /// Returns the tables of a degree, computed once.
    fn of(n: usize) -> &'static Binomials {
        static KNOWN: [OnceLock<Binomials>; MAX_DEGREE + 1] =
            [const { OnceLock::new() }; MAX_DEGREE + 1];
        KNOWN[n].get_or_init(|| {
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
        })
    }

    /// Converts Σ cᵢ (11/8 s)ⁱ on 0 ≤ s ≤ 1 to Bernstein coefficients. Returns their
    /// error bound and Σ |cᵢ| (11/8)ⁱ.
    fn convert(&self, c: &[f64], b: &mut Vec<f64>) -> (f64, f64) {
        let n = c.len() - 1;
        b.clear();
        b.extend(c.iter().zip(&self.weights).map(|(c, w)| c * w));
        let size: f64 = b.iter().zip(&self.of).map(|(b, c)| (b * c).abs()).sum();
        accumulate(b);
        // Lemma Z10, docs/numerics/roots.md.
        let error = (4.0 * n as f64 + 16.0) * U * 1.001 * size;
        (error + super::eval::FLOOR, size)
    }
}

/// Accumulates bⱼ ← Σ C(j, i) bᵢ in place.
fn accumulate(b: &mut [f64]) {
    for k in 1..b.len() {
        for j in (k..b.len()).rev() {
            b[j] += b[j - 1];
        }
    }
}

/// Isolates the positive roots of a polynomial with c₀ ≠ 0 between two numbers ≥ 0, and a
/// few roots beyond them. The pieces ascend and meet at most at their ends.
pub fn isolate(p: &Polynomial, from: f64, to: f64) -> Vec<Piece> {
    let n = p.degree();
    let mut pieces = Vec::new();
    if n == 0 {
        return pieces;
    }
    let binomials = Binomials::of(n);
    // No root is below 2^`lowest`, and no requested one is above 11/8 · 2^k.
    let lowest = p.root_bound_below();
    let mut k = p.root_bound().min(high_exponent(to));
    let floor = lowest.max(low_exponent(from)) - 1;
    let (mut c, mut b) = (Vec::with_capacity(n + 1), Vec::with_capacity(n + 1));
    let mut octave = Octave::default();
    while k > floor {
        p.scaled_into(k, &mut c);
        if outweighed(&c) {
            k -= 1;
            continue;
        }
        let (error, size) = binomials.convert(&c, &mut b);
        match changes(&b, error) {
            Some(0) => break,
            Some(1) => {
                pieces.push(Piece {
                    low: times_power(1.0, lowest.saturating_sub(k).max(-1000)),
                    high: TOP,
                    k,
                    found: Found::One {
                        sign_low: b[0].signum(),
                        guess: TOP * crossing(&b),
                    },
                });
                break;
            }
            _ => {}
        }
        let at = pieces.len();
        octave.look(&c, &b, error, size, k, &mut pieces);
        // Octaves descend, and the pieces of one octave ascend.
        pieces[at..].reverse();
        k -= 1;
    }
    pieces.reverse();
    pieces
}

/// Returns a k with 11/16 · 2^k ≤ x, or an extreme k for 0 and infinity.
fn low_exponent(x: f64) -> i32 {
    match super::polynomial::exponent(x) {
        Some(e) if x < f64::INFINITY => e,
        Some(_) => 1 << 20,
        None => -(1 << 20),
    }
}

/// Returns a k with x ≤ 11/8 · 2^k, or an extreme k for 0 and infinity.
fn high_exponent(x: f64) -> i32 {
    match super::polynomial::exponent(x) {
        Some(e) if x < f64::INFINITY => e + 1,
        Some(_) => 1 << 20,
        None => -(1 << 20),
    }
}

/// Whether one term is larger than all others together for 11/16 ≤ s ≤ 11/8.
fn outweighed(c: &[f64]) -> bool {
    let (mut power, mut largest, mut at) = (1.0, 0.0, 0);
    for (i, c) in c.iter().enumerate() {
        let term = c.abs() * power;
        power *= TOP;
        if term > largest {
            (largest, at) = (term, i);
        }
    }
    // Relative to term j, an earlier term weighs most at the lower end: twice as much for
    // each power between them.
    let (mut power, mut others) = (1.0, 0.0);
    for (i, c) in c.iter().enumerate() {
        let term = c.abs() * power;
        power *= TOP;
        others = match i.cmp(&at) {
            std::cmp::Ordering::Less => 2.0 * (others + term),
            std::cmp::Ordering::Equal => others,
            std::cmp::Ordering::Greater => others + term,
        };
    }
    others < 0.999 * largest
}

/// Counts sign changes of coefficients that are off by at most `error`; `None` if the
/// count is not certain.
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

/// Returns the largest count of sign changes over all signs of coefficients within
/// `error`.
fn most_changes(b: &[f64], error: f64) -> u32 {
    // Most changes so far if the last sign is + or −.
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

/// Returns the first zero crossing of the control polygon, relative to the interval's
/// width; ½ if there is none.
fn crossing(b: &[f64]) -> f64 {
    let width = 1.0 / (b.len() - 1) as f64;
    let is_change = |w: &[f64]| (w[0] < 0.0) != (w[1] < 0.0);
    match b.windows(2).position(is_change) {
        Some(j) => (j as f64 + b[j] / (b[j] - b[j + 1])) * width,
        None => 0.5,
    }
}

/// A part of an octave with its Bernstein coefficients; ends are relative to the octave.
struct Part {
    low: f64,
    high: f64,
    error: f64,
    /// Whether the coefficients were computed with twice the digits.
    is_fine: bool,
    b: Vec<f64>,
}

/// A stack of parts to be examined, and spare vectors.
#[derive(Default)]
struct Octave {
    stack: Vec<Part>,
    spare: Vec<Vec<f64>>,
}

impl Octave {
    /// Appends the pieces of the upper half of 0 ≤ s ≤ 11/8. `b` are the Bernstein
    /// coefficients with error bound `error`, and `size` is Σ |cᵢ| (11/8)ⁱ.
    fn look(
        &mut self,
        c: &[f64],
        b: &[f64],
        error: f64,
        size: f64,
        k: i32,
        pieces: &mut Vec<Piece>,
    ) {
        let mut whole = self.room();
        whole.extend(b);
        let whole = Part {
            low: 0.0,
            high: 1.0,
            error,
            is_fine: false,
            b: whole,
        };
        let (lower, upper) = self.cut(&whole, 0.5, largest(b));
        self.spare.extend([lower.b, whole.b]);
        self.stack.push(upper);
        while let Some(mut part) = self.stack.pop() {
            let scaled = |found| Piece {
                low: part.low * TOP,
                high: part.high * TOP,
                k,
                found,
            };
            let count = changes(&part.b, part.error);
            if count == Some(1) {
                let at = part.low + (part.high - part.low) * crossing(&part.b);
                pieces.push(scaled(Found::One {
                    sign_low: part.b[0].signum(),
                    guess: TOP * at,
                }));
            }
            if let Some(0 | 1) = count {
                self.spare.push(part.b);
                continue;
            }
            let size_here = largest(&part.b);
            // A ratio has four bits, and so has 11/8: down to this width all ends are
            // exact.
            let has_bits = part.high - part.low >= 2.0_f64.powi(-44);
            if has_bits && size_here > 4.0 * part.error {
                let (lower, upper) = self.cut_clear(&part, size_here);
                self.stack.push(upper);
                self.stack.push(lower);
                self.spare.push(part.b);
            } else if !part.is_fine {
                refresh(c, size, &mut part);
                self.stack.push(part);
            } else {
                let is_open = part.b[0].abs() <= part.error;
                join(pieces, scaled(Found::Doubt), is_open);
                self.spare.push(part.b);
            }
        }
    }

    fn room(&mut self) -> Vec<f64> {
        let mut room = self.spare.pop().unwrap_or_default();
        room.clear();
        room
    }

    /// Cuts in the middle, or beside it if p may be 0 in the middle.
    fn cut_clear(&mut self, part: &Part, largest: f64) -> (Part, Part) {
        let halves = self.cut(part, 0.5, largest);
        if halves.1.b[0].abs() > 2.0 * halves.1.error {
            return halves;
        }
        for ratio in [0.4375, 0.5625, 0.3125] {
            let parts = self.cut(part, ratio, largest);
            if parts.1.b[0].abs() > 2.0 * parts.1.error {
                return parts;
            }
        }
        halves
    }

    /// Cuts an interval at a ratio of its width; returns both parts.
    fn cut(&mut self, part: &Part, ratio: f64, largest: f64) -> (Part, Part) {
        let n = part.b.len() - 1;
        let (mut lower, mut upper) = (self.room(), self.room());
        upper.extend(&part.b);
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
        // Lemma Z10, docs/numerics/roots.md.
        let error = part.error + roundings * n as f64 * U * 1.001 * largest;
        let at = part.low + (part.high - part.low) * ratio;
        let of = |low, high, b| Part {
            low,
            high,
            error,
            is_fine: part.is_fine,
            b,
        };
        (of(part.low, at, lower), of(at, part.high, upper))
    }
}

fn largest(b: &[f64]) -> f64 {
    b.iter().fold(0.0, |m: f64, b| m.max(b.abs()))
}

/// Computes the coefficients of a part anew with twice the digits. The polynomial is
/// expanded at the part's lower end by Horner's scheme in pairs of numbers (Dekker),
/// where each of n steps errs by less than 8u² of Σ |cᵢ| (11/8)ⁱ, and then converted as
/// on a whole octave.
fn refresh(c: &[f64], size: f64, part: &mut Part) {
    let n = c.len() - 1;
    let (m, width) = (part.low * TOP, (part.high - part.low) * TOP);
    let mut high = [0.0; MAX_DEGREE + 1];
    let mut low = [0.0; MAX_DEGREE + 1];
    high[..=n].copy_from_slice(c);
    for i in 0..n {
        for j in (i..n).rev() {
            // a[j] += m a[j + 1].
            let product = m * high[j + 1];
            let rest = m.mul_add(high[j + 1], -product) + m * low[j + 1];
            let sum = high[j] + product;
            let rest = sum_error(high[j], product, sum) + (low[j] + rest);
            high[j] = sum + rest;
            low[j] = rest - (high[j] - sum);
        }
    }
    let (mut power, mut here) = (1.0, 0.0);
    let binomials = Binomials::of(n);
    for j in 0..=n {
        let a = high[j] * power;
        power *= width;
        here += a.abs();
        part.b[j] = a / binomials.of[j];
    }
    accumulate(&mut part.b);
    let n = n as f64;
    // Lemma Z10, docs/numerics/roots.md.
    let error = (4.0 * n + 16.0) * U * 1.001 * here + 16.0 * n * U * U * size;
    part.error = error + super::eval::FLOOR;
    part.is_fine = true;
}

/// Appends a doubtful piece. It is merged with its neighbour unless p is certainly not 0
/// where they meet.
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
