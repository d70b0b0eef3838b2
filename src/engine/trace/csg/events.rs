//! Which boundaries of a CSG solid count as one event, in the scalar walk.

use crate::accel::{PLACEMENT, SLOWEST};
use crate::csg::Boundary;
use crate::geom::exact::{Line, Root};
use crate::math::bounds::ErrorBounded;
use crate::math::length;
use crate::scene::{CsgOperand, CsgSolid};
use glam::DVec3;

/// A boundary of an operand, with its slack in t: placement error of its frame against
/// other frames, and the solid's tolerance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mark<'a> {
    pub root: Root<'a>,
    /// Number of the surface ([`CsgSolid::surface`]).
    pub surface: u32,
    /// Whether the line runs against the surface's normal, as it usually does where it
    /// enters the operand.
    pub against: bool,
    /// t of the root; where f64 does not know it well and not `is_rough`, the nearest f64.
    pub t: ErrorBounded,
    pub frame: u32,
    pub placement: f64,
    pub tolerance: f64,
    /// Whether `placement` and `tolerance` are only upper bounds. They mostly suffice, since
    /// other boundaries are rarely that near.
    pub is_rough: bool,
    /// Index of the first boundary at the same t.
    pub place: u32,
    /// Index of the first boundary of the same event.
    pub event: u32,
}

/// Relative error 2⁻⁴⁹ of t above which a boundary's t is computed exactly (K13). It
/// chooses how t is found; no decision depends on it.
const SHARP: f64 = 1.0 / (1_u64 << 49) as f64;

/// Builds a boundary's mark with upper bounds of its slack.
pub(super) fn mark<'a>(
    solid: &CsgSolid,
    operand: &CsgOperand,
    line: &Line,
    root: Root<'a>,
) -> Mark<'a> {
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
    if error <= value.abs() * SHARP || !(value.is_finite() && error.is_finite()) {
        sharpen(solid, operand, line, &mut mark);
        return mark;
    }
    mark.is_rough = true;
    let [org, dir] = [line.org, line.dir].map(DVec3::from_array);
    let far = dir.abs().max_element() * (value.abs() + error);
    let rate = length(dir) * SLOWEST;
    // Doubled to cover the roundings of this bound (K13).
    let size = 2.0 * (org.abs().max_element() + far);
    mark.placement = placement(solid, operand, size) / rate;
    mark.tolerance = 2.0 * solid.tolerance / rate;
    mark
}

/// Replaces the upper bounds of a boundary's slack by the slack itself.
fn sharpen(solid: &CsgSolid, operand: &CsgOperand, line: &Line, mark: &mut Mark) {
    let root = mark.root;
    mark.is_rough = false;
    // Where f64 cannot evaluate t, value and error are infinite.
    let is_known = root.t.value.is_finite() && root.t.error <= root.t.value.abs() * SHARP;
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

/// Placement error of an operand against operands of other frames (S9), in the solid's
/// space, for coordinates no larger than `reach`.
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

/// Numbers the places (equal t) and events of boundaries sorted by t. Two neighbouring
/// places are one event if any two of their boundaries coincide.
pub(super) fn number_events(solid: &CsgSolid, line: &Line, boundaries: &mut [Boundary<Mark>]) {
    let (mut before, mut start, mut event) = (0..0, 0, 0);
    while start < boundaries.len() {
        let (first, rest) = (&boundaries[start].at.root, &boundaries[start + 1..]);
        let same = |b: &&Boundary<Mark>| first.order(&b.at.root).is_eq();
        let end = start + 1 + rest.iter().take_while(same).count();
        let pairs = |(a, b): (&[Boundary<Mark>], &[Boundary<Mark>]), is: PairTest| {
            a.iter().any(|a| b.iter().any(|b| is(a, b)))
        };
        let both = (&boundaries[before.clone()], &boundaries[start..end]);
        let mut near = groups_may_coincide(both.0, both.1) && pairs(both, may_coincide);
        if near {
            for boundary in &mut boundaries[before.start..end] {
                if boundary.at.is_rough {
                    let operand = &solid.operands[boundary.operand as usize];
                    sharpen(solid, operand, line, &mut boundary.at);
                }
            }
            near = pairs((&boundaries[before], &boundaries[start..end]), coincide);
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

/// Whether any pair of boundaries of two places may coincide, by the largest slack of each
/// place. It avoids testing all pairs where thousands of boundaries share a place.
fn groups_may_coincide(before: &[Boundary<Mark>], behind: &[Boundary<Mark>]) -> bool {
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
    // All boundaries of a place have one t, so the first one stands for them.
    let gap = b.at.t.value - a.at.t.value;
    let off = a.at.t.error + b.at.t.error;
    slack > 0.0 && !(gap - 2.0 * off > 2.0 * slack)
}

type PairTest = fn(&Boundary<Mark>, &Boundary<Mark>) -> bool;

/// Whether two boundaries of different t may coincide by the upper bounds of their slack.
fn may_coincide(a: &Boundary<Mark>, b: &Boundary<Mark>) -> bool {
    if !(a.at.is_rough || b.at.is_rough) {
        return coincide(a, b);
    }
    let (a, b) = (&a.at, &b.at);
    let slack = a.tolerance.max(b.tolerance).max(a.placement + b.placement);
    let gap = b.t.value - a.t.value;
    // NaN counts as possible.
    !(gap - 2.0 * (a.t.error + b.t.error) > 2.0 * slack)
}

/// Whether two boundaries of different t coincide: the f64 nearest to each t are compared
/// (K13).
fn coincide(a: &Boundary<Mark>, b: &Boundary<Mark>) -> bool {
    let own = a.operand == b.operand;
    let (a, b) = (&a.at, &b.at);
    // An operand thinner than the placement error of its own ends may be missed entirely.
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
    // The nearest f64 adds half a step to each; 1.001 covers the roundings here (K13).
    let steps = f64::EPSILON * (a.t.value.abs() + b.t.value.abs());
    let off = 1.001 * (a.t.error + b.t.error) + steps;
    if (gap - slack).abs() > off {
        return gap <= slack;
    }
    b.root.rounded() - a.root.rounded() <= slack
}
