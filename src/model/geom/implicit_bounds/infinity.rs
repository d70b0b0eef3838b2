//! Certifies that a polynomial has no zeros far from the origin.
//!
//! Some of the axes are graded. A point whose largest graded coordinate is s ≥ 1/P in magnitude is
//! x = u / p with p = 1/s in (0, P]: one u is ±1, the other graded ones lie in [−1, 1], and
//! ungraded axes keep their coordinates. On each of these faces, cells in (u, p) are bisected
//! until none can hold a zero. A cell is excluded by the form in u and p, whose leading terms
//! decide near p = 0; or by the plain polynomial over the half-lines that the cell stands for,
//! which decides where leading terms vanish in some direction and the other terms have one sign.
//!
//! With all axes graded this is the projective closure. If the closure touches infinity, as that
//! of x² + z² = y³ (1 − y)³ does, single axes are graded one after the other, and then pairs.

use super::values::Forms;
use super::work::Work;
use crate::math::Interval;

/// The sets of graded axes, in the order in which they are tried.
const SETS: [[bool; 3]; 7] = [
    [true, true, true],
    [true, false, false],
    [false, true, false],
    [false, false, true],
    [true, true, false],
    [true, false, true],
    [false, true, true],
];
/// The largest exponent of 1/P, a power of two whose cube is within f64's range.
const EXPONENTS: i32 = 320;
/// The size relative to a face below which cells are not bisected.
const SMALLEST: f64 = 1.0 / 128.0;
/// The most evaluations for one P; a hundred are usual.
const EVALUATIONS: u64 = 6000;

/// Returns a box around all zeros, if one is certified.
pub(super) fn finite_region(work: &mut Work) -> Option<[Interval; 3]> {
    let mut region = [Interval::LINE; 3];
    for round in 0..3 {
        let before = region;
        for (i, set) in SETS.iter().enumerate() {
            let is_open = (0..3).any(|k| set[k] && !region[k].is_finite());
            if !is_open || (i == 0 && round > 0) {
                continue;
            }
            let Some(reach) = reach(work, set, &region) else {
                continue;
            };
            for k in (0..3).filter(|k| set[*k]) {
                region[k].low = region[k].low.max(-reach);
                region[k].high = region[k].high.min(reach);
            }
        }
        if region.iter().all(Interval::is_finite) {
            return Some(region);
        }
        if region == before {
            return None;
        }
    }
    None
}

/// Returns a power of two s such that no zero in the region has a graded coordinate of s or more;
/// the least that the search finds.
fn reach(work: &mut Work, set: &[bool; 3], region: &[Interval; 3]) -> Option<f64> {
    let mut is_clear = |exponent: i32| {
        let mut part = work.part_of_evaluations(EVALUATIONS);
        let is_clear = is_clear(&mut part, set, region, f64::powi(2.0, -exponent));
        work.give_back(part);
        is_clear
    };
    let (mut low, mut high) = (-EXPONENTS - 1, EXPONENTS);
    if !is_clear(high) {
        return None;
    }
    while high - low > 1 {
        let middle = (low + high).div_euclid(2);
        if is_clear(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some(f64::powi(2.0, high))
}

/// A cell of a face.
#[derive(Clone, Copy)]
struct Cell {
    coordinates: [Interval; 3],
    p: Interval,
}

/// Says whether certainly no zero in the region has a graded coordinate of 1/`most` or more.
fn is_clear(work: &mut Work, set: &[bool; 3], region: &[Interval; 3], most: f64) -> bool {
    let mut todo: Vec<Cell> = Vec::new();
    for axis in (0..3).filter(|k| set[*k]) {
        for sign in [-1.0, 1.0] {
            let unit = Interval::new(-1.0, 1.0);
            let mut coordinates = std::array::from_fn(|k| if set[k] { unit } else { region[k] });
            coordinates[axis] = Interval::point(sign);
            let p = Interval::new(0.0, most);
            todo.push(Cell { coordinates, p });
            while let Some(cell) = todo.pop() {
                if cell_is_clear(work, set, &cell) {
                    continue;
                }
                match halves(&cell, set, region, most) {
                    Some(halves) if !work.is_spent() => todo.extend(halves),
                    _ => return false,
                }
            }
        }
    }
    true
}

fn cell_is_clear(work: &mut Work, set: &[bool; 3], cell: &Cell) -> bool {
    let forms = Forms {
        coordinates: &cell.coordinates,
        graded: *set,
        p: cell.p,
    };
    if work.forms(&forms).excludes_zero() {
        return true;
    }
    let scale = cell.p.inverse_of_positive();
    let own: [Interval; 3] = std::array::from_fn(|k| {
        let coordinate = cell.coordinates[k];
        if set[k] {
            coordinate.times(&scale)
        } else {
            coordinate
        }
    });
    work.values(&own).excludes_zero()
}

/// Bisects a cell where it is widest relative to the face; `None` if it is small already.
fn halves(cell: &Cell, set: &[bool; 3], region: &[Interval; 3], most: f64) -> Option<[Cell; 2]> {
    // x / (1/P + |x|) takes an unbounded coordinate into [−1, 1].
    let bent = |x: f64| {
        if x.is_finite() {
            x * most / (1.0 + x.abs() * most)
        } else {
            x.signum()
        }
    };
    let part = |k: usize| {
        let own = &cell.coordinates[k];
        if set[k] {
            own.width() * 0.5
        } else if region[k].is_finite() {
            own.width() / region[k].width()
        } else {
            (bent(own.high) - bent(own.low)) * 0.5
        }
    };
    let parts = [part(0), part(1), part(2), cell.p.width() / most];
    let widest = (0..4).fold(0, |w, k| if parts[k] > parts[w] { k } else { w });
    if !(parts[widest] > SMALLEST) {
        return None;
    }
    let whole = if widest == 3 {
        &cell.p
    } else {
        &cell.coordinates[widest]
    };
    let middle = if whole.is_finite() {
        whole.middle()
    } else {
        let bent = 0.5 * (bent(whole.low) + bent(whole.high));
        bent / (1.0 - bent.abs()) / most
    };
    if !(whole.low < middle && middle < whole.high) {
        return None;
    }
    let [mut below, mut above] = [*cell; 2];
    let at = |cell: &mut Cell, part: Interval| match widest {
        3 => cell.p = part,
        k => cell.coordinates[k] = part,
    };
    at(&mut below, Interval::new(whole.low, middle));
    at(&mut above, Interval::new(middle, whole.high));
    // The half nearer to infinity comes first, because most failures are there.
    Some([above, below])
}
