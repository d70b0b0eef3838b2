//! Ray queries over a built world: closest hit, any hit, and spans.

mod batch;
mod beam;
mod certain_hits;
mod csg;
mod double_pass;
mod exact_fallback;
mod hits;
mod item_buffer;
mod leaf;
mod nested;
mod packet;
mod query;
mod ray_stream;
mod rays;
mod record;
mod refine;
mod scratch;
mod shadow_cache;
mod solids;
mod spans;
mod stream;
mod temporal_bounds;
#[cfg(test)]
mod test_cases;
#[cfg(test)]
mod test_random;

#[cfg(feature = "all-lanes")]
#[doc(hidden)]
pub use batch::closest_all_exact;
pub use batch::{any, any_counted, closest, closest_counted, closest_listed, counts};
pub use beam::BEAM;
pub use csg::{Crossing, TURNED, boundaries, in_frame};
pub use hits::{Depths, HitIds, Hits, Ids};
pub use item_buffer::{ItemBuffer, Raster, Rect};
pub use leaf::Tester;
pub use packet::Packet;
pub use query::{AnyHit, Closest, HitId, Query};
pub use rays::{MAX_LANES, Rays, Vectors};
pub use record::{Outcome, RayKind, TracedRay};
pub use refine::{exact_t, refine};
pub use scratch::{ScratchPool, TraceScratch};
pub use shadow_cache::{CacheCounts, Caching, ShadowCache};
pub use spans::{End, Solids, Span, Spans};
pub use temporal_bounds::{Reuse, TemporalBounds, TemporalCounts};
