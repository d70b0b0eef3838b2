//! Search for the sign changes of a formula along a line.
//!
//! A segment of the line is bisected. A half is discarded if interval arithmetic (Moore, Interval
//! Analysis, 1966) shows that f has no zero there: by the range of its values (V1), or by the
//! range of its slope and its values at the ends (V2). Where the slope certainly has one sign, f
//! has one zero if its signs at the ends differ, and the zero is refined to two neighbouring
//! numbers (V5). A segment shorter than [`SHORTEST`] of the whole is not bisected: it has a zero
//! if the signs at its ends differ (V3). The sign at an end is the one that is certain in f64,
//! else the last certain one; at the beginning it is that of the f64 value, or the next certain
//! one if that value is 0 (V4, docs/numerics/level-sets.md).
//!
//! So the search may miss two zeros that are closer together than that, or between which f
//! consists of roundings only, and a surface that is touched without being crossed. It misses
//! nothing else (V8), unless a line has so many zeros that the search is cut short ([`MOST`]).
//!
//! This search *defines* the t of a zero (S35): every kernel gets the same number for a ray, and
//! exact arithmetic compares these numbers.

use super::{Dual, Formula, Range, Real};
use crate::math::Interval;
use std::ops::ControlFlow;

/// The length, relative to the whole segment, below which segments are not bisected (V3,
/// docs/numerics/level-sets.md).
pub const SHORTEST: f64 = 1.0 / (1_u64 << 36) as f64;

/// The most segments of one line that are examined at full resolution. After these, [`COARSE`]
/// takes the place of [`SHORTEST`], because functions such as sin(1/x) have infinitely many zeros.
const MOST: usize = 1 << 14;
const COARSE: f64 = 1.0 / (1_u64 << 12) as f64;

/// A line in the formula's space and the range of t that is searched. All numbers are finite.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    pub org: [f64; 3],
    pub dir: [f64; 3],
    /// The range of t that is bisected.
    pub part: [f64; 2],
    /// The range of t outside of which changes do not matter (V6, docs/numerics/level-sets.md).
    pub between: [f64; 2],
    /// Whether poles and ends of f's domain count as changes: they bound a solid.
    pub is_solid: bool,
}

/// A change of f's sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    pub t: f64,
    /// Whether f is below zero behind the change.
    pub enters: bool,
}

/// Buffers that are reused from line to line.
#[derive(Debug, Default)]
pub struct SearchScratch {
    waiting: Vec<Segment>,
    numbers: Vec<f64>,
    ranges: Vec<Range>,
    sloped: Vec<Dual<Range, 1>>,
}

/// Makes a place for the value of each step.
fn places<'a, R: Real>(values: &'a mut Vec<R>, formula: &Formula) -> &'a mut [R] {
    if values.len() < formula.steps().len() {
        values.resize(formula.steps().len(), R::constant(0.0));
    }
    values
}

/// A range of t, and f at its ends.
#[derive(Clone, Copy, Debug)]
struct Segment {
    t: Interval,
    ends: [Range; 2],
}

/// Calls `visit` at each change, front to back, until it breaks; changes outside `between` may be
/// among them. Returns whether f is below zero at the beginning of the segment, or where the
/// search begins.
pub fn changes(
    formula: &Formula,
    search: &Search,
    scratch: &mut SearchScratch,
    mut visit: impl FnMut(Change) -> ControlFlow<()>,
) -> bool {
    walk(formula, search, scratch, &mut visit)
}

/// What interval arithmetic says about a segment.
enum Known {
    /// It has no zero, and f is below zero or not.
    Sign(bool),
    /// It has at most one zero, or zeros that are not told apart: the signs at its ends decide.
    /// The value says whether a change counts.
    Ends(bool),
    Nothing,
}

fn walk(
    formula: &Formula,
    search: &Search,
    scratch: &mut SearchScratch,
    visit: &mut dyn FnMut(Change) -> ControlFlow<()>,
) -> bool {
    let waiting = &mut scratch.waiting;
    let mut along = OnLine {
        formula,
        search,
        numbers: places(&mut scratch.numbers, formula),
        ranges: places(&mut scratch.ranges, formula),
        sloped: places(&mut scratch.sloped, formula),
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
    // The sign at the beginning, and the latest one.
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
                // A zero close to the end of the segment before was left to this one.
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

/// The formula along a line.
struct OnLine<'a> {
    formula: &'a Formula,
    search: &'a Search,
    numbers: &'a mut [f64],
    ranges: &'a mut [Range],
    sloped: &'a mut [Dual<Range, 1>],
}

impl OnLine<'_> {
    fn at(&mut self, t: f64) -> f64 {
        let Search { org, dir, .. } = self.search;
        let on = |k: usize| org[k] + dir[k] * t;
        let point = [on(0), on(1), on(2)];
        self.formula.evaluate(&point, self.numbers)
    }

    /// Says whether the f64 value is below zero; `None` if it is 0 or NaN.
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
        let at = [Range::new(x), Range::new(y), Range::new(z)];
        self.formula.evaluate(&at, self.ranges)
    }

    /// Returns the ranges of f and its slope over a segment.
    fn over(&mut self, t: Interval) -> Dual<Range, 1> {
        let points = self.points(t);
        let at = |k: usize| Dual {
            value: Range::new(points[k]),
            slopes: [Range::new(Interval::point(self.search.dir[k]))],
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

    /// Refines a change between two t to two neighbouring numbers of different signs, and returns
    /// the one with the lesser |f| (V5, docs/numerics/level-sets.md): by the secant method, and
    /// then by steps of growing length from where that ends. If the f64 signs do not differ,
    /// returns the first t.
    fn change(&mut self, [mut a, mut b]: [f64; 2]) -> f64 {
        let (mut at_a, mut at_b) = (self.at(a), self.at(b));
        let below = at_a < 0.0;
        if below == (at_b < 0.0) {
            return a;
        }
        let ([mut p, mut at_p], [mut q, mut at_q]) = ([a, at_a], [b, at_b]);
        let mut steps = 0;
        // The step from the secant method's last end; it grows until the sign changes, and then
        // bisection takes over.
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
                // Still on the same side as the last end.
                q = t;
                reach *= 4.0;
            } else {
                reach = f64::INFINITY;
            }
        }
        if at_a.abs() <= at_b.abs() { a } else { b }
    }
}

/// The most steps of the secant method.
const SECANTS: u32 = 12;

/// Returns the sign of a function that is on one side of zero at both ends of a segment and too
/// flat to reach zero between them. With slopes from −u to v, and values p and q above zero at the
/// ends of a segment of length w, it is above both p − u x and q − v (w − x), and these are above
/// zero where they meet if v p + u q > u v w (V2, docs/numerics/level-sets.md).
fn sign_by_slope(part: &Segment, slope: &Interval) -> Option<bool> {
    let [a, b] = part.ends.map(|end| end.values);
    let (p, q, u, v, below) = if a.low > 0.0 && b.low > 0.0 {
        (a.low, b.low, -slope.low, slope.high, false)
    } else if a.high < 0.0 && b.high < 0.0 {
        (-a.high, -b.high, slope.high, -slope.low, true)
    } else {
        return None;
    };
    // Eight roundings, and the loss by underflow (V2, docs/numerics/level-sets.md).
    let most = u * v * part.t.width() * (1.0 + 8.0 * f64::EPSILON);
    (v * p + u * q > most + f64::MIN_POSITIVE).then_some(below)
}
