//! Lint for CSG solids by logic alone. Where operands are equal, lie inside each other or
//! lie apart, only some sets of operands can contain a common point. If none of these sets
//! is in the solid, the solid is empty; an operand that changes none of them is redundant.

use super::solids::overlap;
use crate::csg::State;
use crate::geom::HalfSpace;
use crate::scene::{CsgOperand, CsgSolid, Face, FaceKey, Shape, Tables, faces_of};
use glam::DVec3;

/// The most distinct operands whose subsets, at most 2¹², are enumerated.
const MAX_SETS: usize = 12;

/// The result of the enumeration.
pub(super) struct Logic {
    /// Whether no possible set of operands is in the solid.
    pub is_empty: bool,
    /// Operands that can be left out, or be all of space, without changing the solid, each
    /// by itself.
    pub idle: Vec<usize>,
}

/// Enumerates the possible sets of operands that contain a point; `None` if there are too
/// many operands.
pub(super) fn logic(tables: &Tables, solid: &CsgSolid) -> Option<Logic> {
    let sets = sets(tables, solid)?;
    let first = |set: usize| sets.iter().position(|s| *s == set);
    let count = sets.iter().max()? + 1;
    let all: Vec<&CsgOperand> = (0..count)
        .filter_map(|set| Some(&solid.operands[first(set)?]))
        .collect();
    // Per set: the bits of the sets that contain it, and of those apart from it.
    let mut inside = vec![0_u32; count];
    let mut apart = vec![0_u32; count];
    for (i, a) in all.iter().enumerate() {
        for (j, b) in all.iter().enumerate() {
            if i != j {
                inside[i] |= u32::from(holds(tables, solid, b, a)) << j;
                let boxes = [a.bounds, b.bounds];
                let none = matches!(boxes, [Some(a), Some(b)] if !overlap(&a, &b));
                apart[i] |= u32::from(none) << j;
            }
        }
    }
    let members = |in_sets: u32, operand: usize| in_sets >> sets[operand] & 1 != 0;
    let is_possible = |in_sets: u32| {
        let within = (0..count).filter(|i| in_sets >> i & 1 != 0);
        within.fold(true, |all, i| {
            all && inside[i] & !in_sets == 0 && apart[i] & in_sets == 0
        })
    };
    let mut state = State::default();
    let program = &solid.program;
    let mut is_empty = true;
    // Per operand: whether leaving it out, and whether making it all of space, changes the
    // solid.
    let mut matters = vec![[false; 2]; solid.operands.len()];
    for in_sets in (0..1_u32 << count).filter(|s| is_possible(*s)) {
        program.start(&mut state);
        for operand in 0..solid.operands.len() {
            if members(in_sets, operand) {
                program.flip(&mut state, operand as u32, true);
            }
        }
        let answer = program.is_inside(&state);
        is_empty &= !answer;
        for (operand, matters) in matters.iter_mut().enumerate() {
            let is_in = members(in_sets, operand);
            program.flip(&mut state, operand as u32, !is_in);
            matters[usize::from(!is_in)] |= program.is_inside(&state) != answer;
            program.flip(&mut state, operand as u32, is_in);
        }
    }
    let idle = |(i, [out, everywhere]): (usize, &[bool; 2])| (!out || !everywhere).then_some(i);
    Some(Logic {
        is_empty,
        idle: matters.iter().enumerate().filter_map(idle).collect(),
    })
}

/// Numbers the distinct sets of points among the operands, and returns each operand's
/// number.
fn sets(tables: &Tables, solid: &CsgSolid) -> Option<Vec<usize>> {
    // More operands are not compared, even if most of them are equal.
    if solid.operands.len() > 64 {
        return None;
    }
    let mut known: Vec<(&CsgOperand, Vec<FaceKey>)> = Vec::new();
    let mut sets = Vec::new();
    for operand in &solid.operands {
        let faces = match operand.shape {
            Shape::Sphere(_) | Shape::Ellipsoid(_) | Shape::Cuboid(_) | Shape::Cylinder(_) => {
                let faces = faces_of(tables, operand.shape);
                faces.iter().flatten().map(Face::key).collect()
            }
            // Faces of other kinds do not determine the solid.
            _ => Vec::new(),
        };
        let same = |(other, theirs): &(&CsgOperand, Vec<FaceKey>)| {
            let by_faces = !faces.is_empty() && faces == *theirs;
            other.frame == operand.frame && (other.shape == operand.shape || by_faces)
        };
        let set = known.iter().position(same).unwrap_or(known.len());
        if set == known.len() {
            known.push((operand, faces));
        }
        sets.push(set);
    }
    (known.len() <= MAX_SETS).then_some(sets)
}

/// Says whether the first operand certainly contains the second.
fn holds(tables: &Tables, solid: &CsgSolid, outer: &CsgOperand, inner: &CsgOperand) -> bool {
    let is_one_frame = outer.frame == inner.frame;
    match (outer.shape, inner.shape) {
        (Shape::Sphere(a), Shape::Sphere(b)) if is_one_frame => {
            let (a, b) = (tables.spheres.row(a), tables.spheres.row(b));
            return a.center.distance(b.center) + b.radius <= a.radius * CERTAIN;
        }
        (Shape::Cuboid(a), Shape::Cuboid(b)) if is_one_frame => {
            let (a, b) = (tables.cuboids.row(a), tables.cuboids.row(b));
            return a.min.cmple(b.min).all() && b.max.cmple(a.max).all();
        }
        _ => {}
    }
    // Every outer solid below is convex, so it contains a box if it contains the corners.
    let Some(bounds) = inner.bounds else {
        return false;
    };
    let frame = &solid.frames[outer.frame as usize];
    let map = &frame.operand_from_solid;
    let corners = bounds.corners();
    let shift = DVec3::from_array(map.translation).abs().max_element();
    let reach = map.norm() * (bounds.max_abs() + frame.reach) + shift;
    let inside = |p: DVec3| is_inside(tables, outer.shape, p, reach * ROUNDINGS);
    corners
        .into_iter()
        .all(|p| inside(DVec3::from_array(map.point(p.to_array()))))
}

/// A factor that leaves room for the roundings of a few operations.
const CERTAIN: f64 = 1.0 - 1e-12;

/// Says whether a point is certainly in a convex solid. The point is in the solid's own
/// space and known to within `known` along each axis.
fn is_inside(tables: &Tables, shape: Shape, p: DVec3, known: f64) -> bool {
    let known = known + p.abs().max_element() * ROUNDINGS;
    match shape {
        Shape::Sphere(id) => {
            let row = tables.spheres.row(id);
            p.distance(row.center) <= row.radius * CERTAIN - 2.0 * known
        }
        Shape::Ellipsoid(id) => {
            let row = tables.ellipsoids.row(id);
            let blur = DVec3::splat(known);
            (((p - row.center).abs() + blur) / row.radii).length() <= CERTAIN
        }
        Shape::Cuboid(id) => {
            let row = tables.cuboids.row(id);
            let blur = DVec3::splat(known);
            row.min.cmple(p - blur).all() && (p + blur).cmple(row.max).all()
        }
        Shape::HalfSpace(id) => {
            let HalfSpace { normal, offset } = tables.half_spaces.row(id);
            let size = normal.abs().dot(p.abs()) + offset.abs();
            let known = normal.abs().element_sum() * known;
            normal.dot(p) <= offset - size * ROUNDINGS - known
        }
        Shape::Cylinder(id) => {
            let row = tables.cylinders.row(id);
            let (axis, from) = (row.top - row.base, p - row.base);
            let along = from.dot(axis) / axis.length_squared();
            let blur = 4.0 * known + row.base.abs().max_element() * ROUNDINGS;
            let slack = blur / axis.length();
            (slack..=1.0 - slack).contains(&along)
                && (from - axis * along).length() + blur <= row.radius * CERTAIN
        }
        _ => false,
    }
}

/// 64 roundings 2⁻⁵² of the coordinates. Only the lint depends on it, and no answer.
const ROUNDINGS: f64 = 64.0 * f64::EPSILON;
