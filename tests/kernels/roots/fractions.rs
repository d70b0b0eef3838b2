//! Sturm's theorem in fractions.

use num_bigint::BigInt;
use num_rational::BigRational;

type Row = Vec<BigRational>;

pub struct Fractions {
    p: Row,
    chain: Vec<Row>,
}

fn zero() -> BigRational {
    BigRational::from(BigInt::ZERO)
}

fn exact(x: f64) -> BigRational {
    BigRational::from_float(x).expect("finite")
}

fn stripped(mut p: Row) -> Row {
    while p.last().is_some_and(|c| *c == zero()) {
        p.pop();
    }
    p
}

fn derivative(p: &Row) -> Row {
    let term = |(i, c): (usize, &BigRational)| c * BigInt::from(i);
    p.iter().enumerate().skip(1).map(term).collect()
}

fn division(a: &Row, b: &Row) -> (Row, Row) {
    let mut rest = a.clone();
    let mut quotient = vec![zero(); (a.len() + 1).saturating_sub(b.len())];
    while rest.len() >= b.len() && !rest.is_empty() {
        let shift = rest.len() - b.len();
        let factor = &rest[rest.len() - 1] / &b[b.len() - 1];
        for (j, b) in b.iter().enumerate() {
            rest[shift + j] -= &factor * b;
        }
        quotient[shift] = factor;
        rest.pop();
        rest = stripped(rest);
    }
    (quotient, rest)
}

fn divisor(a: &Row, b: &Row) -> Row {
    let (mut a, mut b) = (a.clone(), b.clone());
    while !b.is_empty() {
        let rest = division(&a, &b).1;
        (a, b) = (b, monic(rest));
    }
    monic(a)
}

fn monic(p: Row) -> Row {
    match p.last().cloned() {
        Some(leading) => p.into_iter().map(|c| c / &leading).collect(),
        None => p,
    }
}

fn chain(p: &Row) -> Vec<Row> {
    let mut rows = vec![p.clone()];
    if p.len() > 1 {
        rows.push(derivative(p));
    }
    while rows[rows.len() - 1].len() > 1 {
        let rest = division(&rows[rows.len() - 2], &rows[rows.len() - 1]).1;
        if rest.is_empty() {
            break;
        }
        // A positive factor keeps numbers short.
        let leading = &rest[rest.len() - 1];
        let size = if *leading < zero() {
            -leading
        } else {
            leading.clone()
        };
        rows.push(rest.iter().map(|c| -c / &size).collect());
    }
    rows.retain(|row| !row.is_empty());
    rows
}

fn changes(signs: impl Iterator<Item = i32>) -> usize {
    let signs: Vec<i32> = signs.filter(|s| *s != 0).collect();
    signs.windows(2).filter(|w| w[0] != w[1]).count()
}

fn sign(x: &BigRational) -> i32 {
    i32::from(*x > zero()) - i32::from(*x < zero())
}

fn distinct(chain: &[Row]) -> usize {
    let at_end = |upper: bool| {
        changes(chain.iter().map(|row| {
            let odd = row.len() % 2 == 0 && !upper;
            let sign = sign(&row[row.len() - 1]);
            if odd { -sign } else { sign }
        }))
    };
    at_end(false) - at_end(true)
}

impl Fractions {
    pub fn of(c: &[f64]) -> Fractions {
        let p: Row = c.iter().map(|c| exact(*c)).collect();
        let common = divisor(&p, &derivative(&p));
        let square_free = division(&p, &common).0;
        let chain = chain(&square_free);
        Fractions { p, chain }
    }

    /// Real roots, each once.
    pub fn distinct(&self) -> usize {
        distinct(&self.chain)
    }

    /// Of the real roots, ascending.
    pub fn multiplicities(&self) -> Vec<u32> {
        // As many roots of p have at least multiplicity m as gcd(p, p', …) has.
        let mut at_least = Vec::new();
        let mut p = self.p.clone();
        while p.len() > 1 {
            let common = divisor(&p, &derivative(&p));
            at_least.push(distinct(&chain(&division(&p, &common).0)));
            p = common;
        }
        at_least.push(0);
        let exactly = |m: usize| std::iter::repeat_n(m as u32 + 1, at_least[m] - at_least[m + 1]);
        (0..at_least.len() - 1).flat_map(exactly).collect()
    }

    /// Distinct roots no farther than `reach` from t.
    pub fn distinct_between(&self, t: f64, reach: f64) -> usize {
        let at = |x: &BigRational| {
            changes(self.chain.iter().map(|row| {
                let value = row.iter().rev().fold(zero(), |y, c| y * x + c);
                sign(&value)
            }))
        };
        let (low, high) = (exact(t) - exact(reach), exact(t) + exact(reach));
        let value = self.p.iter().rev().fold(zero(), |y, c| y * &low + c);
        // (low, high], and low.
        usize::from(value == zero()) + at(&low) - at(&high)
    }
}
