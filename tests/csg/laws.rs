//! The laws of set algebra on random CSG; objects elsewhere and the scale change no hit.

use super::asked::{ALL, Asked, RIGHT, agree, line, spans};
use super::programs::{Leaf, Program, random_rays};
use super::truth::Tree;
use crate::common::{Random, RayColumns, campaign, kernels};
use glam::DVec3;
use lanecast::internals::geom::Sphere;
use lanecast::internals::plan::Precision;
use lanecast::internals::scene::{Edge, Operator, Shape};
use lanecast::internals::trace::HitId;

use Operator::{Complement, Difference, Intersection, Union, Xor};

/// Two solids that are one.
pub fn laws([x, y, z]: &[Tree; 3]) -> Vec<(&'static str, Tree, Tree)> {
    let two = |op, a: &Tree, b: &Tree| Tree::of(op, [a.clone(), b.clone()]);
    let not = |a: &Tree| Tree::of(Complement, [a.clone()]);
    let mut laws = Vec::new();
    for op in [Union, Intersection, Xor] {
        laws.push(("commutative", two(op, x, y), two(op, y, x)));
        let left = two(op, &two(op, x, y), z);
        laws.push(("associative", left.clone(), two(op, x, &two(op, y, z))));
        let all = Tree::of(op, [z.clone(), x.clone(), y.clone()]);
        laws.push(("in one list", left, all));
    }
    for (op, other) in [(Union, Intersection), (Intersection, Union)] {
        let dual = two(other, &not(x), &not(y));
        laws.push(("De Morgan", not(&two(op, x, y)), dual));
        let (left, right) = (two(op, x, y), two(op, x, z));
        let outside = two(op, x, &two(other, y, z));
        laws.push(("distributive", outside, two(other, &left, &right)));
        laws.push(("absorption", two(op, x, &two(other, x, y)), x.clone()));
        laws.push(("idempotent", two(op, x, x), x.clone()));
    }
    let less = two(Difference, x, y);
    laws.push(("difference", less.clone(), two(Intersection, x, &not(y))));
    let more = two(Difference, &two(Difference, x, y), z);
    let list = Tree::of(Difference, [x.clone(), y.clone(), z.clone()]);
    laws.push(("differences", more, list));
    laws.push((
        "xor",
        two(Xor, x, y),
        two(Union, &less, &two(Difference, y, x)),
    ));
    laws.push(("complement", not(&not(x)), x.clone()));
    laws
}

/// Spans of two solids along the same lines, bit for bit; and whether nearest hits
/// are at one place.
pub fn are_one(program: &Program, [a, b]: [&Tree; 2], rays: &RayColumns, context: &str) {
    let asked = [a, b].map(|tree| {
        Asked::one(|scene| {
            let shapes = program.shapes(scene, 1.0);
            Tree::of(Union, [tree.clone()]).shape(scene, &shapes)
        })
    });
    let worlds = [0, 1].map(|i| asked[i].world());
    for i in 0..rays.len() {
        let (org, dir) = rays.ray(i);
        let [one, other] = [0, 1].map(|i: usize| {
            let found = spans(&worlds[i], asked[i].csg(), &line(org, dir));
            let ends = found
                .1
                .iter()
                .map(|c| (c.root.rounded().to_bits(), c.enters));
            (found.0, ends.collect::<Vec<_>>())
        });
        assert_eq!(
            one, other,
            "{context}: {org:?} {dir:?}\n{a:?}\n{b:?}\n{program:?}"
        );
    }
    for precision in RIGHT {
        let [one, other] = [0, 1].map(|i: usize| rays.closest(&worlds[i], &kernels(precision)));
        for (i, (one, other)) in one.iter().zip(&other).enumerate() {
            let context = || {
                format!(
                    "{context} {precision:?} {:?}: {one:?} {other:?}",
                    rays.ray(i)
                )
            };
            assert_eq!(
                one.1 == HitId::NONE,
                other.1 == HitId::NONE,
                "{}",
                context()
            );
            let near = if precision == Precision::Exact {
                1e-6
            } else {
                1e-2
            };
            let near = near * (1.0 + one.0.abs());
            assert!(
                one.1 == HitId::NONE || (one.0 - other.0).abs() <= near,
                "{}",
                context()
            );
        }
    }
}

fn check_laws(programs: usize, rays: usize, seed: u64) {
    for i in 0..programs as u64 {
        let random = &mut Random(seed + i);
        let count = 1 + random.below(12);
        let program = Program::random(random, count, i % 2 == 1);
        let solids = [(); 3].map(|()| {
            let most = 1 + random.below(21);
            program.tree(random, most)
        });
        for (name, a, b) in laws(&solids) {
            let rays = random_rays(random, rays, 1.0);
            are_one(&program, [&a, &b], &rays, &format!("{name}, {i}"));
        }
    }
}

#[test]
fn the_laws_of_set_algebra_hold_for_random_programs() {
    check_laws(12, 8, 1);
}

#[test]
#[ignore = "a million rays, in minutes"]
fn the_laws_of_set_algebra_hold_for_a_million_rays() {
    check_laws(campaign(500), 100, 1_000_000);
}

fn check_programs(programs: usize, rays: usize, seed: u64) {
    let (mut hits, mut all) = (0, 0);
    for i in 0..programs as u64 {
        let random = &mut Random(seed + i);
        let count = 1 + random.below(20);
        let program = Program::random(random, count, i % 2 == 1);
        let most = 2 + random.below(63);
        let tree = program.tree(random, most);
        let asked = Asked::one(|scene| {
            let shapes = program.shapes(scene, 1.0);
            Tree::of(Union, [tree.clone()]).shape(scene, &shapes)
        });
        let rays = random_rays(random, rays, 1.0);
        let truth = agree(&asked, &rays);
        hits += truth.iter().flatten().count();
        all += truth.len();
        let (world, reference) = (asked.world(), asked.reference());
        for ray in 0..rays.len() {
            let (org, dir) = rays.ray(ray);
            let (_, found) = spans(&world, asked.csg(), &line(org, dir));
            let found: Vec<f64> = found.iter().map(|c| c.root.rounded()).collect();
            let own = reference.crossings(org, dir.map(f64::from), 0, 0);
            let own: Vec<f64> = own.iter().map(|c| c.t).collect();
            let context = || format!("{org:?} {dir:?}\n{tree:?}\n{program:?}");
            assert_eq!(found, own, "{seed} {i} {ray}: {}", context());
        }
    }
    assert!(hits * 8 > all && hits * 10 < all * 9, "{hits} of {all}");
}

#[test]
fn random_programs_are_as_the_reference_says() {
    check_programs(campaign(100), 16, 7);
}

/// Solids of which some are moved by about the tolerance, so that faces which were one are nearly
/// so.
fn check_tolerances(programs: usize, rays: usize, seed: u64) {
    let (mut hits, mut all) = (0, 0);
    for i in 0..programs as u64 {
        let random = &mut Random(seed + i);
        let count = 2 + random.below(12);
        let mut program = Program::random(random, count, i % 3 == 1);
        program.leaves.retain(|(leaf, _)| {
            !matches!(
                leaf,
                Leaf::Quadric(_) | Leaf::Round(_) | Leaf::Tube(..) | Leaf::Throat(..)
            )
        });
        if program.leaves.is_empty() {
            continue;
        }
        let tolerance = [1e-7, 1e-5, 1e-3, 0.05][random.below(4) as usize];
        for (leaf, _) in &mut program.leaves {
            if random.below(2) == 0 {
                *leaf = leaf.moved(random.vector() * (2.0 * tolerance));
            }
        }
        let most = 2 + random.below(31);
        let tree = program.tree(random, most);
        let asked = Asked::new(|scene| {
            let shapes = program.shapes(scene, 1.0);
            let shape = Tree::of(Union, [tree.clone()]).shape(scene, &shapes);
            let Shape::Csg(id) = scene.tables().shapes.row(shape) else {
                panic!("a union is a solid");
            };
            scene.set_tolerance(id, tolerance);
            scene.instance("", Edge::shape(shape));
        });
        let truth = agree(&asked, &random_rays(random, rays, 1.0));
        hits += truth.iter().flatten().count();
        all += truth.len();
    }
    assert!(hits * 10 > all && hits * 10 < all * 9, "{hits} of {all}");
}

#[test]
fn lanes_know_tolerances() {
    check_tolerances(campaign(400), 32, 70);
}

#[test]
#[ignore = "some hundred thousand rays before the reference, in minutes"]
fn lanes_know_tolerances_a_hundred_thousand_times() {
    check_tolerances(campaign(10_000), 32, 70_000_000);
}

#[test]
#[ignore = "a hundred thousand rays before the reference, in minutes"]
fn random_programs_are_as_the_reference_says_a_hundred_thousand_times() {
    check_programs(campaign(3_000), 32, 7_000_000);
}

/// Bits of t and ids.
fn bits(asked: &Asked, rays: &RayColumns, precision: Precision) -> Vec<(u64, HitId)> {
    let answers = rays.closest(&asked.world(), &kernels(precision));
    let met = |(t, id): (f64, HitId)| if id == HitId::NONE { 0 } else { t.to_bits() };
    answers.iter().map(|a| (met(*a), a.1)).collect()
}

/// As another operand of the union, behind all others, and as another instance.
#[test]
fn a_disjoint_object_leaves_every_hit_as_it_is() {
    for i in 0..campaign(20) as u64 {
        let random = &mut Random(i);
        let count = 1 + random.below(12);
        let program = Program::random(random, count, i % 2 == 1);
        let tree = program.tree(random, 20);
        let far = random.vector().normalize_or(DVec3::X) * 10.0_f64.powi(1 + (i % 4) as i32);
        let far = Leaf::Ball(Sphere {
            center: far,
            radius: 0.5,
        });
        let rays = random_rays(random, 64, 1.0);
        let scene = |as_operand: bool, as_instance: bool| {
            Asked::new(|scene| {
                let mut shapes = program.shapes(scene, 1.0);
                let mut all = vec![tree.clone()];
                if as_operand {
                    all.push(Tree::Operand(shapes.len()));
                    shapes.push(far.add(scene, 1.0));
                }
                let solid = Tree::of(Union, all).shape(scene, &shapes);
                scene.instance("", Edge::shape(solid));
                if as_instance {
                    let far = far.add(scene, 1.0);
                    scene.instance("", Edge::shape(far));
                }
            })
        };
        let [alone, operand, instance] =
            [(false, false), (true, false), (false, true)].map(|(a, b)| scene(a, b));
        // Rays that meet the far object say nothing.
        let (Leaf::Ball(ball), true) = (far, true) else {
            unreachable!()
        };
        let meets = |i: usize| {
            let (org, dir) = rays.ray(i);
            let (org, dir) = (
                DVec3::from_array(org),
                DVec3::from_array(dir.map(f64::from)),
            );
            let w = ball.center - org;
            let t = w.dot(dir) / dir.dot(dir);
            (w - dir * t).length() < ball.radius * 1.1
        };
        for precision in ALL {
            let expected = bits(&alone, &rays, precision);
            for (name, other) in [("operand", &operand), ("instance", &instance)] {
                let found = bits(other, &rays, precision);
                for i in (0..rays.len()).filter(|i| !meets(*i)) {
                    assert_eq!(
                        found[i],
                        expected[i],
                        "{precision:?} {name} {:?}",
                        rays.ray(i)
                    );
                }
            }
        }
    }
}

#[test]
fn scale_changes_no_bit_of_any_mantissa() {
    for i in 0..campaign(20) as u64 {
        let random = &mut Random(300 + i);
        let count = 1 + random.below(12);
        let program = Program::random(random, count, i % 2 == 1);
        let tree = program.tree(random, 20);
        let seed = random.bits();
        let at = |power: i32| {
            let scale = 2.0_f64.powi(power);
            let asked = Asked::one(|scene| {
                let shapes = program.shapes(scene, scale);
                Tree::of(Union, [tree.clone()]).shape(scene, &shapes)
            });
            let rays = random_rays(&mut Random(seed), 64, scale);
            (asked, rays, scale)
        };
        let (one, rays, _) = at(0);
        for power in [-100, -63, -1, 10, 77, 100] {
            let (scaled, moved, scale) = at(power);
            for precision in ALL {
                // A cone's polynomial has the sixth power of lengths. Where that
                // leaves f32, exact arithmetic has to say; t is then rounded once.
                let in_f32 = precision != Precision::Exact;
                let leaves = in_f32 && power.abs() > 40;
                if leaves && precision == Precision::Fast {
                    continue;
                }
                let expected = bits(&one, &rays, precision);
                let found = bits(&scaled, &moved, precision);
                for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
                    let t = f64::from_bits(expected.0) * scale;
                    let context = format!("2^{power} {precision:?} {:?}", rays.ray(i));
                    assert_eq!(found.1, expected.1, "{context}");
                    let off = (f64::from_bits(found.0) - t).abs();
                    let near = leaves && off <= 1e-5 * t;
                    assert!(
                        near || found.0 == t.to_bits(),
                        "{context}: {off:e} of {t:e}"
                    );
                }
            }
            let (a, b) = (one.world(), scaled.world());
            for i in 0..rays.len() {
                let of = |world, asked: &Asked, rays: &RayColumns| {
                    let (org, dir) = rays.ray(i);
                    spans(world, asked.csg(), &line(org, dir)).1
                };
                let (a, b) = (of(&a, &one, &rays), of(&b, &scaled, &moved));
                let t = a.iter().map(|c| (c.root.rounded() * scale, c.primitive));
                assert!(
                    t.eq(b.iter().map(|c| (c.root.rounded(), c.primitive))),
                    "2^{power}"
                );
            }
        }
    }
}
