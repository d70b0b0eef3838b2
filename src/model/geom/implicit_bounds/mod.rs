//! Certified bounds of polynomial surfaces.
//!
//! First a box of any size is found outside of which the polynomial certainly has no
//! zero (`infinity`), or the clip's is taken; then its faces are moved in (`shrink`).
//! Everything is decided by intervals that are rounded outward ([`Interval`]), so a box
//! is right whatever it cost, and the budget only makes it wider; all parts of a
//! search are counted in evaluated steps of the tape, never in time. All sizes are
//! relative: a polynomial whose steps scale by powers of two has a box that does.

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

/// Steps of a tape that one search may evaluate, in intervals: about a tenth of a second.
const STEPS: u64 = 30_000_000;
/// Evaluations that showing a surface within its clip may take.
const CLIP_EVALUATIONS: u64 = 100_000;
/// Parts of the bounds below which cells are not bisected for a clip.
const CLIP_SMALLEST: f64 = 1.0 / 1024.0;

/// A box around all of f = 0, or of what of it is in the clip. `None` where the surface
/// has no bounds, where none are found within the budget, and where the format
/// overflows. They are within about one part in a hundred where the surface is
/// not too singular. A surface without points has a box that is one point: the
/// origin, or the middle of the clip.
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

/// Whether what of f = 0 is in `bounds` certainly is in the clip. A surface whose bounds
/// *without* its clip pass needs no clip.
pub fn is_within(tape: &Tape, bounds: &Aabb, clip: &Clip) -> bool {
    let mut work = Work::of_evaluations(tape, CLIP_EVALUATIONS);
    let whole: [Interval; 3] = std::array::from_fn(|k| Interval::new(bounds.min[k], bounds.max[k]));
    let mut todo = vec![whole];
    while let Some(mut region) = todo.pop() {
        if shrink::is_inside(clip, &region) {
            continue;
        }
        let slopes = shrink::slopes_unless_clear(&mut work, None, &mut region, |_, _| ());
        // It may have become narrower.
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
