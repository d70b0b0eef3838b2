//! Orientation predicates by integers: the side on which an edge passes a line, and the side on
//! which a point is seen (D9, docs/numerics/exact.md).
//!
//! The side on which an edge from p to q passes the line of origin o and direction d is the sign
//! of [d, p − o, q − o] = (p − o) · ((q − p) × d).
//!
//! Integers ([`crate::math::int`]) have the least size that holds the numbers, on one grid for the
//! origin and p and on others for the rest; if magnitudes differ too much, [`Dyadic`] numbers take
//! over (D11).

use super::Line;
use crate::math::dyadic::{Dyadic, exactly};
use crate::math::int::{Grid, Int, decoded};
use crate::math::{Number, number};
use std::cmp::Ordering;

type Point = [f64; 3];

/// Returns the sign of [d, p − o, q − o]. All numbers are finite.
#[cold]
#[inline(never)]
pub fn of_edge(line: &Line, p: &Point, q: &Point) -> Ordering {
    edge_in::<1, 2>(line, [p, q], |m| {
        passing::<1, 2, 3>(line, p, m)
            .or_else(|| passing::<2, 2, 4>(line, p, m))
            .or_else(|| passing::<4, 2, 6>(line, p, m))
    })
    .or_else(|| {
        edge_in::<2, 4>(line, [p, q], |m| {
            passing::<2, 4, 6>(line, p, m).or_else(|| passing::<4, 4, 8>(line, p, m))
        })
    })
    .or_else(|| edge_in::<4, 8>(line, [p, q], |m| passing::<4, 8, 12>(line, p, m)))
    .unwrap_or_else(|| edge_of_any_size(line, p, q))
}

/// Calls `ask` with (q − p) × d; `None` if integers of A limbs do not hold the numbers.
#[inline(always)]
fn edge_in<const A: usize, const P: usize>(
    line: &Line,
    [p, q]: [&Point; 2],
    ask: impl FnOnce(&[Int<P>; 3]) -> Option<Ordering>,
) -> Option<Ordering> {
    let [p, q] = placed::<A, 2>([*p, *q])?;
    let [d] = placed::<A, 1>([line.dir])?;
    let along = minus(&q, &p);
    let minor = |i: usize, j: usize| along[i].times(&d[j]).minus(&along[j].times(&d[i]));
    ask(&[minor(1, 2), minor(2, 0), minor(0, 1)])
}

/// Returns the sign of (p − o) · m with m in integers; `None` if N limbs do not hold p and o,
/// apart from one component of o that is next to nothing.
#[inline(always)]
fn passing<const N: usize, const P: usize, const Q: usize>(
    line: &Line,
    p: &Point,
    m: &[Int<P>; 3],
) -> Option<Ordering> {
    let mut org = line.org;
    let grid = Grid::<N>::over(&[*p, org]);
    // Times any m such a component is less than the least sum of the others that is not zero.
    let is_tiny = |x: f64| {
        let (magnitude, power) = decoded(x);
        let top = power + 64 - magnitude.leading_zeros() as i32;
        magnitude != 0 && top <= grid.power() - 64 * P as i32
    };
    let mut tiny = None;
    for k in 0..3 {
        if is_tiny(org[k]) {
            if tiny.is_some() {
                return None;
            }
            tiny = Some(k);
            org[k] = 0.0;
        }
    }
    let [p, o] = grid.place(&[*p, org])?;
    let from = minus(&p, &o);
    let product = |k: usize| -> Int<Q> { from[k].times(&m[k]) };
    let side = product(0).plus(&product(1)).plus(&product(2)).sign();
    Some(side.then_with(|| match tiny {
        None => Ordering::Equal,
        Some(k) if line.org[k] > 0.0 => m[k].sign().reverse(),
        Some(k) => m[k].sign(),
    }))
}

/// Returns the sign from products of three of the numbers themselves, with the origin multiplied
/// out. These products are short however far apart the numbers are, whereas differences are long.
#[inline(never)]
fn edge_of_any_size(line: &Line, p: &Point, q: &Point) -> Ordering {
    exactly(&|space| {
        let number = |x: f64| Dyadic::of(space, x);
        let of = |v: &Point| [number(v[0]), number(v[1]), number(v[2])];
        let (o, d, p, q) = (of(&line.org), of(&line.dir), of(p), of(q));
        let to = number::cross(&d, &p);
        let from = number::cross(&d, &o);
        // The term with the origin twice is zero.
        let side = number::dot(&to, &q).minus(&number::dot(&to, &o));
        side.minus(&number::dot(&from, &q)).sign()
    })
}

/// Returns the sign of (p − o)ᵢ dₖ − (p − o)ₖ dᵢ. All numbers are finite.
#[cold]
#[inline(never)]
pub fn of_point(line: &Line, p: &Point, [i, k]: [usize; 2]) -> Ordering {
    point_in::<1, 2>(line, p, [i, k])
        .or_else(|| point_in::<2, 4>(line, p, [i, k]))
        .or_else(|| point_in::<4, 8>(line, p, [i, k]))
        .unwrap_or_else(|| point_of_any_size(line, p, [i, k]))
}

#[inline(always)]
fn point_in<const N: usize, const P: usize>(
    line: &Line,
    p: &Point,
    [i, k]: [usize; 2],
) -> Option<Ordering> {
    let [o, p] = placed::<N, 2>([line.org, *p])?;
    let [d] = placed::<N, 1>([line.dir])?;
    let from = |i: usize| p[i].minus(&o[i]);
    let (x, y): (Int<P>, Int<P>) = (from(i).times(&d[k]), from(k).times(&d[i]));
    Some(x.minus(&y).sign())
}

#[inline(never)]
fn point_of_any_size(line: &Line, p: &Point, [i, k]: [usize; 2]) -> Ordering {
    exactly(&|space| {
        let of = |x: f64| Dyadic::of(space, x);
        let product = |x: f64, y: f64| of(x).times(&of(y));
        let to = |x: &Point| {
            let (a, b) = (product(x[i], line.dir[k]), product(x[k], line.dir[i]));
            a.minus(&b)
        };
        to(p).minus(&to(&line.org)).sign()
    })
}

/// Places points on one grid; `None` if its integers do not hold them.
#[inline(always)]
fn placed<const N: usize, const K: usize>(points: [Point; K]) -> Option<[[Int<N>; 3]; K]> {
    Grid::<N>::over(&points).place(&points)
}

#[inline(always)]
fn minus<const N: usize>(x: &[Int<N>; 3], y: &[Int<N>; 3]) -> [Int<N>; 3] {
    [x[0].minus(&y[0]), x[1].minus(&y[1]), x[2].minus(&y[2])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_rational::BigRational;
    use proptest::prelude::*;

    fn exact(x: f64) -> BigRational {
        BigRational::from_float(x).unwrap()
    }

    fn sign(x: &BigRational) -> Ordering {
        x.cmp(&exact(0.0))
    }

    /// Computes both predicates by fractions.
    fn by_fractions(line: &Line, p: &Point, q: &Point) -> (Ordering, Vec<Ordering>) {
        let to = |x: &Point| [0, 1, 2].map(|k| exact(x[k]) - exact(line.org[k]));
        let (p, q, d) = (to(p), to(q), line.dir.map(exact));
        let minor = |i: usize, j: usize| &p[i] * &q[j] - &p[j] * &q[i];
        let edge = &d[0] * minor(1, 2) + &d[1] * minor(2, 0) + &d[2] * minor(0, 1);
        let place = |(i, k): (usize, usize)| sign(&(&p[i] * &d[k] - &p[k] * &d[i]));
        (sign(&edge), AXES.map(place).to_vec())
    }

    const AXES: [(usize, usize); 3] = [(1, 0), (0, 2), (2, 1)];

    /// Generates numbers of f32, f64 with noise, and of any size; few enough that some coincide.
    fn number() -> impl Strategy<Value = f64> {
        prop_oneof![
            (-3_i8..4).prop_map(f64::from),
            (-3_i8..4).prop_map(f64::from),
            (-1.0_f32..1.0).prop_map(f64::from),
            -1.0..1.0_f64,
            (-3_i8..4).prop_map(|x| f64::from(x) + 6e-17),
            (-2_i64..3).prop_map(|x| x as f64 * 5e-324),
            any::<f64>().prop_filter("finite", |x| x.is_finite()),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            ..ProptestConfig::with_cases(400)
        })]

        /// The origin lies in the plane of edge and direction up to next to nothing.
        #[test]
        fn next_to_nothing_counts_where_the_rest_is_zero(
            [d, mut p, mut q] in [[-3_i8..4, -3_i8..4, -3_i8..4], [-3_i8..4, -3_i8..4, -3_i8..4], [-3_i8..4, -3_i8..4, -3_i8..4]],
            (s, r) in (-2_i8..3, -2_i8..3),
            (axis, tiny) in (0..3_usize, prop_oneof![Just(5e-324), Just(-5e-324), Just(1e-200)]),
        ) {
            let mut o: [i8; 3] = std::array::from_fn(|k| p[k] + s * (q[k] - p[k]) + r * d[k]);
            for x in [&mut p, &mut q] {
                x[axis] -= o[axis];
            }
            o[axis] = 0;
            let [mut org, dir, p, q] = [o, d, p, q].map(|v| v.map(f64::from));
            org[axis] = tiny;
            let line = Line { org, dir };
            let (edge, _) = by_fractions(&line, &p, &q);
            prop_assert_eq!(of_edge(&line, &p, &q), edge);
        }

        /// Asks about all edges and points of one line.
        #[test]
        fn sides_are_those_of_fractions(
            line in [[number(), number(), number()], [number(), number(), number()]],
            points in proptest::collection::vec([number(), number(), number()], 5),
            through in 0..6_usize,
        ) {
            let [mut org, dir] = line;
            // Some lines go through a point, or nearly.
            if let Some(p) = points.get(through) {
                let passing: Point = std::array::from_fn(|k| p[k] - dir[k]);
                if passing.iter().all(|x| x.is_finite()) {
                    org = passing;
                }
            }
            let line = Line { org, dir };
            for _ in 0..2 {
                for p in &points {
                    for q in &points {
                        let (edge, places) = by_fractions(&line, p, q);
                        prop_assert_eq!(of_edge(&line, p, q), edge);
                        for ((i, k), place) in AXES.into_iter().zip(places) {
                            prop_assert_eq!(of_point(&line, p, [i, k]), place);
                        }
                    }
                }
            }
        }
    }
}
