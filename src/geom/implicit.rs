//! Polynomial surfaces: where a polynomial in x, y, z is zero.

use super::tape::Tape;
use super::{Cuboid, Sphere};
use crate::math::Aabb;

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
