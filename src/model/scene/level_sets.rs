//! The table of level sets that are no polynomials.

use super::ids::LevelSetId;
use crate::geom::formula::{Formula, bounds_of};
use crate::geom::{Clip, LevelSet};
use crate::math::Aabb;
use glam::DVec3;

/// One column a field, one row a level set.
#[derive(Clone, Debug, Default)]
pub struct LevelSets {
    pub formula: Vec<Formula>,
    pub open: Vec<bool>,
    pub clip: Vec<Option<Clip>>,
    /// Where zeros are sought; `None` where it is not known where they are.
    pub region: Vec<Option<Aabb>>,
    /// Of the solid, or of the surface in its clip; `None` where none are known.
    pub bounds: Vec<Option<Aabb>>,
    /// Whether the function is below zero outside of the region.
    pub is_below_beyond: Vec<bool>,
}

/// By how much a region is larger than the clip that it is made from, as a part of it.
const ROOM: f64 = 1.0 / 4096.0;
/// And as a part of its largest coordinate, at least.
const LEAST_ROOM: f64 = 64.0 * f64::EPSILON;

impl LevelSets {
    /// A solid's clip says where its surface is sought: whoever gives one makes an
    /// intersection with it.
    pub fn push(&mut self, formula: Formula, open: bool, clip: Option<Clip>) -> LevelSetId {
        let id = LevelSetId(self.formula.len() as u32);
        let (region, bounds, is_below_beyond) = match clip {
            Some(clip) => {
                let bounds = clip.bounds();
                // Far from the origin no less than coordinates have.
                let least = DVec3::splat(bounds.max_abs() * LEAST_ROOM);
                let room = (bounds.extent() * ROOM).max(least);
                (Some(bounds.grown(room)), open.then_some(bounds), false)
            }
            None => match bounds_of(&formula) {
                Some((found, is_outside)) => {
                    let bounds = (open || is_outside).then_some(found);
                    (Some(found), bounds, !is_outside)
                }
                None => (None, None, false),
            },
        };
        // A step further, for corners that are rounded sums.
        let outward = |b: Aabb| {
            let step = |v: DVec3, f: fn(f64) -> f64| DVec3::from_array(v.to_array().map(f));
            Aabb::new(step(b.min, f64::next_down), step(b.max, f64::next_up))
        };
        self.formula.push(formula);
        self.open.push(open);
        self.clip.push(clip);
        self.region.push(region);
        self.is_below_beyond.push(is_below_beyond);
        self.bounds.push(bounds.map(outward));
        id
    }

    #[inline(always)]
    pub fn row(&self, id: LevelSetId) -> LevelSet<'_> {
        let i = id.index();
        LevelSet {
            formula: &self.formula[i],
            open: self.open[i],
            clip: self.clip[i],
            region: self.region[i],
            bounds: self.bounds[i],
            is_below_beyond: self.is_below_beyond[i],
        }
    }

    pub fn len(&self) -> usize {
        self.formula.len()
    }

    pub fn is_empty(&self) -> bool {
        self.formula.is_empty()
    }

    pub fn bytes(&self) -> usize {
        let rest = size_of::<Formula>() + 2 * size_of::<bool>() + size_of::<Option<Clip>>();
        let rest = rest + 2 * size_of::<Option<Aabb>>();
        self.formula
            .iter()
            .map(|formula| formula.bytes() + rest)
            .sum()
    }
}
