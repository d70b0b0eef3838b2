//! Refines t of hits to the f64 nearest to the exact one: what `exact` adds to `guarded`.

use super::exact_fallback::{WorldRay, nearest_t};
use super::hits::{Depths, Hits};
use super::query::HitId;
use super::rays::Rays;
use super::scratch::TraceScratch;
use crate::accel::World;

/// Replaces t of every hit by the number of the column's type that is nearest to where its
/// ray meets its primitive in exact arithmetic (rounded to f64 before it is to f32).
#[inline(never)]
pub(super) fn refine(world: &World, rays: &Rays, hits: &mut Hits, scratch: &mut TraceScratch) {
    for row in 0..hits.len() {
        let id = hits.id.get(row);
        if id == HitId::NONE {
            continue;
        }
        let ray = WorldRay {
            org: rays.org.at(row),
            dir: rays.dir.map(|column| f64::from(column[row])),
            t_min: f64::from(rays.t_min[row]),
        };
        let Some(nearest) = nearest_t(world, &ray, id, scratch) else {
            continue;
        };
        // A t beyond the numbers is reported as the largest of them, as lanes do.
        let nearest = nearest.clamp(f64::MIN, f64::MAX);
        match &mut hits.t {
            Depths::Single(t) => t[row] = (nearest as f32).clamp(f32::MIN, f32::MAX),
            Depths::Double(t) => t[row] = nearest,
        }
    }
}
