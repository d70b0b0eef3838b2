//! Sturm's chain in integers.

use super::{Integers, Isolated, Point, derivative, order, primitive, sign_at, stripped};
use num_bigint::BigInt;
use std::cmp::Ordering;

/// Sturm's chain: p, p', and then the negative remainder of the two members before,
/// without common factors. Remainders are multiplied only by positive numbers, so the
/// signs are those of Sturm's theorem.
#[derive(Clone, Debug)]
pub struct Chain {
    rows: Vec<Integers>,
}

/// Limit of a chain's total bits; a longer chain is given up.
const BUDGET: u64 = 1 << 20;

impl Chain {
    /// Computes the chain of a square-free polynomial; `None` if it exceeds its limit of
    /// bits.
    pub fn new(p: &[BigInt]) -> Option<Chain> {
        let mut rows = vec![primitive(p.to_vec()), primitive(derivative(p))];
        let mut spent = 0;
        while rows[rows.len() - 1].len() > 1 {
            let [.., a, b] = &rows[..] else {
                break;
            };
            let next = primitive(negative_remainder(a, b));
            if next.is_empty() {
                break;
            }
            spent += next.iter().map(BigInt::bits).sum::<u64>();
            if spent > BUDGET {
                return None;
            }
            rows.push(next);
        }
        Some(Chain { rows })
    }

    /// Counts sign changes V at a point: V(a) − V(b) roots lie in (a, b].
    pub fn changes(&self, at: &Point) -> u32 {
        let signs = self.rows.iter().map(|row| sign_at(row, at));
        let (mut count, mut last) = (0, Ordering::Equal);
        for sign in signs.filter(|s| *s != Ordering::Equal) {
            count += u32::from(last == sign.reverse());
            last = sign;
        }
        count
    }
}

/// Limit of 64-bit operations for counting, about a tenth of a second.
const STEPS: u64 = 1 << 26;

/// Isolates roots as [`isolate`](super::isolate) does, by counts at the ends and in the
/// middle of intervals. `None` if the chain, or the count, exceeds its limit.
pub fn isolate_by_chain(p: &[BigInt], low: &Point, high: &Point) -> Option<Vec<Isolated>> {
    let mut found = Vec::new();
    if p.len() < 2 || low >= high {
        return Some(found);
    }
    let chain = Chain::new(p)?;
    let is_root = |at: &Point| sign_at(p, at) == Ordering::Equal;
    // A point, the sign changes there, and whether the point is a root.
    let end = |at: &Point| (at.clone(), chain.changes(at), is_root(at));
    let mut stack = vec![(end(low), end(high))];
    let bits = |row: &Integers| row.iter().map(BigInt::bits).sum::<u64>();
    let size: u64 = chain.rows.iter().map(bits).sum();
    let mut spent = 0;
    while let Some((a, b)) = stack.pop() {
        let inside = a.1 - b.1 - u32::from(b.2);
        if inside == 0 {
        } else if inside == 1 && !a.2 && !b.2 {
            found.push(Isolated::Between(a.0, b.0));
        } else {
            let at = a.0.middle(&b.0);
            // Cost of one evaluation: the length of the chain's numbers and the powers of
            // the point.
            let power = at.e.unsigned_abs() + at.m.bits();
            spent += (size + power * (p.len() * p.len()) as u64) / 64 * (at.m.bits() / 64 + 1);
            if spent > STEPS {
                return None;
            }
            let middle = end(&at);
            if middle.2 {
                found.push(Isolated::At(middle.0.clone()));
            }
            stack.push((middle.clone(), b));
            stack.push((a, middle));
        }
    }
    found.sort_by(|x, y| x.low().cmp(y.low()));
    Some(found)
}

/// Returns −a mod b, times a positive number.
fn negative_remainder(a: &[BigInt], b: &[BigInt]) -> Integers {
    let mut rest = a.to_vec();
    let m = b.len() - 1;
    let leading = &b[m];
    let is_negative = order(leading) == Ordering::Less;
    while rest.len() > m {
        let top = rest[rest.len() - 1].clone();
        let shift = rest.len() - 1 - m;
        // Form rest · |leading| − (± top) b: the factor of `rest` is positive.
        for c in rest.iter_mut() {
            *c *= leading;
            if is_negative {
                *c = -&*c;
            }
        }
        let top = if is_negative { -top } else { top };
        for (j, c) in b.iter().enumerate() {
            rest[shift + j] -= &top * c;
        }
        rest.pop();
        rest = stripped(rest);
    }
    rest.iter().map(|c| -c).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lectures_cubic_has_its_counts() {
        // t³ + 3t² − 1; the last member is +9/4, up to a positive factor.
        let p: Integers = [-1, 0, 3, 1].map(BigInt::from).into();
        let chain = Chain::new(&p).unwrap();
        assert_eq!(chain.rows.len(), 4);
        assert_eq!(order(&chain.rows[3][0]), Ordering::Greater);
        let at = |t: f64| chain.changes(&Point::of(t, 0));
        let far = 1e9;
        for (low, high, count) in [
            (0.0, 1.0, 1),
            (0.0, far, 1),
            (-far, far, 3),
            (-1.0, 0.0, 1),
            (-3.0, -2.0, 1),
        ] {
            assert_eq!(at(low) - at(high), count, "({low}, {high}]");
        }
    }
}
