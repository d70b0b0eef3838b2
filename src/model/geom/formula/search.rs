//! Where a formula changes its sign along a line.
//!
//! The part of a line that is looked at is halved, and halves are dropped where interval
//! arithmetic (Moore, Interval Analysis, 1966) shows that f has no zero there: by its
//! values, or by its slopes and what it is at the ends. Where its slope certainly has one sign, f has one
//! zero if its signs at the ends differ, and that is taken to two neighbouring numbers.
//! What is shorter than [`SHORTEST`] of the whole is not looked into: it has a zero if the
//! signs at its ends differ. A sign is what is certain in f64, else the last one that was;
//! at the beginning, that of f64's value; where that is 0, the next one that is certain.
//! So two zeros may be missed that are closer together than that, or between which f is
//! nothing but roundings; and so is a surface that is touched without being crossed.
//! Nothing else is, unless a line has so many zeros that the search is cut short ([`MOST`]).
//!
//! A zero's t is *defined* by this search: it is one and the same number to all who ask
//! about a ray, and exact arithmetic takes it from there.

use super::{Dual, Formula, Range};
use crate::math::Interval;
use std::cell::Cell;
use std::ops::ControlFlow;

/// Of a line's part that is looked at.
pub const SHORTEST: f64 = 1.0 / (1_u64 << 36) as f64;

/// Parts of one line that are looked at. Beyond that, parts are short that are [`COARSE`]:
/// of sin(1/x) there is no end.
const MOST: usize = 1 << 14;
const COARSE: f64 = 1.0 / (1_u64 << 12) as f64;

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
    waiting: Vec<Segment>,
    numbers: Vec<f64>,
    ranges: Vec<Range>,
    sloped: Vec<Dual<Range, 1>>,
}

thread_local! {
    static SCRATCH: Cell<Option<Box<Scratch>>> = const { Cell::new(None) };
}

/// Of a line, and f at its ends.
#[derive(Clone, Copy)]
struct Segment {
    t: Interval,
    ends: [Range; 2],
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
    let mut along = OnLine {
        formula,
        search,
        numbers: &mut scratch.numbers,
        ranges: &mut scratch.ranges,
        sloped: &mut scratch.sloped,
    };
    let [low, high] = search.part;
    waiting.clear();
    if low < high {
        waiting.push(Segment {
            t: Interval::new(low, high),
            ends: [low, high].map(|t| along.at_point(t)),
        });
    }
    let mut shortest = (high - low) * SHORTEST;
    // The sign at the beginning, and the last one.
    let (mut first, mut below): (Option<bool>, Option<bool>) = (None, None);
    let (mut has_begun, mut looked_at) = (false, 0);
    while let Some(part) = waiting.pop() {
        let Interval { low: a, high: b } = part.t;
        if !(b > search.between[0]) {
            continue;
        }
        if a > search.between[1] {
            break;
        }
        looked_at += 1;
        if looked_at > MOST {
            shortest = (high - low) * COARSE;
        }
        let known = along.known(&part, shortest);
        if let Known::Nothing = known {
            let middle = part.t.middle();
            let at_middle = along.at_point(middle);
            let [at_a, at_b] = part.ends;
            let halves = [
                ([middle, b], [at_middle, at_b]),
                ([a, middle], [at_a, at_middle]),
            ];
            waiting.extend(halves.map(|([low, high], ends)| Segment {
                t: Interval::new(low, high),
                ends,
            }));
            continue;
        }
        if !has_begun {
            has_begun = true;
            below = match known {
                Known::Sign(sign) => Some(sign),
                _ => part.ends[0].sign().or_else(|| along.sign_at(a)),
            };
        }
        let before = below;
        let t = match known {
            Known::Sign(sign) => {
                below = Some(sign);
                // A zero that nearly is at the end of the part before was left to this.
                Some(a)
            }
            Known::Ends(counts) => {
                below = part.ends[1].sign().or(below);
                (counts && below != before).then(|| along.change([a, b]))
            }
            Known::Nothing => None,
        };
        first = first.or(before).or(below);
        if let (Some(before), Some(below), Some(t)) = (before, below, t)
            && below != before
            && visit(Change { t, enters: below }).is_break()
        {
            break;
        }
    }
    first.unwrap_or(false)
}

/// f along a line.
struct OnLine<'a> {
    formula: &'a Formula,
    search: &'a Search,
    numbers: &'a mut Vec<f64>,
    ranges: &'a mut Vec<Range>,
    sloped: &'a mut Vec<Dual<Range, 1>>,
}

impl OnLine<'_> {
    fn at(&mut self, t: f64) -> f64 {
        let Search { org, dir, .. } = self.search;
        let on = |k: usize| org[k] + dir[k] * t;
        let point = [on(0), on(1), on(2)];
        self.formula.evaluate(&point, self.numbers)
    }

    /// Whether f64's value is below zero; `None` where it is 0, or none.
    fn sign_at(&mut self, t: f64) -> Option<bool> {
        let at = self.at(t);
        let has_sign = at != 0.0 && !at.is_nan();
        has_sign.then_some(at < 0.0)
    }

    fn points(&self, t: Interval) -> [Interval; 3] {
        let on = |k: usize| {
            let org = Interval::point(self.search.org[k]);
            org.plus(&Interval::point(self.search.dir[k]).times(&t))
        };
        [on(0), on(1), on(2)]
    }

    fn at_point(&mut self, t: f64) -> Range {
        let [x, y, z] = self.points(Interval::point(t));
        let at = [Range::of(x), Range::of(y), Range::of(z)];
        self.formula.evaluate(&at, self.ranges)
    }

    /// f and its slope over a part.
    fn over(&mut self, t: Interval) -> Dual<Range, 1> {
        let points = self.points(t);
        let at = |k: usize| Dual {
            value: Range::of(points[k]),
            slopes: [Range::of(Interval::point(self.search.dir[k]))],
        };
        let at = [at(0), at(1), at(2)];
        self.formula.evaluate(&at, self.sloped)
    }

    fn known(&mut self, part: &Segment, shortest: f64) -> Known {
        let Dual {
            value,
            slopes: [slope],
        } = self.over(part.t);
        if let Some(sign) = value.sign() {
            return Known::Sign(sign);
        }
        if value.is_whole() && slope.is_whole() {
            if slope.values.excludes_zero() {
                return Known::Ends(true);
            }
            if let Some(sign) = sign_by_slope(part, &slope.values) {
                return Known::Sign(sign);
            }
        }
        let Interval { low, high } = part.t;
        let middle = part.t.middle();
        if high - low <= shortest || !(low < middle && middle < high) {
            return Known::Ends(value.is_whole() || self.search.is_solid);
        }
        Known::Nothing
    }

    /// Between two t of which the signs differ: the one of two neighbouring numbers of
    /// different signs where f is the lesser. By the secant method; then from where that
    /// ends. If the signs do not differ in f64, it is where the first is.
    fn change(&mut self, [mut a, mut b]: [f64; 2]) -> f64 {
        let (mut at_a, mut at_b) = (self.at(a), self.at(b));
        let below = at_a < 0.0;
        if below == (at_b < 0.0) {
            return a;
        }
        let ([mut p, mut at_p], [mut q, mut at_q]) = ([a, at_a], [b, at_b]);
        let mut steps = 0;
        // From the last end, ever farther until the other is met; then by halves.
        let mut reach = 0.0;
        loop {
            let middle = 0.5 * a + 0.5 * b;
            if !(a < middle && middle < b) {
                break;
            }
            let t = if steps < SECANTS {
                q - at_q * ((q - p) / (at_q - at_p))
            } else if q == a {
                a + reach
            } else {
                b - reach
            };
            let is_inside = a < t && t < b;
            let t = if is_inside { t } else { middle };
            let at = self.at(t);
            if at == 0.0 {
                return t;
            }
            let is_before = (at < 0.0) == below;
            if is_before {
                (a, at_a) = (t, at);
            } else {
                (b, at_b) = (t, at);
            }
            if steps < SECANTS {
                steps += 1;
                [p, at_p] = [q, at_q];
                let unit = t.abs().next_up() - t.abs();
                if (t - q).abs() <= 4.0 * unit {
                    steps = SECANTS;
                    reach = 2.0 * unit;
                }
                [q, at_q] = [t, at];
            } else if is_before == (q == a) {
                // Still on the side of the last.
                q = t;
                reach *= 4.0;
            } else {
                reach = f64::INFINITY;
            }
        }
        if at_a.abs() <= at_b.abs() { a } else { b }
    }
}

/// Steps of the secant method, at most.
const SECANTS: u32 = 12;

/// Of a function that is on one side of zero at both ends of a part, and too flat to come
/// to the other between them. With slopes from −u to v, and p and q above zero at the ends
/// of a part of length w, it is above both p − u x and q − v (w − x), and these are above
/// zero where they meet if v p + u q > u v w.
fn sign_by_slope(part: &Segment, slope: &Interval) -> Option<bool> {
    let [a, b] = part.ends.map(|end| end.values);
    let (p, q, u, v, below) = if a.low > 0.0 && b.low > 0.0 {
        (a.low, b.low, -slope.low, slope.high, false)
    } else if a.high < 0.0 && b.high < 0.0 {
        (-a.high, -b.high, slope.high, -slope.low, true)
    } else {
        return None;
    };
    // Eight roundings, and what underflows.
    let most = u * v * part.t.width() * (1.0 + 8.0 * f64::EPSILON);
    (v * p + u * q > most + f64::MIN_POSITIVE).then_some(below)
}
