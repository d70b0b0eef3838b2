//! Certification of isolated roots, shared by `auto`, `sturm` and `bernstein`.
//!
//! 1. Factors t are removed, and the negative half-line is mirrored onto the positive
//!    one.
//! 2. Isolation in f64 (subdivision, or Sturm's chain) gives intervals with one simple
//!    root each, and doubtful intervals.
//! 3. The roots of the former are refined (`refine.rs`). Roots that cannot be refined,
//!    and doubtful intervals, are decided by integers (`exact/`) or reported as clusters.
//! 4. Roots that round to an end of the requested interval are compared with it exactly.

use super::Want;
use super::algebraic::against;
use super::answer::{Answer, Cluster, Parity, Proof, Root};
use super::bernstein::{Found, Piece};
use super::exact::{self, Isolated, Point};
use super::interval::Interval;
use super::polynomial::{Polynomial, times_power};
use super::refine::{approach, certified};
use num_bigint::BigInt;
use std::cell::OnceCell;
use std::cmp::Ordering;

/// The isolation, and the treatment of doubtful pieces.
#[derive(Clone, Copy)]
pub struct Method {
    /// Isolates the roots of a polynomial with c₀ ≠ 0 between two numbers ≥ 0; the pieces
    /// ascend.
    pub isolate: fn(&Polynomial, f64, f64) -> Vec<Piece>,
    pub doubts: Doubts,
}

/// The treatment of pieces that f64 cannot decide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doubts {
    /// Isolate by Descartes' rule of signs in integers.
    Descartes,
    /// Isolate by Sturm's chain in integers, or by Descartes' rule if the chain grows too
    /// long.
    Chain,
    /// Report a cluster.
    Report,
}

/// Finds the roots of a polynomial in an interval.
pub fn roots(p: &Polynomial, interval: &Interval, want: Want, method: Method) -> Answer {
    let mut answer = Answer::empty(Proof::Complete);
    if !interval.is_sound() {
        return answer;
    }
    let (rest, zeros) = p.without_zero();
    let is_done = |answer: &Answer| {
        want == Want::Nearest && !(answer.roots.is_empty() && answer.clusters.is_empty())
    };
    if interval.from() < 0.0 {
        let mirrored = rest.mirrored();
        let half_line = HalfLine::new(&mirrored, method);
        // The least root is the farthest from 0.
        half_line.roots(&interval.mirrored(), want, Order::Descending, &mut answer);
        for root in &mut answer.roots {
            *root = root.mirrored();
        }
        for cluster in &mut answer.clusters {
            (cluster.low, cluster.high) = (-cluster.high, -cluster.low);
        }
    }
    let has_zero = zeros > 0 && interval.holds(|end| 0.0_f64.total_cmp(&(end + 0.0)));
    if has_zero && !is_done(&answer) {
        answer.roots.push(Root::zero(zeros));
    }
    if interval.to() > 0.0 && !is_done(&answer) {
        let mut above = Answer::empty(Proof::Complete);
        HalfLine::new(&rest, method).roots(interval, want, Order::Ascending, &mut above);
        answer.roots.extend(above.roots);
        answer.clusters.extend(above.clusters);
    }
    answer.sort();
    if want == Want::Nearest {
        answer.roots.truncate(1);
    }
    answer
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    Ascending,
    Descending,
}

/// A polynomial without the root 0 on the positive half-line; its integer form is
/// computed on demand.
struct HalfLine<'p> {
    p: &'p Polynomial,
    method: Method,
    integers: OnceCell<Vec<BigInt>>,
    factors: OnceCell<Option<exact::Factors>>,
}

impl<'p> HalfLine<'p> {
    fn new(p: &'p Polynomial, method: Method) -> HalfLine<'p> {
        HalfLine {
            p,
            method,
            integers: OnceCell::new(),
            factors: OnceCell::new(),
        }
    }

    fn integers(&self) -> &[BigInt] {
        self.integers.get_or_init(|| exact::integers(self.p))
    }

    fn factors(&self) -> Option<&exact::Factors> {
        let factors = || exact::factors(self.integers());
        self.factors.get_or_init(factors).as_ref()
    }

    fn roots(&self, interval: &Interval, want: Want, order: Order, answer: &mut Answer) {
        let (from, to) = (interval.from().max(0.0), interval.to());
        if self.p.degree() == 1 {
            return self.line(interval, answer);
        }
        let mut pieces = (self.method.isolate)(self.p, from, to);
        if order == Order::Descending {
            pieces.reverse();
        }
        let mut scratch = Vec::new();
        let mut at = 0;
        while at < pieces.len() {
            let piece = pieces[at];
            at += 1;
            match piece.found {
                Found::One { sign_low, guess } => {
                    let Some(t) = self.simple(&piece, sign_low, guess, &mut scratch) else {
                        let (low, high) = ends(&piece);
                        self.report(&low, &high, interval, answer);
                        continue;
                    };
                    let side = |end: f64| self.simple_against(&piece, t, end);
                    if interval.holds(side) {
                        answer.roots.push(Root::nearest(t, 1));
                    }
                }
                Found::Doubt => {
                    let (mut low, mut high) = ends(&piece);
                    // Merge doubtful neighbours that meet in a root.
                    while let Some(next) = pieces.get(at).filter(|n| n.found == Found::Doubt) {
                        let (a, b) = ends(next);
                        let meeting = match order {
                            Order::Ascending => (a == high).then_some(&a),
                            Order::Descending => (b == low).then_some(&b),
                        };
                        let is_root =
                            |at: &Point| exact::sign_at(self.integers(), at) == Ordering::Equal;
                        if !meeting.is_some_and(is_root) {
                            break;
                        }
                        (low, high) = (low.min(a), high.max(b));
                        at += 1;
                    }
                    self.doubtful(low, high, interval, answer);
                }
            }
            let is_empty = answer.roots.is_empty() && answer.clusters.is_empty();
            if want == Want::Nearest && !is_empty {
                return;
            }
        }
    }

    /// Solves c₀ + c₁ t = 0; division rounds correctly.
    fn line(&self, interval: &Interval, answer: &mut Answer) {
        let c = self.p.coefficients();
        if (c[0] > 0.0) == (c[1] > 0.0) {
            return;
        }
        let t = (-c[0] / c[1]).min(f64::MAX);
        // If the root rounds to an end, the sign of p there tells on which side it lies.
        let against = |end: f64| match t.total_cmp(&end) {
            Ordering::Equal => {
                let sign = exact::sign_at(self.integers(), &Point::of(end, 0));
                if c[1] > 0.0 { sign.reverse() } else { sign }
            }
            order => order,
        };
        if interval.holds(against) {
            answer.roots.push(Root::nearest(t, 1));
        }
    }

    /// Returns the root of a piece with one root, correctly rounded; `None` if f64 cannot
    /// round it and integers are not allowed.
    fn simple(
        &self,
        piece: &Piece,
        sign_low: f64,
        guess: f64,
        scratch: &mut Vec<f64>,
    ) -> Option<f64> {
        self.p.scaled_into(piece.k, scratch);
        let x = approach(scratch, piece.low, piece.high, sign_low, guess);
        if let Some(found) = certified(self.p, x, piece.k, scratch) {
            let down = times_power(1.0, found.k - piece.k);
            let (s, reach) = (found.s * down, found.reach * down);
            // The certified root is the piece's own only if all of its reach is inside.
            if s - 2.0 * reach > piece.low && s + 2.0 * reach < piece.high {
                return Some(found.t());
            }
        }
        if self.method.doubts == Doubts::Report {
            return None;
        }
        let (low, high) = ends(piece);
        let guess = times_power(x, piece.k);
        Some(exact::nearest(self.integers(), &low, &high, guess))
    }

    /// Compares the root of a piece, whose nearest f64 is t, with an f64, exactly.
    fn simple_against(&self, piece: &Piece, t: f64, end: f64) -> Ordering {
        if t != end {
            return t.total_cmp(&end);
        }
        let (low, high) = ends(piece);
        against(self.integers(), &low, &high, &Point::of(end, 0))
    }

    /// Makes a cluster of the interval, one step wider, with its parity.
    fn cluster(&self, low: &Point, high: &Point) -> Cluster {
        let sign = |at| exact::sign_at(self.integers(), at);
        Cluster {
            low: exact::rounded(low).next_down(),
            high: exact::rounded(high).next_up(),
            parity: match (sign(low), sign(high)) {
                (Ordering::Equal, _) | (_, Ordering::Equal) => Parity::Unknown,
                (a, b) if a == b => Parity::Even,
                _ => Parity::Odd,
            },
        }
    }

    /// Reports a cluster, unless it lies outside the requested interval.
    fn report(&self, low: &Point, high: &Point, interval: &Interval, answer: &mut Answer) {
        let cluster = self.cluster(low, high);
        if cluster.high >= interval.from() && cluster.low <= interval.to() {
            answer.clusters.push(cluster);
        }
    }

    /// Isolates, rounds and compares the roots of a doubtful interval by integers, or
    /// reports it as a cluster.
    fn doubtful(&self, low: Point, high: Point, interval: &Interval, answer: &mut Answer) {
        let isolated = match self.method.doubts {
            Doubts::Report => None,
            _ => self.factors().and_then(|factors| {
                let p = &factors.square_free;
                let isolated = match self.method.doubts {
                    Doubts::Chain => exact::isolate_by_chain(p, &low, &high)
                        .or_else(|| exact::isolate(p, &low, &high)),
                    _ => exact::isolate(p, &low, &high),
                };
                Some((factors, isolated?))
            }),
        };
        let Some((factors, isolated)) = isolated else {
            return self.report(&low, &high, interval, answer);
        };
        for root in isolated {
            let mut rows = factors.rows.iter();
            let found = match &root {
                Isolated::At(at) => {
                    let row = rows.find(|(f, _)| exact::sign_at(f, at) == Ordering::Equal);
                    let order = |end: f64| at.cmp(&Point::of(end, 0));
                    row.filter(|_| interval.holds(order))
                        .map(|(_, m)| Root::nearest(exact::rounded(at), *m))
                }
                Isolated::Between(low, high) => {
                    let sign = |f: &[BigInt], at| exact::sign_at(f, at);
                    let row = rows.find(|(f, _)| sign(f, low) != sign(f, high));
                    row.and_then(|(f, m)| {
                        let guess = exact::rounded(&low.middle(high));
                        let t = exact::nearest(f, low, high, guess);
                        let order = |end: f64| match t.total_cmp(&end) {
                            Ordering::Equal => against(f, low, high, &Point::of(end, 0)),
                            order => order,
                        };
                        interval.holds(order).then(|| Root::nearest(t, *m))
                    })
                }
            };
            answer.roots.extend(found);
        }
    }
}

/// Returns the ends of a piece as exact points.
fn ends(piece: &Piece) -> (Point, Point) {
    (
        Point::of(piece.low, piece.k),
        Point::of(piece.high, piece.k),
    )
}
