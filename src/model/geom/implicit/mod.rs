//! Polynomial surfaces: where a polynomial in x, y, z is zero.

pub(super) mod check;
pub(super) mod exact;
pub mod guarded;
mod table;
pub mod torus;

pub use table::Implicits;

use super::guarded::{Ends, ObjectRay, cuboid, sphere};
use super::tape::{Arithmetic, Step, Tape};
use super::{Cuboid, Dense, Sphere};
use crate::math::lanes::Lanes;
use crate::math::{Aabb, Vec3, is_power_of_two};
use glam::DVec3;

/// The solid f(x, y, z) ≤ 0; or, if it is open, the surface f = 0, or the part of it in the clip.
#[derive(Clone, Copy, Debug)]
pub struct Implicit<'a> {
    pub tape: &'a Tape,
    /// The tape expanded into monomials, where that pays.
    pub dense: Option<&'a Dense>,
    pub open: bool,
    /// The clip, which only open surfaces have.
    pub clip: Option<Clip>,
    /// The box of the clipped surface; `None` if none is known.
    pub bounds: Option<Aabb>,
}

/// The closed region to which a surface is cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clip {
    Sphere(Sphere),
    Cuboid(Cuboid),
}

impl Clip {
    pub fn is_finite(&self) -> bool {
        match self {
            Clip::Sphere(ball) => ball.center.is_finite() && ball.radius.is_finite(),
            Clip::Cuboid(row) => row.min.is_finite() && row.max.is_finite(),
        }
    }

    pub fn bounds(&self) -> Aabb {
        match self {
            Clip::Sphere(sphere) => sphere.bounds(),
            Clip::Cuboid(cuboid) => Aabb::new(cuboid.min, cuboid.max),
        }
    }
}

impl Implicit<'_> {
    pub fn is_finite(&self) -> bool {
        let clip = self.clip.is_none_or(|clip| clip.is_finite());
        let mut constants = self.tape.steps().iter().filter_map(Step::constant);
        clip && constants.all(f64::is_finite)
    }

    /// Returns the ends of rays in the surface's clip or, without a clip, in its bounds;
    /// `None` if it has neither.
    #[inline(always)]
    pub(super) fn region_ends<L: Lanes>(&self, object: &ObjectRay<L>) -> Option<Ends<L>> {
        match (self.clip, self.bounds) {
            (Some(Clip::Sphere(ball)), _) => Some(sphere::sphere_ends(&ball, object)),
            (Some(Clip::Cuboid(row)), _) => Some(cuboid::ends(&row, object)),
            (None, Some(Aabb { min, max })) => Some(cuboid::ends(&Cuboid { min, max }, object)),
            (None, None) => None,
        }
    }
}

/// Returns the gradient of f in f64.
pub fn gradient_at(tape: &Tape, p: DVec3) -> DVec3 {
    let (_, gradient) = values_at(tape, Vec3::<f64>::from(p));
    gradient.into()
}

/// Bounds the error of f in arithmetic with the roundoff `unit` and f64's range, if no coordinate
/// is larger than `reach` and each is off by at most `off`: running error analysis (Higham,
/// Accuracy and Stability of Numerical Algorithms).
#[inline(always)]
pub fn error_in<D: Lanes<Scalar = f64>>(tape: &Tape, reach: Vec3<D>, off: Vec3<D>, unit: f64) -> D {
    let least = D::splat(f64::MIN_POSITIVE);
    // No coordinate is known better than to the least normal number.
    let off = off + Vec3::new(least, least, least);
    let unit = D::splat(1.01 * unit);
    tape.evaluate_plain(&Errors { reach, off, unit }).1
}

/// Arithmetic of magnitudes with error bounds. A hundredth added to the roundoff covers the
/// roundings of the bounds.
struct Errors<D> {
    reach: Vec3<D>,
    off: Vec3<D>,
    unit: D,
}

impl<D: Lanes<Scalar = f64>> Arithmetic for Errors<D> {
    type Value = (D, D);

    #[inline(always)]
    fn coordinate(&self, axis: usize) -> (D, D) {
        (self.reach.axis(axis), self.off.axis(axis))
    }

    #[inline(always)]
    fn constant(&self, value: f64) -> (D, D) {
        (D::splat(value.abs()), D::zero())
    }

    #[inline(always)]
    fn sum(&self, a: &(D, D), b: &(D, D)) -> (D, D) {
        let size = a.0 + b.0;
        (size, (a.1 + b.1) + size * self.unit)
    }

    #[inline(always)]
    fn difference(&self, a: &(D, D), b: &(D, D)) -> (D, D) {
        self.sum(a, b)
    }

    #[inline(always)]
    fn product(&self, a: &(D, D), b: &(D, D)) -> (D, D) {
        let size = a.0 * b.0;
        let carried = a.0 * b.1 + a.1 * (b.0 + b.1);
        // An underflow loses the product, and the loss may be multiplied again.
        let lost = size * self.unit + D::splat(f64::MIN_POSITIVE);
        (size, carried + lost)
    }

    #[inline(always)]
    fn scaled(&self, a: &(D, D), by: f64) -> (D, D) {
        let factor = D::splat(by.abs());
        let (size, carried) = (a.0 * factor, a.1 * factor);
        let least = D::splat(f64::MIN_POSITIVE);
        let lost = match is_power_of_two(by) {
            true => least,
            false => size * self.unit + least,
        };
        (size, carried + lost)
    }
}

/// Evaluates S, the tape of magnitudes: constants without signs, differences as sums (F1,
/// docs/numerics/polynomials.md).
#[inline(always)]
pub fn magnitude_at<D: Lanes<Scalar = f64>>(tape: &Tape, size: Vec3<D>) -> D {
    tape.evaluate_plain(&Magnitudes(size))
}

struct Magnitudes<D>(Vec3<D>);

impl<D: Lanes<Scalar = f64>> Arithmetic for Magnitudes<D> {
    type Value = D;

    #[inline(always)]
    fn coordinate(&self, axis: usize) -> D {
        self.0.axis(axis)
    }

    #[inline(always)]
    fn constant(&self, value: f64) -> D {
        D::splat(value.abs())
    }

    #[inline(always)]
    fn sum(&self, a: &D, b: &D) -> D {
        *a + *b
    }

    #[inline(always)]
    fn difference(&self, a: &D, b: &D) -> D {
        *a + *b
    }

    #[inline(always)]
    fn product(&self, a: &D, b: &D) -> D {
        *a * *b
    }
}

/// Evaluates f and its gradient at points.
#[inline(always)]
pub fn values_at<D: Lanes<Scalar = f64>>(tape: &Tape, p: Vec3<D>) -> (D, Vec3<D>) {
    tape.evaluate_plain(&Gradients(p))
}

/// Evaluates f and its gradient by the faster of tape and expansion.
#[inline(always)]
pub fn values_of<D: Lanes<Scalar = f64>>(row: &Implicit, p: Vec3<D>) -> (D, Vec3<D>) {
    match row.dense {
        Some(dense) => dense.values_at(p),
        None => values_at(row.tape, p),
    }
}

/// Arithmetic of values with gradients.
struct Gradients<D>(Vec3<D>);

impl<D: Lanes<Scalar = f64>> Arithmetic for Gradients<D> {
    type Value = (D, Vec3<D>);

    #[inline(always)]
    fn coordinate(&self, axis: usize) -> Self::Value {
        let unit = std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 });
        (self.0.axis(axis), Vec3::splat(unit))
    }

    #[inline(always)]
    fn constant(&self, value: f64) -> Self::Value {
        (D::splat(value), Vec3::splat([0.0; 3]))
    }

    #[inline(always)]
    fn sum(&self, a: &Self::Value, b: &Self::Value) -> Self::Value {
        (a.0 + b.0, a.1 + b.1)
    }

    #[inline(always)]
    fn difference(&self, a: &Self::Value, b: &Self::Value) -> Self::Value {
        (a.0 - b.0, a.1 - b.1)
    }

    #[inline(always)]
    fn product(&self, a: &Self::Value, b: &Self::Value) -> Self::Value {
        (a.0 * b.0, a.1 * b.0 + b.1 * a.0)
    }
}
