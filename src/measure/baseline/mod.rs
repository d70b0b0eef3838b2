//! The baseline: another tracer (Embree 3), measured in the same run on the same rays
//! if the feature `peer-embree` is enabled.
//!
//! The baseline is measured at its best: every mode of every tree is tried on a part of
//! the rays, and the fastest few are measured beside ours at full length.

// The rest of the crate sees one interface, with or without Embree.
#[cfg(all(feature = "peer-embree", target_arch = "x86_64"))]
mod embree;
#[cfg(not(all(feature = "peer-embree", target_arch = "x86_64")))]
#[path = "absent.rs"]
mod embree;

pub use embree::{Embree, Way};

use lanecast_model::plan::Precision;
use thiserror::Error;

/// A baseline's ray-triangle tests: the default ones, or the watertight ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BaselineTests {
    Fast,
    Robust,
}

impl BaselineTests {
    pub const ALL: [BaselineTests; 2] = [BaselineTests::Fast, BaselineTests::Robust];

    /// Returns the tests that compare fairly with a precision.
    pub fn beside(precision: Precision) -> BaselineTests {
        match precision {
            Precision::Fast => BaselineTests::Fast,
            Precision::Guarded | Precision::Exact => BaselineTests::Robust,
        }
    }

    /// Returns the name in a result row's `precision`.
    pub fn name(self) -> &'static str {
        match self {
            BaselineTests::Fast => "fast",
            BaselineTests::Robust => "robust",
        }
    }
}

#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum BaselineError {
    #[error(
        "this program was built without Embree; install libembree-dev 3 \
         and build with --features peer-embree (x86-64 only)"
    )]
    NotBuilt,
    #[error("Embree is compared with AVX2 and AVX-512, and this processor has neither")]
    Processor,
    #[error("Embree cannot be started with '{config}' (its error {code}); is it version 3?")]
    Device { config: String, code: u32 },
    #[error("Embree could not build its tree with '{config}' (its error {code})")]
    Build { config: String, code: u32 },
}
