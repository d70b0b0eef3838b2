//! One ray and one primitive: all points where they meet, and the first one beyond the
//! origin.

use super::approx::{Approx, Undecided};
use super::csg::Csg;
use super::dyadic::Dyadic;
use super::ray::Ray;
use super::rounding;
use super::slack::Measured;
use super::solids::Meeting;
use crate::scene::{Scene, Shape};

/// A primitive of a scene.
#[derive(Clone, Copy)]
pub struct Primitive<'a> {
    pub scene: &'a Scene,
    pub shape: Shape,
    /// The triangle of a mesh; 0 otherwise.
    pub triangle: u32,
    /// The unfolded CSG solid, if the shape is one.
    pub csg: Option<&'a Csg>,
}

/// Bounds on the t of a first meeting.
#[derive(Clone, Debug)]
pub struct Within {
    pub lo: f64,
    pub hi: f64,
    /// The exact meeting, if f64 left it undecided.
    pub exact: Option<Meeting<Dyadic>>,
}

impl Primitive<'_> {
    /// The first with 0 < t < t_max; of faces that meet there, the lowest.
    fn first<N: Measured>(
        &self,
        ray: &Ray,
        t_max: f64,
    ) -> Result<Option<Meeting<N>>, N::Undecided> {
        let mut first: Option<Meeting<N>> = None;
        for meeting in self.meetings(ray)? {
            let t = &meeting.t;
            if t.order_with(0.0)?.is_le() || t_max.is_finite() && t.order_with(t_max)?.is_ge() {
                continue;
            }
            let nearer = match &first {
                None => true,
                Some(first) => t.order(&first.t)?.is_lt(),
            };
            if nearer {
                first = Some(meeting);
            }
        }
        Ok(first)
    }

    /// Bounds the t of the first meeting with 0 < t < t_max, by f64 if its error bounds
    /// decide, and otherwise by exact arithmetic.
    pub fn first_within(&self, ray: &Ray, t_max: f64) -> Option<Within> {
        if !ray.is_finite() || !(t_max > 0.0) {
            return None;
        }
        let t = match self.first::<Approx>(ray, t_max) {
            Ok(None) => return None,
            Ok(Some(meeting)) => meeting.t.value(),
            Err(Undecided) => Approx::exact(f64::NAN),
        };
        if t.lo().is_finite() && t.hi().is_finite() {
            return Some(Within {
                lo: t.lo(),
                hi: t.hi(),
                exact: None,
            });
        }
        let exact = self.first_exactly(ray, t_max)?;
        let t = rounding::nearest(&exact.t);
        Some(Within {
            lo: t.next_down(),
            hi: t.next_up(),
            exact: Some(exact),
        })
    }

    /// Finds the first meeting with 0 < t < t_max by exact arithmetic.
    pub fn first_exactly(&self, ray: &Ray, t_max: f64) -> Option<Meeting<Dyadic>> {
        if !ray.is_finite() || !(t_max > 0.0) {
            return None;
        }
        let Ok(first) = self.first(ray, t_max);
        first
    }

    /// Finds all meetings on the whole line by exact arithmetic, in no order.
    pub fn meetings_exactly(&self, ray: &Ray) -> Vec<Meeting<Dyadic>> {
        if !ray.is_finite() {
            return Vec::new();
        }
        let Ok(meetings) = self.meetings(ray);
        meetings
    }
}
