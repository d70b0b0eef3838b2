//! Boxes of combinations and of what they are made of.

use super::check::{children_first, used_nodes};
use super::csg_solid::{CsgOperand, CsgSolid, Frame, Step, unfolded_counts};
use super::ids::CombinationId;
use super::shapes::Shape;
use super::{Blur, Operand, Tables, Target, shape_bounds};
use crate::csg::Operator;
use crate::geom::HalfSpace;
use crate::geom::hull::of_planes;
use crate::math::{Aabb, Affine};
use glam::DVec3;

/// Where the space of a shape's own numbers begins.
pub(super) fn center(tables: &Tables, shape: Shape) -> DVec3 {
    match shape {
        Shape::Mesh(id) => tables.meshes.center[id.index()],
        _ => DVec3::ZERO,
    }
}

/// The box around an operand, in the space of the combination that it is one of.
pub fn operand_bounds(tables: &Tables, operand: &Operand) -> Option<Aabb> {
    let own = shape_bounds(tables, operand.shape)?;
    let row = operand.transform.index();
    let local = &tables.transforms.local[row];
    match &tables.transforms.inverse[row] {
        Some(inverse) if !local.is_identity() => own.placed(inverse, local),
        _ => Some(own),
    }
}

/// Combinations that are seen nowhere have a box as long as what they unfold into,
/// operators too, is no more than this all together: it is for remarks.
const UNSEEN: u64 = 1 << 16;

/// Boxes of combinations, `None` of those without bounds, and what their operands' spaces
/// blur. Of those that appear, and of others as far as it costs little. `order`: operands
/// first.
pub(super) fn combination_bounds(tables: &Tables, order: &[u32]) -> (Vec<Option<Aabb>>, Vec<Blur>) {
    let count = tables.combinations.len();
    let appears = appearing(tables);
    let counts = unfolded_counts(tables, order, 1, |_| 1);
    let (mut bounds, mut blur) = (vec![None; count], vec![Blur::NONE; count]);
    let mut unseen = 0_u64;
    for row in order {
        let row = *row as usize;
        if !appears[row] {
            unseen = unseen.saturating_add(counts[row]);
        }
        if appears[row] || unseen <= UNSEEN {
            let (solid, steps) = CsgSolid::with_steps(tables, CombinationId(row as u32));
            bounds[row] = around(tables, &solid, &steps);
            let of_frame = |frame: &Frame| {
                Blur::NONE.through(&frame.operand_from_solid, &frame.solid_from_operand)
            };
            let frames = solid.frames.iter().skip(1).map(of_frame);
            blur[row] = frames.fold(Blur::NONE, |most, own| most.max(&own));
        }
    }
    (bounds, blur)
}

/// The combinations that instances lead to, but for those that are only operands.
fn appearing(tables: &Tables) -> Vec<bool> {
    let mut appears = vec![false; tables.combinations.len()];
    let mut mark = |targets: &[Target]| {
        for target in targets {
            if let Target::Shape(shape) = target
                && let Shape::Combination(id) = tables.shapes.row(*shape)
            {
                appears[id.index()] = true;
            }
        }
    };
    mark(&tables.instances.target);
    // The check of cycles comes first.
    let used = used_nodes(tables, &children_first(tables).unwrap_or_default());
    for (rows, _) in (tables.nodes.children.iter().zip(used)).filter(|(_, used)| *used) {
        mark(&tables.edges.target[rows.start as usize..rows.end as usize]);
    }
    appears
}

/// The box around a solid in its own space, as its operands are met: each where its frame
/// has it, with room for all roundings.
fn around(tables: &Tables, solid: &CsgSolid, steps: &[Step]) -> Option<Aabb> {
    let mut operands = solid.operands.iter().rev();
    let mut waiting: Vec<Extent> = Vec::new();
    // Operators come before their operands, so backward operands come first.
    for step in steps.iter().rev() {
        let extent = match step {
            Step::Operand => Extent::of(tables, solid, operands.next()?),
            Step::Operator(operator, count) => {
                let mut all = waiting.split_off(waiting.len() - *count as usize);
                all.reverse();
                Extent::combined(*operator, &all)
            }
        };
        waiting.push(extent);
    }
    waiting.pop()?.inside.bounds
}

/// What holds a set of points.
#[derive(Clone, Debug, Default)]
struct Region {
    bounds: Option<Aabb>,
    /// It lies in all of these; some that it lies in, not necessarily all.
    planes: Vec<HalfSpace>,
}

/// Planes that are looked at together; a box is seldom made of more.
const MAX_PLANES: usize = 24;

/// The condition up to which planes are taken through maps.
const MAX_CONDITION: f64 = 1e3;

impl Region {
    /// All of several regions.
    fn around<'a>(mut all: impl Iterator<Item = &'a Region>) -> Region {
        let of = |b: Aabb, one: &Region| Some(b.union(&one.bounds?));
        Region {
            bounds: all.try_fold(Aabb::EMPTY, of),
            planes: Vec::new(),
        }
    }

    /// What several regions have in common.
    fn common<'a>(all: impl Iterator<Item = &'a Region>) -> Region {
        let mut common = Region::default();
        for one in all {
            common.bounds = match (common.bounds, one.bounds) {
                (Some(a), Some(b)) => Some(overlap(&a, &b)),
                (a, b) => a.or(b),
            };
            let room = MAX_PLANES - common.planes.len();
            common.planes.extend(one.planes.iter().take(room));
        }
        // No fewer planes than four have bounds.
        if common.bounds.is_none() && common.planes.len() >= 4 {
            common.bounds = between(&common.planes);
        }
        common
    }

    /// Of operands of which the inside or the outside has bounds each: what an odd
    /// number of them turn outward has bounds outside.
    fn of_xor(all: &[Extent]) -> (Region, Region) {
        let mut odd = false;
        let mut finite = Vec::new();
        for one in all {
            let turned = one.inside.bounds.is_none() && one.outside.bounds.is_some();
            odd ^= turned;
            finite.push(if turned { &one.outside } else { &one.inside });
        }
        let around = Region::around(finite.into_iter());
        match odd {
            true => (Region::default(), around),
            false => (around, Region::default()),
        }
    }
}

/// The box of what lies in all half-spaces, with room for the roundings of their normals
/// and of the corners; `None` if it has no bounds, or is no solid.
fn between(planes: &[HalfSpace]) -> Option<Aabb> {
    let hull = of_planes(planes).ok()?;
    let bounds = Aabb::of_points(hull.points.iter().copied());
    let size = bounds.max_abs() + bounds.diagonal();
    let grown = bounds.grown(DVec3::splat(size * 1e-6));
    grown.max_abs().is_finite().then_some(grown)
}

/// Where part of a solid lies, in the solid's space.
#[derive(Clone, Debug, Default)]
struct Extent {
    inside: Region,
    /// Of the complement.
    outside: Region,
}

impl Extent {
    fn of(tables: &Tables, solid: &CsgSolid, operand: &CsgOperand) -> Extent {
        let frame = &solid.frames[operand.frame as usize];
        let Shape::HalfSpace(id) = operand.shape else {
            let (bounds, planes) = (operand.bounds, Vec::new());
            return Extent {
                inside: Region { bounds, planes },
                ..Extent::default()
            };
        };
        if !(frame.condition <= MAX_CONDITION) {
            return Extent::default();
        }
        let HalfSpace { normal, offset } = tables.half_spaces.row(id);
        let turned = HalfSpace {
            normal: -normal,
            offset: -offset,
        };
        let region = |own| Region {
            bounds: None,
            planes: vec![plane(&own, &frame.operand_from_solid)],
        };
        Extent {
            inside: region(HalfSpace { normal, offset }),
            outside: region(turned),
        }
    }

    fn combined(operator: Operator, all: &[Extent]) -> Extent {
        let inside = || all.iter().map(|extent| &extent.inside);
        let outside = || all.iter().map(|extent| &extent.outside);
        let (inside, outside) = match operator {
            Operator::Union => (Region::around(inside()), Region::common(outside())),
            Operator::Intersection => (Region::common(inside()), Region::around(outside())),
            Operator::Difference => {
                let minuend = inside().take(1).chain(outside().skip(1));
                let rest = outside().take(1).chain(inside().skip(1));
                (Region::common(minuend), Region::around(rest))
            }
            Operator::Xor => Region::of_xor(all),
            Operator::Complement => (Region::common(outside()), Region::common(inside())),
        };
        Extent { inside, outside }
    }
}

/// A half-space, in a solid's space, from its own: moved outward by what its offset may be
/// rounded, so that sharp corners move as far as they may.
fn plane(own: &HalfSpace, operand_from_solid: &Affine) -> HalfSpace {
    let normal = operand_from_solid.transposed_vector(own.normal.to_array());
    let shift = DVec3::from_array(operand_from_solid.translation);
    let size = own.offset.abs() + own.normal.abs().dot(shift.abs());
    HalfSpace {
        normal: DVec3::from_array(normal),
        offset: own.offset - own.normal.dot(shift) + size * (64.0 * f64::EPSILON),
    }
}

fn overlap(a: &Aabb, b: &Aabb) -> Aabb {
    let both = Aabb {
        min: a.min.max(b.min),
        max: a.max.min(b.max),
    };
    if both.min.cmple(both.max).all() {
        both
    } else {
        // Nothing is there; but a box it must be.
        Aabb::of_points([a.center()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Cuboid, Sphere};
    use crate::scene::{Edge, Scene, SceneBuilder, ShapeId};
    use glam::DAffine3;

    /// The box of what is built.
    fn bounds(build: impl FnOnce(&mut SceneBuilder) -> ShapeId) -> Option<Aabb> {
        let mut scene = SceneBuilder::default();
        let shape = build(&mut scene);
        scene.instance("", Edge::shape(shape));
        let scene: Scene = scene.finish().unwrap();
        shape_bounds(&scene, shape)
    }

    /// It holds a box, and hardly more.
    fn is_about(found: Option<Aabb>, min: [f64; 3], max: [f64; 3]) {
        let found = found.expect("it has bounds");
        let (min, max) = (DVec3::from_array(min), DVec3::from_array(max));
        let near = |a: DVec3, b: DVec3| a.cmple(b).all() && (b - a).max_element() < 1e-4;
        assert!(near(found.min, min) && near(max, found.max), "{found:?}");
    }

    fn walls(scene: &mut SceneBuilder, turn: DAffine3) -> Vec<Operand> {
        let normals = DVec3::AXES.iter().flat_map(|axis| [*axis, -*axis]);
        let transform = scene.transform(turn.into());
        let planes: Vec<ShapeId> = normals
            .map(|normal| {
                let offset = 2.0;
                scene.half_space("", HalfSpace { normal, offset })
            })
            .collect();
        let turned = |id: &ShapeId| Operand::shape(*id).transform(transform);
        planes.iter().map(turned).collect()
    }

    fn cube(scene: &mut SceneBuilder) -> Operand {
        let min = DVec3::splat(-1.0);
        Operand::shape(scene.cuboid("", Cuboid { min, max: -min }))
    }

    fn outside(scene: &mut SceneBuilder, of: Operand) -> Operand {
        Operand::shape(scene.combination("", Operator::Complement, &[of]))
    }

    #[test]
    fn half_spaces_that_close_have_bounds() {
        let found = bounds(|scene| {
            let walls = walls(scene, DAffine3::IDENTITY);
            scene.combination("", Operator::Intersection, &walls)
        });
        is_about(found, [-2.0; 3], [2.0; 3]);
        // Turned about z and moved, in two pieces.
        let found = bounds(|scene| {
            let turn = DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_4);
            let moved = DAffine3::from_translation(DVec3::X * 10.0) * turn;
            let walls = walls(scene, moved);
            let some = scene.combination("", Operator::Intersection, &walls[..3]);
            let all = [&[Operand::shape(some)], &walls[3..]].concat();
            scene.combination("", Operator::Intersection, &all)
        });
        let side = 8.0_f64.sqrt();
        is_about(found, [10.0 - side, -side, -2.0], [10.0 + side, side, 2.0]);
        // What is left of a half-space when others are taken away.
        let found = bounds(|scene| {
            let walls = walls(scene, DAffine3::IDENTITY);
            let others: Vec<Operand> = walls[1..].iter().map(|w| outside(scene, *w)).collect();
            let all = [&walls[..1], &others].concat();
            scene.combination("", Operator::Difference, &all)
        });
        is_about(found, [-2.0; 3], [2.0; 3]);
        // One wall is missing.
        let found = bounds(|scene| {
            let walls = walls(scene, DAffine3::IDENTITY);
            scene.combination("", Operator::Intersection, &walls[1..])
        });
        assert_eq!(found, None);
    }

    /// Shifts that cancel leave their roundings in planes, and not in the frame: x ≤ 2.0009
    /// as it is.
    #[test]
    fn shifts_that_cancel_take_nothing_away() {
        let found = bounds(|scene| {
            let [away, back] = [1e13, -1e13].map(|x| {
                let shift = DAffine3::from_translation(DVec3::X * x);
                scene.transform(shift.into())
            });
            let half = |scene: &mut SceneBuilder, side: f64| {
                let walls: Vec<Operand> = DVec3::AXES
                    .iter()
                    .map(|axis| {
                        let (normal, offset) = (*axis * side, 2.0009);
                        let wall = scene.half_space("", HalfSpace { normal, offset });
                        Operand::shape(wall).transform(away)
                    })
                    .collect();
                let all = scene.combination("", Operator::Intersection, &walls);
                Operand::shape(all).transform(back)
            };
            let halves = [half(scene, 1.0), half(scene, -1.0)];
            scene.combination("", Operator::Intersection, &halves)
        });
        let found = found.expect("it has bounds");
        let corner = DVec3::splat(2.0009);
        assert!(
            found.min.cmple(-corner).all() && corner.cmple(found.max).all(),
            "{found:?}"
        );
    }

    #[test]
    fn complements_are_followed() {
        let found = bounds(|scene| {
            let cube = cube(scene);
            let twice = outside(scene, cube);
            outside(scene, twice).shape
        });
        is_about(found, [-1.0; 3], [1.0; 3]);
        // The complement of a union of complements; and xor of two of them.
        for operator in [Operator::Union, Operator::Xor] {
            let found = bounds(|scene| {
                let a = cube(scene);
                let sphere = Sphere {
                    center: DVec3::X,
                    radius: 1.0,
                };
                let b = Operand::shape(scene.sphere("", sphere));
                let parts = [outside(scene, a), outside(scene, b)];
                let both = Operand::shape(scene.combination("", operator, &parts));
                match operator {
                    Operator::Union => outside(scene, both).shape,
                    _ => both.shape,
                }
            });
            match operator {
                Operator::Union => is_about(found, [0.0, -1.0, -1.0], [1.0; 3]),
                _ => is_about(found, [-1.0; 3], [2.0, 1.0, 1.0]),
            }
        }
        let found = bounds(|scene| {
            let a = cube(scene);
            let b = cube(scene);
            let parts = [a, outside(scene, b)];
            scene.combination("", Operator::Xor, &parts)
        });
        assert_eq!(found, None);
    }
}
