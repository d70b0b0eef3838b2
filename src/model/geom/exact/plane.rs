//! Crossing of a line and a plane through a point, by integers ([`crate::math::int`]): t is a
//! fraction (D16, docs/numerics/exact.md). Functions return `None` if four limbs do not hold the
//! numbers.

use super::Line;
use crate::math::Ratio;
use crate::math::int::{Grid, Int};
use std::cmp::Ordering;

/// The plane n·(x − p) = 0, and a line.
#[derive(Clone, Copy)]
pub(in crate::geom) struct Through<'a> {
    pub normal: &'a [f64; 3],
    pub point: &'a [f64; 3],
    pub line: &'a Line,
}

/// Calls a function at the least size that holds the numbers: two limbs hold normals and places of
/// like size, four nearly all.
macro_rules! at_size {
    ($function:ident($($argument:expr),*)) => {
        $function::<2, 4, 8>($($argument),*).or_else(|| $function::<4, 8, 16>($($argument),*))
    };
}

/// Returns the sign of n·d.
pub(in crate::geom) fn rise(normal: &[f64; 3], dir: &[f64; 3]) -> Option<Ordering> {
    fn of<const N: usize, const Q: usize>(n: &[f64; 3], d: &[f64; 3]) -> Option<Ordering> {
        Some(dot::<N, Q>(&placed(n)?.0, &placed(d)?.0).sign())
    }
    of::<1, 2>(normal, dir)
        .or_else(|| of::<2, 4>(normal, dir))
        .or_else(|| of::<4, 8>(normal, dir))
}

/// Orders two t. The lines are parallel to neither plane.
pub(in crate::geom) fn order(a: &Through, b: &Through) -> Option<Ordering> {
    fn of<const N: usize, const Q: usize, const R: usize>(
        a: &Through,
        b: &Through,
    ) -> Option<Ordering> {
        Some(a.fraction::<N, Q>()?.order::<R>(&b.fraction::<N, Q>()?))
    }
    at_size!(of(a, b))
}

/// Orders t and a finite number.
pub(in crate::geom) fn order_with(a: &Through, x: f64) -> Option<Ordering> {
    fn of<const N: usize, const Q: usize, const R: usize>(a: &Through, x: f64) -> Option<Ordering> {
        Some(a.fraction::<N, Q>()?.order::<R>(&Ratio::of(x)))
    }
    at_size!(of(a, x))
}

/// Returns the f64 nearest to t.
pub(in crate::geom) fn rounded(a: &Through) -> Option<f64> {
    fn of<const N: usize, const Q: usize, const R: usize>(a: &Through) -> Option<f64> {
        Some(a.fraction::<N, Q>()?.rounded::<R>())
    }
    at_size!(of(a))
}

impl Through<'_> {
    /// Returns t = n·(p − o) / n·d.
    #[inline(always)]
    fn fraction<const N: usize, const Q: usize>(&self) -> Option<Ratio<Q>> {
        let (normal, _) = placed::<N>(self.normal)?;
        let (dir, dir_power) = placed::<N>(&self.line.dir)?;
        let places = [*self.point, self.line.org];
        let grid = Grid::<N>::over(&places);
        let [p, o] = grid.place(&places)?;
        let from = [p[0].minus(&o[0]), p[1].minus(&o[1]), p[2].minus(&o[2])];
        let (top, bottom): (Int<Q>, Int<Q>) = (dot(&normal, &from), dot(&normal, &dir));
        let down = bottom.is_negative();
        Some(Ratio {
            top: top.negated_if(down),
            bottom: bottom.negated_if(down),
            power: grid.power() - dir_power,
        })
    }
}

/// Returns a vector in integers, and the power of two that is their unit.
#[inline(always)]
fn placed<const N: usize>(v: &[f64; 3]) -> Option<([Int<N>; 3], i32)> {
    let grid = Grid::<N>::over(&[*v]);
    let [placed] = grid.place(&[*v])?;
    Some((placed, grid.power()))
}

#[inline(always)]
fn dot<const N: usize, const Q: usize>(x: &[Int<N>; 3], y: &[Int<N>; 3]) -> Int<Q> {
    let product = |k: usize| -> Int<Q> { x[k].times(&y[k]) };
    product(0).plus(&product(1)).plus(&product(2))
}
