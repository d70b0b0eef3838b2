//! Certifying that a polynomial has no zeros far out.
//!
//! Some of the axes are graded. Points whose largest graded coordinate is s ≥ 1/P in
//! magnitude are x = u / p with p = 1/s in (0, P]: one u is ±1, the other graded ones
//! are in [−1, 1], the axes that are not graded keep their own coordinates. On each of
//! these faces cells in (u, p) are bisected until none can hold a zero: by the form in
//! u and p, whose leading terms decide near p = 0, or by the plain polynomial over the
//! half-lines that the cell stands for, which serves where leading terms vanish in some
//! direction and the others have one sign.
//!
//! All axes graded is the projective closure. Where that touches infinity, as for
//! x² + z² = y³ (1 − y)³, one axis after the other is tried, over all the others', then
//! pairs.

use super::values::Forms;
use super::work::Work;
use crate::math::Interval;

/// Sets of graded axes, in the order of trial.
const SETS: [[bool; 3]; 7] = [
    [true, true, true],
    [true, false, false],
    [false, true, false],
    [false, false, true],
    [true, true, false],
    [true, false, true],
    [false, true, true],
];
/// 1/P is a power of two with an exponent of at most this: cubes are within the format.
const EXPONENTS: i32 = 320;
/// Cells are not bisected below this part of a face.
const SMALLEST: f64 = 1.0 / 128.0;
/// Evaluations for one P; most need a hundred.
const EVALUATIONS: u64 = 6000;

/// A box around all zeros, if there certainly is one.
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

/// Some s, a power of two and the least that is easily found, so that no zero in the
/// region has a graded coordinate of s or more.
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

/// Part of a face.
#[derive(Clone, Copy)]
struct Cell {
    coordinates: [Interval; 3],
    p: Interval,
}

/// Whether certainly no zero in the region has a graded coordinate of 1/`most` or more.
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

/// Where it is widest, in parts of the face; `None` where it is small already.
fn halves(cell: &Cell, set: &[bool; 3], region: &[Interval; 3], most: f64) -> Option<[Cell; 2]> {
    // Of a coordinate without end, in [−1, 1] by x / (1/P + |x|).
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
    // The half nearer to infinity first: most failures are there.
    Some([above, below])
}
