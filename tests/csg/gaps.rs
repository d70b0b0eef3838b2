//! Gaps and overlaps: of units in the last place, met exactly; narrower than the tolerance of
//! a CSG solid, closed.

use super::asked::{Asked, agree, line, spans};
use super::coincidence::{block_with, v};
use super::truth::{Tree, changes, is_nearest, part_in_box};
use crate::common::{Random, RayColumns, kernels};
use glam::{DAffine3, DVec3};
use lanecast::internals::geom::{Cuboid, Cylinder, HalfSpace, Sphere};
use lanecast::internals::plan::Precision;
use lanecast::internals::scene::{Edge, Operand, Operator};
use lanecast::internals::trace::HitId;

use Operator::{Difference, Intersection, Union, Xor};

/// x, some units in the last place on.
fn steps(x: f64, ulps: i32) -> f64 {
    let next = |x: f64, _| if ulps > 0 { x.next_up() } else { x.next_down() };
    (0..ulps.abs()).fold(x, next)
}

/// Gaps and overlaps of a few units in the last place are what they are, in one
/// space: as rational arithmetic says.
#[test]
fn gaps_and_overlaps_of_units_in_the_last_place_are_exact() {
    let random = &mut Random(31);
    for position in [2.0_f64.powi(-20), 1.0, 1e3, 1e6] {
        for ulps in -8..=8 {
            let (wall, other) = (position, steps(position, ulps));
            let side = position * 0.75;
            let boxes = [
                Cuboid {
                    min: v(position * 0.5, -side, -side),
                    max: v(wall, side, side),
                },
                Cuboid {
                    min: v(other, -side, -side * 0.5),
                    max: v(position * 1.75, side, side),
                },
            ];
            let mut rays = RayColumns::default();
            let y = |random: &mut Random| position * random.unit() * 0.7;
            for i in 0..24 {
                let (org, dir) = match i % 4 {
                    0 => (v(0.0, y(random), y(random)), DVec3::X),
                    1 => (v(position * 2.0, y(random), y(random)), -DVec3::X),
                    // Within the gap, along it.
                    2 => {
                        let x = steps(wall, ulps.signum() * (i % 3));
                        (v(x, -2.0 * position, y(random)), DVec3::Y)
                    }
                    _ => {
                        let org = random.vector() * position * 2.0;
                        let to = v(wall, y(random), y(random));
                        (org, (to - org) / position)
                    }
                };
                rays.push(org, dir.to_array().map(|x| x as f32));
            }
            for (operator, swapped) in [Union, Intersection, Difference, Xor]
                .into_iter()
                .flat_map(|operator| [(operator, false), (operator, true)])
            {
                let mut boxes = boxes;
                if swapped {
                    boxes.reverse();
                }
                let tree = Tree::of(operator, [Tree::Operand(0), Tree::Operand(1)]);
                let asked = Asked::new(|scene| {
                    let shapes = boxes.map(|row| scene.cuboid("", row));
                    let solid = tree.shape(scene, &shapes);
                    scene.instance("", Edge::shape(solid));
                });
                agree(&asked, &rays);
                let world = asked.world();
                for i in 0..rays.len() {
                    let (org, dir) = rays.ray(i);
                    let line = line(org, dir);
                    let parts = boxes.map(|row| part_in_box(line.org, line.dir, &row));
                    let (start, truth) = changes(&tree, &parts);
                    let (inside, found) = spans(&world, asked.csg(), &line);
                    let context =
                        format!("{position} {ulps} {operator:?} {swapped} {line:?}: {found:?}");
                    assert_eq!((inside, found.len()), (start, truth.len()), "{context}");
                    for (found, truth) in found.iter().zip(&truth) {
                        assert!(is_nearest(found.root.rounded(), &truth.t), "{context}");
                        assert_eq!(found.enters, truth.enters, "{context}");
                    }
                }
            }
        }
    }
}

/// A solid with a tolerance begins where it does without, or not at all: what is
/// taken away ends in front of the block.
#[test]
fn a_tolerance_adds_nothing_in_front_of_a_solid() {
    let asked = Asked::new(|scene| {
        let block = scene.cuboid(
            "",
            Cuboid {
                min: v(1.0, -1.0, -1.0),
                max: v(2.0, 1.0, 1.0),
            },
        );
        let (normal, offset) = (DVec3::X, 0.875);
        let before = scene.half_space("", HalfSpace { normal, offset });
        let (shape, id) = scene.declare_csg("", Difference);
        scene.set_operands(id, &[block, before].map(Operand::shape));
        scene.set_tolerance(id, 0.25);
        scene.instance("", Edge::shape(shape));
    });
    let mut rays = RayColumns::default();
    rays.push(v(-2.0, 0.0, 0.0), [1.0, 0.0, 0.0]);
    rays.push(v(-2.0, 0.0, 0.0), [1.0, 0.125, 0.0]);
    rays.push(v(4.0, 0.0, 0.0), [-1.0, 0.0, 0.0]);
    let truth = agree(&asked, &rays);
    let t: Vec<Option<f64>> = truth.iter().map(|hit| hit.map(|hit| hit.t)).collect();
    assert_eq!(t, [Some(3.0), Some(3.0), Some(2.0)]);
}

/// The drill ends short of the face, or beyond it, by less than the tolerance: no
/// skin; by more: there is one.
#[test]
fn gaps_within_the_tolerance_are_closed() {
    for (gap, tolerance, skin) in [
        (1e-3, 0.0, true),
        (1e-3, 2e-3, false),
        (-1e-3, 2e-3, false),
        (1e-2, 2e-3, true),
    ] {
        let asked = Asked::new(|scene| {
            let [block, _] = block_with(0);
            let block = block.add(scene, 1.0);
            let drill = scene.cylinder(
                "",
                Cylinder {
                    base: v(0.0, -1.0 + gap, 0.0),
                    top: v(0.0, 1.0 - gap, 0.0),
                    radius: 0.5,
                    open: false,
                },
            );
            let (shape, id) = scene.declare_csg("", Difference);
            scene.set_operands(id, &[block, drill].map(Operand::shape));
            scene.set_tolerance(id, tolerance);
            scene.instance("", Edge::shape(shape));
        });
        let mut rays = RayColumns::default();
        let random = &mut Random(9);
        for _ in 0..200 {
            let org = v(random.unit() * 0.3, 4.0, random.unit() * 0.3);
            rays.push(org, [0.02, -1.0, -0.01]);
        }
        let hits = agree(&asked, &rays).iter().flatten().count();
        let expected = if skin { 200 } else { 0 };
        assert_eq!(hits, expected, "{gap} {tolerance}");
        let fast = rays.closest(&asked.world(), &kernels(Precision::Fast));
        let hits = fast.iter().filter(|a| a.1 != HitId::NONE).count();
        assert_eq!(hits, expected, "{gap} {tolerance}");
    }
}

/// A tolerance is one between operands: a plate that is thinner is met all the same,
/// and so is one of another frame.
#[test]
fn plates_thinner_than_the_tolerance_are_met() {
    for turn in [DAffine3::IDENTITY, DAffine3::from_rotation_x(0.25)] {
        let asked = Asked::new(|scene| {
            let min = v(-1.0, -0.0625, -1.0);
            let plate = scene.cuboid("", Cuboid { min, max: -min });
            let far = Sphere {
                center: v(0.0, 8.0, 0.0),
                radius: 1.0,
            };
            let far = scene.sphere("", far);
            let transform = scene.transform(turn.into());
            let (shape, id) = scene.declare_csg("", Union);
            let plate = Operand::shape(plate).transform(transform);
            scene.set_operands(id, &[plate, Operand::shape(far)]);
            scene.set_tolerance(id, 0.25);
            scene.instance("", Edge::shape(shape));
        });
        let mut rays = RayColumns::default();
        let random = &mut Random(3);
        for _ in 0..50 {
            let org = v(random.unit() * 0.3, 4.0, random.unit() * 0.3);
            rays.push(org, [0.02, -1.0, -0.01]);
        }
        assert_eq!(agree(&asked, &rays).iter().flatten().count(), 50);
    }
}
