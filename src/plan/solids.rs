//! What a user of combinations may want to know before tracing them: operands that
//! change nothing, solids that are empty, faces that coincide.
//!
//! By bounds and by numbers that are equal; no ray is traced. What is said is so.
//! What is not said may be so as well: solids whose boxes overlap need not.

use crate::math::Aabb;
use crate::scene::{
    CombinationId, CsgOperand, CsgSolid, Face, Operator, Shape, ShapeId, Tables, faces_of,
    operand_bounds, shape_bounds,
};
use glam::DVec3;
use std::collections::BTreeMap;

/// Lines about a combination that appears, at most one of each kind.
pub fn remarks(tables: &Tables, shape: ShapeId, solid: &CsgSolid) -> Vec<String> {
    let name = label(tables, shape);
    if let Some(empty) = empty_within(tables, shape) {
        let empty = label(tables, empty);
        let what = if empty == name {
            format!("{name} is empty")
        } else {
            format!("{empty}, a part of {name}, is empty")
        };
        return vec![format!("{what}: the bounds of its operands do not overlap")];
    }
    let lines = [
        idle(tables, shape, solid),
        coplanar(tables, solid),
        faceted(tables, solid),
    ];
    let lines = lines.into_iter().flatten();
    lines.map(|line| format!("{name}: {line}")).collect()
}

/// A line about a polynomial surface that is placed as it is and reaches anywhere.
pub fn unbounded(tables: &Tables, shape: ShapeId) -> Option<String> {
    let Shape::Implicit(id) = tables.shapes.row(shape) else {
        return None;
    };
    match tables.implicits.row(id).bounds {
        Some(_) => None,
        None => {
            let name = label(tables, shape);
            Some(format!(
                "{name} has no bounds, and every ray is tried on it: give it a clip"
            ))
        }
    }
}

fn label(tables: &Tables, shape: ShapeId) -> String {
    let kind = tables.shapes.row(shape).kind_name();
    match tables.shapes.names.get(shape.0) {
        Some(name) => format!("'{name}'"),
        None => format!("{kind} (shape {})", shape.0),
    }
}

/// An intersection, the shape itself or what it is made of, whose operands' boxes
/// do not overlap.
fn empty_within(tables: &Tables, shape: ShapeId) -> Option<ShapeId> {
    let mut seen = vec![false; tables.combinations.len()];
    let mut waiting = vec![shape];
    while let Some(shape) = waiting.pop() {
        let Shape::Combination(id) = tables.shapes.row(shape) else {
            continue;
        };
        if std::mem::replace(&mut seen[id.index()], true) {
            continue;
        }
        if is_empty(tables, id) {
            return Some(shape);
        }
        let operands = tables.combinations.operands(id);
        waiting.extend(operands.iter().rev().map(|operand| operand.shape));
    }
    None
}

fn is_empty(tables: &Tables, id: CombinationId) -> bool {
    if tables.combinations.operator[id.index()] != Operator::Intersection {
        return false;
    }
    let operands = tables.combinations.operands(id).iter();
    let boxes = operands.filter_map(|operand| operand_bounds(tables, operand));
    let (mut min, mut max) = (DVec3::NEG_INFINITY, DVec3::INFINITY);
    for bounds in boxes {
        min = min.max(bounds.min);
        max = max.min(bounds.max);
    }
    min.cmpgt(max).any()
}

/// Meshes among the operands: what they cost.
fn faceted(tables: &Tables, solid: &CsgSolid) -> Option<String> {
    let of = |operand: &CsgOperand| match operand.shape {
        Shape::Mesh(id) => Some(tables.meshes.triangles_of[id.index()].len()),
        _ => None,
    };
    let triangles: Vec<usize> = solid.operands.iter().filter_map(of).collect();
    let count: usize = triangles.iter().sum();
    Some(match triangles.len() {
        0 => return None,
        1 => format!("an operand is a mesh of {count} triangles; rays in its box go one by one"),
        n => {
            format!("{n} operands are meshes, {count} triangles; rays in their boxes go one by one")
        }
    })
}

fn overlap(a: &Aabb, b: &Aabb) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
}

/// Operands that lie apart from all of the solid: without them it is the same.
fn idle(tables: &Tables, shape: ShapeId, solid: &CsgSolid) -> Option<String> {
    let all = shape_bounds(tables, shape)?;
    let apart = |operand: &&CsgOperand| operand.bounds.is_some_and(|b| !overlap(&b, &all));
    let mut idle = solid.operands.iter().filter(apart);
    let first = label(tables, idle.next()?.id);
    Some(match idle.count() {
        0 => format!("the operand {first} never matters: it lies apart from the solid"),
        others => {
            let count = others + 1;
            format!("{count} operands never matter: they lie apart from the solid, such as {first}")
        }
    })
}

/// Faces of different operands in one frame, across an axis, in the same plane,
/// where their bounds meet.
fn coplanar(tables: &Tables, solid: &CsgSolid) -> Option<String> {
    // By frame, axis and the plane's number.
    let mut planes: BTreeMap<(u32, usize, u64), Vec<u32>> = BTreeMap::new();
    for (number, operand) in (0..).zip(&solid.operands) {
        for (axis, at) in faces(tables, operand.shape) {
            // Zero has two signs.
            let key = (operand.frame, axis, (at + 0.0).to_bits());
            let of_plane = planes.entry(key).or_default();
            if of_plane.last() != Some(&number) {
                of_plane.push(number);
            }
        }
    }
    let size = |number: u32| {
        let bounds = solid.operands[number as usize].bounds;
        bounds.map_or(f64::INFINITY, |b| b.diagonal())
    };
    // With the largest of each plane: linear, and what people ask about.
    let mut found: Option<(u32, u32, usize, f64)> = None;
    let mut count = 0;
    for ((_, axis, at), numbers) in &planes {
        let largest = numbers
            .iter()
            .copied()
            .reduce(|a, b| if size(b) > size(a) { b } else { a });
        let largest = largest.filter(|_| numbers.len() > 1);
        for (a, b) in largest
            .iter()
            .flat_map(|a| numbers.iter().map(move |b| (*a, *b)))
        {
            let bounds = [a, b].map(|n| solid.operands[n as usize].bounds);
            let apart = matches!(bounds, [Some(a), Some(b)] if !overlap(&a, &b));
            if a == b || apart {
                continue;
            }
            count += 1;
            let pair = (a.min(b), a.max(b), *axis, f64::from_bits(*at));
            if found.is_none_or(|best| (pair.0, pair.1, pair.2) < (best.0, best.1, best.2)) {
                found = Some(pair);
            }
        }
    }
    let (a, b, axis, at) = found?;
    let [a, b] = [a, b].map(|n| label(tables, solid.operands[n as usize].id));
    let axis = ["x", "y", "z"][axis];
    let plane = format!("{axis} = {at} in their own space");
    Some(match count {
        1 => format!("{a} and {b} have faces in one plane, {plane}; they count as one boundary"),
        _ => format!(
            "{count} pairs of operands have faces in one plane, such as {a} and {b} ({plane}); \
             each counts as one boundary"
        ),
    })
}

/// Planes across an axis that bound a primitive: the axis and the coordinate.
fn faces(tables: &Tables, shape: Shape) -> impl Iterator<Item = (usize, f64)> {
    let across = |face| match face {
        Face::Across { axis, at } => Some((axis, at)),
        _ => None,
    };
    faces_of(tables, shape)
        .into_iter()
        .flatten()
        .filter_map(across)
}
