//! `rotate_extrude`: what an outline sweeps that is turned about its y axis, which becomes z.
//!
//! The solid is where (distance from z, z) lies in the outline, so operators of outlines are those
//! of what they sweep. A polygon sweeps cones ([`frusta`]), a disc a torus. So all is exact.

use super::curves;
use super::outlines::{Outlines, PlacedShape, Shape, corners};
use super::solids::{Leaf, SolidId, Solids};
use crate::scene::Operator;
use crate::shared::lathe::{Frustum, frusta};
use glam::{DAffine2, DAffine3, DVec2, DVec3};
use std::collections::HashMap;

/// Lengths are equal to this part, of matrices whose entries have six digits.
const SIX_DIGITS: f64 = 4e-6;

/// Sweeps an outline that has been found to lie on the side x ≥ 0.
pub(super) fn swept(
    outlines: &Outlines,
    outline: u32,
    line: u32,
    solids: &mut Solids,
) -> Option<SolidId> {
    let mut made: HashMap<u32, Option<SolidId>> = HashMap::new();
    for PlacedShape { id, map } in outlines.visit(outline).into_iter().rev() {
        let solid = match &outlines.shapes[id as usize] {
            Shape::Box { min, max } => of_rings(&[corners(*min, *max)], &map, line, solids),
            Shape::Rings(rings) => of_rings(rings, &map, line, solids),
            Shape::Disc(radius) => of_disc(*radius, &map, line, solids),
            Shape::Op(operator, operands) => {
                let operands = operands.iter().map(|of| made[of]);
                of_operator(*operator, operands.collect(), line, solids)
            }
            Shape::Placed(of, _) | Shape::Colored(of, _) | Shape::Marked(of) => made[of],
        };
        made.insert(id, solid);
    }
    made.remove(&outline).flatten()
}

fn of_operator(
    operator: Operator,
    operands: Vec<Option<SolidId>>,
    line: u32,
    solids: &mut Solids,
) -> Option<SolidId> {
    let is_nothing = match operator {
        Operator::Intersection => operands.iter().any(Option::is_none),
        Operator::Difference => operands.first().is_none_or(Option::is_none),
        _ => false,
    };
    let operands: Vec<SolidId> = operands.into_iter().flatten().collect();
    let is_there = !is_nothing && !operands.is_empty();
    is_there.then(|| solids.op(line, operator, operands))
}

/// Sweeps rings, as far as they lie at x > 0.
fn of_rings(
    rings: &[Vec<DVec2>],
    map: &DAffine2,
    line: u32,
    solids: &mut Solids,
) -> Option<SolidId> {
    let mut cones = Vec::new();
    for ring in rings {
        let ring: Vec<DVec2> = ring.iter().map(|p| map.transform_point2(*p)).collect();
        cones.extend(frusta(&ring).map(|piece| solids.leaf(line, cone(&piece))));
    }
    (!cones.is_empty()).then(|| solids.op(line, Operator::Xor, cones))
}

fn cone([low, high]: &Frustum) -> Leaf {
    Leaf::Frustum {
        base: DVec3::new(0.0, 0.0, low.y),
        top: DVec3::new(0.0, 0.0, high.y),
        base_radius: low.x,
        top_radius: high.x,
    }
}

/// Says whether a map leaves discs round.
pub(super) fn is_round(map: &DAffine2) -> bool {
    let [u, v] = [map.matrix2.x_axis, map.matrix2.y_axis];
    let (a, b) = (u.length(), v.length());
    (a - b).abs() <= SIX_DIGITS * a.max(b) && u.dot(v).abs() <= SIX_DIGITS * a * b
}

/// Sweeps a disc, if the map leaves it one.
fn of_disc(radius: f64, map: &DAffine2, line: u32, solids: &mut Solids) -> Option<SolidId> {
    if !is_round(map) {
        let ring = curves::circle(radius, curves::FINE_SIDES);
        return of_rings(&[ring], map, line, solids);
    }
    let (center, minor) = (map.translation, radius * map.matrix2.x_axis.length());
    let up = DAffine3::from_translation(DVec3::new(0.0, 0.0, center.y));
    let ball = |radius: f64, solids: &mut Solids| {
        let ball = Leaf::Sphere {
            center: DVec3::ZERO,
            radius,
        };
        solids.leaf(line, ball)
    };
    let major = center.x.abs();
    let solid = if major == 0.0 {
        ball(minor, solids)
    } else if center.x <= -minor {
        return None;
    } else {
        let torus = solids.leaf(line, Leaf::Torus { major, minor });
        if major >= minor {
            torus
        } else {
            // The polynomial's solid is hollow where the tube overlaps itself; the hollow lies in
            // this ball, and of the ball nothing else is outside of it.
            let inner = ball(((minor - major) * (minor + major)).sqrt(), solids);
            match center.x > 0.0 {
                true => solids.op(line, Operator::Union, vec![torus, inner]),
                false => solids.op(line, Operator::Difference, vec![inner, torus]),
            }
        }
    };
    Some(solids.placed(line, solid, up))
}

/// Cuts what is between two angles, in degrees, out of a solid of revolution.
pub(super) fn wedge(
    solid: SolidId,
    (from, to): (f64, f64),
    line: u32,
    solids: &mut Solids,
) -> SolidId {
    let direction = |degrees: f64| {
        // Exact at the quarters.
        match degrees.rem_euclid(360.0) {
            0.0 => DVec3::X,
            90.0 => DVec3::Y,
            180.0 => DVec3::NEG_X,
            270.0 => DVec3::NEG_Y,
            other => {
                let (sin, cos) = libm::sincos(other.to_radians());
                DVec3::new(cos, sin, 0.0)
            }
        }
    };
    let [first, last] = [direction(from), direction(to)];
    let half = |normal: DVec3| Leaf::HalfSpace {
        normal,
        offset: 0.0,
    };
    // Behind the first direction, and before the last.
    let behind = solids.leaf(line, half(DVec3::new(first.y, -first.x, 0.0)));
    if to - from == 180.0 {
        return solids.op(line, Operator::Intersection, vec![solid, behind]);
    }
    let before = solids.leaf(line, half(DVec3::new(-last.y, last.x, 0.0)));
    if to - from < 180.0 {
        return solids.op(line, Operator::Intersection, vec![solid, behind, before]);
    }
    let either = solids.op(line, Operator::Union, vec![behind, before]);
    solids.op(line, Operator::Intersection, vec![solid, either])
}
