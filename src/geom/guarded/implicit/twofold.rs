//! A tape's polynomial along one line, from values in twice the precision: what f64
//! leaves open is nearly always settled by these, and integers have less to do.
//!
//! Numbers are unevaluated sums of two f64 (Dekker 1971; Knuth). An operation is off by
//! less than 2^-100 of the magnitudes that go into it, and by less than the least normal
//! number where it falls below the range.

use crate::geom::implicit::error_in;
use crate::geom::tape::{Arithmetic, Tape};
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::roots::collocation::{Collocation, collocation};
use crate::roots::lanes::{Segment, Simple};

/// What an operation is off by.
const FINE: f64 = UNIT / (1_u64 << 47) as f64;

#[derive(Clone, Copy, Debug)]
struct Twofold {
    high: f64,
    low: f64,
}

/// Of |a| ≥ |b|, as a rule.
fn normalised(a: f64, b: f64) -> Twofold {
    let high = a + b;
    Twofold {
        high,
        low: b - (high - a),
    }
}

impl Twofold {
    fn of(x: f64) -> Twofold {
        Twofold { high: x, low: 0.0 }
    }

    fn plus(self, other: Twofold) -> Twofold {
        let (a, b) = (self.high, other.high);
        let sum = a + b;
        let part = sum - a;
        let lost = (a - (sum - part)) + (b - part);
        normalised(sum, lost + (self.low + other.low))
    }

    fn times(self, other: Twofold) -> Twofold {
        let product = self.high * other.high;
        let lost = self.high.mul_add(other.high, -product);
        normalised(
            product,
            lost + (self.high * other.low + self.low * other.high),
        )
    }

    fn negated(self) -> Twofold {
        Twofold {
            high: -self.high,
            low: -self.low,
        }
    }
}

/// A point.
struct At([Twofold; 3]);

impl Arithmetic for At {
    type Value = Twofold;

    fn coordinate(&self, axis: usize) -> Twofold {
        self.0[axis]
    }

    fn constant(&self, value: f64) -> Twofold {
        Twofold::of(value)
    }

    fn sum(&self, a: &Twofold, b: &Twofold) -> Twofold {
        a.plus(*b)
    }

    fn difference(&self, a: &Twofold, b: &Twofold) -> Twofold {
        a.plus(b.negated())
    }

    fn product(&self, a: &Twofold, b: &Twofold) -> Twofold {
        a.times(*b)
    }
}

/// What [`super::along`] has, of one line.
pub(super) fn along<const N: usize>(
    tape: &Tape,
    (org, dir): ([f64; 3], [f64; 3]),
    start: f64,
    width: f64,
) -> Segment<f64, N> {
    let table: &Collocation = collocation(N);
    let mut reach = [0.0_f64; 3];
    let mut values = [0.0; N];
    for (value, s) in values.iter_mut().zip(&table.nodes) {
        let t = Twofold::of(*s).times(Twofold::of(width));
        let t = t.plus(Twofold::of(start));
        let place = |k: usize| t.times(Twofold::of(dir[k])).plus(Twofold::of(org[k]));
        let point = [place(0), place(1), place(2)];
        for (reach, x) in reach.iter_mut().zip(&point) {
            *reach = reach.max(x.high.abs());
        }
        *value = tape.evaluate_plain(&At(point)).high;
    }
    // What f64 would lose, and this a little of.
    let far = start.abs() + width;
    let moved = |k: usize| (org[k].abs() + far * dir[k].abs()) * (4.0 * FINE);
    let off = Vec3::new(moved(0), moved(1), moved(2));
    let [x, y, z] = reach.map(|x| x * (1.0 + 8.0 * UNIT));
    let lost = error_in(tape, Vec3::new(x, y, z), off, FINE);
    let largest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    // Values are rounded, and multiplied by what is.
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

/// f at a place of a line, and what that may be off by.
fn value_at(tape: &Tape, (org, dir): ([f64; 3], [f64; 3]), t: f64) -> (f64, f64) {
    let place = |k: usize| {
        let moved = Twofold::of(t).times(Twofold::of(dir[k]));
        moved.plus(Twofold::of(org[k]))
    };
    let point = [place(0), place(1), place(2)];
    let value = tape.evaluate_plain(&At(point)).high;
    let reach = |k: usize| point[k].high.abs() * (1.0 + 8.0 * UNIT);
    let moved = |k: usize| (org[k].abs() + (t * dir[k]).abs()) * (4.0 * FINE);
    let reach = Vec3::new(reach(0), reach(1), reach(2));
    let off = Vec3::new(moved(0), moved(1), moved(2));
    let lost = error_in(tape, reach, off, FINE);
    (value, lost + value.abs() * (2.0 * UNIT))
}

/// A few units in the last place on both sides of a crossing are enough.
const NEAR: f64 = 4.0 * f64::EPSILON;

/// Rounds of false position.
const ROUNDS: usize = 4;

/// A crossing between closer numbers, if f is known well enough there.
pub(super) fn sharpened(tape: &Tape, line: ([f64; 3], [f64; 3]), root: Simple) -> Simple {
    let at = |t: f64| {
        let (value, error) = value_at(tape, line, t);
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
        // The root lies on one side of both.
        if (below.1 > 0.0) == (a.1 > 0.0) {
            a = above;
        } else {
            b = below;
        }
    }
    root
}
