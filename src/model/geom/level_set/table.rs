//! The table of level sets of functions that are no polynomials.

use super::{LevelSet, guarded};
use crate::geom::exact::{Line, Root};
use crate::geom::formula::{self, Formula, bounds_of};
use crate::geom::guarded::ObjectRay;
use crate::geom::implicit::check;
use crate::geom::kinds::LevelSetId;
use crate::geom::primitive::{Blur, Boundaries, Exact, Flaw, OPEN, Primitive, outward};
use crate::geom::ray::Meet;
use crate::geom::{Clip, Scratch};
use crate::math::Aabb;
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::math::lanes::Lanes;
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

impl Primitive for LevelSets {
    type Id = LevelSetId;
    type Row<'a> = LevelSet<'a>;
    const BOUNDARIES: Boundaries = Boundaries::Crossings;
    const BLUR: Blur = Blur::Apart;
    const IS_DISTANCE: bool = false;

    #[inline(always)]
    fn exact(&self, id: LevelSetId) -> LevelSet<'_> {
        self.row(id)
    }

    fn check(&self, id: LevelSetId) -> Result<(), Flaw> {
        check::level_set(&self.row(id))
    }

    fn bounds(&self, id: LevelSetId) -> Option<Aabb> {
        self.bounds[id.index()]
    }

    fn no_inside(&self, id: LevelSetId) -> Option<&'static str> {
        self.open[id.index()].then_some(OPEN)
    }

    fn thickness(&self, _id: LevelSetId) -> Option<f64> {
        None
    }

    #[inline(always)]
    fn meet_fast<L: Lanes>(
        &self,
        id: LevelSetId,
        object: &ObjectRay<L>,
        active: L::Mask,
        scratch: &mut Scratch,
    ) -> Meet<L> {
        guarded::meet(&self.row(id), object, active, scratch)
    }

    #[inline(always)]
    fn meet<L: Lanes>(
        &self,
        id: LevelSetId,
        _extent: f32,
        object: &ObjectRay<L>,
        active: L::Mask,
        scratch: &mut Scratch,
    ) -> Meet<L> {
        guarded::meet(&self.row(id), object, active, scratch)
    }

    #[inline(always)]
    fn nearest<D: Lanes<Scalar = f64>>(&self, id: LevelSetId, p: Vec3<D>) -> (D, Vec3<D>) {
        formula::values_at(&self.formula[id.index()], p)
    }

    #[inline(always)]
    fn normals<D: Lanes<Scalar = f64>>(&self, id: LevelSetId, p: Vec3<D>) -> Vec3<D> {
        let (_, normals) = self.nearest(id, p);
        let known = normals.max_abs().gt(D::zero());
        Vec3::select(known, normals, Vec3::splat(DVec3::Y.to_array()))
    }

    #[inline(always)]
    fn blur<D: Lanes<Scalar = f64>>(&self, id: LevelSetId, at: Vec3<D>, slope: Option<D>) -> D {
        let own = || self.nearest(id, at).1.length();
        let off = formula::blur_at(&self.formula[id.index()], at) * D::splat(1.0 / UNIT);
        off / slope.unwrap_or_else(own)
    }
}

impl<'a> Exact<'a> for LevelSet<'a> {
    fn is_finite(&self) -> bool {
        LevelSet::is_finite(self)
    }

    fn crossings(
        &self,
        line: &Line,
        scratch: &mut Scratch,
        visit: impl FnMut(Root<'a>, bool),
    ) -> bool {
        super::exact::crossings(self, line, &mut scratch.search, visit)
    }

    #[inline(always)]
    fn first_beyond(&self, line: &Line, t_min: f64, scratch: &mut Scratch) -> Option<Root<'a>> {
        super::exact::first_beyond(self, line, t_min, &mut scratch.search)
    }
}
