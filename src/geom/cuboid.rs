//! Axis-parallel boxes: three slabs (Kay and Kajiya 1986).

use super::ray::{Ray, Span};
use crate::math::Aabb;
use crate::math::lanes::{Lanes, Mask, Scalar};
use glam::DVec3;

/// An axis-parallel box (`box` is a word of the language).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    pub min: DVec3,
    /// > `min` on every axis.
    pub max: DVec3,
}

impl Cuboid {
    pub fn bounds(&self) -> Aabb {
        Aabb::new(self.min, self.max)
    }

    /// Outward, unit: of the face whose plane is nearest.
    pub fn normal_at(&self, p: DVec3) -> DVec3 {
        self.nearest(p).1
    }

    /// How far `p` lies above that face's plane; and the normal.
    pub fn nearest(&self, p: DVec3) -> (f64, DVec3) {
        let (low, high) = (self.min - p, p - self.max);
        let nearest = low.abs().min(high.abs()).min_element();
        for k in 0..3 {
            if low[k].abs() == nearest {
                return (low[k], -DVec3::AXES[k]);
            }
            if high[k].abs() == nearest {
                return (high[k], DVec3::AXES[k]);
            }
        }
        (0.0, DVec3::Y)
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
