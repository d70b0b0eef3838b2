//! Tests of light: path-traced pictures against closed formulas, and their bits.

mod allocations;
mod closed_forms;
mod identity;
mod inspections;
mod layers;
mod lenses;
mod media;
mod pictures;
mod sampling;
mod smooth;

#[global_allocator]
static ALLOCATOR: allocations::Counting = allocations::Counting;
