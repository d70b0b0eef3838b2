//! Polynomial surfaces as operands: beside primitives that they equal, beside themselves, cut
//! through, and unbounded.

use super::asked::{ALL, Asked, RIGHT, agree, line, spans};
use super::coincidence::{OFFSETS, TURNS, center, csg, rays_about, some, v};
use super::laws::{are_one, laws};
use super::programs::{Leaf, Program, random_rays};
use super::truth::Tree;
use crate::common::{Random, RayColumns, kernels, property};
use glam::{DAffine3, DVec3};
use lanecast::internals::geom::tape::Builder;
use lanecast::internals::geom::{Cuboid, Sphere};
use lanecast::internals::plan::Precision;
use lanecast::internals::scene::{Operand, Operator};
use lanecast::internals::trace::{HitId, TURNED};
use proptest::prelude::*;

use Operator::{Difference, Intersection, Union, Xor};

/// Of leaves in one space.
fn of(operator: Operator, leaves: &[Leaf]) -> Asked {
    Asked::one(|scene| {
        let shapes = leaves.iter().map(|leaf| leaf.add(scene, 1.0));
        let operands: Vec<Operand> = shapes
            .collect::<Vec<_>>()
            .into_iter()
            .map(Operand::shape)
            .collect();
        scene.csg("", operator, &operands)
    })
}

/// Bits of the ends, and which of them a line comes in by.
fn ends(asked: &Asked, rays: &RayColumns) -> Vec<(bool, Vec<(u64, bool)>)> {
    let world = asked.world();
    let of = |i: usize| {
        let (org, dir) = rays.ray(i);
        let (start, all) = spans(&world, asked.csg(), &line(org, dir));
        let ends = all.iter().map(|c| (c.root.rounded().to_bits(), c.enters));
        (start, ends.collect())
    };
    (0..rays.len()).map(of).collect()
}

proptest! {
    #![proptest_config(property(60))]

    #[test]
    fn a_ball_by_its_polynomial_is_the_primitive(seed in any::<u64>()) {
        ball_by_its_polynomial(seed);
    }
}

/// A ray passes by this ball of 0.52 at 8e-6, from 750 off the origin: `fast` leaves a skin.
#[test]
fn a_ball_that_is_grazed_is_the_primitive() {
    ball_by_its_polynomial(6349398872818107150);
}

/// Neither less the other is anything, in any arithmetic; what they have in common
/// is either. In `fast` a ray that grazes them may come into the one alone: where half a
/// chord is less than a quarter of the radius, its ends are worse known than what is one.
fn ball_by_its_polynomial(seed: u64) {
    let random = &mut Random(seed);
    // Any numbers: both are the same polynomial, of squares that are not rounded.
    let center = random.vector() * [0.0, 1.0, 1e3][random.below(3) as usize];
    let row = Sphere {
        center,
        radius: random.size(),
    };
    let (primitive, polynomial) = (Leaf::Ball(row), Leaf::Round(row));
    let rays = rays_about(random, center, 48);
    let alone = ends(&of(Union, &[primitive]), &rays);
    let grazes = |i: usize| {
        let (org, dir) = rays.ray(i);
        let (org, dir) = (
            DVec3::from_array(org),
            DVec3::from_array(dir.map(f64::from)),
        );
        let off = (org - center).cross(dir).length() / dir.length() - row.radius;
        off.abs() < 0.03 * row.radius + 1e-6 * center.length()
    };
    for pair in [[primitive, polynomial], [polynomial, primitive]] {
        for operator in [Difference, Xor] {
            let nothing = of(operator, &pair);
            for precision in ALL {
                let answers = rays.closest(&nothing.world(), &kernels(precision));
                for (i, (t, id)) in answers.into_iter().enumerate() {
                    if precision != Precision::Fast || !grazes(i) {
                        assert_eq!(id, HitId::NONE, "{precision:?} {t} {:?}", rays.ray(i));
                    }
                }
            }
            assert!(agree(&nothing, &some(&rays, 8)).iter().all(Option::is_none));
        }
        for operator in [Intersection, Union] {
            let both = of(operator, &pair);
            assert_eq!(&ends(&both, &rays), &alone, "{row:?}");
            agree(&both, &some(&rays, 8));
        }
    }
}

/// In one space, and turned there and back.
#[test]
fn nothing_is_left_of_a_torus_without_itself() {
    let tori = [
        Leaf::Tube(DVec3::ZERO, [0.75, 0.25]),
        Leaf::Tube(DVec3::ZERO, [0.3, 0.7]),
    ];
    for (turn, offset) in TURNS.into_iter().flat_map(|t| OFFSETS.map(|o| (t, o))) {
        for (kind, leaf) in tori.into_iter().enumerate() {
            let center = center(offset);
            let rays = rays_about(&mut Random(kind as u64), center, 40);
            let context = format!("{turn:?} {offset} {leaf:?}");
            for operator in [Difference, Xor] {
                let asked = csg(operator, &[leaf, leaf], turn, center);
                let world = asked.world();
                for precision in ALL {
                    let answers = rays.closest(&world, &kernels(precision));
                    let skin = answers.iter().position(|a| a.1 != HitId::NONE);
                    let ray = skin.map(|i| (rays.ray(i), answers[i]));
                    assert_eq!(ray, None, "{operator:?} {precision:?} {context}");
                }
                assert!(agree(&asked, &some(&rays, 20)).iter().all(Option::is_none));
            }
            let alone = Asked::one(|scene| leaf.moved(center).add(scene, 1.0));
            let both = csg(Intersection, &[leaf, leaf], turn, center);
            for precision in RIGHT {
                let kernels = kernels(precision);
                let expected = rays.closest(&alone.world(), &kernels);
                let found = rays.closest(&both.world(), &kernels);
                for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
                    let miss = expected.1 == HitId::NONE;
                    let same = (found.1 == HitId::NONE) == miss;
                    let near = miss || (found.0 - expected.0).abs() < 1e-3;
                    assert!(
                        same && near,
                        "{precision:?} {context} {:?}: {found:?} {expected:?}",
                        rays.ray(i)
                    );
                }
            }
            agree(&both, &some(&rays, 20));
        }
    }
}

/// From a billion sizes away a ray is off by more in an operand's space than the bounds
/// of its flat sides have room for: nobody meets what is no deeper than that.
#[test]
fn far_rays_are_met_in_the_operand_s_own_space() {
    let turn = DAffine3::from_axis_angle(v(0.3, 0.5, 0.8).normalize(), 0.6);
    let asked = Asked::one(|scene| {
        // x²⁴ + y²⁴ + z²⁴ − 1.
        let b = &mut Builder::default();
        let powers = [0, 1, 2].map(|axis| {
            let x = b.coordinate(axis);
            b.power(x, 24)
        });
        let sum = b.sum(powers[0], powers[1]);
        let sum = b.sum(sum, powers[2]);
        let one = b.constant(1.0);
        let last = b.difference(sum, one);
        let dice = scene.implicit("", std::mem::take(b).finish(last), false, None);
        let (center, radius) = (v(4.0, 0.0, 0.0), 0.5);
        let ball = scene.sphere("", Sphere { center, radius });
        let place = scene.transform(turn.into());
        let dice = Operand::shape(dice).transform(place);
        scene.csg("", Union, &[Operand::shape(ball), dice])
    });
    let random = &mut Random(1);
    let (mut rays, mut few) = (RayColumns::default(), RayColumns::default());
    for i in 0..1000 {
        let height = 1.0 + 3e-5 * random.unit();
        let to = v(0.5 * random.unit(), height, 0.5 * random.unit());
        let dir = turn.transform_vector3(v(1.0, 0.0, random.unit())).as_vec3();
        let org = turn.transform_point3(to) - dir.as_dvec3() * 1e9;
        rays.push(org, dir.to_array());
        if i % 20 == 0 {
            few.push(org, dir.to_array());
        }
    }
    let hits = agree(&asked, &few);
    let met = hits.iter().flatten().count();
    assert!(met > 10 && met < 40, "{met}");
    let world = asked.world();
    for precision in RIGHT {
        let answers = rays.closest(&world, &kernels(precision));
        for (i, (_, id)) in answers.iter().enumerate() {
            let (org, dir) = rays.ray(i);
            let (_, all) = spans(&world, asked.csg(), &line(org, dir));
            let expected = all.iter().any(|c| c.root.rounded() > 0.0);
            assert_eq!(
                *id != HitId::NONE,
                expected,
                "{precision:?} {org:?} {dir:?}"
            );
        }
    }
}

/// All laws, of a torus, the same one by its minor radius aside, and a ball.
#[test]
fn tori_that_overlap_obey_the_laws() {
    let tube = Leaf::Tube(DVec3::ZERO, [0.75, 0.25]);
    let ball = Leaf::Round(Sphere {
        center: v(0.5, 0.0, 0.25),
        radius: 0.5,
    });
    let leaves = [tube, tube.moved(v(0.25, 0.0, 0.0)), ball].map(|leaf| (leaf, None));
    let program = Program {
        leaves: leaves.to_vec(),
    };
    let solids = [0, 1, 2].map(Tree::Operand);
    let [a, b, _] = &solids;
    // What is in the one and not in the other, and what is in both.
    let parts = [Difference, Intersection].map(|op| Tree::of(op, [a.clone(), b.clone()]));
    let mut all = laws(&solids);
    all.push(("parts", Tree::of(Union, parts.clone()), a.clone()));
    all.push(("parts", Tree::of(Xor, parts), a.clone()));
    for (i, (name, one, other)) in all.iter().enumerate() {
        let rays = random_rays(&mut Random(i as u64), 20, 0.5);
        are_one(&program, [one, other], &rays, name);
    }
    let mut rays = random_rays(&mut Random(40), 60, 0.5);
    // Within the plane that the two are mirrored in.
    for i in 0..8 {
        let y = f64::from(i) / 32.0;
        rays.push(v(0.125, y, 4.0), [0.0, 0.0, -1.0]);
    }
    for operator in [Union, Intersection, Difference, Xor] {
        agree(&of(operator, &[tube, leaves[1].0, ball]), &rays);
    }
}

/// The box' face is the plane of the ring.
#[test]
fn a_torus_cut_through_its_middle_plane() {
    let tube = Leaf::Tube(DVec3::ZERO, [0.75, 0.25]);
    let upper = Leaf::Box(Cuboid {
        min: v(-2.0, 0.0, -2.0),
        max: v(2.0, 1.0, 2.0),
    });
    let asked = of(Difference, &[tube, upper]);
    let all = |org: DVec3, dir: [f64; 3]| {
        let line = line(org.to_array(), dir);
        let world = asked.world();
        let (start, all) = spans(&world, asked.csg(), &line);
        assert!(!start);
        let ends = all.iter().map(|c| (c.root.rounded(), c.primitive));
        ends.collect::<Vec<_>>()
    };
    let (cut, down) = (1 | TURNED, [0.0, -1.0, 0.0]);
    // Down on the cut: at the tube's axis, beside it, where the cut begins and where it
    // ends; the rim is touched, and the hole is free.
    assert_eq!(all(v(0.75, 2.0, 0.0), down), [(2.0, cut), (2.25, 0)]);
    let side = 2.0 + 0.1875_f64.sqrt() / 2.0;
    let beside = all(v(0.0, 2.0, -0.625), down);
    assert_eq!(beside.len(), 2);
    assert_eq!(beside[0], (2.0, cut));
    assert!((beside[1].0 - side).abs() < 1e-15, "{beside:?} {side}");
    for x in [0.5, 1.0, 0.25, 0.0, 1.25] {
        assert!(all(v(x, 2.0, 0.0), down).is_empty(), "{x}");
    }
    // Up from below, and in the plane of the cut itself: a line within a face is in it.
    let up = all(v(0.75, -2.0, 0.0), [0.0, 1.0, 0.0]);
    assert_eq!(up, [(1.75, 0), (2.0, cut)]);
    let within = all(v(-2.0, 0.0, 0.0), [1.0, 0.0, 0.0]);
    let beyond = all(v(-2.0, f64::from_bits(1), 0.0), [1.0, 0.0, 0.0]);
    let below = all(v(-2.0, -f64::from_bits(1), 0.0), [1.0, 0.0, 0.0]);
    assert!(within.is_empty() && beyond.is_empty());
    assert_eq!(below, [(1.0, 0), (1.5, 0), (2.5, 0), (3.0, 0)]);
    let mut rays = rays_about(&mut Random(8), DVec3::ZERO, 300);
    for i in 0..40 {
        let (x, z) = (f64::from(i % 8) / 8.0, f64::from(i / 8) / 8.0);
        rays.push(v(x, 2.0, z), down);
        rays.push(v(-2.0, 0.0, z), [1.0, 0.0, (x * 0.5) as f32]);
    }
    agree(&asked, &rays);
    agree(&of(Intersection, &[tube, upper]), &rays);
}

/// x⁴ + z⁴ ≤ y⁴ + r⁴ has no bounds; they are those of what it is cut by.
#[test]
fn a_quartic_without_end_in_a_ball() {
    let throat = Leaf::Throat(DVec3::ZERO, 0.5);
    let ball = Leaf::Ball(Sphere {
        center: DVec3::ZERO,
        radius: 1.0,
    });
    let both = of(Intersection, &[throat, ball]);
    let less = of(Difference, &[ball, throat]);
    let along_x = |asked: &Asked, y: f64| -> Vec<f64> {
        let line = line([-2.0, y, 0.0], [1.0, 0.0, 0.0]);
        let world = asked.world();
        let (start, all) = spans(&world, asked.csg(), &line);
        assert!(!start);
        all.iter().map(|c| c.root.rounded()).collect()
    };
    assert_eq!(along_x(&both, 0.0), [1.5, 2.5]);
    assert_eq!(along_x(&less, 0.0), [1.0, 1.5, 2.5, 3.0]);
    let wide = 0.125_f64.sqrt().sqrt();
    for (found, expected) in along_x(&both, 0.5).iter().zip([2.0 - wide, 2.0 + wide]) {
        assert!((found - expected).abs() < 1e-15, "{found} {expected}");
    }
    // Wider than the ball.
    let rim = 0.1_f64.sqrt();
    assert_eq!(along_x(&both, 0.9).len(), 2);
    assert!(along_x(&less, 0.9).is_empty());
    assert!(along_x(&both, 0.9)[0] > 2.0 - 2.0 * rim);
    let random = &mut Random(9);
    let mut rays = random_rays(random, 200, 0.5);
    // From far away, along the axis, and from within.
    for _ in 0..40 {
        let to = random.vector() * 0.5;
        let org = random.vector() * 1e4;
        rays.push(org, (to - org).to_array());
        rays.push(to + DVec3::Y * 3.0, [0.0, -1.0, 0.0]);
        rays.push(to, random.vector().to_array());
    }
    let program = Program {
        leaves: vec![(throat, None), (ball, None)],
    };
    let [a, b] = [0, 1].map(Tree::Operand);
    let not = Tree::of(Operator::Complement, [a.clone()]);
    let one = Tree::of(Difference, [b.clone(), a.clone()]);
    let other = Tree::of(Intersection, [b.clone(), not]);
    are_one(&program, [&one, &other], &rays, "less");
    let parts = [one, Tree::of(Intersection, [a, b.clone()])];
    are_one(&program, [&Tree::of(Union, parts), &b], &rays, "parts");
    for asked in [
        both,
        less,
        of(Union, &[throat, ball]),
        of(Xor, &[ball, throat]),
    ] {
        agree(&asked, &rays);
    }
}
