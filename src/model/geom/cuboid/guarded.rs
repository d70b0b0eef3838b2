//! Meets axis-parallel boxes with error bounds: three slabs about the centre (P1,
//! docs/numerics/planes.md).

use crate::geom::guarded::{
    Between, Ends, Near, ObjectRay, OnFace, Part, finite, no_face, roundings, tiny,
};
use crate::geom::{Cuboid, Meet};
use crate::math::lanes::{Lanes, Mask, Scalar};
use glam::DVec3;

/// Moves the ray next to the box, and returns it with its part inside.
#[inline(always)]
fn part<L: Lanes>(cuboid: &Cuboid, object: &ObjectRay<L>) -> (Near<L>, Part<L>) {
    let infinity = L::splat(L::Scalar::INFINITY);
    let off = L::Mask::splat(false);
    let center = cuboid.min * 0.5 + cuboid.max * 0.5;
    let (below, above) = (cuboid.min - center, cuboid.max - center);
    let half: DVec3 = below.abs().max(above);
    let near = Near::to_center(object, center);

    let [mut enter, mut exit] = [-infinity, infinity].map(|at| OnFace {
        at: Between::exactly(at),
        face: no_face(),
        width: L::zero(),
    });
    let (mut sound, mut outside) = (object.ordinary(), off);
    // Within this |t| a ray that is level on an axis moves less than `slack` (P4,
    // docs/numerics/planes.md).
    let mut far = infinity;
    for k in 0..3 {
        let (org, dir) = (near.org.axis(k), object.ray.dir.axis(k));
        let (low, high) = (L::from_f64(below[k]), L::from_f64(above[k]));
        let slack = (L::from_f64(half[k]) + org.abs()) * roundings(6.4)
            + near.error * L::from_f32(1.25)
            + tiny();
        let inverse = L::from_f32(1.0) / dir;
        let (t0, t1) = ((low - org) * inverse, (high - org) * inverse);
        let error = slack * inverse.abs() + tiny();
        let (first, last) = (t0.min(t1), t0.max(t1));
        // A rounded component may be level by underflow.
        let level = dir.abs().le(tiny());
        sound = sound & (level | finite(first, error) & finite(last, error));
        let [first, last] = [first, last].map(|t| Between::new(t, error));
        let (none, all) = (Between::exactly(-infinity), Between::exactly(infinity));
        let faces = [0, 1].map(|side| L::from_f32((2 * k + side) as f32));
        let upward = inverse.gt(L::zero());
        let first_face = L::select(upward, faces[0], faces[1]);
        let last_face = L::select(upward, faces[1], faces[0]);
        enter = enter.max(Between::select(level, none, first), first_face);
        exit = exit.min(Between::select(level, all, last), last_face);
        if level.any() {
            let room = slack + slack;
            let inside = (org - low).gt(room) & (high - org).gt(room);
            let beside = (low - org).gt(room) | (org - high).gt(room);
            sound = sound & (!level | inside | beside);
            outside = outside | level & beside;
            far = far.min(L::select(level, slack / tiny(), infinity));
        }
    }
    // `far` is finite only where an axis is level.
    let reached = enter.at.least.abs().max(exit.at.most.abs()).le(far);
    let sound = sound & reached;
    let part = Part {
        enter: enter.at,
        exit: exit.at,
        sound: sound & !outside,
        none: sound & outside,
        faces: [enter.face, exit.face],
        widths: [enter.width, exit.width],
    };
    (near, part)
}

#[inline(always)]
pub fn ends<L: Lanes>(row: &Cuboid, object: &ObjectRay<L>) -> Ends<L> {
    let (near, part) = part(row, object);
    part.ends(&near)
}

#[inline(always)]
pub fn meet<L: Lanes>(row: &Cuboid, object: &ObjectRay<L>, active: L::Mask) -> Meet<L> {
    let (near, part) = part(row, object);
    part.first_beyond(&near, object.ray.t_min, active)
}
