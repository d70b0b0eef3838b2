//! What a packet asks: the closest hit, or any.
//!
//! A query keeps each lane's limit, the t beyond which nothing matters to it.
//! Equal t's go to the lower id, so the order of visits never shows.
//!
//! Guarded, a hit is known to lie between two bounds: it replaces another if the
//! bounds say so, is dropped if they say that, and else is the caller's to
//! compare exactly.

mod any_hit;
mod closest;

pub use any_hit::AnyHit;
pub use closest::Closest;

use crate::geom::Meet;
use crate::math::lanes::{Lanes, Scalar};

/// A primitive of an instance: what ties are broken by.
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

/// What a packet asks, and how far it has got.
pub trait Query<L: Lanes> {
    /// A ray is done with its first hit.
    const ANY: bool;
    /// Each lane's t_max so far; −∞ where the lane is done.
    fn limit(&self) -> L;
    /// Guarded: what a hit has to precede lies no nearer.
    fn least(&self) -> L;
    /// Hits that the kernel is certain of.
    fn accept(&mut self, hit: L::Mask, t: L, id: HitId);
    /// The same, guarded: takes the hits whose order with what is there is
    /// certain, and returns those whose is not.
    fn accept_sure(&mut self, meet: &Meet<L>, id: HitId) -> L::Mask;
    /// What a hit of a lane would have to precede; `None` where the lane is done.
    fn competitor(&self, lane: usize) -> Option<Competitor>;
    /// A hit that is before all others; its depth is asked for only where it counts.
    fn commit(&mut self, lane: usize, at: impl FnOnce() -> Depth, id: HitId);
    /// One lane's hit; whether its order with what is there is certain.
    fn try_commit(&mut self, lane: usize, at: Depth, id: HitId) -> bool;
    /// Hits of one instance, each lane's with a primitive of its own.
    fn accept_each(&mut self, hit: L::Mask, t: L, instance: u64, primitives: &L::Ids);
    /// The same, guarded, of hits that certainly precede what is there.
    fn accept_each_sure(&mut self, meet: &Meet<L>, instance: u64, primitives: &L::Ids);
    /// Any-hit: these rays are blocked, wherever.
    fn block(&mut self, lanes: L::Mask, id: HitId);
    /// The same question of as many rays as `W` has lanes.
    type Together<W: Lanes>: Query<W> + Found;
    fn together<W: Lanes>(limit: W) -> Self::Together<W>;
}

/// What a query has found.
pub trait Found {
    /// A lane's t and id, if it has a hit: what [`Query::try_commit`] takes.
    fn found(&self, lane: usize) -> Option<(Depth, HitId)>;
}

/// A hit's t.
#[derive(Clone, Copy, Debug)]
pub struct Depth {
    /// As it is reported.
    pub t: f64,
    /// Guarded: where it truly lies.
    pub within: [f64; 2],
}

impl Depth {
    /// Nothing else is known of it.
    pub fn point(t: f64) -> Depth {
        Depth { t, within: [t, t] }
    }
}

/// What a hit has to precede.
#[derive(Clone, Copy, Debug)]
pub enum Competitor {
    /// The ray's own end.
    End(f64),
    /// The nearest hit so far, and between which numbers it lies.
    Hit(HitId, [f64; 2]),
}

/// The next number.
pub(super) fn next_up<X: Scalar>(x: X) -> X {
    if size_of::<X>() == 8 {
        X::from_f64(x.to_f64().next_up())
    } else {
        X::from_f32((x.to_f64() as f32).next_up())
    }
}

/// The number before.
fn next_down<X: Scalar>(x: X) -> X {
    if size_of::<X>() == 8 {
        X::from_f64(x.to_f64().next_down())
    } else {
        X::from_f32((x.to_f64() as f32).next_down())
    }
}
