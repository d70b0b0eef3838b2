//! Level sets: where a function of x, y, z that is no polynomial is zero.

pub(super) mod exact;
pub mod guarded;
mod table;

pub use table::LevelSets;

use super::exact::Line;
use super::formula::{Change, Formula, Search, Step, changes};
use super::implicit::Clip;
use crate::math::Aabb;
use std::ops::ControlFlow;

/// The solid f(x, y, z) ≤ 0; or, where it is open, the surface f = 0 alone.
#[derive(Clone, Copy, Debug)]
pub struct LevelSet<'a> {
    pub formula: &'a Formula,
    pub open: bool,
    /// Of an open one, what of it there is. Of a solid, where its surface is sought: what
    /// it is elsewhere does not matter.
    pub clip: Option<Clip>,
    /// Where zeros are sought: there are no others, or they do not matter. `None`: it is
    /// not known where they are.
    pub region: Option<Aabb>,
    /// Of the solid, or of the surface; `None` where none are known.
    pub bounds: Option<Aabb>,
    /// Whether f is below zero outside of the region; not asked where there is a clip.
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

    /// What it is cut off by.
    pub fn ends(&self) -> Option<Clip> {
        self.clip.filter(|_| self.open)
    }

    /// Calls `visit` where f changes its sign along a line of finite numbers, front to
    /// back, until it has seen enough; it may be called with some that are not between the
    /// two t. Returns whether f is below zero before the first of all, if these are
    /// infinite.
    pub fn changes(
        &self,
        line: &Line,
        between: [f64; 2],
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
        changes(self.formula, &search, visit)
    }
}
