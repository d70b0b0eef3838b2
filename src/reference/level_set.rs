//! Level sets: the sign changes, along a line, of a function that is no polynomial
//! (docs/SPEC.md, S35 to S37; docs/numerics/level-sets.md, V8).
//!
//! The search only halves. A part of the line on which an interval evaluation shows no zero
//! is dropped; a part that is not halved any further has a zero if the signs at its ends
//! differ. Intervals are rounded to nearest and then widened by more than the rounding.
//!
//! Where a ray begins on a level set, or grazes it, the answer depends on f64's roundings.
//! A ray therefore says by how much of the error bound the function is shifted: an answer
//! that differs when the function is shifted up or down is not certain.

use super::number::Number;
use super::ray::{Ray, dot};
use super::root::Root;
use super::solids::{self, Meeting};
use crate::geom::{Binary, Clip, FormulaStep as Step, LevelSet, Unary};
use std::cmp::Ordering;
use std::f64::consts::PI;

/// The length below which a part is not halved any further, relative to the searched part
/// of the line. Between two zeros that are closer, a function without steep waves is
/// nothing but f64's roundings. A line that touches a surface has thousands of parts of
/// this length whose intervals are undecided.
const SHORTEST: f64 = 1e-9;

/// How many parts of a line are searched to the length `SHORTEST`.
const MOST: usize = 1 << 18;
/// The length below which parts are not halved after `MOST` parts.
const COARSE: f64 = 1e-6;

/// The relative error that the result of an operation is widened by (V8).
const OFF: f64 = 1e-15;
/// The least absolute error that a result is widened by.
const LEAST: f64 = 1e-300;

/// The step to either side of a crossing at which f is evaluated, relative to t and the
/// coordinates there.
const SIDES: f64 = 4e-15;

/// Finds where a line meets a level set: at all sign changes of a solid, and at those in
/// the clip of an open row.
pub fn meetings<N: Number>(ray: &Ray, row: &LevelSet) -> Result<Vec<Meeting<N>>, N::Undecided> {
    let clip = match row.clip.filter(|_| row.open) {
        None => Vec::new(),
        Some(Clip::Sphere(sphere)) => solids::sphere::<N>(ray, &sphere),
        Some(Clip::Cuboid(cuboid)) => solids::cuboid(ray, &cuboid),
    };
    let mut found = Vec::new();
    'changes: for t in changes(ray, row).1 {
        let meeting = met::<N>(t);
        for face in &clip {
            if meeting.t.sign_of(face)?.is_gt() {
                continue 'changes;
            }
        }
        found.push(meeting);
    }
    Ok(found)
}

/// Returns the span of a CSG operand: whether the line is inside from the start, and where
/// that changes.
pub fn span<N: Number>(ray: &Ray, row: &LevelSet) -> (bool, Vec<Meeting<N>>) {
    let (first, changes) = changes(ray, row);
    (first, changes.into_iter().map(met).collect())
}

fn met<N: Number>(t: f64) -> Meeting<N> {
    let t = Root::fraction(N::from_f64(t), N::from_f64(1.0), Ordering::Greater);
    let (face, surface) = (0, 0);
    Meeting { t, face, surface }
}

/// Returns whether f < 0 before its first sign change, and all sign changes.
fn changes(ray: &Ray, row: &LevelSet) -> (bool, Vec<f64>) {
    let Some([low, high]) = part(ray, row) else {
        return (row.is_below_beyond, Vec::new());
    };
    let is_below = |t: f64| {
        let value = value(row, at(ray, t));
        if ray.level == 0.0 {
            return value < 0.0;
        }
        let [least, most] = values(row, points(ray, [t, t]));
        value + ray.level * (most - least) < 0.0
    };
    let first = is_below(low);
    let mut below = first;
    let mut found = Vec::new();
    let mut waiting = vec![[low, high]];
    let mut looked_at = 0;
    while let Some([a, b]) = waiting.pop() {
        looked_at += 1;
        let values = values(row, points(ray, [a, b]));
        if values[0].is_nan() || values[0] > 0.0 || values[1] < 0.0 {
            // The sign of f at the part's start was a rounding's; the change lies at that
            // start.
            let sign = values[1] < 0.0;
            if sign != below {
                below = sign;
                found.push(a);
            }
            continue;
        }
        let middle = (a + b) / 2.0;
        let short = if looked_at < MOST { SHORTEST } else { COARSE };
        let is_long = b - a > (high - low) * short;
        if is_long && a < middle && middle < b {
            waiting.extend([[middle, b], [a, middle]]);
            continue;
        }
        let counts = !row.open || values.iter().all(|x| x.is_finite());
        if is_below(b) != below {
            below = !below;
            if counts {
                found.push(nearest(&is_below, [a, b], below));
            }
        }
    }
    (first, found)
}

/// Bisects a sign change to the nearest f64; `behind` says whether f < 0 at the second end.
fn nearest(is_below: &dyn Fn(f64) -> bool, [mut a, mut b]: [f64; 2], behind: bool) -> f64 {
    loop {
        let middle = (a + b) / 2.0;
        if !(a < middle && middle < b) {
            return b;
        }
        if is_below(middle) == behind {
            b = middle;
        } else {
            a = middle;
        }
    }
}

/// Clips the line to the box in which zeros are sought.
fn part(ray: &Ray, row: &LevelSet) -> Option<[f64; 2]> {
    let region = row.region?;
    let (mut enter, mut exit) = (f64::NEG_INFINITY, f64::INFINITY);
    for k in 0..3 {
        let [o, d] = [ray.org[k], ray.dir[k]];
        let [from, to] = [(region.min[k] - o) / d, (region.max[k] - o) / d];
        if d == 0.0 {
            if o < region.min[k] || o > region.max[k] {
                return None;
            }
        } else {
            enter = enter.max(from.min(to));
            exit = exit.min(from.max(to));
        }
    }
    (enter < exit && enter.is_finite() && exit.is_finite()).then_some([enter, exit])
}

fn at(ray: &Ray, t: f64) -> [f64; 3] {
    std::array::from_fn(|k| ray.org[k] + ray.dir[k] * t)
}

fn value(row: &LevelSet, p: [f64; 3]) -> f64 {
    sloped(row, p).0
}

/// Returns the outward normal where a line crosses the surface at t. A sign change need not
/// be a zero: f may have a value on one side only, or pass infinity. The normal is then the
/// gradient of the step that causes it: of the operand of the first step without a value,
/// of a divisor, or of a tangent's angle (V10).
pub fn normal(row: &LevelSet, ray: &Ray, t: f64) -> [f64; 3] {
    let size = |v: [f64; 3]| v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let step = SIDES * (t.abs() + size(ray.org) / size(ray.dir));
    let [before, after] = [t - step, t + step].map(|t| all(row, at(ray, t)));
    let rate = |slopes: [f64; 3]| dot(slopes, ray.dir);
    let is_inside = |steps: &[Sloped]| steps.last().is_some_and(|f| f.0 < 0.0);
    let (leaves, enters) = (is_inside(&before), is_inside(&after));
    let gradient = sloped(row, at(ray, t)).1;
    let turned = |rate: f64| (rate < 0.0) == enters;
    let is_zero = [&before, &after].into_iter().all(|steps| {
        let last = steps.last().copied().unwrap_or_default();
        last.0.is_finite() && rate(last.1) != 0.0 && turned(rate(last.1))
    });
    if leaves == enters || is_zero {
        return gradient;
    }
    for (i, step) in row.formula.steps().iter().enumerate() {
        let values = |i: u32| (before[i as usize].0, after[i as usize].0);
        let (a, b) = values(i as u32);
        let cause = match *step {
            Step::Unary(Unary::Tan, i) if a * b < -1.0 => i,
            Step::Unary(_, i) if a.is_nan() != b.is_nan() => i,
            Step::Binary(Binary::Quotient, _, i) if values(i).0 * values(i).1 <= 0.0 => i,
            _ => continue,
        };
        for slopes in [before[cause as usize].1, after[cause as usize].1] {
            let along = rate(slopes);
            if along.is_finite() && along != 0.0 {
                return slopes.map(|x| if turned(along) { x } else { -x });
            }
        }
    }
    gradient
}

fn function(f: Unary, x: f64) -> f64 {
    match f {
        Unary::Abs => x.abs(),
        Unary::Sqrt => x.sqrt(),
        Unary::Exp => libm::exp(x),
        Unary::Ln => libm::log(x),
        Unary::Sin => libm::sin(x),
        Unary::Cos => libm::cos(x),
        Unary::Tan => libm::tan(x),
        Unary::Asin => libm::asin(x),
        Unary::Acos => libm::acos(x),
        Unary::Atan => libm::atan(x),
        Unary::Sinh => libm::sinh(x),
        Unary::Cosh => libm::cosh(x),
        Unary::Tanh => libm::tanh(x),
    }
}

fn derivative(f: Unary, x: f64) -> f64 {
    match f {
        Unary::Abs => 1.0_f64.copysign(x),
        Unary::Sqrt => 0.5 / x.sqrt(),
        Unary::Exp => libm::exp(x),
        Unary::Ln => 1.0 / x,
        Unary::Sin => libm::cos(x),
        Unary::Cos => -libm::sin(x),
        Unary::Tan => 1.0 / (libm::cos(x) * libm::cos(x)),
        Unary::Asin => 1.0 / (1.0 - x * x).sqrt(),
        Unary::Acos => -1.0 / (1.0 - x * x).sqrt(),
        Unary::Atan => 1.0 / (1.0 + x * x),
        Unary::Sinh => libm::cosh(x),
        Unary::Cosh => libm::sinh(x),
        Unary::Tanh => 1.0 / (libm::cosh(x) * libm::cosh(x)),
    }
}

fn power(x: f64, exponent: u32) -> f64 {
    (0..exponent).fold(1.0, |product, _| product * x)
}

/// A value and its gradient.
type Sloped = (f64, [f64; 3]);

fn sloped(row: &LevelSet, p: [f64; 3]) -> Sloped {
    all(row, p).last().copied().unwrap_or_default()
}

/// Evaluates the value and the gradient of every step.
fn all(row: &LevelSet, p: [f64; 3]) -> Vec<Sloped> {
    let mut all: Vec<Sloped> = Vec::with_capacity(row.formula.steps().len());
    let sum = |a: [f64; 3], s: f64, b: [f64; 3], r: f64| -> [f64; 3] {
        std::array::from_fn(|k| a[k] * s + b[k] * r)
    };
    for step in row.formula.steps() {
        let operand = |i: u32| all[i as usize];
        all.push(match *step {
            Step::Coordinate(axis) => {
                let mut slope = [0.0; 3];
                slope[usize::from(axis)] = 1.0;
                (p[usize::from(axis)], slope)
            }
            Step::Constant(value) => (value, [0.0; 3]),
            Step::Power(a, n) => {
                let (a, u) = operand(a);
                let rate = f64::from(n) * power(a, n - 1);
                (power(a, n), u.map(|u| u * rate))
            }
            Step::Unary(f, a) => {
                let (a, u) = operand(a);
                (function(f, a), u.map(|u| u * derivative(f, a)))
            }
            Step::Binary(operator, i, j) => {
                let ((a, u), (b, v)) = (operand(i), operand(j));
                match operator {
                    Binary::Sum => (a + b, sum(u, 1.0, v, 1.0)),
                    Binary::Difference => (a - b, sum(u, 1.0, v, -1.0)),
                    Binary::Product => (a * b, sum(u, b, v, a)),
                    Binary::Quotient => (a / b, sum(u, 1.0 / b, v, -a / b / b)),
                    Binary::Min if a < b => operand(i),
                    Binary::Max if a > b => operand(i),
                    Binary::Min | Binary::Max if a.is_nan() => operand(i),
                    Binary::Min | Binary::Max => operand(j),
                }
            }
        });
    }
    all
}

/// An interval [low, high]; NaN if the function has no value in it.
type Interval = [f64; 2];

/// The interval of all numbers.
const LINE: Interval = [f64::NEG_INFINITY, f64::INFINITY];

fn points(ray: &Ray, t: Interval) -> [Interval; 3] {
    std::array::from_fn(|k| {
        let along = product([ray.dir[k]; 2], t);
        wider([ray.org[k] + along[0], ray.org[k] + along[1]])
    })
}

fn wider([low, high]: Interval) -> Interval {
    let off = |x: f64| x.abs() * OFF + LEAST;
    let finite = |x: f64, end: f64| if x.is_finite() { end } else { x };
    [finite(low, low - off(low)), finite(high, high + off(high))]
}

/// Returns the widened interval of the least and the greatest of some numbers; the whole
/// line if one is NaN.
fn hull(all: &[f64]) -> Interval {
    if all.iter().any(|x| x.is_nan()) {
        return LINE;
    }
    let least = all.iter().fold(f64::INFINITY, |m, x| m.min(*x));
    let most = all.iter().fold(f64::NEG_INFINITY, |m, x| m.max(*x));
    wider([least, most])
}

fn product(a: Interval, b: Interval) -> Interval {
    hull(&[a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]])
}

/// Returns the interval of f over a box; the whole line if f may have no value at some
/// points of it.
fn values(row: &LevelSet, p: [Interval; 3]) -> Interval {
    let mut all: Vec<Interval> = Vec::with_capacity(row.formula.steps().len());
    let mut is_partial = false;
    for step in row.formula.steps() {
        let operand = |i: u32| all[i as usize];
        all.push(match *step {
            Step::Coordinate(axis) => p[usize::from(axis)],
            Step::Constant(value) => [value; 2],
            Step::Power(a, _) if operand(a)[0].is_nan() => operand(a),
            Step::Power(a, n) => {
                let [low, high] = operand(a);
                let zero = if low < 0.0 && high > 0.0 { 0.0 } else { high };
                // One rounding for each product of the power (V8).
                let [low, high] = hull(&[low, zero, high].map(|x| power(x, n)));
                let off = f64::from(n) * OFF;
                [low - low.abs() * off, high + high.abs() * off]
            }
            Step::Unary(f, a) => {
                let range = range(f, operand(a));
                is_partial |= range == LINE;
                range
            }
            Step::Binary(operator, a, b) => {
                let (a, b) = (operand(a), operand(b));
                if a[0].is_nan() || b[0].is_nan() {
                    all.push([f64::NAN; 2]);
                    continue;
                }
                match operator {
                    Binary::Sum => wider([a[0] + b[0], a[1] + b[1]]),
                    Binary::Difference => wider([a[0] - b[1], a[1] - b[0]]),
                    Binary::Product => product(a, b),
                    Binary::Quotient if b[0] <= 0.0 && b[1] >= 0.0 => {
                        is_partial = true;
                        LINE
                    }
                    Binary::Quotient => product(a, wider([1.0 / b[1], 1.0 / b[0]])),
                    Binary::Min => [a[0].min(b[0]), a[1].min(b[1])],
                    Binary::Max => [a[0].max(b[0]), a[1].max(b[1])],
                }
            }
        });
    }
    match all.last() {
        Some(last) if is_partial && !last[0].is_nan() => LINE,
        Some(last) => *last,
        None => [0.0; 2],
    }
}

fn range(f: Unary, [low, high]: Interval) -> Interval {
    if low.is_nan() {
        return [low; 2];
    }
    let domain = match f {
        Unary::Sqrt | Unary::Ln => [0.0, f64::INFINITY],
        Unary::Asin | Unary::Acos => [-1.0, 1.0],
        _ => LINE,
    };
    // ln 0 is no number.
    let is_end = |x: f64| matches!(f, Unary::Ln) && x <= 0.0;
    if high < domain[0] || low > domain[1] || is_end(high) {
        return [f64::NAN; 2];
    }
    if low < domain[0] || high > domain[1] || is_end(low) {
        return LINE;
    }
    // The ends, and the turning points between them.
    let turns = match f {
        Unary::Sin => Some(PI / 2.0),
        Unary::Cos => Some(0.0),
        Unary::Tan if high - low >= 1.0 => return LINE,
        Unary::Tan => {
            // tan has a pole where cos changes its sign; its slope is nowhere below 1.
            let cos = range(Unary::Cos, [low, high]);
            if cos[0] <= 0.0 && cos[1] >= 0.0 {
                return LINE;
            }
            None
        }
        Unary::Abs | Unary::Cosh if low < 0.0 && high > 0.0 => {
            return hull(&[low, 0.0, high].map(|x| function(f, x)));
        }
        _ => None,
    };
    // Two places for the ends and four for turning points; unused ones repeat the first
    // end.
    let mut all = [function(f, low); 6];
    all[1] = function(f, high);
    if let Some(first) = turns {
        if !(high - low < 2.0 * PI && low.abs() < 1e6) {
            return [-1.0, 1.0];
        }
        let nearest = ((low - first) / PI).floor() as i64;
        for (turn, k) in all[2..].iter_mut().zip(nearest..) {
            let at = first + k as f64 * PI;
            if at > low - 1e-6 && at < high + 1e-6 {
                *turn = if k % 2 == 0 { 1.0 } else { -1.0 };
            }
        }
    }
    hull(&all)
}
