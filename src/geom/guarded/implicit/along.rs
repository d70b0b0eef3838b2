//! A tape's polynomial along rays.

use super::Rays;
use super::eights::by_degree;
use crate::geom::implicit::error_at;
use crate::geom::tape::{Step, Tape};
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::math::lanes::Lanes;
use crate::roots::collocation::{Collocation, MOST, collocation};
use crate::roots::lanes::Segment;

/// How far off a surface rays begin that lanes shall know to have left it, times its
/// slope there, in units of [`crate::math::bounds::LEAVING`]: what f may be off by at
/// points that are themselves rounded, grown by interpolation.
#[inline(always)]
pub fn blur_at<D: Lanes<Scalar = f64>>(tape: &Tape, p: Vec3<D>) -> D {
    let size = p.abs();
    let nodes = by_degree!(tape.degree(), N => N, MOST);
    let grown = collocation(nodes).norm / 16.0;
    error_at(tape, size, size * D::from_f64(UNIT)) * D::from_f64(grown.max(1.0))
}

/// A tape's polynomial on the parts of rays that begin at `start`. `astray`: how far off the surface itself may be.
#[inline(always)]
pub(super) fn along<D: Lanes<Scalar = f64>, const N: usize>(
    tape: &Tape,
    rays: &Rays<D>,
    (start, width, astray): (D, D, D),
    steps: &mut Vec<D>,
) -> Segment<D, N> {
    let table: &Collocation = collocation(N);
    let point = rays.org.along(rays.dir, start);
    let step = rays.dir * width;
    let last = point + step;
    let values = values::<D, N>(tape, (point, step), &table.nodes, steps);
    // What coordinates are off by, of nodes and of the first one.
    let unit = D::from_f64(1.01 * UNIT);
    let begun = D::select(start.eq(D::zero()), D::zero(), unit);
    let (moved, near) = ((rays.dir * start).abs(), point.abs());
    let far = last.abs();
    let reach = Vec3::new(near.x.max(far.x), near.y.max(far.y), near.z.max(far.z));
    let reach = reach * D::from_f64(1.0 + 8.0 * UNIT);
    let astray = Vec3::new(astray, astray, astray);
    let off = (moved + near + reach + step.abs() * D::from_f64(2.0)) * unit + astray;
    let of_values = error_at(tape, reach, off);
    let first = error_at(tape, near, (moved + near) * begun + astray);
    let mut largest = values[0].abs();
    for value in &values[1..] {
        largest = largest.max(value.abs());
    }
    let rounding = D::from_f64((N as f64 + 3.0) * UNIT);
    let error = (of_values + largest * rounding) * D::from_f64(table.norm);
    let mut scaled = [values[0]; N];
    for (to, row) in scaled.iter_mut().zip(&table.rows).skip(1) {
        let mut sum = values[0] * D::from_f64(row[0]);
        for (value, factor) in values.iter().zip(row).skip(1) {
            sum = sum + *value * D::from_f64(*factor);
        }
        *to = sum;
    }
    Segment {
        scaled,
        error,
        first,
    }
}

/// A tape at nodes between a point and `step` farther.
#[inline(always)]
fn values<D: Lanes<Scalar = f64>, const N: usize>(
    tape: &Tape,
    (point, step): (Vec3<D>, Vec3<D>),
    nodes: &[f64],
    all: &mut Vec<D>,
) -> [D; N] {
    all.resize(all.len().max(tape.slot_count() * N), D::zero());
    let place = |i: u32| usize::from(tape.slots()[i as usize]) * N;
    for (i, what) in tape.steps().iter().enumerate() {
        let to = place(i as u32);
        match *what {
            Step::Coordinate(axis) => {
                let (from, by) = (point.axis(usize::from(axis)), step.axis(usize::from(axis)));
                for (value, s) in all[to..to + N].iter_mut().zip(nodes) {
                    *value = from + by * D::from_f64(*s);
                }
            }
            Step::Constant(value) => all[to..to + N].fill(D::from_f64(value)),
            Step::Sum(a, b) => combine::<D, N>(all, (place(a), place(b)), to, |a, b| a + b),
            Step::Difference(a, b) => {
                combine::<D, N>(all, (place(a), place(b)), to, |a, b| a - b);
            }
            Step::Product(a, b) => combine::<D, N>(all, (place(a), place(b)), to, |a, b| a * b),
            Step::Scaled(a, by) => {
                let by = D::from_f64(by);
                combine::<D, N>(all, (place(a), place(a)), to, |a, _| a * by);
            }
        }
    }
    let last = place(tape.steps().len() as u32 - 1);
    let mut result = [D::zero(); N];
    result.copy_from_slice(&all[last..last + N]);
    result
}

/// One step at all nodes: the places of its operands, and of the result, which may be
/// one of theirs.
#[inline(always)]
fn combine<D: Lanes, const N: usize>(
    all: &mut [D],
    (a, b): (usize, usize),
    to: usize,
    of: impl Fn(D, D) -> D,
) {
    let mut result = [D::zero(); N];
    let (first, second) = (&all[a..a + N], &all[b..b + N]);
    for ((value, x), y) in result.iter_mut().zip(first).zip(second) {
        *value = of(*x, *y);
    }
    all[to..to + N].copy_from_slice(&result);
}
