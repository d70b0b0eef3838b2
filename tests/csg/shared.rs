//! Coincident faces, in one space and in spaces that differ by translations: lanes, which know
//! them by number, agree with the reference.

use super::asked::{Asked, agree};
use crate::common::{Random, RayColumns, campaign};
use glam::{DAffine3, DVec3};
use lanecast::internals::geom::{Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Sphere};
use lanecast::internals::scene::{Operand, Operator, SceneBuilder, ShapeId};

/// A coordinate of few, none of which f64 has exactly: faces often coincide.
fn coordinate(random: &mut Random) -> f64 {
    [-0.7, -0.3, 0.1, 0.6][random.below(4) as usize]
}

fn two(random: &mut Random) -> [f64; 2] {
    let (a, b) = (coordinate(random), coordinate(random));
    if a == b {
        [a - 0.4, b]
    } else {
        [a.min(b), a.max(b)]
    }
}

/// About the origin; along y, with one of two radii, what is round.
fn operand(b: &mut SceneBuilder, random: &mut Random) -> ShapeId {
    let [x, y, z] = [0; 3].map(|_| two(random));
    let (base, top) = (DVec3::Y * y[0], DVec3::Y * y[1]);
    let radius = [0.3, 0.45][random.below(2) as usize];
    match random.below(8) {
        0..=2 => {
            let min = DVec3::new(x[0], y[0], z[0]);
            let max = DVec3::new(x[1], y[1], z[1]);
            b.cuboid("", Cuboid { min, max })
        }
        3 => {
            let normal = [DVec3::Y, -DVec3::Y * 3.0, DVec3::new(2.0, 2.0, 0.0)];
            let normal = normal[random.below(3) as usize];
            let offset = y[0] * normal.element_sum();
            b.half_space("", HalfSpace { normal, offset })
        }
        4 => {
            let center = DVec3::Y * 0.1;
            b.sphere("", Sphere { center, radius })
        }
        5 => {
            let (center, radii) = (DVec3::Y * 0.1, DVec3::new(radius, 0.45, 0.3));
            b.ellipsoid("", Ellipsoid { center, radii })
        }
        6 => b.cone(
            "",
            Cone {
                base,
                top,
                base_radius: radius,
                top_radius: 0.3,
                open: false,
            },
        ),
        _ => b.cylinder(
            "",
            Cylinder {
                base,
                top,
                radius,
                open: false,
            },
        ),
    }
}

/// Three to six operands; in spaces of their own where `moved`, by as much as their
/// coordinates are shifted back, so that faces coincide but for roundings.
fn solid(b: &mut SceneBuilder, random: &mut Random, moved: bool) -> ShapeId {
    let mut shape = operand(b, random);
    for _ in 0..2 + random.below(4) {
        let mut other = Operand::shape(operand(b, random));
        if moved && random.below(3) > 0 {
            let shifts = [DVec3::X * 0.4, DVec3::Y * 0.9, DVec3::new(0.4, -0.9, 0.7)];
            let shift = shifts[random.below(3) as usize];
            let way = DAffine3::from_translation(shift);
            let there = b.transform(way.into());
            let back = b.transform(DAffine3::from_translation(-shift).into());
            let inner = [other.transform(there)];
            let inner = b.csg("", Operator::Union, &inner);
            other = Operand::shape(inner).transform(back);
        }
        let operators = [
            Operator::Union,
            Operator::Intersection,
            Operator::Difference,
            Operator::Xor,
        ];
        let operator = operators[random.below(4) as usize];
        shape = b.csg("", operator, &[Operand::shape(shape), other]);
    }
    shape
}

fn rays(random: &mut Random, count: usize) -> RayColumns {
    let mut rays = RayColumns::default();
    for _ in 0..count {
        let org = random.vector() * 2.0;
        let dir = random.vector() * 0.6 - org;
        rays.push(org, dir.to_array().map(|x| x as f32));
    }
    rays
}

fn solids_agree(count: usize) {
    let mut hits = 0;
    for seed in 0..count as u64 {
        let random = &mut Random(seed + 77);
        let moved = seed % 2 == 1;
        let asked = Asked::one(|b| {
            let solid = solid(b, random, moved);
            // Something that all rays may miss is still a solid.
            b.csg("", Operator::Union, &[Operand::shape(solid)])
        });
        let answers = agree(&asked, &rays(random, 48));
        hits += answers.iter().flatten().count();
    }
    assert!(hits > 8 * count, "{hits} hits of {count} solids");
}

#[test]
fn solids_whose_faces_coincide_are_met_as_the_reference_says() {
    solids_agree(campaign(120));
}

#[test]
#[ignore = "a campaign of minutes"]
fn ten_thousand_solids_whose_faces_coincide_are_met_as_the_reference_says() {
    solids_agree(campaign(10_000));
}
