//! Boxes of combinations and of what they are made of.

use super::ids::{CombinationId, ShapeId};
use super::shapes::Shape;
use super::{Operand, Tables, shape_bounds};
use crate::csg::Operator;
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

/// Boxes of all combinations; `None` of those without bounds. `order`: operands
/// first.
pub(super) fn combination_bounds(tables: &Tables, order: &[u32]) -> Vec<Option<Aabb>> {
    let table = &tables.combinations;
    let mut extents = vec![Extent::default(); table.len()];
    for row in order {
        let id = CombinationId(*row);
        let of = |operand: &Operand| match tables.shapes.row(operand.shape) {
            Shape::Combination(below) => extents[below.index()].through(tables, operand),
            leaf => Extent::of(tables, operand.shape, leaf).through(tables, operand),
        };
        let all: Vec<Extent> = table.operands(id).iter().map(of).collect();
        let mut boxes = all.iter().map(|extent| extent.bounds);
        let bounds = match table.operator[id.index()] {
            Operator::Union | Operator::Xor => {
                boxes.try_fold(Aabb::EMPTY, |b, one| Some(b.union(&one?)))
            }
            Operator::Difference => boxes.next().flatten(),
            Operator::Intersection => boxes.flatten().reduce(|a, b| overlap(&a, &b)),
            Operator::Complement => None,
        };
        let greatest = |of: fn(&Extent) -> f64| all.iter().map(of).fold(0.0, f64::max);
        extents[*row as usize] = Extent {
            bounds,
            condition: greatest(|extent| extent.condition),
            reach: greatest(|extent| extent.reach),
        };
    }
    extents.iter().map(|extent| extent.bounds).collect()
}

/// Where a combination lies, and how the maps below it blur that: as of frames.
#[derive(Clone, Copy, Debug)]
struct Extent {
    bounds: Option<Aabb>,
    condition: f64,
    reach: f64,
}

impl Default for Extent {
    fn default() -> Extent {
        Extent {
            bounds: None,
            condition: 1.0,
            reach: 0.0,
        }
    }
}

impl Extent {
    fn of(tables: &Tables, shape: ShapeId, leaf: Shape) -> Extent {
        let bounds = shape_bounds(tables, shape);
        let reach = center(tables, leaf).abs().max_element();
        // Rays are counted from a mesh's centre, and rounded.
        let room = |b: Aabb| b.grown(DVec3::splat(reach * (16.0 * f64::EPSILON)));
        Extent {
            bounds: bounds.map(|b| if reach > 0.0 { room(b) } else { b }),
            reach,
            ..Extent::default()
        }
    }

    /// With room for the roundings of rays that are met below.
    fn through(self, tables: &Tables, operand: &Operand) -> Extent {
        let row = operand.transform.index();
        let (local, inverse) = (
            &tables.transforms.local[row],
            &tables.transforms.inverse[row],
        );
        let Some(inverse) = inverse.filter(|_| !local.is_identity()) else {
            return self;
        };
        let shift = DVec3::from_array(local.translation).abs().max_element();
        let condition = self.condition * local.norm() * inverse.norm();
        let reach = shift + local.norm() * self.reach;
        let bounds = self.bounds.map(|own| {
            let bounds = placed(&own, local);
            let size = bounds.max_abs() + reach;
            bounds.grown(DVec3::splat(size * condition * (16.0 * f64::EPSILON)))
        });
        Extent {
            bounds,
            condition,
            reach,
        }
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
