//! The table of level sets of functions that are no polynomials.

use super::ids::LevelSetId;
use crate::geom::formula::{Formula, bounds_of};
use crate::geom::{Clip, LevelSet};
use crate::math::Aabb;
use glam::DVec3;

/// Level sets, one column a field and one row a level set.
#[derive(Clone, Debug, Default)]
pub struct LevelSets {
    pub formula: Vec<Formula>,
    pub open: Vec<bool>,
    pub clip: Vec<Option<Clip>>,
    /// The box in which zeros are sought; `None` where their place is not known.
    pub region: Vec<Option<Aabb>>,
    /// The box of the solid, or of the surface in its clip; `None` where none is known.
    pub bounds: Vec<Option<Aabb>>,
    /// Whether the function is below zero outside the region.
    pub is_below_beyond: Vec<bool>,
}

/// How much larger a region is than its clip, relative to the clip's extent on each axis.
const ROOM: f64 = 1.0 / 4096.0;
/// The least that a region is larger than its clip, relative to the clip's largest
/// coordinate: 64 roundings 2⁻⁵² (docs/numerics/level-sets.md, V9).
const LEAST_ROOM: f64 = 64.0 * f64::EPSILON;

impl LevelSets {
    /// Adds a level set. The clip of a solid only says where the surface is sought; the
    /// caller that gives one intersects the solid with it.
    pub fn push(&mut self, formula: Formula, open: bool, clip: Option<Clip>) -> LevelSetId {
        let id = LevelSetId(self.formula.len() as u32);
        let (region, bounds, is_below_beyond) = match clip {
            Some(clip) => {
                let bounds = clip.bounds();
                // Far from the origin the room is at least that of the coordinates'
                // roundings.
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
        // One step outward, because corners are rounded sums.
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
