//! Roth's table, and two solids of every kind along a ray, against set algebra.

use super::asked::{ALL, Asked, RIGHT, agree, nearest_hits, spans};
use super::programs::octahedron;
use super::truth::{Change, Part, Rational, Tree, changes, is_nearest, rational};
use crate::common::{RayColumns, kernels};
use glam::DVec3;
use lanecast::internals::geom::exact::Line;
use lanecast::internals::geom::{Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Sphere};
use lanecast::internals::plan::Precision;
use lanecast::internals::scene::{Operator, SceneBuilder, SceneError, ShapeId};
use lanecast::internals::trace::{HitId, TURNED};

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Roth 1982, table 1: an operator, in or out of the left, of the right, of the
/// result.
const ROTH: [(Operator, bool, bool, bool); 12] = [
    (Operator::Union, true, true, true),
    (Operator::Union, true, false, true),
    (Operator::Union, false, true, true),
    (Operator::Union, false, false, false),
    (Operator::Intersection, true, true, true),
    (Operator::Intersection, true, false, false),
    (Operator::Intersection, false, true, false),
    (Operator::Intersection, false, false, false),
    (Operator::Difference, true, true, false),
    (Operator::Difference, true, false, true),
    (Operator::Difference, false, true, false),
    (Operator::Difference, false, false, false),
];

fn ball(scene: &mut SceneBuilder, [from, to]: [f64; 2]) -> ShapeId {
    let (center, radius) = (v((from + to) / 2.0, 0.0, 0.0), (to - from) / 2.0);
    scene.sphere("", Sphere { center, radius })
}

fn two(operator: Operator) -> Tree {
    Tree::of(operator, [Tree::Operand(0), Tree::Operand(1)])
}

/// Spans of spheres along the x-axis, from x = 0.
fn spans_of_balls(tree: &Tree, balls: [[f64; 2]; 2]) -> Vec<f64> {
    let asked = Asked::one(|scene| {
        let shapes = balls.map(|ends| ball(scene, ends));
        tree.shape(scene, &shapes)
    });
    let (org, dir) = ([0.0; 3], [1.0, 0.0, 0.0]);
    let world = asked.world();
    let (start, all) = spans(&world, asked.csg(), &Line { org, dir });
    assert!(!start);
    let reference = asked.reference();
    let expected: Vec<f64> = reference
        .crossings(org, dir, 0, 0)
        .iter()
        .map(|c| c.t)
        .collect();
    let found: Vec<f64> = all.iter().map(|c| c.root.rounded()).collect();
    assert_eq!(found, expected);
    found
}

#[test]
fn every_row_of_roths_table() {
    for (operator, left, right, result) in ROTH {
        // x = 4 is in or out; nobody else is there.
        let place = |inside: bool, at: f64| if inside { [3.0, 5.0] } else { [at, at + 1.0] };
        let found = spans_of_balls(&two(operator), [place(left, 6.0), place(right, 8.0)]);
        let before = found.iter().filter(|t| **t < 4.0).count();
        assert_eq!(
            before % 2 == 1,
            result,
            "{operator:?} {left} {right}: {found:?}"
        );
    }
}

#[test]
fn the_lectures_example() {
    let (a, b) = ([0.9, 3.1], [2.5, 4.5]);
    for (operator, swapped, expected) in [
        (Operator::Union, false, [0.9, 4.5]),
        (Operator::Intersection, false, [2.5, 3.1]),
        (Operator::Difference, false, [0.9, 2.5]),
        (Operator::Difference, true, [3.1, 4.5]),
    ] {
        let balls = if swapped { [b, a] } else { [a, b] };
        let found = spans_of_balls(&two(operator), balls);
        assert_eq!(found.len(), 2, "{operator:?}");
        for (found, expected) in found.iter().zip(expected) {
            // A ball's ends are its centre less and plus its radius, rounded.
            assert!(
                (found - expected).abs() <= 4.0 * f64::EPSILON,
                "{found} {expected}"
            );
        }
    }
}

/// Solids that have [from, to] of the x-axis.
const KINDS: usize = 8;

/// Adds a solid, and what its operands have of the axis.
fn add(
    scene: &mut SceneBuilder,
    kind: usize,
    [from, to]: [f64; 2],
    shapes: &mut Vec<ShapeId>,
    parts: &mut Vec<Option<Part>>,
) -> Tree {
    let number = shapes.len();
    let (middle, half) = (v((from + to) / 2.0, 0.0, 0.0), (to - from) / 2.0);
    let plane = |scene: &mut SceneBuilder, sign: f64, at: f64| {
        let (normal, offset) = (v(sign, 0.0, 0.0), sign * at);
        scene.half_space("", HalfSpace { normal, offset })
    };
    if !from.is_finite() || !to.is_finite() {
        let (sign, at) = if from.is_finite() {
            (-1.0, from)
        } else {
            (1.0, to)
        };
        shapes.push(plane(scene, sign, at));
        parts.push(Some(Part::between(from, to)));
        return Tree::Operand(number);
    }
    if kind == 7 {
        shapes.push(plane(scene, -1.0, from));
        shapes.push(plane(scene, 1.0, to));
        parts.push(Some(Part::between(from, f64::INFINITY)));
        parts.push(Some(Part::between(f64::NEG_INFINITY, to)));
        let both = [Tree::Operand(number), Tree::Operand(number + 1)];
        return Tree::of(Operator::Intersection, both);
    }
    // A point: the axis is a tangent, or passes a corner.
    let point = half == 0.0;
    let (middle, half) = if point {
        (middle + DVec3::Y, 1.0)
    } else {
        (middle, half)
    };
    let (base, top) = (v(from, 0.0, 0.0), v(to, 0.0, 0.0));
    let open = false;
    shapes.push(match kind {
        1 if !point => scene.cuboid(
            "",
            Cuboid {
                min: v(from, -1.0, -1.0),
                max: v(to, 1.0, 1.0),
            },
        ),
        2 if !point => scene.cylinder(
            "",
            Cylinder {
                base,
                top,
                radius: 1.0,
                open,
            },
        ),
        3 => scene.cylinder(
            "",
            Cylinder {
                base: middle - DVec3::Z,
                top: middle + DVec3::Z,
                radius: half,
                open,
            },
        ),
        4 if !point => scene.cone(
            "",
            Cone {
                base,
                top,
                base_radius: 1.0,
                top_radius: 0.5,
                open,
            },
        ),
        5 => octahedron(scene, middle, half),
        6 => scene.ellipsoid(
            "",
            Ellipsoid {
                center: middle,
                radii: v(half, 1.0, 0.5),
            },
        ),
        _ => scene.sphere(
            "",
            Sphere {
                center: middle,
                radius: half,
            },
        ),
    });
    parts.push((!point).then(|| Part::between(from, to)));
    Tree::Operand(number)
}

/// What the second interval is to the first, [2, 4].
const FIRST: [f64; 2] = [2.0, 4.0];
const SECOND: [(&str, [f64; 2]); 12] = [
    ("disjoint", [5.0, 6.0]),
    ("touching", [4.0, 5.0]),
    ("overlapping", [3.0, 4.5]),
    ("containing", [1.0, 4.5]),
    ("contained", [2.5, 3.5]),
    ("equal", [2.0, 4.0]),
    ("sharing the beginning", [2.0, 3.0]),
    ("sharing the end", [3.5, 4.0]),
    ("zero length inside", [3.0, 3.0]),
    ("zero length at an end", [4.0, 4.0]),
    ("half a line from inside", [3.0, f64::INFINITY]),
    ("half a line to the end", [f64::NEG_INFINITY, 4.0]),
];

/// Before everything, in both, in one, on ends, behind everything.
const ORIGINS: [f64; 12] = [
    0.0, 1.5, 2.0, 2.25, 2.75, 3.0, 3.25, 3.75, 4.0, 4.25, 4.75, 8.0,
];

const OPERATORS: [Operator; 4] = [
    Operator::Union,
    Operator::Intersection,
    Operator::Difference,
    Operator::Xor,
];

/// The first beyond t = 0 of a ray from `from` along the axis, or against it.
fn first(all: &[Change], from: f64, backward: bool) -> Option<(&Change, Rational)> {
    let from = rational(from);
    let t = |c: &Change| if backward { &from - &c.t } else { &c.t - &from };
    let zero = rational(0.0);
    let beyond = all.iter().map(|c| (c, t(c))).filter(|(_, t)| *t > zero);
    beyond.min_by(|a, b| a.1.cmp(&b.1))
}

fn check(tree: &Tree, asked: &Asked, parts: &[Option<Part>], in_fast: bool, context: &str) {
    let (world, reference) = (asked.world(), asked.reference());
    let (start, truth) = changes(tree, parts);
    let id_of = |c: &Change| c.operand as u32 | if c.turned { TURNED } else { 0 };
    let found = |dir: f64| {
        let (org, dir) = ([0.0; 3], [dir, 0.0, 0.0]);
        let found = spans(&world, asked.csg(), &Line { org, dir });
        let crossings = reference.crossings(org, dir, 0, 0);
        let same = found.1.iter().map(|c| c.root.rounded());
        assert!(
            same.eq(crossings.iter().map(|c| c.t)),
            "{context}: {crossings:?}"
        );
        found
    };
    let (inside, forward) = found(1.0);
    assert_eq!(inside, start, "{context}");
    assert_eq!(forward.len(), truth.len(), "{context}: {forward:?}");
    for (found, truth) in forward.iter().zip(&truth) {
        assert!(
            is_nearest(found.root.rounded(), &truth.t),
            "{context}: {found:?}"
        );
        assert_eq!(found.enters, truth.enters, "{context}");
        assert_eq!(found.primitive, id_of(truth), "{context}");
    }
    // Against the axis, and twice as fast: the same the other way round.
    let (_, backward) = found(-2.0);
    assert_eq!(backward.len(), truth.len(), "{context}");
    for (found, truth) in backward.iter().zip(truth.iter().rev()) {
        assert_eq!(rational(found.root.rounded() * -2.0), truth.t, "{context}");
        assert_eq!(found.enters, !truth.enters, "{context}");
    }

    let mut rays = RayColumns::default();
    for backward in [false, true] {
        for from in ORIGINS {
            rays.push(
                v(from, 0.0, 0.0),
                [if backward { -1.0 } else { 1.0 }, 0.0, 0.0],
            );
        }
    }
    let expected: Vec<_> = (0..rays.len())
        .map(|i| first(&truth, ORIGINS[i % ORIGINS.len()], i >= ORIGINS.len()))
        .collect();
    for (i, hit) in nearest_hits(&reference, &rays).iter().enumerate() {
        let context = format!("{context}: reference, {:?}: {hit:?}", rays.ray(i));
        assert_eq!(hit.is_some(), expected[i].is_some(), "{context}");
        if let (Some(hit), Some((change, t))) = (hit, &expected[i]) {
            assert!(is_nearest(hit.t, t), "{context}");
            let outward = if change.enters { -1.0 } else { 1.0 };
            assert!(hit.normal[0] * outward > 0.5, "{context}");
        }
    }
    let modes = if in_fast { &ALL[..] } else { &RIGHT[..] };
    for precision in modes {
        let answers = rays.closest(&world, &kernels(*precision));
        for (i, (t, id)) in answers.into_iter().enumerate() {
            let context = format!("{context}: {precision:?} {:?}: {t} {id:?}", rays.ray(i));
            assert_eq!(id != HitId::NONE, expected[i].is_some(), "{context}");
            if let Some((change, exact)) = &expected[i] {
                let off = (rational(t) - exact) / exact;
                let near = if *precision == Precision::Exact {
                    1e-14
                } else {
                    1e-6
                };
                assert!(off < rational(near) && off > rational(-near), "{context}");
                // Of several surfaces at one place fast takes any.
                let told = i < ORIGINS.len() && *precision != Precision::Fast;
                assert!(!told || id.primitive == id_of(change), "{context}");
            }
        }
    }
}

#[test]
fn two_intervals_of_any_kinds_are_as_set_algebra_says() {
    for (name, second) in SECOND {
        for kinds in 0..KINDS * KINDS {
            let kinds = [kinds / KINDS, kinds % KINDS];
            // The complement of one order alone, and of like kinds.
            for case in 0..OPERATORS.len() * 3 {
                let operator = OPERATORS[case / 3];
                let (swapped, complement) = (case % 3 == 1, case % 3 == 2);
                if complement && kinds[0] != kinds[1] {
                    continue;
                }
                let (mut tree, mut parts) = (Tree::Operand(0), Vec::new());
                let asked = Asked::one(|scene| {
                    let mut shapes = Vec::new();
                    let mut pair = [(kinds[0], FIRST), (kinds[1], second)];
                    if swapped {
                        pair.reverse();
                    }
                    let of =
                        pair.map(|(kind, ends)| add(scene, kind, ends, &mut shapes, &mut parts));
                    tree = Tree::of(operator, of);
                    if complement {
                        tree = Tree::of(Operator::Complement, [tree.clone()]);
                    }
                    tree.shape(scene, &shapes)
                });
                let context = format!(
                    "{name}, kinds {kinds:?}, {operator:?}, swapped {swapped}, complement {complement}"
                );
                // In f32 kinds agree with their like at best.
                let in_fast = kinds == [1, 1] && second[0] < second[1];
                check(&tree, &asked, &parts, in_fast, &context);
            }
        }
    }
}

/// Not turned round silently.
#[test]
fn a_box_given_the_wrong_way_round_is_refused() {
    let mut scene = SceneBuilder::default();
    let (min, max) = (v(1.0, 0.0, 0.0), v(0.0, 1.0, 1.0));
    let wrong = scene.cuboid("wrong", Cuboid { min, max });
    let right = ball(&mut scene, [0.0, 1.0]);
    let both = two(Operator::Union).shape(&mut scene, &[right, wrong]);
    scene.instance("", lanecast::internals::scene::Edge::shape(both));
    let error = scene.finish().expect_err("min lies above max");
    assert!(matches!(error, SceneError::Degenerate { .. }), "{error}");
    assert!(error.to_string().contains("must be below max"), "{error}");
}

/// The reference needs no stack for what lies in each other, and neither does anybody.
#[test]
fn a_hundred_thousand_nested_differences() {
    const DEEP: usize = 100_000;
    let asked = Asked::one(|scene| {
        let min = v(0.0, -1.0, -1.0);
        let max = v(DEEP as f64, 1.0, 1.0);
        let mut solid = scene.cuboid("", Cuboid { min, max });
        for i in 0..DEEP {
            let hole = ball(scene, [i as f64 + 0.25, i as f64 + 0.75]);
            let operands = [solid, hole].map(lanecast::internals::scene::Operand::shape);
            solid = scene.csg("", Operator::Difference, &operands);
        }
        solid
    });
    let mut rays = RayColumns::default();
    let middle = (DEEP / 2) as f64;
    rays.push(v(middle, 0.0, 2.0), [0.5, 0.0, -2.0]);
    rays.push(v(middle, 0.0, 2.0), [0.25, 0.0, -1.0]);
    rays.push(v(middle + 0.5, 0.0, 0.0), [0.0, 0.0, 1.0]);
    let truth = agree(&asked, &rays);
    // Out of a hole, over its surface turned inside out.
    let hit = truth[2].expect("the hole's wall");
    assert_eq!(
        (hit.t, hit.primitive),
        (0.25, (DEEP / 2 + 1) as u32 | TURNED)
    );
    assert_eq!(hit.normal, [0.0, 0.0, -1.0]);
}
