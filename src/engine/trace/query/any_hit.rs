//! Any-hit queries: occlusion of each lane.

use super::{Competitor, Depth, Found, HitId, Query};
use crate::geom::Meet;
use crate::math::lanes::{Lanes, Mask, Scalar, max};

/// Occlusion of a packet's rays.
pub struct AnyHit<L: Lanes> {
    limit: L,
    /// The last occluder of any lane.
    pub occluder: HitId,
}

impl<L: Lanes> AnyHit<L> {
    #[inline(always)]
    pub fn new(t_max: L) -> AnyHit<L> {
        AnyHit {
            // −∞ is reserved for blocked lanes.
            limit: max(t_max, L::from_f32(f32::MIN)),
            occluder: HitId::NONE,
        }
    }

    /// Returns the blocked lanes.
    #[inline(always)]
    pub fn blocked(&self) -> L::Mask {
        self.limit.eq(-L::splat(L::Scalar::INFINITY))
    }
}

impl<L: Lanes> Query<L> for AnyHit<L> {
    const ANY: bool = true;

    #[inline(always)]
    fn limit(&self) -> L {
        self.limit
    }

    #[inline(always)]
    fn least(&self) -> L {
        self.limit
    }

    #[inline(always)]
    fn accept(&mut self, hit: L::Mask, t: L, id: HitId) {
        let blocked = hit & t.lt(self.limit);
        if blocked.any() {
            self.block(blocked, id);
        }
    }

    #[inline(always)]
    fn accept_sure(&mut self, meet: &Meet<L>, id: HitId) -> L::Mask {
        let [from, to] = meet.within;
        let open = !self.blocked();
        let sure = meet.hit & to.lt(self.limit);
        if sure.any() {
            self.block(sure, id);
        }
        meet.hit & open & !sure & !from.gt(self.limit)
    }

    fn competitor(&self, lane: usize) -> Option<Competitor> {
        let end = self.limit.lane(lane).to_f64();
        (end != f64::NEG_INFINITY).then_some(Competitor::End(end))
    }

    fn commit(&mut self, lane: usize, _at: impl FnOnce() -> Depth, id: HitId) {
        self.block(L::Mask::from_bits(1 << lane), id);
    }

    fn try_commit(&mut self, lane: usize, at: Depth, id: HitId) -> bool {
        if at.within[1] < self.limit.lane(lane).to_f64() {
            self.block(L::Mask::from_bits(1 << lane), id);
        }
        true
    }

    #[inline(always)]
    fn accept_each(&mut self, hit: L::Mask, t: L, instance: u64, primitives: &L::Ids) {
        let blocked = hit & t.lt(self.limit);
        let bits = blocked.bits();
        if bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            let primitive = primitives.as_ref()[lane];
            self.block(
                blocked,
                HitId {
                    instance,
                    primitive,
                },
            );
        }
    }

    fn accept_each_sure(&mut self, meet: &Meet<L>, instance: u64, primitives: &L::Ids) {
        self.accept_each(meet.hit, meet.within[1], instance, primitives);
    }

    #[inline(always)]
    fn block(&mut self, lanes: L::Mask, id: HitId) {
        let done = -L::splat(L::Scalar::INFINITY);
        self.limit = L::select(lanes, done, self.limit);
        self.occluder = id;
    }

    type Together<W: Lanes> = AnyHit<W>;

    #[inline(always)]
    fn together<W: Lanes>(limit: W) -> AnyHit<W> {
        AnyHit::new(limit)
    }
}

impl<L: Lanes> Found for AnyHit<L> {
    /// t is −∞: any-hit rays need none.
    #[inline(always)]
    fn found(&self, lane: usize) -> Option<(Depth, HitId)> {
        let blocked = self.blocked().bits() >> lane & 1 != 0;
        blocked.then_some((Depth::point(f64::NEG_INFINITY), self.occluder))
    }
}
