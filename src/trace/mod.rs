//! Ray queries over a built scene.

mod record;

pub use record::{Outcome, RayKind, TracedRay};
