//! Packets: as many rays as there are lanes, in one space.

use crate::accel::Slabs;
use crate::geom::Ray;
use crate::geom::guarded::ObjectRay;
use crate::math::lanes::Lanes;
use crate::math::{Aabb32, Affine, Vec3};
use glam::DVec3;

/// Rays in world or object space: the f64 numbers that define them, these rounded to the
/// lanes' type, and the slab constants for the boxes of one tree.
pub struct Packet<L: Lanes> {
    pub org: Vec3<L::Double>,
    pub dir: Vec3<L::Double>,
    pub ray: Ray<L>,
    pub slabs: Slabs<L>,
}

impl<L: Lanes> Packet<L> {
    /// Makes a packet for a tree with these bounds.
    #[inline(always)]
    pub fn new(org: Vec3<L::Double>, dir: Vec3<L::Double>, t_min: L, bounds: &Aabb32) -> Packet<L> {
        Packet::about(DVec3::ZERO, org, dir, t_min, bounds)
    }

    /// Makes a packet for a tree with these bounds, whose boxes are relative to `center` (X10).
    #[inline(always)]
    pub fn about(
        center: DVec3,
        org: Vec3<L::Double>,
        dir: Vec3<L::Double>,
        t_min: L,
        bounds: &Aabb32,
    ) -> Packet<L> {
        let narrow = |v: Vec3<L::Double>| Vec3::new(L::narrow(v.x), L::narrow(v.y), L::narrow(v.z));
        let ray = Ray::new(narrow(org), narrow(dir), t_min);
        let from_center = narrow(org - Vec3::splat(center.to_array()));
        Packet {
            org,
            dir,
            slabs: Slabs::new(from_center, ray.dir, bounds),
            ray,
        }
    }

    /// Makes a packet for tests without boxes: its rays reach every box.
    #[inline(always)]
    pub fn open(org: Vec3<L::Double>, dir: Vec3<L::Double>, t_min: L) -> Packet<L> {
        let narrow = |v: Vec3<L::Double>| Vec3::new(L::narrow(v.x), L::narrow(v.y), L::narrow(v.z));
        Packet {
            org,
            dir,
            slabs: Slabs::open(),
            ray: Ray::new(narrow(org), narrow(dir), t_min),
        }
    }

    /// Transforms the rays to an instance's object space, relative to `center`.
    #[inline(always)]
    pub fn in_object(
        &self,
        object_from_world: &Affine,
        center: DVec3,
        bounds: &Aabb32,
    ) -> Packet<L> {
        let org = object_from_world.points(self.org) - Vec3::splat(center.to_array());
        let dir = object_from_world.vectors(self.dir);
        Packet::new(org, dir, self.ray.t_min, bounds)
    }

    /// Returns the same rays with slab constants for another tree.
    #[inline(always)]
    pub fn for_tree(&self, bounds: &Aabb32) -> Packet<L> {
        Packet {
            org: self.org,
            dir: self.dir,
            ray: self.ray,
            slabs: Slabs::new(self.ray.org, self.ray.dir, bounds),
        }
    }

    /// Returns the rays as guarded kernels take them.
    #[inline(always)]
    pub fn line(&self) -> ObjectRay<'_, L> {
        ObjectRay::new(&self.org, &self.dir, &self.ray)
    }

    /// Returns origin and direction of one lane.
    #[inline(always)]
    pub fn lane(&self, i: usize) -> ([f64; 3], [f64; 3]) {
        let at = |v: &Vec3<L::Double>| [v.x.lane(i), v.y.lane(i), v.z.lane(i)];
        (at(&self.org), at(&self.dir))
    }
}
