//! //! Shading: surface evaluation, materials, lights and the integrator.

mod columns;
mod height;
mod integrate;
mod ledger;
mod light;
mod lit;
mod material;
mod site;
mod surface;
mod wave;

pub use columns::{Doubles, STEP};
pub use integrate::{Columns, Integrator};
pub use ledger::{Ledger, Memory, RayCounts};
pub use material::{Looks, Onward, leaves_rays, onward, reflected};
pub use surface::Surface;
pub use wave::{PIECE, Wave};
