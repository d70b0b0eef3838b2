//! Boxes of combinations and of what they are made of.

use super::csg_solid::ONE_FRAME;
use super::ids::{CombinationId, ShapeId};
use super::shapes::Shape;
use super::{Blur, Operand, Tables, shape_bounds};
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

/// The box around a box under a map, with room for its roundings.
pub(super) fn placed(own: &Aabb, map: &Affine) -> Aabb {
    if own.is_empty() {
        return Aabb::EMPTY;
    }
    let place = |p: DVec3| DVec3::from_array(map.point(p.to_array()));
    let bounds = Aabb::of_points(own.corners().map(place));
    let size = map.norm() * own.max_abs() + bounds.max_abs();
    bounds.grown(DVec3::splat(size * (16.0 * f64::EPSILON)))
}

/// The box around an operand, in the space of the combination that it is one of.
pub(crate) fn operand_bounds(tables: &Tables, operand: &Operand) -> Option<Aabb> {
    let local = &tables.transforms.local[operand.transform.index()];
    match shape_bounds(tables, operand.shape) {
        Some(own) if !local.is_identity() => Some(placed(&own, local)),
        own => own,
    }
}

/// Boxes of all combinations, `None` of those without bounds, and what their operands'
/// spaces blur. `order`: operands first.
pub(super) fn combination_bounds(tables: &Tables, order: &[u32]) -> (Vec<Option<Aabb>>, Vec<Blur>) {
    let table = &tables.combinations;
    let mut extents = vec![Extent::default(); table.len()];
    for row in order {
        let id = CombinationId(*row);
        let of = |operand: &Operand| match tables.shapes.row(operand.shape) {
            Shape::Combination(below) => extents[below.index()].through(tables, operand),
            leaf => Extent::of(tables, operand.shape, leaf).through(tables, operand),
        };
        let all: Vec<Extent> = table.operands(id).iter().map(of).collect();
        let greatest = |of: fn(&Extent) -> f64| all.iter().map(of).fold(0.0, f64::max);
        let (condition, reach) = (greatest(|e| e.condition), greatest(|e| e.reach));
        let spaces = all.iter().fold(Blur::NONE, |most, e| most.max(&e.blur));
        let blur = condition * reach * (64.0 * f64::EPSILON + 4.0 * ONE_FRAME);
        let inside = || all.iter().map(|extent| &extent.inside);
        let outside = || all.iter().map(|extent| &extent.outside);
        let (inside, outside) = match table.operator[id.index()] {
            Operator::Union => (Region::around(inside()), Region::common(outside(), blur)),
            Operator::Intersection => (Region::common(inside(), blur), Region::around(outside())),
            Operator::Difference => {
                let minuend = inside().take(1).chain(outside().skip(1));
                let rest = outside().take(1).chain(inside().skip(1));
                (Region::common(minuend, blur), Region::around(rest))
            }
            Operator::Xor => Region::of_xor(&all),
            Operator::Complement => {
                let turned = Region::common(outside(), blur);
                (turned, Region::common(inside(), blur))
            }
        };
        extents[*row as usize] = Extent {
            inside,
            outside,
            condition,
            reach,
            blur: spaces,
        };
    }
    let rows = extents.iter();
    rows.map(|extent| (extent.inside.bounds, extent.blur))
        .unzip()
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
    fn of_planes(planes: Vec<HalfSpace>) -> Region {
        let bounds = None;
        Region { bounds, planes }
    }

    /// All of several regions.
    fn around<'a>(mut all: impl Iterator<Item = &'a Region>) -> Region {
        let of = |b: Aabb, one: &Region| Some(b.union(&one.bounds?));
        Region {
            bounds: all.try_fold(Aabb::EMPTY, of),
            planes: Vec::new(),
        }
    }

    /// What several regions have in common. `blur`: by how much maps may have moved
    /// planes.
    fn common<'a>(all: impl Iterator<Item = &'a Region>, blur: f64) -> Region {
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
            common.bounds = between(&common.planes, blur);
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

/// The box of what lies in all half-spaces, with room for the roundings of maps that
/// planes came through and of the corners; `None` if it has no bounds, or is no solid.
fn between(planes: &[HalfSpace], blur: f64) -> Option<Aabb> {
    // Moved outward, so that sharp corners move as far as they may.
    let moved = planes.iter().map(|plane| HalfSpace {
        offset: plane.offset + blur * plane.normal.length(),
        ..*plane
    });
    let hull = of_planes(&moved.collect::<Vec<_>>()).ok()?;
    let bounds = Aabb::of_points(hull.points.iter().copied());
    let size = bounds.max_abs() + bounds.diagonal();
    let grown = bounds.grown(DVec3::splat(size * 1e-6 + blur));
    grown.max_abs().is_finite().then_some(grown)
}

/// Where a combination lies, and how the maps below it blur that: as of frames.
#[derive(Clone, Debug)]
struct Extent {
    inside: Region,
    /// Of the complement.
    outside: Region,
    condition: f64,
    reach: f64,
    blur: Blur,
}

impl Default for Extent {
    fn default() -> Extent {
        Extent {
            inside: Region::default(),
            outside: Region::default(),
            condition: 1.0,
            reach: 0.0,
            blur: Blur::NONE,
        }
    }
}

impl Extent {
    fn of(tables: &Tables, shape: ShapeId, leaf: Shape) -> Extent {
        if let Shape::HalfSpace(id) = leaf {
            let HalfSpace { normal, offset } = tables.half_spaces.row(id);
            let turned = HalfSpace {
                normal: -normal,
                offset: -offset,
            };
            return Extent {
                inside: Region::of_planes(vec![HalfSpace { normal, offset }]),
                outside: Region::of_planes(vec![turned]),
                ..Extent::default()
            };
        }
        let bounds = shape_bounds(tables, shape);
        let reach = center(tables, leaf).abs().max_element();
        // Rays are counted from a mesh's centre, and rounded.
        let room = |b: Aabb| b.grown(DVec3::splat(reach * (16.0 * f64::EPSILON)));
        let inside = Region {
            bounds: bounds.map(|b| if reach > 0.0 { room(b) } else { b }),
            planes: Vec::new(),
        };
        Extent {
            inside,
            reach,
            ..Extent::default()
        }
    }

    /// With room for the roundings of rays that are met below.
    fn through(&self, tables: &Tables, operand: &Operand) -> Extent {
        let row = operand.transform.index();
        let (local, inverse) = (
            &tables.transforms.local[row],
            &tables.transforms.inverse[row],
        );
        let Some(inverse) = inverse.filter(|_| !local.is_identity()) else {
            return self.clone();
        };
        let shift = DVec3::from_array(local.translation).abs().max_element();
        let condition = self.condition * local.norm() * inverse.norm();
        let reach = shift + local.norm() * self.reach;
        let moved = |region: &Region| Region {
            bounds: region.bounds.map(|own| {
                let bounds = placed(&own, local);
                let size = bounds.max_abs() + reach;
                // An operand is met in the first frame that is equal to its own.
                let room = size * condition * (16.0 * f64::EPSILON + 4.0 * ONE_FRAME);
                bounds.grown(DVec3::splat(room))
            }),
            planes: match condition <= MAX_CONDITION {
                true => region
                    .planes
                    .iter()
                    .map(|p| plane(p, local, &inverse))
                    .collect(),
                false => Vec::new(),
            },
        };
        Extent {
            inside: moved(&self.inside),
            outside: moved(&self.outside),
            condition,
            reach,
            blur: self.blur.through(&inverse, local),
        }
    }
}

/// A half-space under a map.
fn plane(own: &HalfSpace, map: &Affine, inverse: &Affine) -> HalfSpace {
    let normal = DVec3::from_array(inverse.transposed_vector(own.normal.to_array()));
    HalfSpace {
        normal,
        offset: own.offset + normal.dot(DVec3::from_array(map.translation)),
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
    use crate::scene::{Edge, Scene, SceneBuilder};
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
