//! A ray against a triangle, decided as exact arithmetic would.
//!
//! The pair's numbers are f64 and f32, and exact by definition (docs/NUMERICS.md).
//! With corners a, b, c from the ray's origin and d its direction, the edge
//! functions are [d, b, c], [d, c, a] and [d, a, b]. The ray's line meets the
//! triangle where none has a sign that another opposes, and not all are zero; so
//! edges and corners belong to it, and edge-on it is never met. D is their sum,
//! T = [a, b, c], and t = T / D (Möller and Trumbore 1997). An edge function
//! changes sign with the direction of its edge: neighbours have opposite values.
//!
//! Signs, and the order of two t, come from f64 where its error bound allows,
//! as nearly always, and else from integers ([`crate::math::int`]) of the least
//! size that holds the pair's numbers: no ray or triangle of finite numbers is
//! refused. tests/exact.rs compares with integers of any length.

use super::Corners;
use crate::math::Ratio;
use crate::math::bounds::{Bounded, UNIT};
use crate::math::int::{Int, on_grid};
use std::cmp::Ordering;

/// The first size of integer that holds the pair's numbers: of a coordinate, a
/// product of two and of three, and of the product of two such. One limb is for
/// rays and meshes of f32 numbers, two for f64 origins; four for those with
/// noise (a cosine of 90° is 6e-17); 33 hold any finite numbers.
macro_rules! at_size {
    ($this:ident.$function:ident($($argument:expr),*)) => {
        $this.$function::<1, 2, 3, 6>($($argument),*)
            .or_else(|| $this.$function::<2, 4, 6, 12>($($argument),*))
            .or_else(|| $this.$function::<4, 8, 12, 24>($($argument),*))
            .or_else(|| $this.$function::<33, 66, 99, 198>($($argument),*))
    };
}

/// An object ray and a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pair {
    org: [f64; 3],
    dir: [f64; 3],
    corners: Corners,
}

/// Where the line of a ray meets a triangle, before or behind its origin.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    pair: Pair,
    /// Whether D is negative.
    backward: bool,
    /// t, as far as f64 knows it.
    pub t: Bounded,
}

/// Where the ray's line meets the triangle in exact arithmetic. Rays with a
/// coordinate that is not finite meet nothing.
#[inline]
pub fn meet_exact(org: [f64; 3], dir: [f64; 3], corners: &Corners) -> Option<Crossing> {
    let edges = edge_functions(org, dir, corners);
    let mut positive = edges.iter().any(|e| e.value > e.error);
    let mut negative = edges.iter().any(|e| e.value < -e.error);
    if positive & negative {
        return None;
    }
    let pair = Pair {
        org,
        dir,
        corners: *corners,
    };
    let doubtful = edges.map(|e| e.sign().is_none());
    if doubtful != [false; 3] {
        [negative, positive] = pair.settle(doubtful, [negative, positive])?;
    }
    (positive != negative).then(|| Crossing::new(pair, negative))
}

impl Crossing {
    fn new(pair: Pair, backward: bool) -> Crossing {
        let t = pair.t(backward);
        Crossing { pair, backward, t }
    }

    /// By t, exactly.
    #[inline]
    pub fn order(&self, other: &Crossing) -> Ordering {
        let certain = self.t.order(&other.t);
        certain.unwrap_or_else(|| self.order_exact(other))
    }

    /// t against a number, exactly. Infinity is above all, and so is NaN.
    #[inline]
    pub fn order_with(&self, x: f64) -> Ordering {
        let (value, error) = (x, 0.0);
        let certain = self.t.order(&Bounded { value, error });
        certain.unwrap_or_else(|| self.order_with_exact(x))
    }

    /// The f64 nearest to t, ties to even; so equal t have equal bits.
    pub fn rounded(&self) -> f64 {
        at_size!(self.rounded_at()).expect(FINITE)
    }

    #[cold]
    #[inline(never)]
    fn order_exact(&self, other: &Crossing) -> Ordering {
        at_size!(self.order_at(other)).expect(FINITE)
    }

    #[cold]
    #[inline(never)]
    fn order_with_exact(&self, x: f64) -> Ordering {
        if !x.is_finite() {
            return if x == f64::NEG_INFINITY {
                Ordering::Greater
            } else {
                Ordering::Less
            };
        }
        at_size!(self.order_with_at(x)).expect(FINITE)
    }

    fn order_at<const N: usize, const P: usize, const Q: usize, const R: usize>(
        &self,
        other: &Crossing,
    ) -> Option<Ordering> {
        let (ours, theirs) = (self.ratio::<N, P, Q>()?, other.ratio::<N, P, Q>()?);
        Some(ours.order::<R>(&theirs))
    }

    fn order_with_at<const N: usize, const P: usize, const Q: usize, const R: usize>(
        &self,
        x: f64,
    ) -> Option<Ordering> {
        Some(self.ratio::<N, P, Q>()?.order::<R>(&Ratio::of(x)))
    }

    fn rounded_at<const N: usize, const P: usize, const Q: usize, const R: usize>(
        &self,
    ) -> Option<f64> {
        Some(self.ratio::<N, P, Q>()?.rounded::<R>())
    }

    /// T / D by the edges at the first corner, D positive.
    fn ratio<const N: usize, const P: usize, const Q: usize>(&self) -> Option<Ratio<Q>> {
        let Whole { to, dir, power } = self.pair.whole::<N>()?;
        let [a, b, c] = to;
        let normal: [Int<P>; 3] = cross(&difference(&b, &a), &difference(&c, &a));
        let (top, bottom) = (dot(&a, &normal), dot(&dir, &normal));
        Some(Ratio {
            top: Int::negated_if(&top, self.backward),
            bottom: Int::negated_if(&bottom, self.backward),
            power,
        })
    }
}

const FINITE: &str = "33 limbs hold any finite numbers, and others have no crossing";

/// A pair in integers: the corners from the ray's origin, and its direction.
struct Whole<const N: usize> {
    to: [[Int<N>; 3]; 3],
    dir: [Int<N>; 3],
    /// t is what these numbers give, times 2^power.
    power: i32,
}

impl Pair {
    /// Which signs the edge functions have, [negative, positive], given those of
    /// the edges without doubt; at the latest until both are found.
    #[cold]
    #[inline(never)]
    fn settle(&self, doubtful: [bool; 3], signs: [bool; 2]) -> Option<[bool; 2]> {
        at_size!(self.settle_at(doubtful, signs))
    }

    fn settle_at<const N: usize, const P: usize, const Q: usize, const R: usize>(
        &self,
        doubtful: [bool; 3],
        mut signs: [bool; 2],
    ) -> Option<[bool; 2]> {
        let Whole { to, dir, .. } = self.whole::<N>()?;
        for i in (0..3).filter(|i| doubtful[*i]) {
            let normal: [Int<P>; 3] = cross(&to[(i + 1) % 3], &to[(i + 2) % 3]);
            match Int::<Q>::sign(&dot(&dir, &normal)) {
                Ordering::Less => signs[0] = true,
                Ordering::Equal => {}
                Ordering::Greater => signs[1] = true,
            }
            if signs == [true; 2] {
                break;
            }
        }
        Some(signs)
    }

    #[inline(always)]
    fn whole<const N: usize>(&self) -> Option<Whole<N>> {
        let numbers = std::array::from_fn(|i| match i / 3 {
            0 => self.org[i],
            corner => f64::from(self.corners[corner - 1][i % 3]),
        });
        let (points, power) = on_grid::<N, 12>(&numbers)?;
        let (dir, dir_power) = on_grid::<N, 3>(&self.dir)?;
        let corner = |i: usize| std::array::from_fn(|k| points[3 + 3 * i + k].minus(&points[k]));
        Some(Whole {
            to: [corner(0), corner(1), corner(2)],
            dir,
            power: power - dir_power,
        })
    }

    /// t in f64.
    ///
    /// Roundings: one of a corner's difference from the origin, one of each
    /// edge, two of a product's difference, one of the last product, two of the
    /// sum: eight for T, seven for D. Edges are differences of f32 numbers, so
    /// only the last products can underflow.
    #[inline(always)]
    fn t(&self, backward: bool) -> Bounded {
        let [a, b, c] = self.corners.map(|c| c.map(f64::from));
        let minus = |x: [f64; 3], y: [f64; 3]| std::array::from_fn(|k| x[k] - y[k]);
        let from_org = minus(a, self.org);
        let (normal, normal_size) = cross_in_double(minus(b, a), minus(c, a));
        let top = dot_in_double((normal, normal_size), from_org, 10.0);
        let bottom = dot_in_double((normal, normal_size), self.dir, 8.0);
        let depth = if backward { -top.value } else { top.value };
        let speed = bottom.value.abs();
        // Not above D.
        let least = speed - bottom.error;
        let value = depth / speed;
        // |T/D − T̂/D̂| ≤ (|T − T̂| + |T̂/D̂| |D − D̂|) / |D|.
        let error = (top.error + value.abs() * bottom.error) / least;
        Bounded {
            value,
            error: if least > 0.0 {
                error * (1.0 + 16.0 * UNIT) + value.abs() * (2.0 * UNIT) + f64::MIN_POSITIVE
            } else {
                f64::INFINITY
            },
        }
    }
}

/// The edge functions in f64, and how far they may be from exact.
///
/// Seven roundings each: one of either corner's difference from the origin, two
/// of a product's difference, one of the last product, two of the sum. Counted
/// as eight, which covers the bound's own.
#[inline(always)]
pub fn edge_functions(org: [f64; 3], dir: [f64; 3], corners: &Corners) -> [Bounded; 3] {
    let [a, b, c] = corners.map(|c| std::array::from_fn(|k| f64::from(c[k]) - org[k]));
    let (to_a, to_b) = (cross_in_double(dir, a), cross_in_double(dir, b));
    let second = dot_in_double(to_a, c, 8.0);
    [
        dot_in_double(to_b, c, 8.0),
        Bounded {
            value: -second.value,
            ..second
        },
        dot_in_double(to_a, b, 8.0),
    ]
}

/// x × y, and the same of magnitudes with sums for differences.
#[inline(always)]
fn cross_in_double(x: [f64; 3], y: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let products = |k: usize| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        (x[i] * y[j], x[j] * y[i])
    };
    let all: [(f64, f64); 3] = std::array::from_fn(products);
    (all.map(|(p, q)| p - q), all.map(|(p, q)| p.abs() + q.abs()))
}

/// A product of three vectors, with `roundings` in each of its terms. What
/// underflow takes, 2^−1075 a product, is far below the least normal number.
#[inline(always)]
fn dot_in_double((x, size): ([f64; 3], [f64; 3]), y: [f64; 3], roundings: f64) -> Bounded {
    let z = y.map(f64::abs);
    let terms = size[0] * z[0] + size[1] * z[1] + size[2] * z[2];
    Bounded {
        value: x[0] * y[0] + x[1] * y[1] + x[2] * y[2],
        error: terms * (roundings * UNIT) + f64::MIN_POSITIVE * (1.0 + z[0] + z[1] + z[2]),
    }
}

fn difference<const N: usize>(x: &[Int<N>; 3], y: &[Int<N>; 3]) -> [Int<N>; 3] {
    std::array::from_fn(|k| x[k].minus(&y[k]))
}

#[inline(always)]
fn cross<const N: usize, const P: usize>(x: &[Int<N>; 3], y: &[Int<N>; 3]) -> [Int<P>; 3] {
    std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        x[i].times(&y[j]).minus(&x[j].times(&y[i]))
    })
}

#[inline(always)]
fn dot<const N: usize, const P: usize, const Q: usize>(x: &[Int<N>; 3], y: &[Int<P>; 3]) -> Int<Q> {
    let [i, j, k] = std::array::from_fn(|k| x[k].times::<P, Q>(&y[k]));
    i.plus(&j).plus(&k)
}
