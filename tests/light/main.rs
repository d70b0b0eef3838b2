//! Tests of light: path-traced pictures against closed formulas, and their bits.

mod allocations;
mod blur;
mod blur_bits;
mod cached;
mod closed_forms;
mod identity;
mod inspections;
mod layers;
mod lenses;
mod media;
mod normal_maps;
mod pictures;
mod sampling;
mod smooth;
mod textured;
mod textured_files;
mod textured_lamps;
mod textured_solids;

#[global_allocator]
static ALLOCATOR: allocations::Counting = allocations::Counting;
