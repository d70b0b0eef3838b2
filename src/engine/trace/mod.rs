//! Ray queries over a built world.

mod batch;
mod bunch;
#[cfg(test)]
mod cases;
mod combined;
mod decide;
mod few;
mod guess;
mod hits;
mod items;
mod leaf;
mod nested;
mod packet;
mod query;
#[cfg(test)]
mod random;
mod rays;
mod record;
mod refine;
mod shadow_cache;
mod solids;
mod spans;
mod stream;
mod tile;

#[cfg(feature = "all-lanes")]
#[doc(hidden)]
pub use batch::closest_doubting_all;
pub use batch::{any, any_counted, closest, closest_counted, closest_listed, counts};
pub use combined::{Crossing, TURNED, boundaries, in_frame};
pub use decide::decided;
pub use guess::{GuessCounts, Guesses, Reuse};
pub use hits::{Depths, HitIds, Hits, Ids};
pub use items::{ItemBuffer, Raster, Rect};
pub use leaf::Tester;
pub use packet::Packet;
pub use query::{AnyHit, Closest, HitId, Query};
pub use rays::{MAX_LANES, Origins, Rays};
pub use record::{Outcome, RayKind, TracedRay};
pub use shadow_cache::{CacheCounts, Caching, ShadowCache};
pub use spans::{End, Span, Spans, spans};
pub use tile::TILE;
