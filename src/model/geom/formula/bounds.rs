//! Boxes outside of which a formula certainly has no zero, by interval arithmetic (V9,
//! docs/numerics/level-sets.md).

use super::{Formula, Range};
use crate::math::{Aabb, Interval};
use glam::DVec3;

/// The exponents of the half widths of cubes about the origin that are tried.
const POWERS: std::ops::RangeInclusive<i32> = -400..=400;

/// The number of halvings of the step by which a face is moved inward.
const HALVINGS: u32 = 7;

/// The most boxes that are examined for one move of a face, and the size relative to the whole
/// below which a box is not halved.
const BOXES: u32 = 2000;
const SMALLEST: f64 = 1.0 / 64.0;

/// The most steps of a formula that one search evaluates: some tenths of a second.
const STEPS: u64 = 10_000_000;

/// Returns a box around all zeros, and whether f is above zero everywhere outside it. `None` if
/// none is found.
pub fn bounds_of(formula: &Formula) -> Option<(Aabb, bool)> {
    let mut kept = formula.values();
    let mut sign =
        |region: &[Interval; 3]| formula.evaluate(&region.map(Range::new), &mut kept).sign();
    let mut beyond = |power: i32| {
        let reach = libm::ldexp(1.0, power);
        let ends = [
            Interval::new(f64::NEG_INFINITY, -reach),
            Interval::new(reach, f64::INFINITY),
        ];
        let mut signs = (0..6).map(|face| {
            let mut region = [Interval::LINE; 3];
            region[face / 2] = ends[face % 2];
            sign(&region).map(|below| !below)
        });
        let first = signs.next()??;
        signs.all(|sign| sign == Some(first)).then_some(first)
    };
    // If there is no zero beyond a cube there is none beyond a larger one.
    let (mut low, mut high) = (*POWERS.start(), *POWERS.end());
    let is_outside = beyond(high)?;
    while low < high {
        let middle = (low + high).div_euclid(2);
        match beyond(middle) {
            Some(_) => high = middle,
            None => low = middle + 1,
        }
    }
    let reach = libm::ldexp(1.0, high);
    let mut region = [Interval::new(-reach, reach); 3];
    let mut left = (STEPS / formula.steps().len().max(1) as u64) as u32;
    for face in (0..6).chain(0..6) {
        let (axis, upper) = (face / 2, face % 2 == 1);
        let mut part = 0.5;
        for _ in 0..HALVINGS {
            let Interval { low, high } = region[axis];
            let cut = (high - low) * part;
            let (mut slab, mut rest) = (region, region);
            if upper {
                (slab[axis].low, rest[axis].high) = (high - cut, high - cut);
            } else {
                (slab[axis].high, rest[axis].low) = (low + cut, low + cut);
            }
            if low < rest[axis].high
                && rest[axis].low < high
                && is_clear(&mut sign, slab, &mut left)
            {
                region = rest;
            } else {
                part *= 0.5;
            }
        }
    }
    Some((aabb(&region), is_outside))
}

/// Says whether f certainly has no zero in a box.
fn is_clear(
    sign: &mut impl FnMut(&[Interval; 3]) -> Option<bool>,
    whole: [Interval; 3],
    left: &mut u32,
) -> bool {
    let mut waiting = vec![whole];
    let mut boxes = BOXES.min(*left);
    while let Some(region) = waiting.pop() {
        if sign(&region).is_some() {
            continue;
        }
        let part = |k: usize| region[k].width() / whole[k].width();
        let widest = (0..3).fold(0, |w, k| {
            if region[k].width() > region[w].width() {
                k
            } else {
                w
            }
        });
        if boxes == 0 || part(widest) < SMALLEST {
            return false;
        }
        boxes -= 1;
        *left -= 1;
        let middle = region[widest].middle();
        let [mut below, mut above] = [region; 2];
        below[widest].high = middle;
        above[widest].low = middle;
        waiting.extend([below, above]);
    }
    true
}

fn aabb(region: &[Interval; 3]) -> Aabb {
    Aabb::new(
        DVec3::from_array(region.map(|x| x.low)),
        DVec3::from_array(region.map(|x| x.high)),
    )
}
