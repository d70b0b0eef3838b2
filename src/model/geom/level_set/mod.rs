//! Level sets: surfaces on which a function of x, y, z that is no polynomial is zero.

pub(super) mod exact;
pub mod guarded;
mod table;

pub use table::LevelSets;

use super::exact::Line;
use super::formula::{Change, Formula, Search, SearchScratch, Step, changes};
use super::implicit::Clip;
use crate::math::Aabb;
use std::ops::ControlFlow;

/// The solid f(x, y, z) ≤ 0; or, if it is open, the surface f = 0 alone.
#[derive(Clone, Copy, Debug)]
pub struct LevelSet<'a> {
    pub formula: &'a Formula,
    pub open: bool,
    /// The region to which an open surface is cut. For a solid, the region in which its surface is
    /// sought; the solid elsewhere does not matter.
    pub clip: Option<Clip>,
    /// The box in which zeros are sought: there are no others, or they do not matter. `None` if
    /// their place is not known.
    pub region: Option<Aabb>,
    /// The box of the solid or of the surface; `None` if none is known.
    pub bounds: Option<Aabb>,
    /// Whether f is below zero outside the region; unused if there is a clip.
    pub is_below_beyond: bool,
}

impl LevelSet<'_> {
    pub fn is_finite(&self) -> bool {
        let clip = self.clip.is_none_or(|clip| clip.is_finite());
        let constant = |step: &Step| match step {
            Step::Constant(value) => value.is_finite(),
            _ => true,
        };
        clip && self.formula.steps().iter().all(constant)
    }

    /// Returns the clip of an open surface.
    pub fn ends(&self) -> Option<Clip> {
        self.clip.filter(|_| self.open)
    }

    /// Calls `visit` at the sign changes of f along a line of finite numbers, front to back, until
    /// it breaks; changes outside `between` may be among them. Returns whether f is below zero
    /// before the first change, if `between` is infinite.
    pub fn changes(
        &self,
        line: &Line,
        between: [f64; 2],
        scratch: &mut SearchScratch,
        visit: impl FnMut(Change) -> ControlFlow<()>,
    ) -> bool {
        let part = self.region.and_then(|region| line.part_in(&region, 1.0));
        let part = part.filter(|[a, b]| a.is_finite() && b.is_finite() && a < b);
        let Some(part) = part else {
            return self.is_below_beyond;
        };
        let search = Search {
            org: line.org,
            dir: line.dir,
            part,
            between,
            is_solid: !self.open,
        };
        changes(self.formula, &search, scratch, visit)
    }
}
