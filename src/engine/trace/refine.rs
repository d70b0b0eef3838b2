//! Refines t of hits to the f64 nearest to the exact one: what `exact` adds to `guarded`.

use super::exact_fallback::{WorldRay, nearest_t};
use super::hits::{Depths, Hits};
use super::query::HitId;
use super::rays::Rays;
use super::scratch::TraceScratch;
use crate::accel::World;

/// Finds the f64 nearest to where a world ray first meets a primitive beyond its origin, in
/// exact arithmetic. Returns `None` if it does not.
pub fn exact_t(world: &World, org: [f64; 3], dir: [f64; 3], id: HitId) -> Option<f64> {
    let (t_min, scratch) = (0.0, &mut TraceScratch::default());
    nearest_t(world, &WorldRay { org, dir, t_min }, id, scratch).filter(|t| t.is_finite())
}

/// Replaces t of every hit by the number of the column's type that is nearest to where its
/// ray meets its primitive in exact arithmetic (rounded to f64 before it is to f32).
#[inline(never)]
pub fn refine(world: &World, rays: &Rays, hits: &mut Hits, scratch: &mut TraceScratch) {
    for row in 0..hits.len() {
        let id = hits.id.get(row);
        if id == HitId::NONE {
            continue;
        }
        let ray = WorldRay {
            org: rays.org.at(row),
            dir: rays.dir.at(row),
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
