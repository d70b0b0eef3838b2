//! Where a formula changes its sign along a line.
//!
//! The part of a line that is looked at is halved, and halves are dropped where interval
//! arithmetic shows that f has no zero there: by its values, or by the mean value form
//! (Moore, Interval Analysis, 1966). Where its slope certainly has one sign, f has one
//! zero if its signs at the ends differ, and that is taken to two neighbouring numbers.
//! What is shorter than [`SHORTEST`] of the whole is not looked into: it has a zero if the
//! signs at its ends differ. A sign is what is certain in f64, else the last one that was.
//! So two zeros may be missed that are closer together than that, or between which f is
//! nothing but roundings; and so is a surface that is touched without being crossed.
//! Nothing else is.
//!
//! A zero's t is *defined* by this search, which depends on the formula and the line
//! alone: it is one and the same number to all who ask, and exact arithmetic takes it
//! from there.

use super::{Dual, Formula, Range};
use crate::math::Interval;
use std::cell::Cell;
use std::ops::ControlFlow;

/// Of a line's part that is looked at.
pub const SHORTEST: f64 = 1.0 / (1_u64 << 36) as f64;

/// Parts of one line that are looked at. Beyond that, parts are as if they were short:
/// of sin(1/x) there is no end.
const MOST: usize = 1 << 14;

/// A line in the formula's space, and what of it is looked at, as numbers of lengths of
/// `dir`. All finite.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    pub org: [f64; 3],
    pub dir: [f64; 3],
    /// Of which parts are halves of halves.
    pub part: [f64; 2],
    /// What lies before this does not matter, nor what lies behind the other.
    pub between: [f64; 2],
    /// Whether the ends of a pole, or of where f is defined, count: they bound a solid.
    pub is_solid: bool,
}

/// Where f changes its sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    pub t: f64,
    /// Whether f is below zero behind it.
    pub enters: bool,
}

/// What is used anew for each line.
#[derive(Default)]
struct Scratch {
    waiting: Vec<[f64; 2]>,
    numbers: Vec<f64>,
    ranges: Vec<Range>,
    sloped: Vec<Dual<Range, 1>>,
}

thread_local! {
    static SCRATCH: Cell<Option<Box<Scratch>>> = const { Cell::new(None) };
}

/// Calls `visit` at each change, front to back, until it has seen enough; it may be called
/// with some that are not between the two t. Returns whether f is below zero at the part's
/// beginning, or where the search begins.
pub fn changes(
    formula: &Formula,
    search: &Search,
    mut visit: impl FnMut(Change) -> ControlFlow<()>,
) -> bool {
    let mut scratch = SCRATCH.take().unwrap_or_default();
    let first = walk(formula, search, &mut scratch, &mut visit);
    SCRATCH.set(Some(scratch));
    first
}

/// What is known of a part.
enum Known {
    /// There is no zero in it, and f is below zero or not.
    Sign(bool),
    /// There is at most one, or none is told from another: as the signs at its ends say.
    /// Whether a change counts.
    Ends(bool),
    Nothing,
}

fn walk(
    formula: &Formula,
    search: &Search,
    scratch: &mut Scratch,
    visit: &mut dyn FnMut(Change) -> ControlFlow<()>,
) -> bool {
    let waiting = &mut scratch.waiting;
    let mut along = Along {
        formula,
        search,
        numbers: &mut scratch.numbers,
        ranges: &mut scratch.ranges,
        sloped: &mut scratch.sloped,
    };
    let [low, high] = search.part;
    waiting.clear();
    if low < high {
        waiting.push(search.part);
    }
    let mut shortest = (high - low) * SHORTEST;
    let (mut first, mut below) = (None, false);
    let mut looked_at = 0;
    while let Some([a, b]) = waiting.pop() {
        if !(b > search.between[0]) {
            continue;
        }
        if a > search.between[1] {
            break;
        }
        looked_at += 1;
        if looked_at > MOST {
            shortest = f64::INFINITY;
        }
        let known = along.known(Interval::new(a, b), shortest);
        if let Known::Nothing = known {
            let middle = Interval::new(a, b).middle();
            waiting.extend([[middle, b], [a, middle]]);
            continue;
        }
        if first.is_none() {
            below = match known {
                Known::Sign(sign) => sign,
                _ => along.over(Interval::point(a)).sign().unwrap_or(false),
            };
            first = Some(below);
        }
        let before = below;
        let t = match known {
            Known::Sign(sign) => {
                below = sign;
                // A zero that nearly is at the end of the part before was left to this.
                Some(a)
            }
            Known::Ends(counts) => {
                below = along.over(Interval::point(b)).sign().unwrap_or(below);
                (counts && below != before).then(|| along.change([a, b]))
            }
            Known::Nothing => None,
        };
        if let Some(t) = t
            && below != before
            && visit(Change { t, enters: below }).is_break()
        {
            break;
        }
    }
    first.unwrap_or(false)
}

/// f along a line.
struct Along<'a> {
    formula: &'a Formula,
    search: &'a Search,
    numbers: &'a mut Vec<f64>,
    ranges: &'a mut Vec<Range>,
    sloped: &'a mut Vec<Dual<Range, 1>>,
}

impl Along<'_> {
    fn at(&mut self, t: f64) -> f64 {
        let Search { org, dir, .. } = self.search;
        let point = std::array::from_fn(|k| org[k] + dir[k] * t);
        self.formula.evaluate(&point, self.numbers)
    }

    fn over(&mut self, t: Interval) -> Range {
        let points = self.points(t).map(Range::of);
        self.formula.evaluate(&points, self.ranges)
    }

    fn points(&self, t: Interval) -> [Interval; 3] {
        std::array::from_fn(|k| {
            let [org, dir] = [self.search.org[k], self.search.dir[k]].map(Interval::point);
            org.plus(&dir.times(&t))
        })
    }

    fn slope(&mut self, t: Interval) -> Range {
        let points = self.points(t);
        let at = std::array::from_fn(|k| Dual {
            value: Range::of(points[k]),
            slopes: [Range::of(Interval::point(self.search.dir[k]))],
        });
        self.formula.evaluate(&at, self.sloped).slopes[0]
    }

    fn known(&mut self, t: Interval, shortest: f64) -> Known {
        let values = self.over(t);
        if let Some(sign) = values.sign() {
            return Known::Sign(sign);
        }
        if values.is_whole() {
            let slope = self.slope(t);
            if slope.is_whole() && slope.values.excludes_zero() {
                return Known::Ends(true);
            }
            // The mean value form: f(m) + f'(T)·(T − m).
            if slope.is_whole() {
                let middle = Interval::point(t.middle());
                let at_middle = self.over(middle).values;
                let off = t.minus(&middle);
                let values = at_middle.plus(&slope.values.times(&off));
                if values.excludes_zero() {
                    return Known::Sign(values.high < 0.0);
                }
            }
        }
        let middle = t.middle();
        if t.width() <= shortest || !(t.low < middle && middle < t.high) {
            return Known::Ends(values.is_whole() || self.search.is_solid);
        }
        Known::Nothing
    }

    /// Between two t of which the signs differ: the one of two neighbouring numbers of
    /// different signs where f is the lesser. By false position, and halving where that is
    /// slow. If they do not differ in f64, it is where the first is.
    fn change(&mut self, [mut a, mut b]: [f64; 2]) -> f64 {
        let (mut at_a, mut at_b) = (self.at(a), self.at(b));
        let below = at_a < 0.0;
        if below == (at_b < 0.0) {
            return a;
        }
        let mut halve = false;
        loop {
            let middle = 0.5 * a + 0.5 * b;
            if !(a < middle && middle < b) {
                break;
            }
            let width = b - a;
            // A little past the zero, so that both ends come nearer.
            let [left, right] = [at_a, at_b].map(|at| at / (at_a - at_b) * width);
            let past = 0.125 * left.abs().min(right.abs());
            let t = if left < -right {
                a + left + past
            } else {
                b + right - past
            };
            let inside = a < t && t < b && !halve;
            let t = if inside { t } else { middle };
            let at = self.at(t);
            if at == 0.0 {
                return t;
            }
            if (at < 0.0) == below {
                (a, at_a) = (t, at);
            } else {
                (b, at_b) = (t, at);
            }
            halve = b - a > 0.5 * width;
        }
        if at_a.abs() <= at_b.abs() { a } else { b }
    }
}
