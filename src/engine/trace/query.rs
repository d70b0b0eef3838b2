//! Queries of a packet: closest hit or any hit.
//!
//! A query keeps each lane's limit, the t beyond which no hit matters. Of equal t the lower id
//! wins, so the order of visits does not show.
//!
//! In `guarded` a hit's t lies in an interval. If the intervals of two hits do not overlap
//! the query orders them, else the caller compares them exactly.

mod any_hit;
mod closest;

pub use any_hit::AnyHit;
pub use closest::Closest;

use crate::geom::Meet;
use crate::math::lanes::{Lanes, Scalar};

/// Id of a primitive of an instance; ties in t go to the lower one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct HitId {
    /// Id of one of [`Instances`](crate::scene::Instances).
    pub instance: u64,
    /// Triangle in source order; 0 for other shapes.
    pub primitive: u32,
}

impl HitId {
    /// No hit.
    pub const NONE: HitId = HitId {
        instance: u64::MAX,
        primitive: u32::MAX,
    };
}

/// A query's state: limits and hits of a packet's rays.
pub trait Query<L: Lanes> {
    /// Whether any hit finishes a ray.
    const ANY: bool;
    /// Returns each lane's t_max so far; −∞ for finished lanes.
    fn limit(&self) -> L;
    /// `guarded`: lower bound of the current closest t; a hit whose upper bound is below it
    /// certainly wins.
    fn least(&self) -> L;
    /// `fast`: takes hits where they precede the current ones.
    fn accept(&mut self, hit: L::Mask, t: L, id: HitId);
    /// `guarded`: takes or drops the hits whose order with the current ones is certain, and
    /// returns the others.
    fn accept_sure(&mut self, meet: &Meet<L>, id: HitId) -> L::Mask;
    /// Returns what a hit of a lane has to precede; `None` for a finished lane.
    fn competitor(&self, lane: usize) -> Option<Competitor>;
    /// Takes a hit that precedes all others; `at` is called only if t is needed.
    fn commit(&mut self, lane: usize, at: impl FnOnce() -> Depth, id: HitId);
    /// Takes or drops one lane's hit. Returns whether its order with the current one is certain.
    fn try_commit(&mut self, lane: usize, at: Depth, id: HitId) -> bool;
    /// `fast`: takes hits of one instance, with a primitive for each lane.
    fn accept_each(&mut self, hit: L::Mask, t: L, instance: u64, primitives: &L::Ids);
    /// `guarded`: takes hits of one instance that certainly precede the current ones.
    fn accept_each_sure(&mut self, meet: &Meet<L>, instance: u64, primitives: &L::Ids);
    /// Any hit: marks lanes as blocked.
    fn block(&mut self, lanes: L::Mask, id: HitId);
    /// The same query at another width.
    type Together<W: Lanes>: Query<W> + Found;
    /// Starts the same query at another width.
    fn together<W: Lanes>(limit: W) -> Self::Together<W>;
}

/// Access to a query's hits.
pub trait Found {
    /// Returns a lane's t and id, if it has a hit, as [`Query::try_commit`] takes them.
    fn found(&self, lane: usize) -> Option<(Depth, HitId)>;
}

/// t of a hit.
#[derive(Clone, Copy, Debug)]
pub struct Depth {
    /// As it is reported.
    pub t: f64,
    /// `guarded`: bounds of the exact t.
    pub within: [f64; 2],
}

impl Depth {
    /// A t without bounds.
    pub fn point(t: f64) -> Depth {
        Depth { t, within: [t, t] }
    }
}

/// What a new hit is compared with.
#[derive(Clone, Copy, Debug)]
pub enum Competitor {
    /// The ray's end.
    End(f64),
    /// The closest hit so far, with bounds of its t.
    Hit(HitId, [f64; 2]),
}

/// Rounds the bounds of an interval outward to the type.
pub(super) fn outward<X: Scalar>([from, to]: [f64; 2]) -> [X; 2] {
    let (mut least, mut greatest) = (X::from_f64(from), X::from_f64(to));
    if least.to_f64() > from {
        least = next_down(least);
    }
    if greatest.to_f64() < to {
        greatest = next_up(greatest);
    }
    [least, greatest]
}

/// Returns the next greater number of the type.
pub(super) fn next_up<X: Scalar>(x: X) -> X {
    if size_of::<X>() == 8 {
        X::from_f64(x.to_f64().next_up())
    } else {
        X::from_f32((x.to_f64() as f32).next_up())
    }
}

/// Returns the next smaller number of the type.
fn next_down<X: Scalar>(x: X) -> X {
    if size_of::<X>() == 8 {
        X::from_f64(x.to_f64().next_down())
    } else {
        X::from_f32((x.to_f64() as f32).next_down())
    }
}
