//! The expected cost of the TLAS, by which a refitted tree is compared with the tree as it
//! was built.

use crate::math::Aabb32;

/// The expected cost of the TLAS for a random ray.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TlasCost {
    /// The cost for a ray that meets the root: the surface area heuristic.
    inside: f64,
    /// The cost for any ray, up to a constant: `inside` times the root's area.
    anywhere: f64,
}

impl TlasCost {
    pub fn new(sah: f64, bounds: &Aabb32) -> TlasCost {
        TlasCost {
            inside: sah,
            anywhere: sah * f64::from(bounds.half_area()),
        }
    }

    /// Returns whether both costs are at most `times` those of `other`.
    pub fn is_within(&self, times: f64, other: &TlasCost) -> bool {
        self.inside <= other.inside * times && self.anywhere <= other.anywhere * times
    }
}
