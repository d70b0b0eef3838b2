//! Lints of CSG solids and costly shapes: operands that change nothing, empty solids,
//! coincident faces.
//!
//! The lints look at bounds, logic and equal numbers, and trace no ray. What they report is
//! true. They may miss cases: two solids whose boxes overlap need not overlap themselves.

use super::coplanar::coplanar;
use super::logic::{Logic, logic};
use crate::geom::implicit::torus::radii_of;
use crate::math::Aabb;
use crate::roots::Solver;
use crate::scene::{
    CsgId, CsgOperand, CsgSolid, Operator, Shape, ShapeId, Tables, operand_bounds, shape_bounds,
};
use glam::DVec3;

/// Lists the lints of a CSG solid that some instance places, at most one line of each kind.
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
    let logic = logic(tables, solid);
    if logic.as_ref().is_some_and(|logic| logic.is_empty) {
        let what = "its operands leave nothing of each other";
        return vec![format!("{name} is empty: {what}")];
    }
    let lines = [
        idle(tables, shape, solid).or_else(|| redundant(tables, solid, logic.as_ref()?)),
        coplanar(tables, solid),
        faceted(tables, solid),
        searched_within(solid),
    ];
    let lines = lines.into_iter().flatten();
    lines.map(|line| format!("{name}: {line}")).collect()
}

/// Reports a polynomial surface that an instance places directly and that has no bounds.
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

/// Reports a polynomial surface, or an operand, whose solver the user chose.
pub fn solved(tables: &Tables, shape: ShapeId) -> Option<String> {
    let Shape::Implicit(id) = tables.shapes.row(shape) else {
        return None;
    };
    let solver = tables.implicits.solver(id);
    (solver != Solver::Auto).then(|| {
        let name = label(tables, shape);
        format!(
            "{name}: the solver '{}' finds where rays meet it in fast, and is taken at its word; \
             the other precisions decide that exactly",
            solver.name()
        )
    })
}

/// Reports a solid torus that passes through itself: what its tube fills twice is outside
/// (docs/SPEC.md, S29).
pub fn spindle(tables: &Tables, shape: ShapeId) -> Option<String> {
    let Shape::Implicit(id) = tables.shapes.row(shape) else {
        return None;
    };
    let row = tables.implicits.row(id);
    let [major, minor] = radii_of(row.tape).filter(|_| !row.open)?;
    (minor > major).then(|| {
        let name = label(tables, shape);
        // (r − R)(r + R) loses no digits where the radii are close.
        let radius = ((minor - major) * (minor + major)).sqrt();
        format!(
            "{name} is a torus that passes through itself (minor > major), and hollow: what its \
             tube fills twice is outside; to fill it, unite it with a sphere of radius {radius} \
             about its centre"
        )
    })
}

/// Reports a level set that an instance places directly.
pub fn searched(tables: &Tables, shape: ShapeId) -> Option<String> {
    let Shape::LevelSet(_) = tables.shapes.row(shape) else {
        return None;
    };
    let name = label(tables, shape);
    Some(format!(
        "{name} is no polynomial: rays look for its zeros by intervals, one by one"
    ))
}

/// Names a shape for a message.
pub(super) fn label(tables: &Tables, shape: ShapeId) -> String {
    let kind = tables.shapes.row(shape).kind_name();
    match tables.shapes.names.get(shape.0) {
        Some(name) => format!("'{name}'"),
        None => format!("{kind} (shape {})", shape.0),
    }
}

/// Finds an intersection, the shape itself or one below it, whose operands' boxes do not
/// overlap.
fn empty_within(tables: &Tables, shape: ShapeId) -> Option<ShapeId> {
    let mut seen = vec![false; tables.csg.len()];
    let mut waiting = vec![shape];
    while let Some(shape) = waiting.pop() {
        let Shape::Csg(id) = tables.shapes.row(shape) else {
            continue;
        };
        if std::mem::replace(&mut seen[id.index()], true) {
            continue;
        }
        if is_empty(tables, id) {
            return Some(shape);
        }
        let operands = tables.csg.operands(id);
        waiting.extend(operands.iter().rev().map(|operand| operand.shape));
    }
    None
}

/// Says whether an intersection's operands have boxes with nothing in common.
fn is_empty(tables: &Tables, id: CsgId) -> bool {
    if tables.csg.operator[id.index()] != Operator::Intersection {
        return false;
    }
    let operands = tables.csg.operands(id).iter();
    let boxes = operands.filter_map(|operand| operand_bounds(tables, operand));
    let (mut min, mut max) = (DVec3::NEG_INFINITY, DVec3::INFINITY);
    for bounds in boxes {
        min = min.max(bounds.min);
        max = max.min(bounds.max);
    }
    min.cmpgt(max).any()
}

/// Reports meshes among the operands, and what they cost.
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

/// Reports level sets among the operands, and what they cost.
fn searched_within(solid: &CsgSolid) -> Option<String> {
    let is_one = |operand: &&CsgOperand| matches!(operand.shape, Shape::LevelSet(_));
    Some(match solid.operands.iter().filter(is_one).count() {
        0 => return None,
        1 => "an operand is no polynomial; rays in its box go one by one".into(),
        n => format!("{n} operands are no polynomials; rays in their boxes go one by one"),
    })
}

/// Says whether two closed boxes have a point in common.
pub(super) fn overlap(a: &Aabb, b: &Aabb) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
}

/// Reports operands that lie apart from the whole solid and so do not change it.
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

/// Reports operands that other operands make redundant, because they contain them, lie in
/// them or equal them.
fn redundant(tables: &Tables, solid: &CsgSolid, logic: &Logic) -> Option<String> {
    let first = label(tables, solid.operands[*logic.idle.first()?].id);
    Some(match logic.idle.len() {
        1 => format!(
            "the operand {first} never matters to the solid's form: others are in it, around it \
             or the same"
        ),
        count => format!(
            "{count} operands never matter to the solid's form, each beside the others, such as \
             {first}: others are in them, around them or the same"
        ),
    })
}
