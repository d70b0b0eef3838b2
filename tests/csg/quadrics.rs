//! Quadrics as operands: a line may have two intervals inside, or all but one.

use super::asked::{Asked, agree, line, spans};
use super::programs::{Leaf, random_quadric, random_rays};
use crate::common::{Random, RayColumns, property};
use glam::{DAffine3, DMat3, DVec3};
use lanecast::internals::geom::{Cuboid, Quadric, Sphere, exact};
use lanecast::internals::scene::{Operand, Operator, SceneBuilder, ShapeId};
use lanecast::internals::trace::TURNED;
use proptest::prelude::*;

fn opposite(row: Quadric) -> Quadric {
    Quadric {
        coefficients: row.coefficients.map(|x| -x),
    }
}

/// A box and a quadric by an operator.
fn cut(operator: Operator, row: Quadric) -> Asked {
    Asked::one(|scene: &mut SceneBuilder| -> ShapeId {
        let (min, max) = (DVec3::splat(-1.0), DVec3::splat(1.0));
        let block = scene.cuboid("", Cuboid { min, max });
        let other = scene.quadric("", row);
        scene.csg(
            "",
            operator,
            &[Operand::shape(block), Operand::shape(other)],
        )
    })
}

/// Along a line that is nearly parallel to a hyperboloid's cone, which a turn by a right
/// angle leaves off by a rounding: the other end is 10^15 away, where f64 knows nothing of
/// it, and is not one with the end that is near.
#[test]
fn an_end_that_f64_knows_nothing_of_is_far_away() {
    let coefficients = [-1.0, -1.0, 1.0, 0.0, 0.0, 0.0, 1.0, -0.25, 0.0, -0.328125];
    let turn = DMat3::from_cols(
        DVec3::new(f64::EPSILON / 2.0, 0.5, 0.0),
        DVec3::new(-0.5, f64::EPSILON / 2.0, 0.0),
        DVec3::new(0.0, 0.0, 0.5),
    );
    let shift = DVec3::new(
        -0.21990697351007282,
        -0.02610556019454724,
        0.27413767489098795,
    );
    let map = DAffine3::from_mat3_translation(turn, shift);
    let asked = Asked::one(|scene| {
        let shape = scene.quadric("", Quadric { coefficients });
        let operand = Operand::shape(shape).transform(scene.transform(map.into()));
        scene.csg("", Operator::Union, &[operand])
    });
    let (org, dir) = ([0.0, -0.75, 0.75], [0.75, 1.0, -1.25]);
    let world = asked.world();
    let (inside, found) = spans(&world, asked.csg(), &line(org, dir));
    let found: Vec<f64> = found.iter().map(|c| c.root.rounded()).collect();
    assert!(inside);
    assert_eq!(found, [1.4605256039393673, 4701961632884670.0]);
    let mut rays = RayColumns::default();
    rays.push(org.into(), dir);
    agree(&asked, &rays);
}

proptest! {
    #![proptest_config(property(120))]

    /// What a quadric takes away is what its opposite leaves; with its sides turned.
    /// Where a line only touches, neither has anything there.
    #[test]
    fn a_quadric_taken_away_is_its_opposite_left(seed in any::<u64>()) {
        let random = &mut Random(seed);
        let row = random_quadric(random);
        let asked = [
            cut(Operator::Difference, row),
            cut(Operator::Intersection, opposite(row)),
        ];
        let rays = random_rays(random, 24, 1.0);
        let worlds = [0, 1].map(|i: usize| asked[i].world());
        for i in 0..rays.len() {
            let (org, dir) = rays.ray(i);
            // A line within the surface is in both, as both are closed.
            let of = |row| exact::span(&exact::Solid::Quadric(row), &line(org, dir));
            let [one, other] = [of(row), of(opposite(row))];
            if one.at_first && other.at_first {
                let ends = one.ends.iter().chain(&other.ends).flatten().count();
                prop_assert_eq!(ends, 0);
                continue;
            }
            let [one, other] = [0, 1].map(|i: usize| {
                spans(&worlds[i], asked[i].csg(), &line(org, dir))
            });
            prop_assert_eq!(one.0, other.0);
            prop_assert_eq!(one.1.len(), other.1.len(), "{:?} {:?}", row, rays.ray(i));
            for (a, b) in one.1.iter().zip(&other.1) {
                prop_assert!(a.root.order(&b.root).is_eq(), "{:?} {:?}", a, b);
                let turned = if a.primitive & !TURNED == 1 { TURNED } else { 0 };
                prop_assert_eq!(a.primitive, b.primitive ^ turned);
            }
        }
        for asked in &asked {
            agree(asked, &rays);
        }
    }

    /// The same ball three times: as a sphere, as a quadric, and as what is left
    /// outside of one.
    #[test]
    fn a_ball_is_a_ball_however_it_is_written(seed in any::<u64>()) {
        let random = &mut Random(seed);
        let grid = |random: &mut Random| (random.unit() * 8.0).round() / 8.0;
        let center = DVec3::new(grid(random), grid(random), grid(random));
        let radius = 0.125 * (1 + random.below(8)) as f64;
        let [x, y, z] = (center * -2.0).to_array();
        let constant = center.length_squared() - radius * radius;
        let row = Quadric {
            coefficients: [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, x, y, z, constant],
        };
        let of = |make: &dyn Fn(&mut SceneBuilder) -> Vec<Operand>, operator| {
            Asked::one(|scene| {
                let operands = make(scene);
                scene.csg("", operator, &operands)
            })
        };
        let ball = Sphere { center, radius };
        let all = [
            of(&|b| vec![Operand::shape(b.sphere("", ball))], Operator::Union),
            of(&|b| vec![Operand::shape(b.quadric("", row))], Operator::Union),
            of(&|b| vec![Operand::shape(b.quadric("", opposite(row)))], Operator::Complement),
            of(
                &|b| vec![Operand::shape(b.quadric("", row)), Operand::shape(b.sphere("", ball))],
                Operator::Intersection,
            ),
        ];
        let rays = random_rays(random, 24, 1.0);
        let worlds = all.each_ref().map(|asked| asked.world());
        for i in 0..rays.len() {
            let (org, dir) = rays.ray(i);
            let found = [0, 1, 2, 3].map(|i: usize| {
                let (start, all) = spans(&worlds[i], all[i].csg(), &line(org, dir));
                let ends = all.iter().map(|c| (c.root.rounded().to_bits(), c.enters));
                (start, ends.collect::<Vec<_>>())
            });
            for other in &found[1..] {
                prop_assert_eq!(&found[0], other, "{:?} {:?}", ball, rays.ray(i));
            }
        }
        for asked in &all[1..] {
            agree(asked, &rays);
        }
    }
}

#[test]
fn leaves_that_are_quadrics_move_as_wholes() {
    let row = Quadric {
        coefficients: [1.0, 2.0, -1.0, 0.5, 0.25, -1.0, 3.0, 0.0, 1.0, -2.0],
    };
    let Leaf::Quadric(moved) = Leaf::Quadric(row).moved(DVec3::new(1.0, -2.0, 0.5)) else {
        panic!("it stays a quadric");
    };
    for p in [DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)] {
        let there = p + DVec3::new(1.0, -2.0, 0.5);
        assert_eq!(row.value_at(p).0, moved.value_at(there).0);
    }
}
