//! Boxes of CSG solids and of their operands.

use super::conditioning::Conditioning;
use super::csg_solid::{CsgOperand, CsgSolid, Frame, Step, unfolded_counts};
use super::graph_order::{children_first, used_nodes};
use super::ids::CsgId;
use super::primitives::shape_bounds;
use super::shapes::Shape;
use super::{Operand, Tables, Target};
use crate::csg::Operator;
use crate::geom::HalfSpace;
use crate::geom::hull::of_planes;
use crate::math::{Aabb, Affine};
use glam::DVec3;

/// Returns the box around an operand, in the space of the CSG solid that it belongs to.
pub fn operand_bounds(tables: &Tables, operand: &Operand) -> Option<Aabb> {
    let own = shape_bounds(tables, operand.shape)?;
    let row = operand.transform.index();
    let local = &tables.transforms.local[row];
    match &tables.transforms.inverse[row] {
        Some(inverse) if !local.is_identity() => own.placed(inverse, local),
        _ => Some(own),
    }
}

/// CSG solids that no instance places have a box only while they unfold into no more
/// operands and operators than this, all together. Only lints use these boxes.
const UNSEEN: u64 = 1 << 16;

/// Returns the boxes of CSG solids, `None` for those without bounds, and the conditioning
/// of their operands' spaces. Solids that instances place have them, and others as far as
/// `UNSEEN` allows. `order` lists operands first.
pub(super) fn csg_bounds_of(
    tables: &Tables,
    order: &[u32],
) -> (Vec<Option<Aabb>>, Vec<Conditioning>) {
    let count = tables.csg.len();
    let appears = appearing(tables);
    let counts = unfolded_counts(tables, order, 1, |_| 1);
    let (mut bounds, mut conditioning) = (vec![None; count], vec![Conditioning::NONE; count]);
    let mut unseen = 0_u64;
    for row in order {
        let row = *row as usize;
        if !appears[row] {
            unseen = unseen.saturating_add(counts[row]);
        }
        if appears[row] || unseen <= UNSEEN {
            let (solid, steps) = CsgSolid::with_steps(tables, CsgId(row as u32));
            bounds[row] = around(tables, &solid, &steps);
            let of_frame = |frame: &Frame| {
                Conditioning::NONE.through(&frame.operand_from_solid, &frame.solid_from_operand)
            };
            let frames = solid.frames.iter().skip(1).map(of_frame);
            conditioning[row] = frames.fold(Conditioning::NONE, |most, own| most.max(&own));
        }
    }
    (bounds, conditioning)
}

/// Marks the CSG solids that instances place, and not those that are only operands.
fn appearing(tables: &Tables) -> Vec<bool> {
    let mut appears = vec![false; tables.csg.len()];
    let mut mark = |targets: &[Target]| {
        for target in targets {
            if let Target::Shape(shape) = target
                && let Shape::Csg(id) = tables.shapes.row(*shape)
            {
                appears[id.index()] = true;
            }
        }
    };
    mark(&tables.roots.target);
    // The check of cycles has come first.
    let used = used_nodes(tables, &children_first(tables).unwrap_or_default());
    for (rows, _) in (tables.nodes.children.iter().zip(used)).filter(|(_, used)| *used) {
        mark(&tables.edges.target[rows.start as usize..rows.end as usize]);
    }
    appears
}

/// Returns the box around a solid in its own space. Each operand is boxed where its frame
/// places it, with room for all roundings (docs/numerics/csg.md, K12).
fn around(tables: &Tables, solid: &CsgSolid, steps: &[Step]) -> Option<Aabb> {
    let mut operands = solid.operands.iter().rev();
    let mut waiting: Vec<Extent> = Vec::new();
    // Operators come before their operands, so in reverse order the operands come first.
    for step in steps.iter().rev() {
        let extent = match step {
            Step::Operand => Extent::of(tables, solid, operands.next()?),
            Step::Operator(operator, count) => {
                let mut all = waiting.split_off(waiting.len() - *count as usize);
                all.reverse();
                Extent::csg(*operator, &all)
            }
        };
        waiting.push(extent);
    }
    waiting.pop()?.inside.bounds
}

/// A conservative description of a set of points.
#[derive(Clone, Debug, Default)]
struct Region {
    bounds: Option<Aabb>,
    /// Half-spaces that contain the set, not necessarily all of them.
    planes: Vec<HalfSpace>,
}

/// The most planes that are intersected together; boxes seldom consist of more.
const MAX_PLANES: usize = 24;

/// The largest condition of a map that planes are taken through.
const MAX_CONDITION: f64 = 1e3;

impl Region {
    /// Returns a region that contains all of several regions.
    fn around<'a>(mut all: impl Iterator<Item = &'a Region>) -> Region {
        let of = |b: Aabb, one: &Region| Some(b.union(&one.bounds?));
        Region {
            bounds: all.try_fold(Aabb::EMPTY, of),
            planes: Vec::new(),
        }
    }

    /// Returns a region that contains the intersection of several regions.
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
        common.bounds = match common.bounds {
            Some(bounds) => Some(cut(&bounds, &common.planes)),
            // Fewer than four planes bound nothing.
            None if common.planes.len() < 4 => None,
            None => between(&common.planes),
        };
        common
    }

    /// Returns the inside and the outside of an xor of operands each of which is bounded
    /// inside or outside. If an odd number of them are bounded outside, so is the xor.
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

/// Returns a box around what half-spaces leave of a box, with the room of [`between`]. Along each
/// axis a plane ends where the other coordinates leave most.
fn cut(bounds: &Aabb, planes: &[HalfSpace]) -> Aabb {
    let room = (bounds.max_abs() + bounds.diagonal()) * 1e-6;
    let mut left = *bounds;
    for HalfSpace { normal, offset } in planes {
        let least = (*normal * left.min).min(*normal * left.max);
        for axis in 0..3 {
            let others = least.element_sum() - least[axis];
            let end = (offset - others) / normal[axis];
            if normal[axis] > 0.0 && end.is_finite() {
                left.max[axis] = left.max[axis].min(end + room);
            } else if normal[axis] < 0.0 && end.is_finite() {
                left.min[axis] = left.min[axis].max(end - room);
            }
        }
    }
    overlap(bounds, &left)
}

/// Returns the box of the intersection of half-spaces, with room for the roundings of their
/// normals and of the corners; `None` if it is unbounded or not a solid.
fn between(planes: &[HalfSpace]) -> Option<Aabb> {
    let hull = of_planes(planes).ok()?;
    let bounds = Aabb::of_points(hull.points.iter().copied());
    let size = bounds.max_abs() + bounds.diagonal();
    let grown = bounds.grown(DVec3::splat(size * 1e-6));
    grown.max_abs().is_finite().then_some(grown)
}

/// Regions around the inside and the outside of a part of a solid, in the solid's space.
#[derive(Clone, Debug, Default)]
struct Extent {
    inside: Region,
    /// A region around the complement.
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

    fn csg(operator: Operator, all: &[Extent]) -> Extent {
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

/// Maps a half-space from its own space to a solid's. The plane moves outward by 64
/// roundings 2⁻⁵² of its offset, so that sharp corners move by as much as they may (K12).
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
        // An empty intersection still needs a box.
        Aabb::of_points([a.center()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Cuboid, Sphere};
    use crate::scene::{Edge, Scene, SceneBuilder, ShapeId};
    use glam::DAffine3;

    /// Returns the box of the shape that `build` builds.
    fn bounds(build: impl FnOnce(&mut SceneBuilder) -> ShapeId) -> Option<Aabb> {
        let mut scene = SceneBuilder::default();
        let shape = build(&mut scene);
        scene.instance("", Edge::shape(shape));
        let scene: Scene = scene.finish().unwrap();
        shape_bounds(&scene, shape)
    }

    /// Asserts that a box contains the given box and is hardly larger.
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
        Operand::shape(scene.csg("", Operator::Complement, &[of]))
    }

    #[test]
    fn half_spaces_that_close_have_bounds() {
        let found = bounds(|scene| {
            let walls = walls(scene, DAffine3::IDENTITY);
            scene.csg("", Operator::Intersection, &walls)
        });
        is_about(found, [-2.0; 3], [2.0; 3]);
        // A shape in two pieces, rotated about z and moved.
        let found = bounds(|scene| {
            let turn = DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_4);
            let moved = DAffine3::from_translation(DVec3::X * 10.0) * turn;
            let walls = walls(scene, moved);
            let some = scene.csg("", Operator::Intersection, &walls[..3]);
            let all = [&[Operand::shape(some)], &walls[3..]].concat();
            scene.csg("", Operator::Intersection, &all)
        });
        let side = 8.0_f64.sqrt();
        is_about(found, [10.0 - side, -side, -2.0], [10.0 + side, side, 2.0]);
        // The rest of a half-space when others are subtracted.
        let found = bounds(|scene| {
            let walls = walls(scene, DAffine3::IDENTITY);
            let others: Vec<Operand> = walls[1..].iter().map(|w| outside(scene, *w)).collect();
            let all = [&walls[..1], &others].concat();
            scene.csg("", Operator::Difference, &all)
        });
        is_about(found, [-2.0; 3], [2.0; 3]);
        // A shape with one wall missing.
        let found = bounds(|scene| {
            let walls = walls(scene, DAffine3::IDENTITY);
            scene.csg("", Operator::Intersection, &walls[1..])
        });
        assert_eq!(found, None);
    }

    /// A plane cuts a box along every axis that it slopes to.
    #[test]
    fn half_spaces_cut_boxes() {
        let cut_by = |normal: DVec3, offset: f64| {
            bounds(|scene| {
                let wall = scene.half_space("", HalfSpace { normal, offset });
                let all = [cube(scene), Operand::shape(wall)];
                scene.csg("", Operator::Intersection, &all)
            })
        };
        is_about(cut_by(DVec3::X, 0.25), [-1.0; 3], [0.25, 1.0, 1.0]);
        is_about(cut_by(-DVec3::Z, 0.5), [-1.0, -1.0, -0.5], [1.0; 3]);
        is_about(cut_by(DVec3::ONE, -1.5), [-1.0; 3], [0.5; 3]);
        is_about(cut_by(DVec3::ONE, 5.0), [-1.0; 3], [1.0; 3]);
        // What is cut off whole still has a box.
        let nothing = cut_by(DVec3::X, -3.0).unwrap();
        assert!(
            nothing.is_finite() && nothing.diagonal() < 1e-3,
            "{nothing:?}"
        );
        // A difference cuts by the other side.
        let found = bounds(|scene| {
            let wall = scene.half_space(
                "",
                HalfSpace {
                    normal: DVec3::Y,
                    offset: 0.0,
                },
            );
            let all = [cube(scene), Operand::shape(wall)];
            scene.csg("", Operator::Difference, &all)
        });
        is_about(found, [-1.0, 0.0, -1.0], [1.0; 3]);
    }

    /// Shifts that cancel leave their roundings in planes, but not in the frame: x ≤ 2.0009
    /// is as it is written.
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
                let all = scene.csg("", Operator::Intersection, &walls);
                Operand::shape(all).transform(back)
            };
            let halves = [half(scene, 1.0), half(scene, -1.0)];
            scene.csg("", Operator::Intersection, &halves)
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
        // The complement of a union of complements; and the xor of two complements.
        for operator in [Operator::Union, Operator::Xor] {
            let found = bounds(|scene| {
                let a = cube(scene);
                let sphere = Sphere {
                    center: DVec3::X,
                    radius: 1.0,
                };
                let b = Operand::shape(scene.sphere("", sphere));
                let parts = [outside(scene, a), outside(scene, b)];
                let both = Operand::shape(scene.csg("", operator, &parts));
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
            scene.csg("", Operator::Xor, &parts)
        });
        assert_eq!(found, None);
    }
}
