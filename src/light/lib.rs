//! Light: random numbers and where they lead. Samplers and pixel filters, BSDFs, emitters and
//! environments, each a few plain functions in lanes, tested by themselves.
//!
//! Nothing here knows of rays or scenes' trees: the integrators of `shade` do.

pub mod bsdf;
#[cfg(test)]
mod chi2;
pub mod emitter;
pub mod environment;
pub mod filter;
pub mod hemisphere;
pub mod sampler;
pub mod sampling;
pub mod sky;
