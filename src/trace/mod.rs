//! Ray queries over a built world.

mod batch;
mod guess;
mod items;
mod leaf;
mod nested;
mod packet;
mod query;
mod record;
mod shadow_cache;
mod stream;
mod tile;

pub use batch::{
    Depths, Hits, MAX_LANES, Origins, Rays, any, any_counted, closest, closest_counted,
    closest_listed,
};
pub use guess::{GuessCounts, Guesses, Reuse};
pub use items::{ItemBuffer, Raster, Rect};
pub use leaf::{Features, Has, Scratch, Tester, resolve_one};
pub use packet::Packet;
pub use query::{AnyHit, Closest, HitId, Query};
pub use record::{Outcome, RayKind, TracedRay};
pub use shadow_cache::{CacheCounts, Caching, ShadowCache};
pub use tile::TILE;
