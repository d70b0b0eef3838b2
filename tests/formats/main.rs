//! Scene files: what each format means, what is refused and with which message, and the
//! check of a finished scene.

#[path = "../common/mod.rs"]
mod common;

mod animated;
mod draco;
mod found_dialects;
mod found_gltf;
mod found_meshes;
mod gltf;
mod included;
mod io_bad;
mod ktx2;
mod lathe;
mod limits;
mod meshopt;
mod mitsuba;
mod mutated;
mod native;
mod native_bad;
mod native_looks;
mod nff;
mod obj_images;
mod placed;
mod points;
mod polynomials;
mod pov;
mod repeated;
mod scad;
mod scene_checks;
mod threemf;
mod up_axis;
