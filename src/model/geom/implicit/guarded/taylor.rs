//! Evaluates a polynomial along rays by its Taylor form about a point: f(o + t d) = Σ tᵏ hₖ(d).
//! Rays of one origin share the coefficients of the hₖ, which are computed once (F6 to F9,
//! docs/numerics/polynomials.md).
//!
//! A ray takes the same steps whether it shares its origin or not.

use super::Rays;
use super::chebyshev_nodes::Stretch;
use crate::geom::Dense;
use crate::geom::dense::{Expanded, FLOOR, MOST, RANGE, taylor_forms};
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Mask};
use crate::roots::lanes::{Segment, from_powers};

/// Computes the polynomial on segments of rays that begin at `start`, in the lanes in which the
/// Taylor form pays; `None` if it pays in none.
///
/// f is expanded about the ray's origin, unless that is so far away that too much would cancel
/// (F8, docs/numerics/polynomials.md): then about the beginning of the segment, if an expansion
/// for each ray pays.
#[inline(always)]
pub(super) fn expanded<D: Lanes<Scalar = f64>, const N: usize>(
    dense: &Dense,
    rays: &Rays<D>,
    (start, width): (D, D),
    asked: D::Mask,
    expanded: &mut Expanded,
) -> Option<(Segment<D, N>, D::Mask)> {
    let zero = D::zero();
    let near = rays.org.max_abs().le(D::from_f64(dense.near));
    let of_use = match dense.everywhere {
        true => asked,
        // A ray that begins on the surface shares its origin with no other.
        false => asked & near & start.gt(rays.t_min),
    };
    if of_use.none() {
        return None;
    }
    let moved = rays.dir * start;
    let point = rays.org + moved;
    // Adding 0 turns −0 into +0, so that equal points have the same expansion.
    let base = Vec3::select(near, rays.org, point) + Vec3::new(zero, zero, zero);
    let from = D::select(near, start, zero);
    let (begin, step) = (from.abs(), rays.dir.abs());
    let unit = D::from_f64(1.01 * UNIT);
    let lost = Vec3::select(near, Vec3::new(zero, zero, zero), moved.abs() + point.abs());
    let off = lost * unit;
    let out = D::from_f64(1.0 + 8.0 * UNIT);
    let near_end = (base.abs() + step * begin) * out;
    let far_end = (base.abs() + step * (begin + width)) * out;
    let stretch = Stretch::choose((N as u32 - 1, dense.roundings()), far_end, off);
    let size = |end: Vec3<D>| dense.magnitude_in::<D, N>(stretch.magnitudes(FLOOR, end, off));
    let error = size(far_end) * stretch.lost;
    // Where f is expanded about the beginning itself, its value there has a much smaller error
    // (F7, docs/numerics/polynomials.md).
    let mut first = error;
    if (of_use & from.eq(zero)).any() {
        first = D::select(from.eq(zero), size(near_end) * stretch.lost, error);
    }
    let (range, longest) = (D::from_f64(RANGE), rays.dir.max_abs());
    let known =
        of_use & longest.ge(D::from_f64(FLOOR)) & longest.le(range) & far_end.max_abs().le(range);

    let mut c = powers::<D, N>(dense, (base, rays.dir), of_use, expanded);
    // Shift to the beginning of the segment, by repeated synthetic division.
    for round in 0..N - 1 {
        for k in (round..N - 1).rev() {
            c[k] = c[k] + from * c[k + 1];
        }
    }
    let mut power = width;
    for c in &mut c[1..] {
        *c = *c * power;
        power = power * width;
    }
    let Segment { scaled, .. } = from_powers(&c, zero);
    Some((
        Segment {
            scaled,
            error,
            first,
        },
        known,
    ))
}

/// Returns the coefficients of f(base + t dir) by powers of t.
#[inline(always)]
fn powers<D: Lanes<Scalar = f64>, const N: usize>(
    dense: &Dense,
    (base, dir): (Vec3<D>, Vec3<D>),
    asked: D::Mask,
    expanded: &mut Expanded,
) -> [D; N] {
    let one = asked.bits().trailing_zeros() as usize;
    let shared = [base.x.lane(one), base.y.lane(one), base.z.lane(one)];
    let [x, y, z] = shared.map(D::from_f64);
    let alike = base.x.eq(x) & base.y.eq(y) & base.z.eq(z);
    if (asked & !alike).none() {
        let c = expanded.coefficients_about(dense, shared);
        return taylor_forms(&|i| D::from_f64(c[i]), dir);
    }
    match N {
        3 => {
            let c = dense.expanded_about::<D, 10>(base);
            taylor_forms(&|i| c[i], dir)
        }
        4 => {
            let c = dense.expanded_about::<D, 20>(base);
            taylor_forms(&|i| c[i], dir)
        }
        _ => {
            let c = dense.expanded_about::<D, MOST>(base);
            taylor_forms(&|i| c[i], dir)
        }
    }
}

#[cfg(test)]
#[path = "taylor_tests.rs"]
mod tests;
