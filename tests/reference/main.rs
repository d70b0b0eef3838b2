//! The reference, against formulas worked out by hand and published hits; and the
//! measurements that compare with it: `verify`, `extremes`, the ray sets of `bench`.

#[path = "../common/mod.rs"]
mod common;

mod cameras;
mod extremes;
mod light;
mod light_parts;
mod light_smooth;
mod oracle;
mod ray_sets;
mod slices;
mod verify;
