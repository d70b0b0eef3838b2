//! A ray against a solid that is made of others: where it comes into it and where
//! it leaves it.
//!
//! Every operand's span is found, and the order of their ends, as exact
//! arithmetic would ([`crate::geom::exact`]); f64 with error bounds nearly always
//! knows. Boundaries of operands in one frame are one event where they are equal;
//! of operands in different frames, or where the solid has a tolerance, where they
//! are so near to each other, from each to the next (docs/NUMERICS.md).

pub mod lanes;
mod leaf;
mod mesh;

use crate::accel::{PLACEMENT, PreparedCsg, SLOWEST};
use crate::csg::{Boundary, Walk};
use crate::geom::Tape;
use crate::geom::exact::{Inside, Line, Root, meetings_between, span};
use crate::geom::guarded::implicit::Crossing as Crossed;
use crate::geom::primitive::Boundaries;
use crate::math::bounds::ErrorBounded;
use crate::math::{Aabb, Vec3, length};
use crate::scene::{CsgOperand, CsgSolid, Frame, Shape, Tables};
use glam::DVec3;
use mesh::Facet;
use std::cell::Cell;
use std::ops::ControlFlow;

/// Of a hit's `primitive`: the solid's outside is the operand's inside.
pub const TURNED: u32 = 1 << 31;

/// A boundary of the solid.
#[derive(Clone, Copy, Debug)]
pub struct Crossing<'a> {
    pub root: Root<'a>,
    /// The surface's number ([`CsgSolid::surface`]), and [`TURNED`].
    pub primitive: u32,
    /// The ray comes into the solid.
    pub enters: bool,
}

/// An operand's boundary, and how far off it may be in t: by its own frame's
/// roundings beside those of others, and by the solid's tolerance.
#[derive(Clone, Copy, Debug)]
struct Mark<'a> {
    root: Root<'a>,
    /// The number of the surface.
    surface: u32,
    /// The line comes against the surface's normal: where an operand is left, as a
    /// rule, it does not.
    against: bool,
    /// The root's t: where f64 hardly knows it, rounded, unless `is_rough`.
    t: ErrorBounded,
    frame: u32,
    placement: f64,
    tolerance: f64,
    /// `placement` and `tolerance` are no more than the most that they may be: as a rule
    /// no other boundary is so near.
    is_rough: bool,
    /// The first of those at the same t, and of those of the same event.
    place: u32,
    event: u32,
}

/// Reused from ray to ray.
#[derive(Default)]
struct Scratch {
    boundaries: Vec<Boundary<Mark<'static>>>,
    inside: Vec<u32>,
    walk: Walk,
    operands: Vec<u32>,
    facets: Vec<Facet>,
    crossings: Vec<Crossed>,
}

thread_local! {
    static SCRATCH: Cell<Option<Box<Scratch>>> = const { Cell::new(None) };
}

/// The first boundary beyond t_min. `line`: in the solid's space.
pub fn first<'a>(
    csg: &PreparedCsg,
    tables: &'a Tables,
    line: &Line,
    t_min: f64,
) -> Option<Crossing<'a>> {
    let mut found = None;
    boundaries(csg, tables, (line, t_min), |crossing| {
        if crossing.root.order_with(t_min).is_gt() {
            found = Some(crossing);
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    });
    found
}

/// Calls `visit` at the solid's boundaries in order, until it has seen enough: of
/// a line in the solid's space those beyond t_min, and perhaps others. Returns
/// whether the line has always been inside before the first.
pub fn boundaries<'a>(
    csg: &PreparedCsg,
    tables: &'a Tables,
    (line, t_min): (&Line, f64),
    mut visit: impl FnMut(Crossing<'a>) -> ControlFlow<()>,
) -> bool {
    let mut scratch = SCRATCH.take().unwrap_or_default();
    let mut marks: Vec<Boundary<Mark<'a>>> = std::mem::take(&mut scratch.boundaries);
    let boundaries = &mut marks;
    let Scratch {
        inside,
        walk,
        operands,
        facets,
        crossings,
        ..
    } = &mut *scratch;
    let ray = [line.org, line.dir].map(Vec3::<f64>::splat);
    let solid = &csg.solid;
    // What lies before t_min may be one event with what lies behind it.
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
                collect_implicit(csg, tape, line, *number, crossings, found);
            }
            shape if shape.boundaries() == Boundaries::Crossings => {
                collect_crossings(solid, tables, line, *number, found);
            }
            _ => collect(solid, tables, line, *number, found),
        }
    }
    boundaries.sort_by(|a, b| a.at.root.order(&b.at.root));
    gather(solid, line, boundaries);
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
    scratch.boundaries = emptied(marks);
    SCRATCH.set(Some(scratch));
    start
}

/// Without what was in it, its place is kept for lines that live longer.
fn emptied<'a>(mut marks: Vec<Boundary<Mark<'a>>>) -> Vec<Boundary<Mark<'static>>> {
    marks.clear();
    // Collected in place: nothing is allocated.
    let none = |_: Boundary<Mark<'a>>| -> Option<Boundary<Mark<'static>>> { None };
    marks.into_iter().filter_map(none).collect()
}

/// The ends of an operand's span, or that the line is in it from the start.
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
    // One point is no part of a closed interior.
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

/// An end of a span of an operand that is one surface.
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

/// A line in an operand's space; `None` if it is none there.
fn own_line(solid: &CsgSolid, line: &Line, number: u32) -> Option<Line> {
    let operand = &solid.operands[number as usize];
    let own = in_frame(&solid.frames[operand.frame as usize], operand.frame, line);
    let is_line = own.dir.iter().any(|x| *x != 0.0) && own.is_finite();
    is_line.then_some(own)
}

/// [`collect`] of a polynomial's surface: where the polynomial changes its sign.
fn collect_implicit<'a>(
    csg: &PreparedCsg,
    tape: &'a Tape,
    line: &Line,
    number: u32,
    crossings: &mut Vec<Crossed>,
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
    let first = meetings_between(tape, &own, between, crossings, |meeting| {
        if meeting.before == meeting.after {
            return;
        }
        let enters = meeting.after.is_lt();
        boundaries.push(boundary(solid, line, number, meeting.root, enters));
    });
    // A line in the surface is in the solid.
    if first.is_le() {
        inside.push(number);
    }
}

/// [`collect`] of what a line may come into many times.
fn collect_crossings<'a>(
    solid: &CsgSolid,
    tables: &'a Tables,
    line: &Line,
    number: u32,
    (boundaries, inside): (&mut Vec<Boundary<Mark<'a>>>, &mut Vec<u32>),
) {
    let primitive = tables.solid(solid.operands[number as usize].shape);
    let (Some(own), Some(primitive)) = (own_line(solid, line, number), primitive) else {
        return;
    };
    let always = primitive.crossings(&own, |root, enters| {
        boundaries.push(boundary(solid, line, number, root, enters));
    });
    if always {
        inside.push(number);
    }
}

/// [`collect`] of a mesh, beyond t_min.
fn collect_mesh(
    csg: &PreparedCsg,
    tables: &Tables,
    (line, t_min): (&Line, f64),
    number: u32,
    met: &mut Vec<Facet>,
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

/// The operand's ray, by definition.
pub fn in_frame(frame: &Frame, number: u32, line: &Line) -> Line {
    if number == 0 {
        return *line;
    }
    Line {
        org: frame.operand_from_solid.point(line.org),
        dir: frame.operand_from_solid.vector(line.dir),
    }
}

/// Certain, but not complete: the box is met with room for all roundings, each of
/// which counts `condition` times.
pub(super) fn passes_by(bounds: &Aabb, line: &Line, condition: f64) -> bool {
    line.part_in(bounds, condition).is_none()
}

/// t that is known no better than to this part is worth being worked out exactly.
const KNOWN: f64 = 1.0 / (1_u64 << 49) as f64;

fn mark<'a>(solid: &CsgSolid, operand: &CsgOperand, line: &Line, root: Root<'a>) -> Mark<'a> {
    let mut mark = Mark {
        root,
        t: root.t,
        surface: 0,
        against: false,
        frame: operand.frame,
        placement: 0.0,
        tolerance: 0.0,
        is_rough: false,
        place: 0,
        event: 0,
    };
    if solid.is_exact() {
        return mark;
    }
    let ErrorBounded { value, error } = mark.t;
    if error <= value.abs() * KNOWN || !(value.is_finite() && error.is_finite()) {
        sharpen(solid, operand, line, &mut mark);
        return mark;
    }
    mark.is_rough = true;
    let [org, dir] = [line.org, line.dir].map(DVec3::from_array);
    let far = dir.abs().max_element() * (value.abs() + error);
    let rate = length(dir) * SLOWEST;
    // Twice, for the roundings of this.
    let size = 2.0 * (org.abs().max_element() + far);
    mark.placement = placement(solid, operand, size) / rate;
    mark.tolerance = 2.0 * solid.tolerance / rate;
    mark
}

/// What is known of a boundary beside others, in full.
fn sharpen(solid: &CsgSolid, operand: &CsgOperand, line: &Line, mark: &mut Mark) {
    let root = mark.root;
    mark.is_rough = false;
    // Of what f64 cannot say, both are infinite.
    let is_known = root.t.value.is_finite() && root.t.error <= root.t.value.abs() * KNOWN;
    if !is_known {
        mark.t = ErrorBounded::exact(root.rounded());
    }
    let frame = &solid.frames[operand.frame as usize];
    let at = |line: &Line| DVec3::from_array(line.org) + DVec3::from_array(line.dir) * mark.t.value;
    let normal = root.normal_at(mark.t.value);
    let normal = frame
        .operand_from_solid
        .transposed_vector(normal.to_array());
    let normal = DVec3::from_array(normal);
    let dir = DVec3::from_array(line.dir);
    let rate = (normal.dot(dir) / length(normal)).abs();
    let rate = rate.max(length(dir) * SLOWEST);
    let reach = DVec3::from_array(line.org).abs().max(at(line).abs());
    mark.placement = placement(solid, operand, reach.max_element()) / rate;
    mark.tolerance = solid.tolerance / rate;
}

/// How far off an operand may be beside those of other frames, where coordinates of
/// the solid's space are no larger than `reach`: these were rounded on their way there.
fn placement(solid: &CsgSolid, operand: &CsgOperand, reach: f64) -> f64 {
    if solid.frames.len() == 1 {
        return 0.0;
    }
    let frame = &solid.frames[operand.frame as usize];
    let (there, back) = (&frame.operand_from_solid, &frame.solid_from_operand);
    let moved = DVec3::from_array(there.translation).abs().max_element();
    let carried = there.norm() * reach + moved;
    PLACEMENT * (back.norm() * carried + frame.reach)
}

/// Numbers places and events. Boundaries stand in the order of t; those of two
/// neighbouring places are one event if any two of them are so near.
fn gather(solid: &CsgSolid, line: &Line, boundaries: &mut [Boundary<Mark>]) {
    let (mut before, mut start, mut event) = (0..0, 0, 0);
    while start < boundaries.len() {
        let (first, rest) = (&boundaries[start].at.root, &boundaries[start + 1..]);
        let same = |b: &&Boundary<Mark>| first.order(&b.at.root).is_eq();
        let end = start + 1 + rest.iter().take_while(same).count();
        let pairs = |(a, b): (&[Boundary<Mark>], &[Boundary<Mark>]), is: Asked| {
            a.iter().any(|a| b.iter().any(|b| is(a, b)))
        };
        let both = (&boundaries[before.clone()], &boundaries[start..end]);
        let mut near = may_meet(both.0, both.1) && pairs(both, may_be_one);
        if near {
            for boundary in &mut boundaries[before.start..end] {
                if boundary.at.is_rough {
                    let operand = &solid.operands[boundary.operand as usize];
                    sharpen(solid, operand, line, &mut boundary.at);
                }
            }
            near = pairs((&boundaries[before], &boundaries[start..end]), are_one);
        }
        if !near {
            event = start as u32;
        }
        for boundary in &mut boundaries[start..end] {
            boundary.at.place = start as u32;
            boundary.at.event = event;
        }
        before = start..end;
        start = end;
    }
}

/// False where no two of them are one, by the most that any of either side may be off.
/// Where thousands of boundaries coincide, pairs are too many to be asked.
fn may_meet(before: &[Boundary<Mark>], behind: &[Boundary<Mark>]) -> bool {
    let most = |of: fn(&Mark) -> f64| {
        let most = |side: &[Boundary<Mark>]| side.iter().map(|b| of(&b.at)).fold(0.0, f64::max);
        (most(before), most(behind))
    };
    let (tolerances, placements) = (most(|m| m.tolerance), most(|m| m.placement));
    let slack = tolerances
        .0
        .max(tolerances.1)
        .max(placements.0 + placements.1);
    let (Some(a), Some(b)) = (before.first(), behind.first()) else {
        return false;
    };
    // Those of a side are at one t; so each of them tells where it is.
    let gap = b.at.t.value - a.at.t.value;
    let off = a.at.t.error + b.at.t.error;
    slack > 0.0 && !(gap - 2.0 * off > 2.0 * slack)
}

type Asked = fn(&Boundary<Mark>, &Boundary<Mark>) -> bool;

/// Of different t: false where they are not one, whatever is found out yet.
fn may_be_one(a: &Boundary<Mark>, b: &Boundary<Mark>) -> bool {
    if !(a.at.is_rough || b.at.is_rough) {
        return are_one(a, b);
    }
    let (a, b) = (&a.at, &b.at);
    let slack = a.tolerance.max(b.tolerance).max(a.placement + b.placement);
    let gap = b.t.value - a.t.value;
    // Not of what is no number.
    !(gap - 2.0 * (a.t.error + b.t.error) > 2.0 * slack)
}

/// Of different t, by the f64 nearest to them.
fn are_one(a: &Boundary<Mark>, b: &Boundary<Mark>) -> bool {
    let own = a.operand == b.operand;
    let (a, b) = (&a.at, &b.at);
    // An operand that is no thicker than its ends are known, may not be met at all.
    let placement = match own || a.frame != b.frame {
        true => a.placement + b.placement,
        false => 0.0,
    };
    let tolerance = match own {
        true => 0.0,
        false => a.tolerance.max(b.tolerance),
    };
    let slack = tolerance.max(placement);
    if slack == 0.0 {
        return false;
    }
    let gap = b.t.value - a.t.value;
    // And by half a step each from the nearest f64.
    let steps = f64::EPSILON * (a.t.value.abs() + b.t.value.abs());
    let off = 1.001 * (a.t.error + b.t.error) + steps;
    if (gap - slack).abs() > off {
        return gap <= slack;
    }
    b.root.rounded() - a.root.rounded() <= slack
}
