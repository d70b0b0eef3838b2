//! Code that the integration binaries share; each binary uses a part of it.
#![allow(dead_code, unused_imports)]

mod campaign;
mod files;
mod formulas;
mod hard;
mod picture;
mod random;
mod rays;
mod spans;
mod surfaces;
mod time;

pub use campaign::{campaign, property};
pub use files::{Loaded, assets, in_repository, load};
pub use formulas::{gyroid, ring, unit_ball};
pub use hard::{hard_rays, hard_scene};
pub use picture::{ALL_AOVS, Way, hash, kernels, picture, structures};
pub use random::{
    Random, dented, random_csg, random_mesh, random_scene, random_shape, random_solid,
};
pub use rays::RayColumns;
pub use spans::spans;
pub use surfaces::{ball, barth_sextic, clebsch, throat, torus};
pub use time::within_seconds;
