//! A tape's polynomial along one line from values in double-double, which decide nearly all lines
//! that f64 leaves undecided, before integers do.
//!
//! Numbers are unevaluated sums of two f64 (Dekker 1971; Knuth). An operation is off by less than
//! 2⁻¹⁰⁰ of the magnitudes of its operands, or by less than the least normal number if it
//! underflows (F14, docs/numerics/polynomials.md).

use crate::geom::implicit::error_in;
use crate::geom::tape::{Arithmetic, Tape};
use crate::math::bounds::UNIT;
use crate::math::lanes::Lanes;
use crate::math::{Vec3, is_power_of_two};
use crate::roots::collocation::{Collocation, collocation};
use crate::roots::lanes::{Segment, Simple};

/// The relative error bound of an operation, 2⁻¹⁰⁰ (F14, docs/numerics/polynomials.md).
const FINE: f64 = UNIT / (1_u64 << 47) as f64;

#[derive(Clone, Copy, Debug)]
struct PlainDoubleDouble<D> {
    high: D,
    low: D,
}

/// Renormalises a sum of two f64 with |a| ≥ |b|, as a rule.
#[inline(always)]
fn normalised<D: Lanes<Scalar = f64>>(a: D, b: D) -> PlainDoubleDouble<D> {
    let high = a + b;
    PlainDoubleDouble {
        high,
        low: b - (high - a),
    }
}

impl<D: Lanes<Scalar = f64>> PlainDoubleDouble<D> {
    #[inline(always)]
    fn exact(x: D) -> PlainDoubleDouble<D> {
        PlainDoubleDouble {
            high: x,
            low: D::zero(),
        }
    }

    #[inline(always)]
    fn plus(self, other: PlainDoubleDouble<D>) -> PlainDoubleDouble<D> {
        let (a, b) = (self.high, other.high);
        let sum = a + b;
        let part = sum - a;
        let lost = (a - (sum - part)) + (b - part);
        normalised(sum, lost + (self.low + other.low))
    }

    #[inline(always)]
    fn times(self, other: PlainDoubleDouble<D>) -> PlainDoubleDouble<D> {
        let product = self.high * other.high;
        let lost = self.high.product_error(other.high, product);
        normalised(
            product,
            lost + (self.high * other.low + self.low * other.high),
        )
    }

    #[inline(always)]
    fn negated(self) -> PlainDoubleDouble<D> {
        PlainDoubleDouble {
            high: -self.high,
            low: -self.low,
        }
    }
}

/// Double-double arithmetic at a point.
struct At<D>([PlainDoubleDouble<D>; 3]);

impl<D: Lanes<Scalar = f64>> Arithmetic for At<D> {
    type Value = PlainDoubleDouble<D>;

    #[inline(always)]
    fn coordinate(&self, axis: usize) -> PlainDoubleDouble<D> {
        self.0[axis]
    }

    #[inline(always)]
    fn constant(&self, value: f64) -> PlainDoubleDouble<D> {
        PlainDoubleDouble::exact(D::from_f64(value))
    }

    #[inline(always)]
    fn sum(&self, a: &PlainDoubleDouble<D>, b: &PlainDoubleDouble<D>) -> PlainDoubleDouble<D> {
        a.plus(*b)
    }

    #[inline(always)]
    fn difference(
        &self,
        a: &PlainDoubleDouble<D>,
        b: &PlainDoubleDouble<D>,
    ) -> PlainDoubleDouble<D> {
        a.plus(b.negated())
    }

    #[inline(always)]
    fn product(&self, a: &PlainDoubleDouble<D>, b: &PlainDoubleDouble<D>) -> PlainDoubleDouble<D> {
        a.times(*b)
    }
}

impl<D: Lanes<Scalar = f64>> At<D> {
    #[inline(always)]
    fn on_line(org: [D; 3], dir: [D; 3], t: PlainDoubleDouble<D>) -> At<D> {
        let place = |k: usize| {
            t.times(PlainDoubleDouble::exact(dir[k]))
                .plus(PlainDoubleDouble::exact(org[k]))
        };
        At([place(0), place(1), place(2)])
    }
}

/// Double-double arithmetic at a point of a ray, with derivatives by t in f64.
struct Moving<D> {
    at: At<D>,
    dir: Vec3<D>,
}

impl<D: Lanes<Scalar = f64>> Arithmetic for Moving<D> {
    type Value = (PlainDoubleDouble<D>, D);

    #[inline(always)]
    fn coordinate(&self, axis: usize) -> Self::Value {
        (self.at.0[axis], self.dir.axis(axis))
    }

    #[inline(always)]
    fn constant(&self, value: f64) -> Self::Value {
        (self.at.constant(value), D::zero())
    }

    #[inline(always)]
    fn sum(&self, a: &Self::Value, b: &Self::Value) -> Self::Value {
        (a.0.plus(b.0), a.1 + b.1)
    }

    #[inline(always)]
    fn difference(&self, a: &Self::Value, b: &Self::Value) -> Self::Value {
        (a.0.plus(b.0.negated()), a.1 - b.1)
    }

    #[inline(always)]
    fn product(&self, a: &Self::Value, b: &Self::Value) -> Self::Value {
        (a.0.times(b.0), a.1 * b.0.high + b.1 * a.0.high)
    }

    #[inline(always)]
    fn scaled(&self, a: &Self::Value, by: f64) -> Self::Value {
        let factor = D::from_f64(by);
        let value = match is_power_of_two(by) {
            true => PlainDoubleDouble {
                high: a.0.high * factor,
                low: a.0.low * factor,
            },
            false => a.0.times(PlainDoubleDouble::exact(factor)),
        };
        (value, a.1 * factor)
    }
}

/// Interpolates a tape's polynomial on a segment of one line, as [`super::chebyshev_nodes`] does
/// for lanes.
pub(super) fn interpolated<const N: usize>(
    tape: &Tape,
    (org, dir): ([f64; 3], [f64; 3]),
    start: f64,
    width: f64,
) -> Segment<f64, N> {
    let table: &Collocation = collocation(N);
    let mut reach = [0.0_f64; 3];
    let mut values = [0.0; N];
    for (value, s) in values.iter_mut().zip(&table.nodes) {
        let t = PlainDoubleDouble::exact(*s).times(PlainDoubleDouble::exact(width));
        let t = t.plus(PlainDoubleDouble::exact(start));
        let point = At::on_line(org, dir, t);
        for (reach, x) in reach.iter_mut().zip(&point.0) {
            *reach = reach.max(x.high.abs());
        }
        *value = tape.evaluate_plain(&point).high;
    }
    // Error bounds of coordinates and values (F14, docs/numerics/polynomials.md).
    let far = start.abs() + width;
    let moved = |k: usize| (org[k].abs() + far * dir[k].abs()) * (4.0 * FINE);
    let off = Vec3::new(moved(0), moved(1), moved(2));
    let [x, y, z] = reach.map(|x| x * (1.0 + 8.0 * UNIT));
    let lost = error_in(tape, Vec3::new(x, y, z), off, FINE);
    let largest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    // Values are rounded to f64, and so are the factors (F5, docs/numerics/polynomials.md).
    let rounding = (N as f64 + 5.0) * UNIT;
    let mut scaled = [values[0]; N];
    for (to, row) in scaled.iter_mut().zip(&table.rows).skip(1) {
        *to = values.iter().zip(row).map(|(v, factor)| v * factor).sum();
    }
    Segment {
        scaled,
        error: (lost + largest * rounding) * table.norm,
        first: lost + values[0].abs() * (2.0 * UNIT),
    }
}

/// Returns f at a place on a line, and its error bound (F14, docs/numerics/polynomials.md).
fn value_at(
    tape: &Tape,
    (org, dir): ([f64; 3], [f64; 3]),
    t: PlainDoubleDouble<f64>,
) -> (f64, f64) {
    let point = At::on_line(org, dir, t);
    let value = tape.evaluate_plain(&point).high;
    let reach = |k: usize| point.0[k].high.abs() * (1.0 + 8.0 * UNIT);
    let moved = |k: usize| (org[k].abs() + (t.high * dir[k]).abs()) * (4.0 * FINE);
    let reach = Vec3::new(reach(0), reach(1), reach(2));
    let off = Vec3::new(moved(0), moved(1), moved(2));
    let lost = error_in(tape, reach, off, FINE);
    (value, lost + value.abs() * (2.0 * UNIT))
}

/// Finds the f64 nearest to the only root between two numbers, from an approximation between them
/// (F16, docs/numerics/polynomials.md). `None` if the polynomial's values halfway to the two
/// neighbouring f64 do not certainly have opposite signs.
pub fn nearest(
    tape: &Tape,
    (org, dir): ([f64; 3], [f64; 3]),
    [from, t, to]: [f64; 3],
) -> Option<f64> {
    let (mut found, slopes) = (t, Vec3::<f64>::splat(dir));
    for _ in 0..STEPS {
        let at = At::on_line(org, dir, PlainDoubleDouble::exact(found));
        let (value, slope) = tape.evaluate_plain(&Moving { at, dir: slopes });
        let step = value.high / slope;
        found -= step;
        if !(found >= from && found <= to) {
            return None;
        }
        if step.abs() <= found.abs() * SETTLED {
            break;
        }
    }
    let sign = |neighbour: f64| {
        let halfway = PlainDoubleDouble::exact(found)
            .plus(PlainDoubleDouble::exact((neighbour - found) * 0.5));
        let (value, error) = value_at(tape, (org, dir), halfway);
        (value.abs() > error).then_some(value > 0.0)
    };
    let (below, above) = (sign(found.next_down())?, sign(found.next_up())?);
    (below != above).then_some(found)
}

/// The most steps of Newton's method; the first is nearly always enough (F16,
/// docs/numerics/polynomials.md).
const STEPS: usize = 4;

/// The length of a step relative to t after which the next one is far below the last place.
const SETTLED: f64 = 1.0 / (1_u64 << 40) as f64;

/// The half-width relative to t to which a crossing is refined: four roundings 2u (F15,
/// docs/numerics/polynomials.md).
const NEAR: f64 = 4.0 * f64::EPSILON;

/// The most rounds of false position.
const ROUNDS: usize = 4;

/// Narrows the bounds of a crossing, if the signs of f next to it are certain (F15,
/// docs/numerics/polynomials.md).
pub(super) fn refined(tape: &Tape, line: ([f64; 3], [f64; 3]), root: Simple) -> Simple {
    let at = |t: f64| {
        let (value, error) = value_at(tape, line, PlainDoubleDouble::exact(t));
        (value.abs() > error).then_some((t, value))
    };
    let (Some(mut a), Some(mut b)) = (at(root.from), at(root.to)) else {
        return root;
    };
    for _ in 0..ROUNDS {
        if (a.1 > 0.0) == (b.1 > 0.0) {
            return root;
        }
        let t = a.0 - a.1 * ((b.0 - a.0) / (b.1 - a.1));
        if !(t >= a.0 && t <= b.0) {
            return root;
        }
        let room = t.abs() * NEAR;
        let (from, to) = ((t - room).max(a.0), (t + room).min(b.0));
        let (Some(below), Some(above)) = (at(from), at(to)) else {
            return root;
        };
        if (below.1 > 0.0) != (above.1 > 0.0) {
            return Simple { t, from, to };
        }
        // The root lies on the same side of both places.
        if (below.1 > 0.0) == (a.1 > 0.0) {
            a = above;
        } else {
            b = below;
        }
    }
    root
}
