//! Exact predicates of a ray and a triangle.
//!
//! The pair's numbers are f64 and f32, and exact by definition (S6). With corners a, b, c relative
//! to the ray's origin and direction d, the edge functions are [d, b, c], [d, c, a] and [d, a, b].
//! The ray's line meets the triangle if no two of them have opposite signs and not all are zero:
//! edges and corners belong to the triangle, and seen edge-on it is never met. With D their sum
//! and T = [a, b, c], t = T / D (Möller and Trumbore 1997). An edge function changes its sign with
//! the direction of its edge, so neighbours have opposite values.
//!
//! Signs, and the order of two t, come from f64 where its error bound allows (D3 and D4,
//! docs/numerics/exact.md), which is nearly always, and else from integers ([`orientation`],
//! [`crate::math::int`]) of the least size that holds the pair's numbers (D7 to D9). No ray or
//! triangle of finite numbers is refused. tests/kernels/exact_triangles/ compares with integers of
//! any length.

use super::Corners;
use crate::geom::exact::{Line, orientation};
use crate::math::bounds::{ErrorBounded, UNIT};
use crate::math::double_double::DoubleDouble;
use crate::math::dyadic::{Dyadic, exactly};
use crate::math::int::{Grid, Int};
use crate::math::{Number, Ratio};
use std::cmp::Ordering;

/// Calls a function at the first size of integers that holds the pair's numbers (D8,
/// docs/numerics/exact.md): the limbs of a coordinate, of a product of two and of three, and of
/// the product of two such. One limb serves numbers of f32, two serve origins of f64, four serve
/// those with noise (a cosine of 90° is 6e-17); 33 hold any finite numbers.
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
pub struct Pair {
    pub org: [f64; 3],
    pub dir: [f64; 3],
    pub corners: Corners,
}

/// The signs of the edge functions, as far as they are known.
#[derive(Clone, Copy, Debug)]
struct Signs {
    positive: bool,
    negative: bool,
    /// The edge functions that are exactly zero.
    zero: [bool; 3],
}

impl Signs {
    /// Adds the signs of the undecided ones, until both signs occur.
    #[inline(always)]
    fn with(mut self, doubtful: [bool; 3], side: impl Fn(usize) -> Ordering) -> Signs {
        for i in (0..3).filter(|i| doubtful[*i]) {
            match side(i) {
                Ordering::Less => self.negative = true,
                Ordering::Equal => self.zero[i] = true,
                Ordering::Greater => self.positive = true,
            }
            if self.positive & self.negative {
                break;
            }
        }
        self
    }
}

/// A crossing of a ray's line and a triangle, before or behind the ray's origin.
#[derive(Clone, Copy, Debug)]
pub struct Crossing<'a> {
    pub pair: &'a Pair,
    signs: Signs,
    /// t in f64 with its error bound.
    pub t: ErrorBounded,
}

/// Returns where the ray's line meets the triangle in exact arithmetic. Rays with a coordinate
/// that is not finite meet nothing.
#[inline]
pub fn meet_exact(pair: &Pair) -> Option<Crossing<'_>> {
    let edges = edge_functions(pair);
    let mut signs = Signs {
        positive: edges.iter().any(|e| e.value > e.error),
        negative: edges.iter().any(|e| e.value < -e.error),
        zero: [false; 3],
    };
    if signs.positive & signs.negative {
        return None;
    }
    let doubtful = edges.map(|e| e.sign().is_none());
    if doubtful != [false; 3] {
        signs = pair.settle(doubtful, signs)?;
    }
    (signs.positive != signs.negative).then(|| Crossing {
        pair,
        signs,
        t: t_in_double(pair),
    })
}

impl Crossing<'_> {
    /// Says whether a symbolically perturbed line of the same direction, which meets no edge,
    /// meets the triangle, too. The perturbation is the same for all triangles, so a line crosses
    /// a closed surface an even number of times.
    #[inline]
    pub fn is_generic(&self) -> bool {
        let side = if self.signs.negative {
            Ordering::Less
        } else {
            Ordering::Greater
        };
        (0..3).all(|i| !self.signs.zero[i] || self.pair.drift(i) == side)
    }

    /// Says whether the line runs against the triangle's normal, which its winding defines.
    #[inline]
    pub fn is_against(&self) -> bool {
        self.signs.negative
    }

    /// Orders by t, exactly.
    #[inline]
    pub fn order(&self, other: &Crossing) -> Ordering {
        let certain = self.t.order(&other.t);
        certain.unwrap_or_else(|| self.order_exact(other))
    }

    /// Orders t and a number, exactly. Infinity and NaN are above all t.
    #[inline]
    pub fn order_with(&self, x: f64) -> Ordering {
        let (value, error) = (x, 0.0);
        let certain = self.t.order(&ErrorBounded { value, error });
        certain.unwrap_or_else(|| self.order_with_exact(x))
    }

    /// Returns the f64 nearest to t, ties to even, so that equal t have equal bits (D12,
    /// docs/numerics/exact.md).
    pub fn rounded(&self) -> f64 {
        let near = self.rounded_in_double_double();
        near.unwrap_or_else(|| at_size!(self.rounded_at()).expect(FINITE))
    }

    /// Returns the nearest f64 if double-double arithmetic is certain of it.
    fn rounded_in_double_double(&self) -> Option<f64> {
        let of = |x: f64| <DoubleDouble as Number>::of((), x);
        let [a, b, c] = self.pair.corners_in_double();
        let difference = |p: [f64; 3], q: [f64; 3]| [0, 1, 2].map(|k| of(p[k]).minus(&of(q[k])));
        let (ba, ca) = (difference(b, a), difference(c, a));
        let minor = |i: usize, j: usize| ba[i].times(&ca[j]).minus(&ba[j].times(&ca[i]));
        let normal = [minor(1, 2), minor(2, 0), minor(0, 1)];
        let dot = |v: [DoubleDouble; 3]| {
            let product = |k: usize| normal[k].times(&v[k]);
            product(0).plus(&product(1)).plus(&product(2))
        };
        let (top, bottom) = (
            dot(difference(a, self.pair.org)),
            dot(self.pair.dir.map(of)),
        );
        let first = top.value() / bottom.value();
        let left = |t: &DoubleDouble| top.minus(&bottom.times(t));
        let t = first + left(&of(first)).value() / bottom.value();
        if !(t.is_finite() && t.abs() > f64::MIN_POSITIVE / UNIT) {
            return None;
        }
        // T / D must lie between the numbers halfway to t's neighbours.
        let halfway = |to: f64| of(t).plus(&of((to - t) * 0.5));
        let below = left(&halfway(t.next_down())).sign()?;
        let above = left(&halfway(t.next_up())).sign()?;
        (below.is_ne() && above == below.reverse()).then_some(t)
    }

    #[cold]
    #[inline(never)]
    fn order_exact(&self, other: &Crossing) -> Ordering {
        if self.shares_point(other) {
            return Ordering::Equal;
        }
        at_size!(self.order_at(other)).expect(FINITE)
    }

    /// Says whether one ray meets both triangles at a shared edge or corner, or the same triangle:
    /// then t is the same without computation (D10, docs/numerics/exact.md).
    fn shares_point(&self, other: &Crossing) -> bool {
        let (ours, theirs) = (self.pair, other.pair);
        if ours.org != theirs.org || ours.dir != theirs.dir {
            return false;
        }
        // The point is a mean of the corners whose weights are not zero.
        let (zero, others) = (self.signs.zero, other.signs.zero);
        let is_theirs =
            |i: usize| (0..3).any(|j| !others[j] && ours.corners[i] == theirs.corners[j]);
        let count = |zero: [bool; 3]| zero.iter().filter(|z| **z).count();
        count(zero) == count(others) && (0..3).all(|i| zero[i] || is_theirs(i))
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

    #[inline(never)]
    fn order_at<const N: usize, const P: usize, const Q: usize, const R: usize>(
        &self,
        other: &Crossing,
    ) -> Option<Ordering> {
        let (ours, theirs) = (self.ratio::<N, P, Q>()?, other.ratio::<N, P, Q>()?);
        Some(ours.order::<R>(&theirs))
    }

    #[inline(never)]
    fn order_with_at<const N: usize, const P: usize, const Q: usize, const R: usize>(
        &self,
        x: f64,
    ) -> Option<Ordering> {
        Some(self.ratio::<N, P, Q>()?.order::<R>(&Ratio::of(x)))
    }

    #[inline(never)]
    fn rounded_at<const N: usize, const P: usize, const Q: usize, const R: usize>(
        &self,
    ) -> Option<f64> {
        Some(self.ratio::<N, P, Q>()?.rounded::<R>())
    }

    /// Returns T / D from the edges at the first corner, with D positive (D4,
    /// docs/numerics/exact.md).
    #[inline(always)]
    fn ratio<const N: usize, const P: usize, const Q: usize>(&self) -> Option<Ratio<Q>> {
        let Whole { to, dir, power } = self.pair.whole::<N>()?;
        let [a, b, c] = to;
        let normal: [Int<P>; 3] = cross(&difference(&b, &a), &difference(&c, &a));
        let (top, bottom) = (dot(&a, &normal), dot(&dir, &normal));
        Some(Ratio {
            top: Int::negated_if(&top, self.signs.negative),
            bottom: Int::negated_if(&bottom, self.signs.negative),
            power,
        })
    }
}

const FINITE: &str = "33 limbs hold any finite numbers, and others have no crossing";

/// A pair in integers: the corners relative to the ray's origin, and its direction (D7,
/// docs/numerics/exact.md).
struct Whole<const N: usize> {
    to: [[Int<N>; 3]; 3],
    dir: [Int<N>; 3],
    /// The exponent of t: t is the quotient of these numbers times 2^power.
    power: i32,
}

impl Pair {
    /// Returns the sign that an edge function that is zero takes if the line's origin moves by ε
    /// and ε² along the two axes after the direction's longest. Zero for an edge along the line.
    ///
    /// With p, q the edge's ends relative to the origin and δ the shift, [d, p − δ, q − δ] = [d,
    /// p, q] + [d, δ, p − q].
    #[cold]
    #[inline(never)]
    fn drift(&self, edge: usize) -> Ordering {
        let corners = self.corners_in_double();
        let [p, q] = [1, 2].map(|next| corners[(edge + next) % 3]);
        let size = self.dir.map(f64::abs);
        let k = (0..3).fold(0, |k, i| if size[i] > size[k] { i } else { k });
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        exactly(&|space| {
            let of = |x: f64| Dyadic::of(space, x);
            let along = |m: usize| of(p[m]).minus(&of(q[m]));
            let minor = |m: usize, n: usize| {
                let (x, y) = (of(self.dir[m]), of(self.dir[n]));
                x.times(&along(n)).minus(&y.times(&along(m))).sign()
            };
            let first = minor(k, j)?;
            if first.is_ne() {
                return Some(first);
            }
            minor(i, k)
        })
    }

    /// Returns the exact signs of the undecided edge functions, until both signs occur, given the
    /// others. `None` if a number is not finite.
    #[cold]
    #[inline(never)]
    fn settle(&self, doubtful: [bool; 3], signs: Signs) -> Option<Signs> {
        let (org, dir) = (self.org, self.dir);
        let corners = self.corners_in_double();
        let line = Line { org, dir };
        if !line.is_finite() || !corners.as_flattened().iter().all(|x| x.is_finite()) {
            return None;
        }
        // Edge-on all three are zero; a ray along a flat part of a mesh has many such pairs.
        if doubtful == [true; 3] && self.is_edge_on() {
            return None;
        }
        let side =
            |i: usize| orientation::of_edge(&line, &corners[(i + 1) % 3], &corners[(i + 2) % 3]);
        Some(signs.with(doubtful, side))
    }

    /// Says whether D = 0, if small integers decide that.
    fn is_edge_on(&self) -> bool {
        let corners = self.corners_in_double();
        let [a, b, c] = corners;
        // The triangle is perpendicular to an axis, and so is the ray: every product is zero.
        if (0..3).any(|k| self.dir[k] == 0.0 && a[k] == b[k] && b[k] == c[k]) {
            return true;
        }
        let place = || {
            let [a, b, c] = Grid::<1>::over(&corners).place(&corners)?;
            let [dir] = Grid::<1>::over(&[self.dir]).place(&[self.dir])?;
            let normal: [Int<2>; 3] = cross(&difference(&b, &a), &difference(&c, &a));
            Some(dot::<1, 2, 3>(&dir, &normal).is_zero())
        };
        place().unwrap_or(false)
    }

    #[inline(always)]
    fn whole<const N: usize>(&self) -> Option<Whole<N>> {
        let (corners, org, dir) = (self.corners_in_double(), [self.org], [self.dir]);
        let grid = Grid::over(&corners).and(Grid::over(&org));
        let dir_grid = Grid::over(&dir);
        let ([a, b, c], [org]) = (grid.place(&corners)?, grid.place(&org)?);
        let [dir] = dir_grid.place(&dir)?;
        Some(Whole {
            to: [
                difference(&a, &org),
                difference(&b, &org),
                difference(&c, &org),
            ],
            dir,
            power: grid.power() - dir_grid.power(),
        })
    }

    #[inline(always)]
    fn corners_in_double(&self) -> [[f64; 3]; 3] {
        let [a, b, c] = self.corners;
        let double = |c: [f32; 3]| [f64::from(c[0]), f64::from(c[1]), f64::from(c[2])];
        [double(a), double(b), double(c)]
    }
}

/// Computes t in f64 with its error bound (D4, docs/numerics/exact.md).
///
/// Roundings: one of a corner's difference from the origin, one of each edge, two of a product's
/// difference, one of the last product, two of the sum: eight for T, seven for D; one more of each
/// covers those of the bound. Edges are differences of f32 numbers, so only the last products can
/// underflow.
#[inline(always)]
fn t_in_double(pair: &Pair) -> ErrorBounded {
    let [a, b, c] = pair.corners_in_double();
    let normal = cross_in_double(minus(b, a), minus(c, a));
    let top = dot_in_double(normal, minus(a, pair.org), 9.0);
    let bottom = dot_in_double(normal, pair.dir, 8.0);
    // A lower bound of |D|. The two divisions are independent of each other.
    let least = bottom.value.abs() - bottom.error;
    let (value, inverse) = (top.value / bottom.value, 1.0 / least);
    // |T/D − T̂/D̂| ≤ (|T − T̂| + |T̂/D̂| |D − D̂|) / |D|.
    let error = (top.error + value.abs() * bottom.error) * inverse;
    ErrorBounded {
        value,
        // Beyond this the inverse is subnormal and has a larger relative error.
        error: if least > 0.0 && least < 1e300 {
            error * (1.0 + 16.0 * UNIT) + value.abs() * (2.0 * UNIT) + f64::MIN_POSITIVE
        } else {
            f64::INFINITY
        },
    }
}

/// Computes the edge functions in f64 with their error bounds (D3, docs/numerics/exact.md).
///
/// Seven roundings each: one of either corner's difference from the origin, two of a product's
/// difference, one of the last product, two of the sum. They count as eight, which covers those of
/// the bound.
#[inline(always)]
pub fn edge_functions(pair: &Pair) -> [ErrorBounded; 3] {
    let [a, b, c] = pair.corners_in_double();
    let (a, b, c) = (minus(a, pair.org), minus(b, pair.org), minus(c, pair.org));
    let to_a = cross_in_double(pair.dir, a);
    let to_b = cross_in_double(pair.dir, b);
    let second = dot_in_double(to_a, c, 8.0);
    [
        dot_in_double(to_b, c, 8.0),
        ErrorBounded {
            value: -second.value,
            ..second
        },
        dot_in_double(to_a, b, 8.0),
    ]
}

#[inline(always)]
fn minus(x: [f64; 3], y: [f64; 3]) -> [f64; 3] {
    [x[0] - y[0], x[1] - y[1], x[2] - y[2]]
}

/// Returns x × y, and the same of magnitudes with sums for differences.
#[inline(always)]
fn cross_in_double(x: [f64; 3], y: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let p = [x[1] * y[2], x[2] * y[0], x[0] * y[1]];
    let q = [x[2] * y[1], x[0] * y[2], x[1] * y[0]];
    let size = |k: usize| p[k].abs() + q[k].abs();
    (minus(p, q), [size(0), size(1), size(2)])
}

/// Computes a product of three vectors with `roundings` in each of its terms. The loss by
/// underflow, 2⁻¹⁰⁷⁵ per product, is far below the least normal number.
#[inline(always)]
fn dot_in_double((x, size): ([f64; 3], [f64; 3]), y: [f64; 3], roundings: f64) -> ErrorBounded {
    let z = [y[0].abs(), y[1].abs(), y[2].abs()];
    let terms = size[0] * z[0] + size[1] * z[1] + size[2] * z[2];
    ErrorBounded {
        value: x[0] * y[0] + x[1] * y[1] + x[2] * y[2],
        error: terms * (roundings * UNIT) + f64::MIN_POSITIVE * (1.0 + z[0] + z[1] + z[2]),
    }
}

#[inline(always)]
fn difference<const N: usize>(x: &[Int<N>; 3], y: &[Int<N>; 3]) -> [Int<N>; 3] {
    [x[0].minus(&y[0]), x[1].minus(&y[1]), x[2].minus(&y[2])]
}

#[inline(always)]
fn cross<const N: usize, const P: usize>(x: &[Int<N>; 3], y: &[Int<N>; 3]) -> [Int<P>; 3] {
    let minor = |i: usize, j: usize| x[i].times::<N, P>(&y[j]).minus(&x[j].times(&y[i]));
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

#[inline(always)]
fn dot<const N: usize, const P: usize, const Q: usize>(x: &[Int<N>; 3], y: &[Int<P>; 3]) -> Int<Q> {
    let product = |k: usize| x[k].times::<P, Q>(&y[k]);
    product(0).plus(&product(1)).plus(&product(2))
}
