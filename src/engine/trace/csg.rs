//! The scalar walk of a line through a CSG solid: where it enters and leaves.
//!
//! Spans of operands and the order of their ends are those of exact arithmetic
//! ([`crate::geom::exact`]); f64 with error bounds nearly always suffices. Boundaries of
//! operands in one frame are one event where their t are equal. Boundaries of different
//! frames, or of a solid with a tolerance, are one event where consecutive ones are within
//! the slack (docs/numerics/csg.md, K13).

mod events;
pub mod lanes;
mod leaf;
mod mesh;

use super::scratch::TraceScratch;
use crate::accel::PreparedCsg;
use crate::csg::{Boundary, Walk};
use crate::geom::exact::{Inside, Line, Root, meetings_between, span};
use crate::geom::primitive::Boundaries;
use crate::geom::{Scratch, Tape};
use crate::math::{Aabb, Vec3};
use crate::scene::{CsgSolid, Frame, Shape, Tables};
use events::{Mark, mark, number_events};
use mesh::MeshCrossing;
use std::ops::ControlFlow;

/// Flag of a hit's `primitive`: the solid's outside is the operand's inside.
pub const TURNED: u32 = 1 << 31;

/// A boundary of the CSG solid along a line.
#[derive(Clone, Copy, Debug)]
pub struct Crossing<'a> {
    pub root: Root<'a>,
    /// Number of the surface ([`CsgSolid::surface`]), with the flag [`TURNED`].
    pub primitive: u32,
    /// Whether the line enters the solid here.
    pub enters: bool,
}

/// Buffers of the scalar walk, reused from line to line.
#[derive(Default)]
pub(super) struct CsgScratch {
    boundaries: Vec<Boundary<Mark<'static>>>,
    inside: Vec<u32>,
    walk: Walk,
    operands: Vec<u32>,
    facets: Vec<MeshCrossing>,
}

/// Finds the first boundary beyond t_min of a line in the solid's space.
pub fn first<'a>(
    csg: &PreparedCsg,
    tables: &'a Tables,
    line: &Line,
    t_min: f64,
    scratch: &mut TraceScratch,
) -> Option<Crossing<'a>> {
    let mut found = None;
    let visit = |crossing: Crossing<'a>| {
        if crossing.root.order_with(t_min).is_gt() {
            found = Some(crossing);
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    };
    boundaries(csg, tables, (line, t_min), scratch, visit);
    found
}

/// Calls `visit` at the solid's boundaries in the order of t until it breaks off. The line
/// is in the solid's space; all boundaries beyond t_min are visited, and perhaps others.
/// Returns whether the line is inside the solid before the first boundary.
pub fn boundaries<'a>(
    csg: &PreparedCsg,
    tables: &'a Tables,
    (line, t_min): (&Line, f64),
    scratch: &mut TraceScratch,
    mut visit: impl FnMut(Crossing<'a>) -> ControlFlow<()>,
) -> bool {
    let CsgScratch {
        boundaries: kept,
        inside,
        walk,
        operands,
        facets,
    } = &mut scratch.csg;
    let kernels = &mut scratch.kernels;
    let mut marks: Vec<Boundary<Mark<'a>>> = std::mem::take(kept);
    let boundaries = &mut marks;
    let ray = [line.org, line.dir].map(Vec3::<f64>::splat);
    let solid = &csg.solid;
    // A boundary before t_min may be one event with a boundary beyond it.
    let from = if solid.is_exact() {
        t_min
    } else {
        f64::NEG_INFINITY
    };
    csg.operands_along((ray[0], ray[1]), from, f64::INFINITY, operands);
    boundaries.clear();
    inside.clear();
    for number in operands.iter() {
        let found = (&mut *boundaries, &mut *inside);
        match solid.operands[*number as usize].shape {
            Shape::Mesh(_) => collect_mesh(csg, tables, (line, from), *number, facets, found),
            Shape::Implicit(id) => {
                let tape = &tables.implicits.tape[id.index()];
                collect_implicit(csg, tape, line, *number, kernels, found);
            }
            shape if shape.boundaries() == Boundaries::Crossings => {
                collect_crossings(solid, tables, line, *number, kernels, found);
            }
            _ => collect(solid, tables, line, *number, found),
        }
    }
    // A stable sort would allocate.
    for (place, boundary) in boundaries.iter_mut().enumerate() {
        boundary.at.place = place as u32;
    }
    boundaries.sort_unstable_by(|a, b| {
        let by_place = || a.at.place.cmp(&b.at.place);
        a.at.root.order(&b.at.root).then_with(by_place)
    });
    number_events(solid, line, boundaries);
    let always = inside.iter().copied();
    let start = walk.starts_inside(&solid.program, always.clone());
    let same = |a: &Mark, b: &Mark| a.place == b.place;
    let one = |a: &Mark, b: &Mark| a.event == b.event;
    let _ = walk.run(&solid.program, always, boundaries, (same, one), |change| {
        let at = &change.boundary.at;
        let turned = if change.enters == at.against {
            0
        } else {
            TURNED
        };
        visit(Crossing {
            root: at.root,
            primitive: at.surface | turned,
            enters: change.enters,
        })
    });
    *kept = emptied(marks);
    start
}

/// Empties a vector and returns its memory at a lifetime that outlives the line.
fn emptied<'a>(mut marks: Vec<Boundary<Mark<'a>>>) -> Vec<Boundary<Mark<'static>>> {
    marks.clear();
    // An empty iterator is collected in place, so nothing is allocated.
    let none = |_: Boundary<Mark<'a>>| -> Option<Boundary<Mark<'static>>> { None };
    marks.into_iter().filter_map(none).collect()
}

/// Collects the ends of an operand's span, and the operand where the line starts inside.
fn collect<'a>(
    solid: &CsgSolid,
    tables: &'a Tables,
    line: &Line,
    number: u32,
    (boundaries, inside): (&mut Vec<Boundary<Mark<'a>>>, &mut Vec<u32>),
) {
    let operand = &solid.operands[number as usize];
    let frame = &solid.frames[operand.frame as usize];
    let missed = |b: Aabb| passes_by(&b, line, frame.condition);
    if operand.bounds.is_some_and(missed) {
        return;
    }
    let Some(primitive) = tables.solid(operand.shape) else {
        return;
    };
    let own = in_frame(frame, operand.frame, line);
    let Inside { at_first, ends } = span(&primitive, &own);
    // A span of one point has no interior.
    if let [Some(first), Some(last)] = &ends
        && first.order(last).is_eq()
    {
        return;
    }
    if at_first {
        inside.push(number);
    }
    for (root, enters) in ends.into_iter().flatten().zip([!at_first, at_first]) {
        boundaries.push(boundary(solid, line, number, root, enters));
    }
}

/// Builds the boundary at an end of a span, for an operand of a single surface.
fn boundary<'a>(
    solid: &CsgSolid,
    line: &Line,
    number: u32,
    root: Root<'a>,
    enters: bool,
) -> Boundary<Mark<'a>> {
    let operand = &solid.operands[number as usize];
    Boundary {
        at: Mark {
            surface: solid.surface(number, 0),
            against: enters,
            ..mark(solid, operand, line, root)
        },
        operand: number,
        enters,
    }
}

/// Transforms a line to an operand's space; `None` if its direction vanishes or overflows.
fn own_line(solid: &CsgSolid, line: &Line, number: u32) -> Option<Line> {
    let operand = &solid.operands[number as usize];
    let own = in_frame(&solid.frames[operand.frame as usize], operand.frame, line);
    let is_line = own.dir.iter().any(|x| *x != 0.0) && own.is_finite();
    is_line.then_some(own)
}

/// [`collect`] for a polynomial surface: its boundaries are changes of the sign.
fn collect_implicit<'a>(
    csg: &PreparedCsg,
    tape: &'a Tape,
    line: &Line,
    number: u32,
    kernels: &mut Scratch,
    (boundaries, inside): (&mut Vec<Boundary<Mark<'a>>>, &mut Vec<u32>),
) {
    let solid = &csg.solid;
    let operand = &solid.operands[number as usize];
    let Some(own) = own_line(solid, line, number) else {
        return;
    };
    let between = match csg.box_around(operand) {
        Some((bounds, condition)) => line.part_in(&bounds, condition),
        None => Some([f64::NEG_INFINITY, f64::INFINITY]),
    };
    let Some(between) = between else {
        return;
    };
    let first = meetings_between(tape, &own, between, &mut kernels.polynomial, |meeting| {
        if meeting.before == meeting.after {
            return;
        }
        let enters = meeting.after.is_lt();
        boundaries.push(boundary(solid, line, number, meeting.root, enters));
    });
    // A line that lies in the surface counts as inside.
    if first.is_le() {
        inside.push(number);
    }
}

/// [`collect`] for a solid that a line may enter several times.
fn collect_crossings<'a>(
    solid: &CsgSolid,
    tables: &'a Tables,
    line: &Line,
    number: u32,
    kernels: &mut Scratch,
    (boundaries, inside): (&mut Vec<Boundary<Mark<'a>>>, &mut Vec<u32>),
) {
    let primitive = tables.solid(solid.operands[number as usize].shape);
    let (Some(own), Some(primitive)) = (own_line(solid, line, number), primitive) else {
        return;
    };
    let always = primitive.crossings(&own, kernels, |root, enters| {
        boundaries.push(boundary(solid, line, number, root, enters));
    });
    if always {
        inside.push(number);
    }
}

/// [`collect`] for a closed mesh, beyond t_min.
fn collect_mesh(
    csg: &PreparedCsg,
    tables: &Tables,
    (line, t_min): (&Line, f64),
    number: u32,
    met: &mut Vec<MeshCrossing>,
    (boundaries, inside): (&mut Vec<Boundary<Mark<'_>>>, &mut Vec<u32>),
) {
    let solid = &csg.solid;
    let operand = &solid.operands[number as usize];
    let frame = &solid.frames[operand.frame as usize];
    let missed = |b: Aabb| passes_by(&b, line, frame.condition);
    let Shape::Mesh(id) = operand.shape else {
        return;
    };
    if operand.bounds.is_some_and(missed) {
        return;
    }
    let own = in_frame(frame, operand.frame, line);
    let mesh = (&tables.meshes.row(id), csg.mesh_crossings(id));
    let first = boundaries.len();
    let is_inside = mesh::crossings(mesh, &own, t_min, met, |facet| {
        boundaries.push(Boundary {
            at: Mark {
                surface: solid.surface(number, facet.triangle),
                against: facet.against,
                ..mark(solid, operand, line, facet.root)
            },
            operand: number,
            enters: false,
        });
    });
    if is_inside {
        inside.push(number);
    }
    let mut enters = !is_inside;
    for boundary in &mut boundaries[first..] {
        boundary.enters = enters;
        enters = !enters;
    }
}

/// Transforms a line to an operand's frame by the steps that define it (S40).
pub fn in_frame(frame: &Frame, number: u32, line: &Line) -> Line {
    if number == 0 {
        return *line;
    }
    Line {
        org: frame.operand_from_solid.point(line.org),
        dir: frame.operand_from_solid.vector(line.dir),
    }
}

/// Whether a line certainly misses a box. The box is padded for all roundings, each times
/// `condition` (X11); a miss by less than that is not found.
pub(super) fn passes_by(bounds: &Aabb, line: &Line, condition: f64) -> bool {
    line.part_in(bounds, condition).is_none()
}
