//! From hits to radiance: surfaces, materials, lights, and the integrator.

mod integrate;
mod light;
mod material;
mod surface;

pub use integrate::{Integrator, Ledger, RayCounts, Wave};
pub use light::Arrival;
pub use material::{Onward, leaves_rays, onward, reflected};
pub use surface::Surface;
