//! Meets spheres and ellipsoids with error bounds: half a chord, from the point of the line
//! nearest the centre (Haines, Günther, Akenine-Möller, Ray Tracing Gems 2019; here the ray itself
//! is moved there, so that neither root cancels). Bounds: E1 to E3, docs/numerics/spheres.md.

use crate::geom::guarded::{Between, Ends, Near, ObjectRay, Part, narrow, range, roundings, tiny};
use crate::geom::ray::Shear;
use crate::geom::{Ellipsoid, Meet, Sphere};
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask, Scalar};
use glam::DVec3;

/// The chord of a line in a sphere about the origin.
struct Chord<L: Lanes> {
    near: Near<L>,
    /// 1 / dir².
    inverse: L,
    /// t at its middle, from the moved origin.
    middle: L,
    /// r² minus the squared distance of the line from the centre.
    room: L,
    /// The terms of `room`: |near|², and how far that exceeds the squared distance.
    away: L,
    back: L,
    radius: L,
    /// Lanes whose dir² is far from overflow and underflow.
    ordinary: L::Mask,
}

impl<L: Lanes> Chord<L> {
    /// Computes the chord; `along` is the direction as `shear` permutes it, `near` is not
    /// permuted.
    #[inline(always)]
    fn new(
        near: Near<L>,
        shear: &Shear<L>,
        along: Vec3<L>,
        [squared, inverse]: [L; 2],
        radius: L,
    ) -> Chord<L> {
        let org = shear.turned(near.org);
        let b = -org.dot(along);
        let middle = b * inverse;
        let (away, back) = (org.length_squared(), b * middle);
        let room = (radius * radius - away) + back;
        let (small, large) = range::<L>();
        Chord {
            near,
            inverse,
            middle,
            room,
            away,
            back,
            radius,
            ordinary: squared.gt(small) & squared.lt(large),
        }
    }

    #[inline(always)]
    fn of_sphere(sphere: &Sphere, object: &ObjectRay<L>) -> Chord<L> {
        let near = Near::to_center(object, sphere.center);
        let (shear, squared) = (&object.ray.shear, object.ray.dir_squared);
        let dir = shear.turned_dir(object.ray.dir);
        let radius = L::from_f64(sphere.radius);
        Chord::new(
            near,
            shear,
            dir,
            [squared, L::from_f32(1.0) / squared],
            radius,
        )
    }

    /// Computes the chord in the unit sphere of rays divided by the radii.
    #[inline(always)]
    fn of_ellipsoid(ellipsoid: &Ellipsoid, object: &ObjectRay<L>) -> Chord<L> {
        let by: Vec3<L::Double> = Vec3::splat((DVec3::ONE / ellipsoid.radii).to_array());
        let over = |v: Vec3<L::Double>| Vec3::new(v.x * by.x, v.y * by.y, v.z * by.z);
        let start = over(*object.org - Vec3::splat(ellipsoid.center.to_array()));
        let dir = over(*object.dir);
        let shear = &object.ray.shear;
        let turned = |v| shear.turned(narrow::<L>(v));
        let (coarse, along) = (turned(start), turned(dir));
        let (one, squared) = (L::from_f32(1.0), along.length_squared());
        let inverse = one / squared;
        let shift = -(coarse.dot(along) * inverse);
        let near = Near::at(start, dir, coarse.max_abs(), shift);
        Chord::new(near, shear, along, [squared, inverse], one)
    }

    /// Bounds the error of `room`, including that of `middle` times `half` (E1,
    /// docs/numerics/spheres.md).
    #[inline(always)]
    fn error(&self) -> L {
        let Near { size, error, .. } = self.near;
        let relative = self.away * roundings(17.0)
            + self.back * roundings(48.0)
            + self.radius * self.radius * roundings(6.0);
        let moved = size * L::from_f32(13.0) + error * L::from_f32(7.0) + self.radius + self.radius;
        relative + error * moved + tiny()
    }

    #[inline(always)]
    fn meet(&self, t_min: L, active: L::Mask) -> Meet<L> {
        let error = self.error();
        let none = self.ordinary & self.room.lt(-error);
        if (active & !none).none() {
            return Meet::certain(L::Mask::splat(false), L::zero());
        }
        self.part(error, none)
            .first_beyond(&self.near, t_min, active)
    }

    #[inline(always)]
    fn ends(&self) -> Ends<L> {
        let error = self.error();
        let none = self.ordinary & self.room.lt(-error);
        self.part(error, none).ends(&self.near)
    }

    #[inline(always)]
    fn part(&self, error: L, none: L::Mask) -> Part<L> {
        let (small, large) = range::<L>();
        let squared = self.room.max(L::zero()) * self.inverse;
        let ordinary = self.ordinary & squared.gt(small) & squared.lt(large);
        // Half the chord in t.
        let half = squared.sqrt();
        let slack = error * self.inverse / half + half * roundings(15.0) + tiny();
        Part {
            enter: Between::new(self.middle - half, slack),
            exit: Between::new(self.middle + half, slack),
            sound: ordinary & self.room.gt(error) & slack.lt(L::splat(L::Scalar::INFINITY)),
            none,
            faces: [L::zero(); 2],
            widths: [L::zero(); 2],
        }
    }
}

#[inline(always)]
pub fn meet_sphere<L: Lanes>(row: &Sphere, object: &ObjectRay<L>, active: L::Mask) -> Meet<L> {
    Chord::of_sphere(row, object).meet(object.ray.t_min, active)
}

#[inline(always)]
pub fn sphere_ends<L: Lanes>(row: &Sphere, object: &ObjectRay<L>) -> Ends<L> {
    Chord::of_sphere(row, object).ends()
}

#[inline(always)]
pub fn ellipsoid_ends<L: Lanes>(row: &Ellipsoid, object: &ObjectRay<L>) -> Ends<L> {
    Chord::of_ellipsoid(row, object).ends()
}

#[inline(always)]
pub fn meet_ellipsoid<L: Lanes>(
    row: &Ellipsoid,
    object: &ObjectRay<L>,
    active: L::Mask,
) -> Meet<L> {
    Chord::of_ellipsoid(row, object).meet(object.ray.t_min, active)
}
