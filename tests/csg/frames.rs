//! Operands in spaces of their own: transforms that cancel, long chains of transforms, and
//! error bounds of the faces that they place.

use super::asked::{Asked, RIGHT, agree, line, spans};
use super::coincidence::{solids, some, v};
use super::events::rays_from;
use crate::common::{Random, RayColumns, kernels};
use glam::{DAffine3, DQuat, DVec3};
use lanecast::internals::geom::{Cone, Cuboid, Sphere};
use lanecast::internals::scene::{Operand, Operator, SceneBuilder};
use lanecast::internals::trace::HitId;

use Operator::{Difference, Intersection, Union, Xor};

/// Spaces are one only where all of their maps' numbers are, powers of two too.
#[test]
fn operands_that_are_moved_or_scaled_by_powers_of_two_are_told_apart() {
    let ball =
        |scene: &mut SceneBuilder, center, radius| scene.sphere("", Sphere { center, radius });
    let places = [
        (1.0, 0.0),
        (1.0, 4.0),
        (1.0, 8.0),
        (1.0, 16.0),
        (0.5, 24.0),
        (2.0, 24.0),
    ];
    let placed = Asked::one(|scene| {
        let unit = ball(scene, DVec3::ZERO, 1.0);
        let operands = places.map(|(scale, x)| {
            let map = DAffine3::from_scale_rotation_translation(
                DVec3::splat(scale),
                DQuat::IDENTITY,
                v(x, 0.0, 0.0),
            );
            Operand::shape(unit).transform(scene.transform(map.into()))
        });
        scene.csg("", Xor, &operands)
    });
    let direct = Asked::one(|scene| {
        let balls = places.map(|(radius, x)| Operand::shape(ball(scene, v(x, 0.0, 0.0), radius)));
        scene.csg("", Xor, &balls)
    });
    let along = line([-5.0, 0.25, 0.0], [1.0, 0.0, 0.0]);
    let ends = |asked: &Asked| -> Vec<(f64, u32)> {
        let world = asked.world();
        let (_, ends) = spans(&world, asked.csg(), &along);
        ends.iter()
            .map(|c| (c.root.rounded(), c.primitive))
            .collect()
    };
    let (found, expected) = (ends(&placed), ends(&direct));
    assert_eq!(expected.len(), 12);
    for (found, expected) in found.iter().zip(&expected) {
        assert_eq!(found.1, expected.1);
        assert!(
            (found.0 - expected.0).abs() < 1e-12,
            "{found:?} {expected:?}"
        );
    }
    assert_eq!(found.len(), 12);
}

/// At its silhouette a ray may meet the one of two solids that are the same, and
/// not the other: what it has there is shorter than either is known.
#[test]
fn nothing_is_left_at_the_silhouette_of_a_solid_without_its_turned_self() {
    let random = &mut Random(77);
    for (kind, leaf) in solids().into_iter().take(4).enumerate() {
        let asked = Asked::one(|scene| {
            let shape = leaf.add(scene, 1.0);
            // All but the box look the same when they are turned about y; it by 180°.
            let degrees = if kind == 1 { 180.0 } else { 30.0 };
            let turn = DQuat::from_rotation_y(f64::to_radians(degrees));
            let map = scene.transform(DAffine3::from_quat(turn).into());
            let operands = [Operand::shape(shape), Operand::shape(shape).transform(map)];
            scene.csg("", Difference, &operands)
        });
        // A tangent at a point of the equator, off by a little.
        let mut rays = RayColumns::default();
        for i in 0..4_000 {
            let radius = [1.0, 0.0, 0.75, 0.625][kind];
            let n = DQuat::from_rotation_y(3.0 * random.unit()) * DVec3::X;
            let off = random.unit() * 10.0_f64.powi(-(i % 12) - 5);
            let (point, dir) = match kind {
                1 => (
                    v(1.0, 0.5 * random.unit(), 0.75),
                    v(-1.0, random.unit(), -2.0),
                ),
                _ => (n * radius, DVec3::Y.cross(n)),
            };
            let dir = DVec3::from_array(dir.to_array().map(|x| f64::from(x as f32)));
            let org = point * (1.0 + off) - dir * 2.0;
            rays.push(org, dir.to_array().map(|x| x as f32));
        }
        let world = asked.world();
        for precision in RIGHT {
            let answers = rays.closest(&world, &kernels(precision));
            let left = answers.iter().filter(|a| a.1 != HitId::NONE).count();
            assert_eq!(left, 0, "{leaf:?} {precision:?}");
        }
        agree(&asked, &some(&rays, 20));
    }
}

/// A boundary that lies certainly behind a ray's start may be one with one certainly
/// before it: where the ray has left a face that it hardly rises above, so that the face's
/// placement is a long way, and comes to another from in front.
#[test]
fn boundaries_on_both_sides_of_a_start_may_be_one() {
    let random = &mut Random(78);
    let mut rays = RayColumns::default();
    for _ in 0..2_000 {
        let rise = 10.0_f64.powi(-5 - random.below(4) as i32);
        let above = (10 + random.below(9)) as f64 * f64::EPSILON;
        // The placement is sixteen of these; beyond a dozen f64 is sure on which side it is.
        let gone = random.unit() * 4.0 * f64::EPSILON / rise;
        let org = v(1.0 + above, 0.5 - gone, 0.4 * random.unit());
        rays.push(org, [rise as f32, 1.0, 0.25 * random.unit() as f32]);
    }
    let (mut met, mut missed) = (0, 0);
    for operator in [Union, Intersection, Difference, Xor] {
        for first in [0, 1] {
            let asked = Asked::one(|scene| {
                let [min, max] = [v(-1.0, -1.0, -1.0), v(1.0, 1.0, 1.0)];
                let block = scene.cuboid("", Cuboid { min, max });
                let max = v(2.0, 0.5, 2.0);
                let other = scene.cuboid("", Cuboid { min, max });
                // About an axis across the face that rays rise above: it stays where it is.
                let turn = DQuat::from_rotation_x(f64::to_radians(30.0));
                let turn = scene.transform(DAffine3::from_quat(turn).into());
                let mut operands = [Operand::shape(block).transform(turn), Operand::shape(other)];
                operands.rotate_left(first);
                scene.csg("", operator, &operands)
            });
            for hit in agree(&asked, &rays) {
                match hit {
                    Some(hit) if hit.t < 1e-3 => met += 1,
                    _ => missed += 1,
                }
            }
        }
    }
    // Both are found, so that a start may be on either side of it.
    assert!(met > 1_000 && missed > 1_000, "{met} {missed}");
}

/// The box of a solid has room for operands that are met in a space equal to their own but
/// for roundings of the shifts on the way.
#[test]
fn solids_that_are_as_thin_as_shifts_are_rounded_are_not_lost() {
    let random = &mut Random(79);
    for (away, back) in [
        (759_250_200.0, 759_250_200.000_03),
        (3e5, 3e5 + 1e-8),
        (1e12, 1e12 + 0.03),
    ] {
        let asked = Asked::one(|scene| {
            let block = scene.cuboid(
                "",
                Cuboid {
                    min: v(-1.0, -1.0, 0.0),
                    max: DVec3::ONE,
                },
            );
            let other = scene.cuboid(
                "",
                Cuboid {
                    min: -DVec3::ONE,
                    max: v(1.0, 1.0, 1e-14 * away),
                },
            );
            let [there, here] = [away, -back].map(|z| {
                let shift = DAffine3::from_translation(v(0.0, 0.0, z));
                scene.transform(shift.into())
            });
            let moved = Operand::shape(other).transform(there);
            let moved = Operand::shape(scene.csg("", Union, &[moved]));
            let operands = [Operand::shape(block), moved.transform(here)];
            scene.csg("", Intersection, &operands)
        });
        let rays = rays_from(random, v(0.3, 0.2, -2.0), DVec3::Z, 0.3);
        agree(&asked, &rays);
    }
}

/// Steps on the way may be strong, and cancel: boxes of operands hold what their rays meet.
#[test]
fn ways_that_are_strong_and_cancel_leave_operands_their_boxes() {
    let random = &mut Random(80);
    for strength in [1e4, 1e7, 1e10, 1e13] {
        let asked = Asked::one(|scene| {
            let [min, max] = [-DVec3::ONE, DVec3::ONE];
            let axis = v(1.0, 2.0, 3.0).normalize();
            let turn = |degrees: f64| DAffine3::from_axis_angle(axis, f64::to_radians(degrees));
            let scale = |x: f64| DAffine3::from_scale(v(x, 1.0, 1.0));
            let steps = [
                turn(30.0) * scale(strength),
                turn(-17.0),
                scale(1.0 / strength) * turn(-13.0),
            ];
            steps
                .iter()
                .fold(scene.cuboid("", Cuboid { min, max }), |below, step| {
                    let step = scene.transform((*step).into());
                    scene.csg("", Union, &[Operand::shape(below).transform(step)])
                })
        });
        let mut rays = RayColumns::default();
        for _ in 0..2_000 {
            // At the edges of a cube, nearly.
            let mut corner = DVec3::ONE.copysign(random.vector());
            corner[random.below(3) as usize] = random.unit();
            let org = v(0.4, -0.3, -3.0) + 0.1 * random.vector();
            rays.push(org, (corner - org).as_vec3().to_array());
        }
        agree(&asked, &rays);
    }
}

/// Boxes come from whole ways, not from level upon level of room.
#[test]
fn long_ways_of_turns_and_scales_lose_nothing() {
    let random = &mut Random(81);
    let center = DVec3::ZERO;
    for strength in [1.0, 10.0, 1e6] {
        let asked = Asked::one(|scene| {
            let radius = 0.5;
            let ball = scene.sphere("", Sphere { center, radius });
            let mut shape = ball;
            for _ in 0..120 {
                let turn = DAffine3::from_rotation_y(f64::to_radians(20.0));
                let map = turn * DAffine3::from_scale(v(1.0 / strength, 1.0, 1.0));
                let there = scene.transform(DAffine3::from_scale(v(strength, 1.0, 1.0)).into());
                let back = scene.transform(map.into());
                let scaled = Operand::shape(shape).transform(there);
                let scaled = Operand::shape(scene.csg("", Union, &[scaled]));
                let operands = [scaled.transform(back), Operand::shape(ball)];
                shape = scene.csg("", Union, &operands[..1]);
            }
            let away = scene.transform(DAffine3::from_translation(v(0.0, 0.8, 0.0)).into());
            let operands = [shape, ball].map(Operand::shape);
            scene.csg("", Union, &[operands[0], operands[1].transform(away)])
        });
        let rays = rays_from(random, v(0.1, 0.4, -3.0), DVec3::Z, 0.15);
        let met = agree(&asked, &rays).iter().flatten().count();
        assert!(met > 20, "{met}");
    }
}

/// An operand that is met in the space of an earlier one, whose way there was longer.
#[test]
fn solids_hold_operands_that_are_met_where_others_have_them() {
    let random = &mut Random(82);
    let asked = Asked::one(|scene| {
        let [there, here, turn] = [
            DAffine3::from_translation(v(1e12, 0.0, 0.0)),
            DAffine3::from_translation(v(-1e12 + 0.03, 0.0, 0.0)),
            DAffine3::from_rotation_z(f64::to_radians(90.0)),
        ]
        .map(|map| scene.transform(map.into()));
        let (center, radius) = (DVec3::ZERO, 0.5);
        let ball = scene.sphere("", Sphere { center, radius });
        let max = DVec3::splat(5.0);
        let block = scene.cuboid("", Cuboid { min: -max, max });
        let turned = Operand::shape(ball).transform(turn);
        let turned = scene.csg("", Union, &[turned]);
        let away = Operand::shape(turned).transform(there);
        let away = scene.csg("", Union, &[away]);
        let operands = [
            Operand::shape(away).transform(here),
            Operand::shape(block).transform(turn),
        ];
        scene.csg("", Union, &operands)
    });
    let mut rays = RayColumns::default();
    for _ in 0..2_000 {
        let x = 5.0 + 0.06 * random.unit();
        rays.push(v(x, random.unit(), -20.0), [0.0, 0.0, 1.0]);
    }
    agree(&asked, &rays);
    // What two spaces far away have in common.
    let asked = Asked::one(|scene| {
        let shifts = [0.02, 1e12, -999_999_999_999.5]
            .map(|x| scene.transform(DAffine3::from_translation(v(x, 0.0, 0.0)).into()));
        let [left, right] = [(-10.0, 0.0), (0.01, 10.0)].map(|(low, high)| {
            let [min, max] = [v(low, -5.0, -5.0), v(high, 5.0, 5.0)];
            scene.cuboid("", Cuboid { min, max })
        });
        let operands = [
            Operand::shape(left).transform(shifts[0]),
            Operand::shape(right),
        ];
        let mut shape = scene.csg("", Intersection, &operands);
        for shift in &shifts[1..] {
            let moved = Operand::shape(shape).transform(*shift);
            shape = scene.csg("", Union, &[moved]);
        }
        shape
    });
    let rays = rays_from(random, v(8.0, 0.5, 0.2), -DVec3::X, 0.3);
    agree(&asked, &rays);
}

/// Seen from far enough that what lies apart by less than rays are rounded is one with it.
#[test]
fn operands_that_lie_apart_may_still_be_one_event_with_the_solid() {
    for (gap, distance) in [(5e-14, 1e3), (1e-12, 1e5), (1e-9, 1e8), (4e-9, 1e8)] {
        let asked = Asked::one(|scene| {
            let (min, max) = (-DVec3::ONE, DVec3::ONE);
            let block = scene.cuboid("", Cuboid { min, max });
            let (min, max) = (v(0.0, -0.5, -0.5), v(1.0, 0.5, 0.5));
            let other = scene.cuboid("", Cuboid { min, max });
            let shift = DAffine3::from_translation(v(1.0 + gap, 0.0, 0.0));
            let other = Operand::shape(other).transform(scene.transform(shift.into()));
            scene.csg("", Difference, &[Operand::shape(block), other])
        });
        let random = &mut Random(83);
        let mut rays = RayColumns::default();
        for _ in 0..500 {
            let org = v(distance, 1.1 * random.unit(), 1.1 * random.unit());
            rays.push(org, [-1.0, 0.0, 0.0]);
        }
        agree(&asked, &rays);
    }
}

/// Beside an apex, where the side turns about the axis within roundings, the rate at which
/// rays leave it is still the side's.
#[test]
fn tips_that_are_cut_off_below_an_apex_are_one_event_by_the_side_s_rate() {
    for cut in [1e-8, 1e-10, 1e-12] {
        let apex = v(0.1, 0.2, 0.3);
        let asked = Asked::one(|scene| {
            let cone = scene.cone(
                "",
                Cone {
                    base: apex - DVec3::Z,
                    top: apex,
                    base_radius: 0.5,
                    top_radius: 0.0,
                    open: false,
                },
            );
            let (min, max) = (v(-1.0, -1.0, -2.0), v(1.0, 1.0, 0.3));
            let block = scene.cuboid("", Cuboid { min, max });
            let shift = DAffine3::from_translation(v(0.0, 0.0, -cut));
            let block = Operand::shape(block).transform(scene.transform(shift.into()));
            scene.csg("", Difference, &[Operand::shape(cone), block])
        });
        let random = &mut Random(84);
        let mut rays = RayColumns::default();
        for i in 0..600 {
            let dir = match i % 3 {
                0 => [0.0, 0.0, -1.15],
                1 => [0.0, 0.0, 1.0],
                // With a component of nothing: normals at an apex are not compared.
                _ => [random.unit() as f32, 0.0, -1.5],
            };
            let back = DVec3::from_array(dir.map(f64::from)) * (1 + i % 8) as f64;
            rays.push(apex - back, dir);
        }
        agree(&asked, &rays);
    }
}
