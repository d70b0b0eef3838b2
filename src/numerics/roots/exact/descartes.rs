//! Isolation by Descartes' rule of signs in integers: the subdivision of
//! [`bernstein`](crate::roots::bernstein) without rounding.

use super::{Integers, Point, aligned, order};
use num_bigint::BigInt;
use std::cmp::Ordering;

/// An isolated root of a square-free polynomial.
#[derive(Clone, Debug)]
pub enum Isolated {
    /// A root that is a dyadic number.
    At(Point),
    /// An isolating interval between two points that are not roots.
    Between(Point, Point),
}

impl Isolated {
    pub(super) fn low(&self) -> &Point {
        match self {
            Isolated::At(at) | Isolated::Between(at, _) => at,
        }
    }
}

/// Limit of 64-bit operations for an interval, about two seconds.
const BUDGET: u64 = 1 << 32;

/// Isolates all roots of a square-free polynomial strictly between two points, ascending.
/// `None` if the size of the coefficients and the distances of the roots exceed the limit
/// of operations.
pub fn isolate(p: &[BigInt], low: &Point, high: &Point) -> Option<Vec<Isolated>> {
    let n = p.len() - 1;
    let mut found = Vec::new();
    if n == 0 || low >= high {
        return Some(found);
    }
    let mut spent = 0_u64;
    let whole = Part {
        at: BigInt::ZERO,
        depth: 0,
        b: bernstein(&on_unit(p, low, high)),
    };
    let point = |at: &BigInt, depth: u64| {
        // Position low + (high − low) · at / 2^depth.
        let [a, b, _] = aligned(low, high);
        let e = low.e.min(high.e);
        Point {
            m: (&a << depth) + (b - &a) * at,
            e: e - depth as i64,
        }
        .reduced()
    };
    let mut stack = vec![Task::Look(whole)];
    while let Some(task) = stack.pop() {
        let part = match task {
            Task::Look(part) => part,
            Task::Root(at, depth) => {
                found.push(Isolated::At(point(&at, depth)));
                continue;
            }
        };
        let ends = [&part.b[0], &part.b[n]].map(order);
        let clear = ends.iter().all(|end| *end != Ordering::Equal);
        match changes(&part.b) {
            0 => continue,
            1 if clear => {
                let next = &part.at + 1;
                found.push(Isolated::Between(
                    point(&part.at, part.depth),
                    point(&next, part.depth),
                ));
                continue;
            }
            _ => {}
        }
        let bits: u64 = part.b.iter().map(BigInt::bits).max().unwrap_or(0);
        spent += (n * n / 2) as u64 * (bits / 64 + 4);
        if spent > BUDGET {
            return None;
        }
        let (lower, upper) = halved(part);
        let middle = (upper.at.clone(), upper.depth);
        let is_root = order(&upper.b[0]) == Ordering::Equal;
        stack.push(Task::Look(upper));
        if is_root {
            stack.push(Task::Root(middle.0, middle.1));
        }
        stack.push(Task::Look(lower));
    }
    Some(found)
}

enum Task {
    Look(Part),
    Root(BigInt, u64),
}

/// The interval from at / 2^depth to (at + 1) / 2^depth of the whole, with its
/// polynomial.
struct Part {
    at: BigInt,
    depth: u64,
    /// Bernstein coefficients times a positive number.
    b: Integers,
}

/// Returns the coefficients of p(low + (high − low) s) in s, times a power of two.
fn on_unit(p: &[BigInt], low: &Point, high: &Point) -> Integers {
    let [a, b, _] = aligned(low, high);
    let width = b - &a;
    let e = low.e.min(high.e);
    let n = p.len() - 1;
    let mut q: Integers = Vec::with_capacity(n + 1);
    for (i, c) in p.iter().enumerate().rev() {
        // q ← q · (a + width s) + c.
        q.push(BigInt::ZERO);
        for j in (0..q.len()).rev() {
            let carried = if j > 0 {
                &q[j - 1] * &width
            } else {
                BigInt::ZERO
            };
            q[j] = &q[j] * &a + carried;
        }
        let power = if e >= 0 {
            e as u64 * i as u64
        } else {
            e.unsigned_abs() * (n - i) as u64
        };
        q[0] += c << power;
    }
    q
}

/// Converts powers to Bernstein coefficients, times the least common multiple of the
/// C(n, i).
fn bernstein(c: &[BigInt]) -> Integers {
    let n = c.len() - 1;
    let mut binomials = vec![BigInt::from(1)];
    for i in 0..n {
        let next = &binomials[i] * (n - i) / (i + 1);
        binomials.push(next);
    }
    let multiple = binomials.iter().fold(BigInt::from(1), |m, b| {
        let common = super::common(m.clone(), b.clone());
        m * b / common
    });
    let weighted = c.iter().zip(&binomials).map(|(c, b)| c * (&multiple / b));
    let mut b: Integers = weighted.collect();
    for k in 1..=n {
        for j in (k..=n).rev() {
            let (before, after) = b.split_at_mut(j);
            after[0] += &before[j - 1];
        }
    }
    b
}

/// Counts sign changes, ignoring zeros: an upper bound of the number of roots strictly
/// inside, exact if it is 0 or 1.
fn changes(b: &[BigInt]) -> u32 {
    let (mut count, mut last) = (0, Ordering::Equal);
    for sign in b.iter().map(order).filter(|s| *s != Ordering::Equal) {
        count += u32::from(last == sign.reverse());
        last = sign;
    }
    count
}

fn halved(part: Part) -> (Part, Part) {
    let Part { at, depth, b } = part;
    let n = b.len() - 1;
    let mut upper = b;
    let mut lower = Vec::with_capacity(n + 1);
    // De Casteljau's scheme with sums instead of averages: row m is 2^m times the true
    // one, and all are scaled to 2^n times.
    for m in 0..=n {
        lower.push(&upper[0] << (n - m) as u64);
        for j in 0..n - m {
            let (before, after) = upper.split_at_mut(j + 1);
            before[j] += &after[0];
        }
        upper[n - m] <<= (n - m) as u64;
    }
    let part = |at: BigInt, b| Part {
        at,
        depth: depth + 1,
        b: reduced(b),
    };
    let first = at << 1_u32;
    let second = &first + 1;
    (part(first, lower), part(second, upper))
}

/// Divides by the largest common power of two.
fn reduced(mut b: Integers) -> Integers {
    let zeros = b
        .iter()
        .filter_map(BigInt::trailing_zeros)
        .min()
        .unwrap_or(0);
    if zeros > 0 {
        b.iter_mut().for_each(|c| *c >>= zeros);
    }
    b
}
