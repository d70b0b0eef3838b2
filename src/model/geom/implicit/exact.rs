//! Where a line meets a polynomial surface.

use crate::geom::exact::restriction::restrict_tape;
use crate::geom::exact::root::{Branch, Root};
use crate::geom::exact::surface::Surface;
use crate::geom::exact::{Line, solid};
use crate::geom::guarded::implicit::{Crossing, crossings};
use crate::geom::{Clip, Implicit, Tape};
use crate::math::bounds::ErrorBounded;
use crate::roots::real_roots;
use num_bigint::{BigInt, Sign};
use std::cmp::Ordering;

/// A root, and the signs of f just before it and behind it.
#[derive(Clone, Copy, Debug)]
pub struct Meeting<'a> {
    pub root: Root<'a>,
    pub before: Ordering,
    pub after: Ordering,
}

/// Calls `visit` at all distinct roots along a line, in order; and returns the sign of f
/// far before the first. Of a line in the surface: none, and zero.
pub fn meetings<'a>(tape: &'a Tape, line: &Line, mut visit: impl FnMut(Meeting<'a>)) -> Ordering {
    let c = restrict_tape(tape, line);
    let Some(degree) = c.iter().rposition(|c| c.sign() != Sign::NoSign) else {
        return Ordering::Equal;
    };
    let mut sign = match (c[degree].sign(), degree % 2) {
        (Sign::Plus, 0) | (Sign::Minus, 1) => Ordering::Greater,
        _ => Ordering::Less,
    };
    let first = sign;
    // Coefficients so long that roots would take seconds do not come from f64 numbers
    // of like size; such a line meets nothing.
    let Some(roots) = real_roots(&c) else {
        return first;
    };
    for i in 0..roots.len() {
        let before = sign;
        if roots.multiplicity(i) % 2 == 1 {
            sign = sign.reverse();
        }
        let branch = Branch::Nth(i as u8);
        visit(Meeting {
            root: Root::new(line, Surface::Implicit(tape), branch, known(roots.t(i))),
            before,
            after: sign,
        });
    }
    first
}

/// The same between two t, beyond which nothing matters, by f64 where that knows: then
/// the sign is that at the first t, which f is not zero at.
pub fn meetings_between<'a>(
    tape: &'a Tape,
    line: &Line,
    between: [f64; 2],
    found: &mut Vec<Crossing>,
    mut visit: impl FnMut(Meeting<'a>),
) -> Ordering {
    let Some(first) = crossings(tape, (line.org, line.dir), between, found) else {
        return meetings(tape, line, visit);
    };
    let mut sign = first;
    for at in found {
        let before = sign;
        sign = sign.reverse();
        let error = (at.t - at.from).max(at.to - at.t).next_up();
        let t = ErrorBounded { value: at.t, error };
        visit(Meeting {
            root: Root::new(line, Surface::Implicit(tape), Branch::Only, t),
            before,
            after: sign,
        });
    }
    first
}

/// Of f at a point of finite coordinates.
pub fn sign_at(tape: &Tape, p: [f64; 3]) -> Ordering {
    let line = Line {
        org: p,
        dir: [0.0; 3],
    };
    match restrict_tape(tape, &line).first().map(BigInt::sign) {
        Some(Sign::Plus) => Ordering::Greater,
        Some(Sign::Minus) => Ordering::Less,
        _ => Ordering::Equal,
    }
}

/// A root that `t` is the nearest f64 to.
fn known(t: f64) -> ErrorBounded {
    let error = match t.abs() {
        f64::MAX => f64::INFINITY,
        size => size.next_up() - size,
    };
    ErrorBounded { value: t, error }
}

/// The first beyond t_min. A solid is met where a line is outside before or behind a
/// point of it; a surface in each of its points, in the clip.
pub(in crate::geom) fn first_beyond<'a>(
    row: &Implicit<'a>,
    line: &Line,
    t_min: f64,
) -> Option<Root<'a>> {
    let ends = match row.clip {
        None => Some([None, None]),
        Some(Clip::Sphere(sphere)) => solid::sphere(line, &sphere),
        Some(Clip::Cuboid(cuboid)) => solid::cuboid(line, &cuboid),
    };
    let [enter, exit] = ends?;
    let between = match row.bounds {
        Some(bounds) => line.part_in(&bounds, 1.0)?,
        None => [f64::NEG_INFINITY, f64::INFINITY],
    };
    let mut first = None;
    meetings_between(row.tape, line, between, &mut Vec::new(), |meeting| {
        let Meeting {
            root,
            before,
            after,
        } = meeting;
        let is_end = row.open || before.is_gt() || after.is_gt();
        let in_clip = || {
            let enters = enter.is_none_or(|end| root.order(&end).is_ge());
            enters && exit.is_none_or(|end| root.order(&end).is_le())
        };
        if first.is_none() && is_end && root.order_with(t_min).is_gt() && in_clip() {
            first = Some(root);
        }
    });
    first
}
