//! Polynomial surfaces: where a polynomial in x, y, z is zero.

use super::tape::{Arithmetic, Step, Tape};
use super::{Cuboid, Sphere};
use crate::math::lanes::Lanes;
use crate::math::{Aabb, Vec3};
use glam::DVec3;

/// The solid f(x, y, z) ≤ 0; or, where it is open or clipped, the surface f = 0 alone,
/// and of that what lies in the clip.
#[derive(Clone, Copy, Debug)]
pub struct Implicit<'a> {
    pub tape: &'a Tape,
    pub open: bool,
    /// Only of open ones.
    pub clip: Option<Clip>,
    /// Of the surface, clipped; `None` where none are known.
    pub bounds: Option<Aabb>,
}

/// What an open surface is seen in; closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clip {
    Sphere(Sphere),
    Cuboid(Cuboid),
}

impl Clip {
    pub fn bounds(&self) -> Aabb {
        match self {
            Clip::Sphere(sphere) => sphere.bounds(),
            Clip::Cuboid(cuboid) => Aabb::new(cuboid.min, cuboid.max),
        }
    }
}

impl Implicit<'_> {
    pub fn is_finite(&self) -> bool {
        let clip = match self.clip {
            None => true,
            Some(Clip::Sphere(ball)) => ball.center.is_finite() && ball.radius.is_finite(),
            Some(Clip::Cuboid(row)) => row.min.is_finite() && row.max.is_finite(),
        };
        let is_finite = |step: &Step| !matches!(step, Step::Constant(x) if !x.is_finite());
        clip && self.tape.steps().iter().all(is_finite)
    }
}

/// Of f, in f64.
pub fn gradient_at(tape: &Tape, p: DVec3) -> DVec3 {
    let (_, gradient) = values_at(tape, Vec3::<f64>::from(p));
    gradient.into()
}

/// A bound of the sum of all terms' magnitudes, where no coordinate is larger than
/// `reach`.
#[inline(always)]
pub fn size_at<D: Lanes<Scalar = f64>>(tape: &Tape, reach: D) -> D {
    let mut sum = D::zero();
    for c in tape.magnitude().iter().rev() {
        sum = sum * reach + D::from_f64(*c);
    }
    sum
}

/// f and its gradient, at points.
#[inline(always)]
pub fn values_at<D: Lanes<Scalar = f64>>(tape: &Tape, p: Vec3<D>) -> (D, Vec3<D>) {
    tape.evaluate(&Dual(p))
}

/// Values with gradients.
struct Dual<D>(Vec3<D>);

impl<D: Lanes<Scalar = f64>> Arithmetic for Dual<D> {
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
