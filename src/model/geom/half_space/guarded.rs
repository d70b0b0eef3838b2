//! Meets half-spaces and convex polyhedra with error bounds; polyhedra relative to one of their
//! corners (P2 to P6, docs/numerics/planes.md).

use crate::geom::guarded::{
    Between, Ends, LEVEL, LEVEL_MOVES, LEVEL_SLACK, Near, ObjectRay, OnFace, Part, finite, no_face,
    roundings, tiny,
};
use crate::geom::ray::Shear;
use crate::geom::{HalfSpace, Meet};
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::math::{Vec3, unordered_dot};
use glam::DVec3;

/// A plane as seen by a ray that has been moved next to a polyhedron: `room` is the distance to it
/// times the length of its normal, and `speed` the rate at which that shrinks (P2,
/// docs/numerics/planes.md).
struct Ahead<L> {
    room: L,
    room_error: L,
    speed: L,
    speed_error: L,
}

impl<L: Lanes> Ahead<L> {
    #[inline(always)]
    fn level(&self) -> L::Mask {
        !self.speed.abs().gt(self.speed_error * L::from_f32(LEVEL))
    }

    /// Returns t, and its error where the ray is not level with the plane (P3,
    /// docs/numerics/planes.md).
    #[inline(always)]
    fn depth(&self) -> (L, L) {
        let inverse = L::from_f32(1.0) / self.speed;
        let t = self.room * inverse;
        let error = (self.room_error + t.abs() * self.speed_error) * inverse.abs();
        let error = error * L::from_f32(LEVEL_SLACK) + t.abs() * roundings(4.0) + tiny();
        (t, error)
    }
}

/// The rays, as all planes of the polyhedron take them.
struct Polyhedron<'a, L: Lanes> {
    corner: DVec3,
    near: Near<L>,
    /// The direction, turned by the ray's `shear`, and the ray's place.
    dir: Vec3<L>,
    shear: &'a Shear<L>,
    /// The direction's largest component.
    along: L,
}

impl<'a, L: Lanes> Polyhedron<'a, L> {
    #[inline(always)]
    fn new(corner: DVec3, object: &ObjectRay<'a, L>) -> Self {
        let near = Near::to_center(object, corner);
        let shear = &object.ray.shear;
        let near = Near {
            org: shear.turned(near.org),
            ..near
        };
        let dir = shear.turned_dir(object.ray.dir);
        Polyhedron {
            corner,
            near,
            dir,
            shear,
            along: shear.along.abs(),
        }
    }

    #[inline(always)]
    fn ahead(&self, plane: &HalfSpace) -> Ahead<L> {
        let n = plane.normal;
        let offset = plane.offset - unordered_dot(n, self.corner);
        let lost = (plane.offset.abs() + n.abs().dot(self.corner.abs())) * (5.0 * UNIT);
        let normal: Vec3<L> = Vec3::splat(n.to_array().map(L::Scalar::from_f64));
        let normal = self.shear.turned(normal);
        let length = L::from_f64(n.abs().element_sum());
        let own = L::from_f64(offset.abs()) * roundings(2.5)
            + L::from_f64(lost) * L::from_f32(1.25)
            + tiny();
        // Products first: if `room` or `speed` overflows, so does its bound.
        let moved =
            length * self.near.size * roundings(6.5) + length * self.near.error * L::from_f32(1.25);
        Ahead {
            room: L::from_f64(offset) - normal.dot(self.near.org),
            room_error: moved + own,
            speed: normal.dot(self.dir),
            speed_error: length * self.along * roundings(5.5) + tiny(),
        }
    }

    #[inline(always)]
    fn part(&self, planes: &[HalfSpace], ordinary: L::Mask) -> Part<L> {
        let infinity = L::splat(L::Scalar::INFINITY);
        let [mut enter, mut exit] = [-infinity, infinity].map(|at| OnFace {
            at: Between::exactly(at),
            face: no_face(),
            width: L::zero(),
        });
        let mut sound = ordinary;
        let mut some_level = L::Mask::splat(false);
        for (face, plane) in planes.iter().enumerate() {
            let at = self.ahead(plane);
            let (t, error) = at.depth();
            // A level plane is left to the second pass (P4, docs/numerics/planes.md).
            let level = at.level();
            sound = sound & (level | finite(t, error));
            some_level = some_level | level;
            let inward = at.speed.lt(L::zero());
            let t = Between::new(t, error);
            let (always, never) = (Between::exactly(-infinity), Between::exactly(infinity));
            let first = Between::select(inward & !level, t, always);
            let last = Between::select(inward | level, never, t);
            // f32 represents whole numbers up to 2²⁴; faces beyond have no number.
            let face = L::from_f32(if face < 1 << 24 {
                face as f32
            } else {
                f32::NAN
            });
            enter = enter.max(first, face);
            exit = exit.min(last, face);
        }
        let mut none = L::Mask::splat(false);
        if some_level.any() {
            let reach = enter.at.least.abs().max(exit.at.most.abs());
            for plane in planes {
                let at = self.ahead(plane);
                let level = at.level();
                let moved = at.room_error + reach * at.speed_error * L::from_f32(LEVEL_MOVES);
                let (inside, outside) = (at.room.gt(moved), at.room.lt(-moved));
                let number = at.room.abs().lt(infinity);
                sound = sound & (!level | number & (inside | outside));
                none = none | level & outside;
            }
        }
        Part {
            enter: enter.at,
            exit: exit.at,
            sound: sound & !none,
            none: sound & none,
            faces: [enter.face, exit.face],
            // CSG takes the rates of all planes instead.
            widths: [L::zero(); 2],
        }
    }
}

/// Returns the part of each ray in a bounded solid; `corner` is a point in or near it.
#[inline(always)]
pub fn meet_polyhedron<L: Lanes>(
    planes: &[HalfSpace],
    corner: DVec3,
    object: &ObjectRay<L>,
    active: L::Mask,
) -> Meet<L> {
    let solid = Polyhedron::new(corner, object);
    let part = solid.part(planes, object.ordinary());
    part.first_beyond(&solid.near, object.ray.t_min, active)
}

#[inline(always)]
pub fn polyhedron_ends<L: Lanes>(
    planes: &[HalfSpace],
    corner: DVec3,
    object: &ObjectRay<L>,
) -> Ends<L> {
    let solid = Polyhedron::new(corner, object);
    solid.part(planes, object.ordinary()).ends(&solid.near)
}

/// Returns the ends of rays in one half-space, of which one is infinite.
#[inline(always)]
pub fn ends<L: Lanes>(row: &HalfSpace, object: &ObjectRay<L>) -> Ends<L> {
    let Plane { ahead, parallel } = plane(row, object);
    let (t, error) = ahead.depth();
    let met = !ahead.level() & finite(t, error);
    let beside = parallel & ahead.room.lt(-ahead.room_error);
    let within = parallel & ahead.room.gt(ahead.room_error);
    let inward = ahead.speed.lt(L::zero());
    let infinity = Between::exactly(L::splat(L::Scalar::INFINITY));
    let always = Between::exactly(-infinity.value);
    let at = Between::new(t, error);
    let part = Part {
        enter: Between::select(met & inward, at, always),
        exit: Between::select(met & !inward, at, infinity),
        sound: met | within,
        none: beside,
        faces: [L::zero(); 2],
        widths: [L::zero(); 2],
    };
    part.ends(&Near::unmoved(object.ray.org))
}

/// A half-space's plane as seen by a ray that has not been moved, computed in f64 (P5,
/// docs/numerics/planes.md).
struct Plane<L: Lanes> {
    ahead: Ahead<L>,
    /// Lanes whose ray is exactly parallel to the plane.
    parallel: L::Mask,
}

#[inline(always)]
fn plane<L: Lanes>(row: &HalfSpace, object: &ObjectRay<L>) -> Plane<L> {
    let splat = |v: DVec3| -> Vec3<L::Double> { Vec3::splat(v.to_array()) };
    let (n, size) = (splat(row.normal), splat(row.normal.abs()));
    let abs = |v: Vec3<L::Double>| Vec3::new(v.x.abs(), v.y.abs(), v.z.abs());
    let offset = <L::Double as Lanes>::splat(row.offset);
    let (org, dir) = (*object.org, *object.dir);
    let (room, speed) = (
        L::narrow(offset - n.unordered_dot(org)),
        L::narrow(n.unordered_dot(dir)),
    );
    let across = size.dot(abs(dir));
    let unit = L::from_f64(5.0 * UNIT);
    let room_size = L::narrow(offset.abs() + size.dot(abs(org)));
    // A product of two numbers that are not zero may underflow to zero.
    let zero = |n: L::Double, d: L::Double| {
        n.eq(<L::Double as Lanes>::zero()) | d.eq(<L::Double as Lanes>::zero())
    };
    let products = Vec3::new(n.x * dir.x, n.y * dir.y, n.z * dir.z);
    let zeros = Vec3::new(zero(n.x, dir.x), zero(n.y, dir.y), zero(n.z, dir.z));
    let mut parallel = zeros.x & zeros.y & zeros.z;
    let axes = [
        (
            row.normal.y,
            row.normal.z,
            zeros.x,
            [dir.y, dir.z],
            [products.y, products.z],
        ),
        (
            row.normal.z,
            row.normal.x,
            zeros.y,
            [dir.z, dir.x],
            [products.z, products.x],
        ),
        (
            row.normal.x,
            row.normal.y,
            zeros.z,
            [dir.x, dir.y],
            [products.x, products.y],
        ),
    ];
    for (a, b, third, [da, db], [pa, pb]) in axes {
        // Planes at 45 degrees seen along a diagonal: two products of the same numbers, of which
        // one is negative.
        if a.abs() == b.abs() && a != 0.0 {
            let none = <L::Double as Lanes>::zero();
            let cancel = da.abs().eq(db.abs()) & (pa + pb).eq(none) & !pa.eq(none);
            parallel = parallel | third & cancel;
        }
    }
    Plane {
        ahead: Ahead {
            room,
            speed,
            room_error: room.abs() * roundings(1.25) + room_size * unit + tiny(),
            speed_error: speed.abs() * roundings(1.25) + L::narrow(across) * unit + tiny(),
        },
        parallel: L::Mask::from_bits(parallel.bits()),
    }
}

/// Meets the boundary of one half-space.
#[inline(always)]
pub fn meet<L: Lanes>(row: &HalfSpace, object: &ObjectRay<L>, active: L::Mask) -> Meet<L> {
    let at = plane(row, object);
    let near = Near::unmoved(object.ray.org);
    let (t, error) = at.ahead.depth();
    let sound = !at.ahead.level() & finite(t, error);
    let t = Between::new(t, error);
    let begin = object.ray.t_min;
    let possible = active & !at.parallel & !(sound & t.most.le(begin));
    near.hit(possible & sound & t.least.gt(begin), t, possible)
}
