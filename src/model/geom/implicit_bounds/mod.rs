//! Certified bounds of polynomial surfaces.
//!
//! The search begins with a box of any size outside of which the polynomial certainly has no zero
//! (`infinity`), or with the clip's box, and moves its faces inward (`shrink`). Every decision is
//! made by intervals that are rounded outward ([`Interval`]), so a box is correct whatever it
//! cost; a small budget only makes it wider. Budgets count evaluated steps of the tape, never
//! time. All sizes are relative: if a polynomial's steps scale by powers of two, so does its box.

mod infinity;
mod shrink;
#[cfg(test)]
mod tests;
mod values;
mod work;

use super::implicit::Clip;
use super::tape::Tape;
use crate::math::Aabb;
use crate::math::Interval;
use glam::DVec3;
use work::Work;

/// The most steps of a tape that one search evaluates in intervals: about a tenth of a second.
const STEPS: u64 = 30_000_000;
/// The most evaluations for certifying that a surface lies within its clip.
const CLIP_EVALUATIONS: u64 = 100_000;
/// The size relative to the bounds below which cells are not bisected for a clip.
const CLIP_SMALLEST: f64 = 1.0 / 1024.0;

/// Returns a box around f = 0, or around the part of it in the clip. `None` if the surface is
/// unbounded, if no box is found within the budget, or if numbers overflow. The box is tight to
/// about one part in a hundred unless the surface is very singular. A surface without points has a
/// box of one point: the origin, or the middle of the clip.
pub fn bounds_of(tape: &Tape, clip: Option<&Clip>) -> Option<Aabb> {
    let mut work = Work::new(tape, STEPS);
    let region = match clip {
        Some(clip) => around(clip),
        None => infinity::finite_region(&mut work)?,
    };
    if !region.iter().all(Interval::is_finite) {
        return None;
    }
    let none = || region.map(|x| Interval::point(x.middle()));
    let region = shrink::shrunk(&mut work, clip, region).unwrap_or_else(none);
    Some(Aabb {
        min: DVec3::from_array(region.map(|x| x.low)),
        max: DVec3::from_array(region.map(|x| x.high)),
    })
}

/// Says whether the part of f = 0 in `bounds` certainly lies in the clip. A surface whose bounds
/// *without* its clip pass this test needs no clip.
pub fn is_within(tape: &Tape, bounds: &Aabb, clip: &Clip) -> bool {
    let mut work = Work::of_evaluations(tape, CLIP_EVALUATIONS);
    let whole: [Interval; 3] = std::array::from_fn(|k| Interval::new(bounds.min[k], bounds.max[k]));
    let mut todo = vec![whole];
    while let Some(mut region) = todo.pop() {
        if shrink::is_inside(clip, &region) {
            continue;
        }
        let slopes = shrink::slopes_unless_clear(&mut work, None, &mut region, |_, _| ());
        // The region may have become narrower.
        if slopes.is_none() || shrink::is_inside(clip, &region) {
            continue;
        }
        let part = |k: usize| region[k].width() / whole[k].width();
        let widest = (0..3).fold(0, |w, k| if part(k) > part(w) { k } else { w });
        let middle = region[widest].middle();
        let is_small = !(part(widest) > CLIP_SMALLEST);
        if is_small || work.is_spent() {
            return false;
        }
        todo.extend(shrink::halves(&region, widest, middle));
    }
    true
}

fn around(clip: &Clip) -> [Interval; 3] {
    match clip {
        Clip::Sphere(s) => {
            let radius = Interval::new(-s.radius, s.radius);
            std::array::from_fn(|k| Interval::point(s.center[k]).plus(&radius))
        }
        Clip::Cuboid(c) => std::array::from_fn(|k| Interval::new(c.min[k], c.max[k])),
    }
}
