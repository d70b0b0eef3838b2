//! Shading: surface evaluation, materials, lights and the integrator.

mod barycentric;
mod bsdf;
mod columns;
mod cutouts;
mod hit_buffer;
mod hit_columns;
mod hit_groups;
mod hits;
mod integrate;
mod interaction;
mod light;
pub mod path;
mod patterns;
mod projection;
mod ray_queue;
mod statistics;
mod surface;
mod textures;

pub use barycentric::barycentrics;
pub use bsdf::{BsdfSample, MaterialFlags, reflected, sample_bsdf, spawns_rays};
pub use columns::{Doubles, STEP, Singles, each_lane};
pub use integrate::{Integrator, Scratch};
pub use interaction::InteractionPart;
pub use ray_queue::{BATCH, RayQueue};
pub use statistics::{Memory, RayCounts, Statistics};
pub use surface::Surface;
pub use textures::{material_at, place_of};
