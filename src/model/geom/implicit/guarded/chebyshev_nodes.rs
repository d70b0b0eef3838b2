//! Interpolates a tape's polynomial along rays from its values at Chebyshev nodes (F1 to F5,
//! docs/numerics/polynomials.md).

use super::lane_regrouping::by_degree;
use super::taylor::expanded;
use super::{Rays, Store};
use crate::geom::dense;
use crate::geom::implicit::magnitude_at;
use crate::geom::tape::{Fused, Tape};
use crate::geom::{Dense, Implicit};
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Mask};
use crate::roots::collocation::{Collocation, MOST, collocation};
use crate::roots::lanes::Segment;

/// Bounds the error of f at rounded points, grown by interpolation, in units of
/// [`crate::math::bounds::LEAVING`] (F17, docs/numerics/polynomials.md). Divided by the slope it
/// is the distance at which a ray must start so that lanes are certain that it has left the
/// surface.
#[inline(always)]
pub fn blur_at<D: Lanes<Scalar = f64>>((tape, dense): (&Tape, Option<&Dense>), p: Vec3<D>) -> D {
    if let Some(dense) = dense.filter(|dense| dense.everywhere) {
        return dense.blur_at(p);
    }
    let nodes = by_degree!(tape.degree(), N => N, MOST);
    let grown = collocation(nodes).norm / 16.0;
    let (size, floor) = (p.abs(), D::from_f64(tape.floor()));
    let size = Vec3::new(size.x.max(floor), size.y.max(floor), size.z.max(floor));
    // Every term is rounded, and so are its coordinates (F17, docs/numerics/polynomials.md).
    let lost = 1.02 * (tape.roundings() + f64::from(tape.degree())) * UNIT;
    magnitude_at(tape, size) * D::from_f64(lost * grown.max(1.0))
}

/// Computes a surface's polynomial on segments of rays that begin at `start`, for the lanes
/// `asked`; other lanes are meaningless.
#[inline(always)]
pub(super) fn segment_of<D: Lanes<Scalar = f64>, const N: usize>(
    row: &Implicit,
    rays: &Rays<D>,
    part: (D, D),
    asked: D::Mask,
    store: &mut Store<D>,
) -> Segment<D, N> {
    let (start, width) = part;
    let whole = (start, width, D::zero());
    let by_nodes = |steps: &mut _| interpolated::<D, N>(row.tape, rays, whole, steps);
    let dense = row.dense.filter(|_| N - 1 <= dense::DEGREE);
    let Some(dense) = dense else {
        return by_nodes(&mut store.values);
    };
    let Some((formed, known)) = expanded::<D, N>(dense, rays, part, asked, &mut store.expanded)
    else {
        return by_nodes(&mut store.values);
    };
    if (asked & !known).none() {
        return formed;
    }
    let other: Segment<D, N> = by_nodes(&mut store.values);
    Segment {
        scaled: std::array::from_fn(|j| D::select(known, formed.scaled[j], other.scaled[j])),
        error: D::select(known, formed.error, other.error),
        first: D::select(known, formed.first, other.first),
    }
}

/// Interpolates a tape's polynomial from its values at the nodes. `astray` bounds how far the
/// surface itself may be displaced.
#[inline(always)]
pub(super) fn interpolated<D: Lanes<Scalar = f64>, const N: usize>(
    tape: &Tape,
    rays: &Rays<D>,
    (start, width, astray): (D, D, D),
    steps: &mut Vec<D>,
) -> Segment<D, N> {
    let table: &Collocation = collocation(N);
    let point = rays.org.along(rays.dir, start);
    let step = rays.dir * width;
    let last = point + step;
    // Error bounds of coordinates, at all nodes and at the first one (F2,
    // docs/numerics/polynomials.md).
    let unit = D::from_f64(1.01 * UNIT);
    let begun = D::select(start.eq(D::zero()), D::zero(), unit);
    let (moved, near) = ((rays.dir * start).abs(), point.abs());
    let far = last.abs();
    let reach = Vec3::new(near.x.max(far.x), near.y.max(far.y), near.z.max(far.z));
    let reach = reach * D::from_f64(1.0 + 8.0 * UNIT);
    let astray = Vec3::new(astray, astray, astray);
    let off = (moved + near + reach + step.abs() * D::from_f64(2.0)) * unit + astray;
    let first_off = (moved + near) * begun + astray;
    let stretch = Stretch::choose_for_tape(tape, reach, off);
    let sizes = [
        stretch.magnitudes(tape.floor(), reach, off),
        stretch.magnitudes(tape.floor(), near, first_off),
    ];
    let (values, sizes) = values::<D, N>(tape, (point, step), sizes, &table.nodes, steps);
    let [of_values, first] = sizes.map(|size| size * stretch.lost);
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

/// The stretch λ with which one value of magnitudes S bounds all errors of f (F3,
/// docs/numerics/polynomials.md). Errors of coordinates change f by at most S(R + off) − S(R).
/// Since S is convex, λ ≥ 1 times that is at most S(R + λ·off), which bounds the roundings of the
/// tape as well.
pub(super) struct Stretch<D> {
    /// The stretch λ.
    by: D,
    /// The factor of S(R + λ·off): 1.01/λ and the roundings.
    pub lost: D,
}

impl<D: Lanes<Scalar = f64>> Stretch<D> {
    /// Chooses λ so that it moves the largest coordinate by 1/degree of itself, by which the
    /// polynomial grows to at most e times its value.
    #[inline(always)]
    pub fn choose((degree, roundings): (u32, f64), reach: Vec3<D>, off: Vec3<D>) -> Stretch<D> {
        let one = D::from_f64(1.0);
        let parts = D::from_f64(f64::from(degree.max(1)));
        let least = D::from_f64(f64::MIN_POSITIVE);
        let inverse = off.max_element() * parts / (reach.max_element() + least);
        // A larger λ gains nothing beside the roundings.
        let inverse = inverse.max(D::from_f64(UNIT / 256.0)).min(one);
        let roundings = D::from_f64(1.02 * roundings * UNIT);
        Stretch {
            by: one / inverse,
            lost: inverse * D::from_f64(1.01) + roundings,
        }
    }

    #[inline(always)]
    fn choose_for_tape(tape: &Tape, reach: Vec3<D>, off: Vec3<D>) -> Stretch<D> {
        Stretch::choose((tape.degree(), tape.roundings()), reach, off)
    }

    /// Returns R + λ·off, and `floor` at least (F4, docs/numerics/polynomials.md).
    #[inline(always)]
    pub fn magnitudes(&self, floor: f64, reach: Vec3<D>, off: Vec3<D>) -> Vec3<D> {
        let floor = D::from_f64(floor);
        let far = reach + off * self.by;
        Vec3::new(far.x.max(floor), far.y.max(floor), far.z.max(floor))
    }
}

/// Evaluates a tape at the nodes between a point and `step` farther, and its magnitudes S at two
/// points.
#[inline(always)]
fn values<D: Lanes<Scalar = f64>, const N: usize>(
    tape: &Tape,
    (point, step_along): (Vec3<D>, Vec3<D>),
    sizes: [Vec3<D>; 2],
    nodes: &[f64],
    all: &mut Vec<D>,
) -> ([D; N], [D; 2]) {
    let (steps, places) = tape.fused();
    let columns = const { N + 2 };
    all.resize(all.len().max(places * columns), D::zero());
    let place = |at: u16| usize::from(at) * columns;
    let mut last = 0;
    for (step, to) in steps {
        let to = place(*to);
        last = to;
        match *step {
            Fused::Coordinate(axis) => {
                let axis = usize::from(axis);
                let (from, by) = (point.axis(axis), step_along.axis(axis));
                let (values, magnitudes) = all[to..to + columns].split_at_mut(N);
                for (value, s) in values.iter_mut().zip(nodes) {
                    *value = from + by * D::from_f64(*s);
                }
                magnitudes.copy_from_slice(&sizes.map(|size| size.axis(axis)));
            }
            Fused::Constant(value) => {
                let (values, magnitudes) = all[to..to + columns].split_at_mut(N);
                values.fill(D::from_f64(value));
                magnitudes.fill(D::from_f64(value.abs()));
            }
            Fused::Sum(a, b) => {
                let sum = |a, b, _| a + b;
                combine::<D, N>(all, [a, b, b].map(place), to, sum, sum);
            }
            Fused::Difference(a, b) => {
                let (of, sizes) = (|a, b, _| a - b, |a, b, _| a + b);
                combine::<D, N>(all, [a, b, b].map(place), to, of, sizes);
            }
            Fused::Product(a, b) => {
                let product = |a, b, _| a * b;
                combine::<D, N>(all, [a, b, b].map(place), to, product, product);
            }
            Fused::ProductAnd(a, b, c) => {
                let sum = |a, b, c| a * b + c;
                combine::<D, N>(all, [a, b, c].map(place), to, sum, sum);
            }
            Fused::ProductLess(a, b, c) => {
                let (of, sizes) = (|a, b, c| a * b - c, |a, b, c| a * b + c);
                combine::<D, N>(all, [a, b, c].map(place), to, of, sizes);
            }
            Fused::LessProduct(a, b, c) => {
                let (of, sizes) = (|a, b, c| c - a * b, |a, b, c| a * b + c);
                combine::<D, N>(all, [a, b, c].map(place), to, of, sizes);
            }
            Fused::Scaled(a, by) => {
                let (by, size) = (D::from_f64(by), D::from_f64(by.abs()));
                let (of, sizes) = (|a, _, _| a * by, |a, _, _| a * size);
                combine::<D, N>(all, [a, a, a].map(place), to, of, sizes);
            }
            Fused::ScaledAnd(a, by, c) => {
                let (by, size) = (D::from_f64(by), D::from_f64(by.abs()));
                let (of, sizes) = (|a, _, c| a * by + c, |a, _, c| a * size + c);
                combine::<D, N>(all, [a, a, c].map(place), to, of, sizes);
            }
            Fused::ScaledLess(a, by, c) => {
                let (by, size) = (D::from_f64(by), D::from_f64(by.abs()));
                let (of, sizes) = (|a, _, c| a * by - c, |a, _, c| a * size + c);
                combine::<D, N>(all, [a, a, c].map(place), to, of, sizes);
            }
            Fused::LessScaled(a, by, c) => {
                let (by, size) = (D::from_f64(by), D::from_f64(by.abs()));
                let (of, sizes) = (|a, _, c| c - a * by, |a, _, c| a * size + c);
                combine::<D, N>(all, [a, a, c].map(place), to, of, sizes);
            }
        }
    }
    let (mut values, mut magnitudes) = ([D::zero(); N], [D::zero(); 2]);
    values.copy_from_slice(&all[last..last + N]);
    magnitudes.copy_from_slice(&all[last + N..last + columns]);
    (values, magnitudes)
}

/// Computes one step at all nodes and for the magnitudes, given the slots of its operands and of
/// the result, which may be one of the operands'.
#[inline(always)]
fn combine<D: Lanes, const N: usize>(
    all: &mut [D],
    [a, b, c]: [usize; 3],
    to: usize,
    of: impl Fn(D, D, D) -> D,
    of_sizes: impl Fn(D, D, D) -> D,
) {
    let columns = const { N + 2 };
    let mut result = [D::zero(); N];
    let (a, b, c) = (
        &all[a..a + columns],
        &all[b..b + columns],
        &all[c..c + columns],
    );
    for (((value, a), b), c) in result.iter_mut().zip(a).zip(b).zip(c) {
        *value = of(*a, *b, *c);
    }
    let sizes = [N, N + 1].map(|i| of_sizes(a[i], b[i], c[i]));
    all[to..to + N].copy_from_slice(&result);
    all[to + N..to + columns].copy_from_slice(&sizes);
}

#[cfg(test)]
#[path = "chebyshev_nodes_tests.rs"]
mod tests;
