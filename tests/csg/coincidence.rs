//! Surfaces that coincide: in one space exactly, in spaces that were turned away
//! and back as far as these are known. Neither shows a skin.

use super::asked::{Asked, RIGHT, agree, kernels, line, spans};
use super::common::{Random, RayColumns};
use super::programs::Leaf;
use super::truth::{Tree, changes, is_nearest, part_in_box};
use glam::{DAffine3, DQuat, DVec3};
use lanecast::geom::{Cone, Cuboid, Cylinder, Ellipsoid, Sphere};
use lanecast::scene::{Edge, Operand, Operator, SceneBuilder, ShapeId};
use lanecast::trace::HitId;

use Operator::{Difference, Intersection, Union, Xor};

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// How operands come to where they are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Turn {
    /// In the solid's own space.
    None,
    /// By 30° about an axis through the origin, and back.
    Back,
    /// The same about an axis through their centre.
    Pivot,
    /// The same about one that is a million away.
    Far,
    /// Twelve times by 30° about an axis through their centre.
    Round,
}

const TURNS: [Turn; 5] = [Turn::None, Turn::Back, Turn::Pivot, Turn::Far, Turn::Round];

/// An operand about `center`, with an axis of its own.
fn turned(
    scene: &mut SceneBuilder,
    shape: ShapeId,
    (turn, number): (Turn, usize),
    center: DVec3,
) -> ShapeId {
    let angle = f64::to_radians(30.0);
    let by = |angle: f64| {
        let turn = DQuat::from_axis_angle(DVec3::AXES[(number + 1) % 3], angle);
        DAffine3::from_quat(turn)
    };
    let pivot = match turn {
        Turn::Far => center + v(1e6, 1e6, -1e6),
        _ => center,
    };
    let about = |map: DAffine3| {
        DAffine3::from_translation(pivot) * map * DAffine3::from_translation(-pivot)
    };
    let maps = match turn {
        Turn::None => vec![],
        Turn::Back => vec![by(angle), by(-angle)],
        Turn::Pivot | Turn::Far => vec![about(by(angle)), about(by(-angle))],
        Turn::Round => vec![about(by(angle)); 12],
    };
    let place = |shape, map: DAffine3| {
        let transform = scene.transform(map.into());
        let operand = Operand::shape(shape).transform(transform);
        scene.combination("", Union, &[operand])
    };
    maps.into_iter().fold(shape, place)
}

/// An operator over solids about `center`.
fn combined(operator: Operator, leaves: &[Leaf], turn: Turn, center: DVec3) -> Asked {
    Asked::one(|scene| {
        let operands: Vec<Operand> = (0..)
            .zip(leaves)
            .map(|(number, leaf)| {
                let shape = leaf.moved(center).add(scene, 1.0);
                Operand::shape(turned(scene, shape, (turn, number), center))
            })
            .collect();
        scene.combination("", operator, &operands)
    })
}

fn solids() -> [Leaf; 6] {
    let (center, open) = (DVec3::ZERO, false);
    let (base, top) = (v(0.0, -1.0, 0.0), v(0.0, 1.0, 0.0));
    [
        Leaf::Ball(Sphere {
            center,
            radius: 1.0,
        }),
        Leaf::Box(Cuboid {
            min: v(-1.0, -0.5, -0.75),
            max: v(1.0, 0.5, 0.75),
        }),
        Leaf::Cylinder(Cylinder {
            base,
            top,
            radius: 0.75,
            open,
        }),
        Leaf::Cone(Cone {
            base,
            top,
            base_radius: 1.0,
            top_radius: 0.25,
            open,
        }),
        Leaf::Ellipsoid(Ellipsoid {
            center,
            radii: v(1.0, 0.5, 0.75),
        }),
        Leaf::Octahedron(center, 1.0),
    ]
}

/// About `center`: from within and without to anywhere near, and along axes.
fn rays_about(random: &mut Random, center: DVec3, count: usize) -> RayColumns {
    let mut rays = RayColumns::default();
    for i in 0..count {
        let reach = [1.0, 3.0][i % 2];
        let org = random.vector() * reach;
        let dir = match i % 8 {
            0 => DVec3::AXES[random.below(3) as usize] * random.unit().signum(),
            _ => random.vector() - org,
        };
        rays.push(center + org, dir.to_array().map(|x| x as f32));
    }
    rays
}

const OFFSETS: [f64; 4] = [0.0, 1.0, 1e3, 1e6];

fn center(offset: f64) -> DVec3 {
    v(offset, -0.5 * offset, 0.25 * offset)
}

/// Some rays, to be asked of the judge too.
fn some(rays: &RayColumns, every: usize) -> RayColumns {
    let mut some = RayColumns::default();
    for i in (0..rays.len()).step_by(every) {
        let (org, dir) = rays.ray(i);
        some.push(DVec3::from_array(org), dir);
    }
    some
}

#[test]
fn nothing_is_left_of_a_solid_without_itself() {
    for (turn, offset) in TURNS.into_iter().flat_map(|t| OFFSETS.map(|o| (t, o))) {
        for (kind, leaf) in solids().into_iter().enumerate() {
            let center = center(offset);
            let rays = rays_about(&mut Random(kind as u64), center, 2_000);
            for operator in [Difference, Xor] {
                let asked = combined(operator, &[leaf, leaf], turn, center);
                let world = asked.world();
                for arithmetic in RIGHT {
                    let answers = rays.closest(&world, &kernels(arithmetic));
                    let skin = answers.iter().position(|a| a.1 != HitId::NONE);
                    let context = format!("{operator:?} {turn:?} {offset} {leaf:?}");
                    let ray = skin.map(|i| (rays.ray(i), answers[i]));
                    assert_eq!(ray, None, "{arithmetic:?} {context}");
                }
                assert!(agree(&asked, &some(&rays, 50)).iter().all(Option::is_none));
            }
        }
    }
}

#[test]
fn a_solid_with_itself_is_itself() {
    for (turn, offset) in TURNS.into_iter().flat_map(|t| OFFSETS.map(|o| (t, o))) {
        for (kind, leaf) in solids().into_iter().enumerate() {
            let center = center(offset);
            let rays = rays_about(&mut Random(kind as u64), center, 1_000);
            let alone = Asked::one(|scene| leaf.moved(center).add(scene, 1.0));
            for operator in [Intersection, Union] {
                let asked = combined(operator, &[leaf, leaf], turn, center);
                for arithmetic in RIGHT {
                    let kernels = kernels(arithmetic);
                    let expected = rays.closest(&alone.world(), &kernels);
                    let found = rays.closest(&asked.world(), &kernels);
                    for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
                        let context = format!(
                            "{operator:?} {turn:?} {offset} {leaf:?} {arithmetic:?} {:?}: {found:?} {expected:?}",
                            rays.ray(i)
                        );
                        let miss = expected.1 == HitId::NONE;
                        assert_eq!(found.1 == HitId::NONE, miss, "{context}");
                        assert!(miss || (found.0 - expected.0).abs() < 1e-3, "{context}");
                    }
                }
                agree(&asked, &some(&rays, 50));
            }
        }
    }
}

/// A block of side 2 and a hole through it along y, whose ends lie in its faces.
fn block_with(hole: usize) -> [Leaf; 2] {
    let block = Leaf::Box(Cuboid {
        min: v(-1.0, -1.0, -1.0),
        max: v(1.0, 1.0, 1.0),
    });
    let (base, top, open) = (v(0.0, -1.0, 0.0), v(0.0, 1.0, 0.0), false);
    let hole = match hole {
        0 => Leaf::Cylinder(Cylinder {
            base,
            top,
            radius: 0.5,
            open,
        }),
        1 => Leaf::Box(Cuboid {
            min: v(-0.5, -1.0, -0.5),
            max: v(0.5, 1.0, 0.5),
        }),
        _ => Leaf::Cone(Cone {
            base,
            top,
            base_radius: 0.5,
            top_radius: 0.75,
            open,
        }),
    };
    [block, hole]
}

/// Rays before a block with a hole: nothing may be met well within the hole.
fn no_skin(count: usize, seed: u64) {
    let (mut inside, mut through) = (0, 0);
    for (turn, offset) in TURNS.into_iter().flat_map(|t| OFFSETS.map(|o| (t, o))) {
        for hole in 0..3 {
            let center = center(offset);
            let rays = rays_about(&mut Random(seed + hole as u64), center, count);
            let asked = combined(Difference, &block_with(hole), turn, center);
            let world = asked.world();
            for arithmetic in RIGHT {
                let answers = rays.closest(&world, &kernels(arithmetic));
                for (i, (t, id)) in answers.iter().enumerate() {
                    let (org, dir) = rays.ray(i);
                    let (org, dir) = (
                        DVec3::from_array(org),
                        DVec3::from_array(dir.map(f64::from)),
                    );
                    if *id == HitId::NONE {
                        through += 1;
                        continue;
                    }
                    let p = org - center + dir * *t;
                    // Radius 0.5 at least, or that of the square within.
                    let skin = p.x.abs().max(p.z.abs()) < 0.35 - 1e-3;
                    assert!(
                        !skin,
                        "{turn:?} {offset} {hole} {arithmetic:?} {:?}: {t} {id:?} {p}",
                        rays.ray(i)
                    );
                    inside += usize::from(p.x.hypot(p.z) < 0.76 && p.y.abs() < 0.99);
                }
            }
            agree(&asked, &some(&rays, count / 40));
        }
    }
    assert!(inside > 100 && through > 100, "{inside} {through}");
}

#[test]
fn a_hole_whose_ends_lie_in_the_faces_has_no_skin() {
    no_skin(2_100, 11);
}

#[test]
#[ignore = "a million rays of each placement and hole, in minutes"]
fn a_hole_whose_ends_lie_in_the_faces_has_no_skin_for_a_million_rays() {
    no_skin(1_000_000, 12);
}

/// Turned about its own axis a drill is the same drill in another space.
#[test]
fn a_drill_turned_about_its_own_axis_leaves_no_skin() {
    for offset in OFFSETS {
        let center = center(offset);
        let rays = rays_about(&mut Random(5), center, 20_000);
        let [block, drill] = block_with(0);
        let asked = Asked::one(|scene| {
            let block = block.moved(center).add(scene, 1.0);
            let drill = drill.add(scene, 1.0);
            let turn = DQuat::from_rotation_y(f64::to_radians(30.0));
            let map = DAffine3::from_rotation_translation(turn, center);
            let map = scene.transform(map.into());
            let operands = [Operand::shape(block), Operand::shape(drill).transform(map)];
            scene.combination("", Difference, &operands)
        });
        let world = asked.world();
        for arithmetic in RIGHT {
            for (i, (t, id)) in rays
                .closest(&world, &kernels(arithmetic))
                .iter()
                .enumerate()
            {
                let (org, dir) = rays.ray(i);
                let p =
                    DVec3::from_array(org) - center + DVec3::from_array(dir.map(f64::from)) * *t;
                let skin = *id != HitId::NONE && p.x.hypot(p.z) < 0.5 - 1e-3;
                assert!(
                    !skin,
                    "{offset} {arithmetic:?} {:?}: {t} {id:?} {p}",
                    rays.ray(i)
                );
            }
        }
        agree(&asked, &some(&rays, 100));
    }
}

#[test]
fn boxes_that_touch_have_nothing_in_common_and_no_wall_between() {
    let left = Leaf::Box(Cuboid {
        min: v(-1.0, -0.5, -0.5),
        max: v(0.25, 0.5, 0.5),
    });
    let right = Leaf::Box(Cuboid {
        min: v(0.25, -0.5, -0.5),
        max: v(1.0, 0.5, 0.5),
    });
    for (turn, offset) in TURNS.into_iter().flat_map(|t| OFFSETS.map(|o| (t, o))) {
        let center = center(offset);
        let rays = rays_about(&mut Random(21), center, 3_000);
        let both = combined(Intersection, &[left, right], turn, center);
        let union = combined(Union, &[left, right], turn, center);
        let (both_world, union_world) = (both.world(), union.world());
        for arithmetic in RIGHT {
            let kernels = kernels(arithmetic);
            let answers = rays.closest(&both_world, &kernels);
            let skin = answers.iter().position(|a| a.1 != HitId::NONE);
            assert_eq!(
                skin.map(|i| rays.ray(i)),
                None,
                "{turn:?} {offset} {arithmetic:?}"
            );
            for (i, (t, id)) in rays.closest(&union_world, &kernels).iter().enumerate() {
                let (org, dir) = rays.ray(i);
                let p =
                    DVec3::from_array(org) - center + DVec3::from_array(dir.map(f64::from)) * *t;
                let within = p.y.abs().max(p.z.abs()) < 0.5 - 1e-3 && p.x.abs() < 1.0 - 1e-3;
                let wall = *id != HitId::NONE && within;
                assert!(
                    !wall,
                    "{turn:?} {offset} {arithmetic:?} {:?}: {t} {id:?}",
                    rays.ray(i)
                );
            }
        }
        for i in 0..rays.len() {
            let (org, dir) = rays.ray(i);
            let (_, ends) = spans(&union_world, union.combination(), &line(org, dir));
            // Together they are a box.
            assert!(
                ends.len() <= 2,
                "{turn:?} {offset} {:?}: {ends:?}",
                rays.ray(i)
            );
        }
        agree(&both, &some(&rays, 50));
        agree(&union, &some(&rays, 50));
    }
}

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
                    let (inside, found) = spans(&world, asked.combination(), &line);
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

/// A solid with a tolerance ends where one of its operands ends, never before it:
/// the drill's side passes near the block's face there, but not in the block.
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
        let before = scene.cuboid(
            "",
            Cuboid {
                min: v(-1.0, -2.0, -2.0),
                max: v(0.875, 2.0, 2.0),
            },
        );
        let (shape, id) = scene.declare_combination("", Difference);
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
            let (shape, id) = scene.declare_combination("", Difference);
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
        assert_eq!(hits, if skin { 200 } else { 0 }, "{gap} {tolerance}");
    }
}

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
        scene.combination("", Xor, &operands)
    });
    let direct = Asked::one(|scene| {
        let balls = places.map(|(radius, x)| Operand::shape(ball(scene, v(x, 0.0, 0.0), radius)));
        scene.combination("", Xor, &balls)
    });
    let along = line([-5.0, 0.25, 0.0], [1.0, 0.0, 0.0]);
    let ends = |asked: &Asked| -> Vec<(f64, u32)> {
        let (_, ends) = spans(&asked.world(), asked.combination(), &along);
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
            scene.combination("", Difference, &operands)
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
        for arithmetic in RIGHT {
            let answers = rays.closest(&world, &kernels(arithmetic));
            let left = answers.iter().filter(|a| a.1 != HitId::NONE).count();
            assert_eq!(left, 0, "{leaf:?} {arithmetic:?}");
        }
        agree(&asked, &some(&rays, 20));
    }
}
