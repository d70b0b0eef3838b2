//! Axis-parallel boxes: three slabs (Kay and Kajiya 1986).

pub mod guarded;

use super::chart::Chart;
use super::columns::{kernels_of_span, table};
use super::exact::{Inside, Line, solid};
use super::face::Face;
use super::guarded::{Ends, ObjectRay};
use super::kinds::CuboidId;
use super::primitive::{Blur, Exact, Flaw, Primitive, finite3};
use super::ray::Meet;
use super::ray::{Ray, Span};
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::math::{Aabb, Vec3};
use glam::DVec3;

/// An axis-parallel box (`box` is a word of the language).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    pub min: DVec3,
    /// The upper corner, > `min` on every axis.
    pub max: DVec3,
}

impl Cuboid {
    pub fn bounds(&self) -> Aabb {
        Aabb::new(self.min, self.max)
    }

    /// Returns the distance of `p` above the face whose plane is nearest, and the outward unit
    /// normal there.
    #[inline(always)]
    pub fn nearest<D: Lanes<Scalar = f64>>(&self, p: Vec3<D>) -> (D, Vec3<D>) {
        let low = Vec3::splat(self.min.to_array()) - p;
        let high = p - Vec3::splat(self.max.to_array());
        let least = |k: usize| low.axis(k).abs().min(high.axis(k).abs());
        let nearest = least(0).min(least(1)).min(least(2));
        let (mut above, mut normal) = (D::zero(), Vec3::splat(DVec3::Y.to_array()));
        // Of several equally near faces the first counts.
        for k in (0..3).rev() {
            let axis = DVec3::AXES[k];
            for (off, out) in [(high.axis(k), axis), (low.axis(k), -axis)] {
                let is = off.abs().eq(nearest);
                above = D::select(is, off, above);
                normal = Vec3::select(is, Vec3::splat(out.to_array()), normal);
            }
        }
        (above, normal)
    }
}

#[inline(always)]
pub fn span<L: Lanes>(cuboid: &Cuboid, ray: &Ray<L>) -> Span<L> {
    let infinity = L::splat(L::Scalar::INFINITY);
    let mut some = L::Mask::splat(true);
    let mut enter = -infinity;
    let mut exit = infinity;
    for k in 0..3 {
        let (org, dir) = (ray.org.axis(k), ray.dir.axis(k));
        let low = L::from_f64(cuboid.min[k]) - org;
        let high = L::from_f64(cuboid.max[k]) - org;
        let parallel = dir.eq(L::zero());
        let (t0, t1) = (low / dir, high / dir);
        enter = enter.max(L::select(parallel, -infinity, t0.min(t1)));
        exit = exit.min(L::select(parallel, infinity, t0.max(t1)));
        some = some & (!parallel | (low.le(L::zero()) & high.ge(L::zero())));
    }
    Span {
        some: some & enter.le(exit),
        enter,
        exit,
    }
}

table!(Cuboids of Cuboid by CuboidId { min: DVec3, max: DVec3 });

impl Primitive for Cuboids {
    type Id = CuboidId;
    type Row<'a> = Cuboid;
    const BLUR: Blur = Blur::Planar;

    #[inline(always)]
    fn exact(&self, id: CuboidId) -> Cuboid {
        self.row(id)
    }

    fn check(&self, id: CuboidId) -> Result<(), Flaw> {
        let row = self.row(id);
        finite3("min", row.min)?;
        finite3("max", row.max)?;
        if !row.min.cmplt(row.max).all() {
            return Err(Flaw::Degenerate(format!(
                "min {} must be below max {} on every axis",
                row.min, row.max
            )));
        }
        Ok(())
    }

    fn bounds(&self, id: CuboidId) -> Option<Aabb> {
        Some(self.row(id).bounds())
    }

    fn faces(&self, id: CuboidId) -> Vec<Option<Face>> {
        let row = self.row(id);
        let across = |(axis, at)| Some(Face::Across { axis, at });
        let axes = (0..3).flat_map(|k| [(k, row.min[k]), (k, row.max[k])]);
        axes.map(across).collect()
    }

    kernels_of_span! {
        (self, id: CuboidId, object, active)
        span(&self.row(id), object.ray),
        guarded::meet(&self.row(id), object, active),
        guarded::ends(&self.row(id), object),
    }

    #[inline(always)]
    fn nearest<D: Lanes<Scalar = f64>>(&self, id: CuboidId, p: Vec3<D>) -> (D, Vec3<D>) {
        self.row(id).nearest(p)
    }

    fn chart(&self, id: CuboidId, p: DVec3, normal: DVec3) -> Chart {
        let row = self.row(id);
        Chart::on_box([row.min, row.max], p, normal)
    }
}

impl<'a> Exact<'a> for Cuboid {
    fn is_finite(&self) -> bool {
        self.min.is_finite() && self.max.is_finite()
    }

    #[inline(always)]
    fn inside(&self, line: &Line) -> Inside {
        Inside::of_convex(solid::cuboid(line, self))
    }
}
