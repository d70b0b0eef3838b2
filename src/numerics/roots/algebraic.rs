//! Real algebraic numbers: all real roots of a polynomial with integer coefficients, in a
//! form that can be compared exactly. Rays meet polynomial surfaces in them.
//!
//! A root is a square-free polynomial and an isolating interval, in which the polynomial
//! changes its sign once. A root is compared with a number by the sign there. Two roots
//! are equal if the greatest common divisor of their polynomials changes its sign on the
//! intersection of their intervals; otherwise bisection separates the intervals. Lemma
//! D17, docs/numerics/exact.md.

use super::exact::{self, Integers, Isolated, Point, sign_at};
use num_bigint::{BigInt, Sign};
use std::cmp::Ordering;

/// Limit of bisections. Different roots separate long before it: at degree 24 with
/// coefficients of some thousand bits they are at least 2^-50,000 apart, as a rule
/// 2^-100.
const HALVINGS: u32 = 100_000;

/// The distinct real roots of one polynomial, ascending.
#[derive(Clone, Debug)]
pub struct RealRoots {
    /// The square-free part without the root 0. Isolating intervals of other roots may
    /// end at 0, and the sign at both ends of an interval must tell where its root is.
    square_free: Integers,
    rows: Vec<Row>,
}

#[derive(Clone, Debug)]
struct Row {
    place: Isolated,
    t: f64,
    multiplicity: u32,
}

/// Computes the real roots of Σ cᵢ tⁱ, not all cᵢ 0. `None` if the isolation exceeds its
/// budget of operations, or primes run out in the square-free decomposition.
pub fn real_roots(c: &[BigInt]) -> Option<RealRoots> {
    let c = exact::stripped(c.to_vec());
    let zeros = c.iter().take_while(|c| c.sign() == Sign::NoSign).count();
    let rest = &c[zeros..];
    let mut rows = Vec::new();
    if rest.len() < 2 {
        rows.extend(at_zero(zeros));
        let square_free = vec![BigInt::from(1)];
        return Some(RealRoots { square_free, rows });
    }
    let factors = exact::factors(rest)?;
    let mut below = positive(&mirrored(&factors))?;
    below.reverse();
    rows.extend(below.into_iter().map(|row| Row {
        place: match row.place {
            Isolated::At(at) => Isolated::At(negated(at)),
            Isolated::Between(low, high) => Isolated::Between(negated(high), negated(low)),
        },
        t: -row.t,
        ..row
    }));
    rows.extend(at_zero(zeros));
    rows.extend(positive(&factors)?);
    let square_free = factors.square_free;
    Some(RealRoots { square_free, rows })
}

fn at_zero(zeros: usize) -> Option<Row> {
    (zeros > 0).then(|| Row {
        place: Isolated::At(Point::of(0.0, 0)),
        t: 0.0,
        multiplicity: zeros as u32,
    })
}

fn negated(at: Point) -> Point {
    Point { m: -at.m, ..at }
}

/// Substitutes −t for t.
fn mirrored(factors: &exact::Factors) -> exact::Factors {
    let mirror = |p: &Integers| -> Integers {
        let signed = |(i, c): (usize, &BigInt)| if i % 2 == 1 { -c } else { c.clone() };
        p.iter().enumerate().map(signed).collect()
    };
    exact::Factors {
        rows: factors.rows.iter().map(|(p, m)| (mirror(p), *m)).collect(),
        square_free: mirror(&factors.square_free),
    }
}

/// Isolates the positive roots of a polynomial that is not 0 at 0.
fn positive(factors: &exact::Factors) -> Option<Vec<Row>> {
    let p = &factors.square_free;
    let signs = p.iter().map(|c| c.sign()).filter(|s| *s != Sign::NoSign);
    let signs: Vec<Sign> = signs.collect();
    // Descartes' rule of signs: without a change of sign there is no positive root.
    if signs.windows(2).all(|pair| pair[0] == pair[1]) {
        return Some(Vec::new());
    }
    let high = Point {
        m: BigInt::from(1),
        e: bound(p),
    };
    let isolated = exact::isolate(p, &Point::of(0.0, 0), &high)?;
    let row = |place: Isolated| {
        let mut of = factors.rows.iter();
        let found = match &place {
            Isolated::At(at) => {
                let row = of.find(|(f, _)| sign_at(f, at) == Ordering::Equal);
                row.map(|(_, m)| (exact::rounded(at), *m))
            }
            Isolated::Between(low, high) => {
                let row = of.find(|(f, _)| sign_at(f, low) != sign_at(f, high));
                row.map(|(f, m)| {
                    let guess = exact::rounded(&low.middle(high));
                    (exact::nearest(f, low, high, guess), *m)
                })
            }
        };
        let (t, multiplicity) = found?;
        Some(Row {
            place,
            t,
            multiplicity,
        })
    };
    isolated.into_iter().map(row).collect()
}

/// Returns an exponent k so that every root is below 2^k in magnitude (Fujiwara 1916,
/// with powers of two).
fn bound(p: &[BigInt]) -> i64 {
    let n = p.len() - 1;
    let last = p[n].bits() as i64 - 1;
    let of = |(i, c): (usize, &BigInt)| {
        let over = c.bits() as i64 - last;
        over.div_euclid((n - i) as i64) + 1
    };
    let terms = p[..n].iter().enumerate();
    let terms = terms.filter(|(_, c)| c.sign() != Sign::NoSign).map(of);
    terms.max().unwrap_or(0) + 1
}

impl RealRoots {
    /// Returns the number of distinct roots.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Returns the f64 nearest to root i, ties to even; ± `f64::MAX` beyond the range.
    pub fn t(&self, i: usize) -> f64 {
        self.rows[i].t
    }

    pub fn multiplicity(&self, i: usize) -> u32 {
        self.rows[i].multiplicity
    }

    /// Compares root i with a finite f64, exactly.
    pub fn order_with(&self, i: usize, x: f64) -> Ordering {
        let row = &self.rows[i];
        if row.t != x {
            return row.t.total_cmp(&x);
        }
        let x = Point::of(x, 0);
        match &row.place {
            Isolated::At(at) => at.cmp(&x),
            Isolated::Between(low, high) => against(&self.square_free, low, high, &x),
        }
    }

    /// Compares root i exactly with root j of another polynomial or of the same.
    pub fn order(&self, i: usize, other: &RealRoots, j: usize) -> Ordering {
        let (a, b) = (&self.rows[i], &other.rows[j]);
        if a.t != b.t {
            return a.t.total_cmp(&b.t);
        }
        let (p, q) = (&self.square_free, &other.square_free);
        let (low, high, from, to) = match (&a.place, &b.place) {
            (Isolated::At(a), Isolated::At(b)) => return a.cmp(b),
            (Isolated::At(at), Isolated::Between(low, high)) => {
                return against(q, low, high, at).reverse();
            }
            (Isolated::Between(low, high), Isolated::At(at)) => return against(p, low, high, at),
            (Isolated::Between(low, high), Isolated::Between(from, to)) => (low, high, from, to),
        };
        if let Some(common) = exact::divisor(p, q)
            && common.len() > 1
        {
            let (first, last) = (low.max(from), high.min(to));
            if first < last && sign_at(&common, first) != sign_at(&common, last) {
                return Ordering::Equal;
            }
        }
        let mut mine = (low.clone(), high.clone());
        let mut theirs = (from.clone(), to.clone());
        for _ in 0..HALVINGS {
            if mine.1 <= theirs.0 {
                return Ordering::Less;
            }
            if theirs.1 <= mine.0 {
                return Ordering::Greater;
            }
            // Bisect each interval, and compare with the other root. They separate, since
            // the roots differ.
            let middle = mine.0.middle(&mine.1);
            match against(p, low, high, &middle) {
                Ordering::Equal => return against(q, from, to, &middle).reverse(),
                Ordering::Less => mine.1 = middle,
                Ordering::Greater => mine.0 = middle,
            }
            let middle = theirs.0.middle(&theirs.1);
            match against(q, from, to, &middle) {
                Ordering::Equal => return against(p, low, high, &middle),
                Ordering::Less => theirs.1 = middle,
                Ordering::Greater => theirs.0 = middle,
            }
        }
        Ordering::Equal
    }
}

/// Compares the only root between two points, where p changes its sign, with a third.
pub(super) fn against(p: &[BigInt], low: &Point, high: &Point, at: &Point) -> Ordering {
    exact::against(p, (low, high), sign_at(p, low), at)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns Π (bᵢ t − aᵢ).
    fn product(roots: &[(i64, i64)]) -> Integers {
        let one = vec![BigInt::from(1)];
        roots.iter().fold(one, |p, (a, b)| {
            let mut q = vec![BigInt::ZERO; p.len() + 1];
            for (i, c) in p.iter().enumerate() {
                q[i] -= c * a;
                q[i + 1] += c * b;
            }
            q
        })
    }

    fn found(p: &[BigInt]) -> Vec<(f64, u32)> {
        let roots = real_roots(p).unwrap();
        let row = |i| (roots.t(i), roots.multiplicity(i));
        (0..roots.len()).map(row).collect()
    }

    #[test]
    fn roots_on_the_whole_line_with_their_multiplicities() {
        let p = product(&[(-3, 1), (-3, 1), (0, 1), (0, 1), (0, 1), (1, 3), (7, 1)]);
        let expected = [(-3.0, 2), (0.0, 3), (1.0 / 3.0, 1), (7.0, 1)];
        assert_eq!(found(&p), expected);
        assert_eq!(found(&[BigInt::from(5)]), []);
        assert_eq!(found(&product(&[(0, 1)])), [(0.0, 1)]);
        // t² − 2 and t² + 2.
        let square = |c: i64| vec![BigInt::from(c), BigInt::ZERO, BigInt::from(1)];
        let root = 2.0_f64.sqrt();
        assert_eq!(found(&square(-2)), [(-root, 1), (root, 1)]);
        assert_eq!(found(&square(2)), []);
    }

    #[test]
    fn roots_that_round_to_one_number_are_told_apart() {
        // 1/3 and 1/3 + 2^-70 (about): the same f64.
        let one = product(&[(1, 3)]);
        let big = 1_i64 << 61;
        let near = product(&[(big + 1, 3 * big)]);
        let (a, b) = (real_roots(&one).unwrap(), real_roots(&near).unwrap());
        assert_eq!(a.t(0), b.t(0));
        assert_eq!(a.order(0, &b, 0), Ordering::Less);
        assert_eq!(b.order(0, &a, 0), Ordering::Greater);
        assert_eq!(b.order(0, &b, 0), Ordering::Equal);
        assert_eq!(a.order_with(0, 1.0 / 3.0), Ordering::Greater);
        assert_eq!(a.order_with(0, 0.25), Ordering::Greater);
    }

    #[test]
    fn common_roots_are_equal() {
        // (t² − 2)(t − 5) and (t² − 2)(t + 9)(3 t − 4).
        let times = |q: &[BigInt]| {
            let mut p = vec![BigInt::ZERO; q.len() + 2];
            for (i, c) in q.iter().enumerate() {
                p[i] -= c * 2;
                p[i + 2] += c;
            }
            p
        };
        let p = real_roots(&times(&product(&[(5, 1)]))).unwrap();
        let q = real_roots(&times(&product(&[(-9, 1), (4, 3)]))).unwrap();
        // −√2, √2, 5 and −9, −√2, 4/3, √2.
        assert_eq!(p.order(0, &q, 1), Ordering::Equal);
        assert_eq!(p.order(1, &q, 3), Ordering::Equal);
        assert_eq!(p.order(1, &q, 2), Ordering::Greater);
        assert_eq!(p.order(0, &q, 0), Ordering::Greater);
    }

    /// Isolating intervals may begin at 0, also if 0 is a root.
    #[test]
    fn a_root_at_zero_does_not_change_the_order_of_others() {
        let unit = 1_i64 << 55;
        for zeros in 0..3 {
            for sign in [1, -1] {
                let beyond = |by: i64| {
                    let mut roots = vec![(0, 1); zeros];
                    roots.push((sign * (unit + by), unit));
                    real_roots(&product(&roots)).unwrap()
                };
                let (p, q) = (beyond(1), beyond(2));
                // Index of the only root that is not 0.
                let i = usize::from(zeros > 0 && sign > 0);
                assert_eq!((p.t(i), q.t(i)), (sign as f64, sign as f64));
                let outward = 0.cmp(&-sign);
                assert_eq!(p.order_with(i, sign as f64), outward, "{zeros} {sign}");
                assert_eq!(q.order(i, &p, i), outward, "{zeros} {sign}");
                assert_eq!(p.order(i, &p, i), Ordering::Equal);
            }
        }
    }
}
