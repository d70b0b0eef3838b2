//! Exact meetings of a line and a polynomial surface (D17, docs/numerics/exact.md).

use crate::geom::exact::restriction::restrict_tape;
use crate::geom::exact::root::{Branch, Root};
use crate::geom::exact::surface::Surface;
use crate::geom::exact::{Line, solid};
use crate::geom::guarded::implicit::{PolynomialScratch, crossings};
use crate::geom::{Implicit, Tape};
use crate::math::bounds::ErrorBounded;
use crate::roots::real_roots;
use num_bigint::{BigInt, Sign};
use std::cmp::Ordering;

/// A root, and the signs of f just before and just behind it.
#[derive(Clone, Copy, Debug)]
pub struct Meeting<'a> {
    pub root: Root<'a>,
    pub before: Ordering,
    pub after: Ordering,
}

/// Calls `visit` at all distinct roots along a line, in order, and returns the sign of f far
/// before the first. A line in the surface has no roots and the sign zero.
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
    // Coefficients so long that isolating roots would take seconds do not come from f64 numbers of
    // like size; such a line meets nothing.
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

/// Does the same for roots between two t, outside of which roots do not matter, in f64 where that
/// is certain: then the sign is that at the first t, where f is not zero.
pub fn meetings_between<'a>(
    tape: &'a Tape,
    line: &Line,
    between: [f64; 2],
    scratch: &mut PolynomialScratch,
    mut visit: impl FnMut(Meeting<'a>),
) -> Ordering {
    let Some(first) = crossings(tape, (line.org, line.dir), between, scratch) else {
        return meetings(tape, line, visit);
    };
    let mut sign = first;
    for at in &scratch.crossings {
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

/// Returns the exact sign of f at a point of finite coordinates.
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

/// Returns the bounds of a root whose nearest f64 is `t`.
fn known(t: f64) -> ErrorBounded {
    let error = match t.abs() {
        f64::MAX => f64::INFINITY,
        size => size.next_up() - size,
    };
    ErrorBounded { value: t, error }
}

/// Returns the first meeting beyond t_min. A solid is met at a root if the line is outside just
/// before or just behind it; a surface is met at each root in the clip.
pub(in crate::geom) fn first_beyond<'a>(
    row: &Implicit<'a>,
    line: &Line,
    t_min: f64,
    scratch: &mut PolynomialScratch,
) -> Option<Root<'a>> {
    let [enter, exit] = solid::clip(line, row.clip)?;
    let between = match row.bounds {
        Some(bounds) => line.part_in(&bounds, 1.0)?,
        None => [f64::NEG_INFINITY, f64::INFINITY],
    };
    let mut first = None;
    meetings_between(row.tape, line, between, scratch, |meeting| {
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
