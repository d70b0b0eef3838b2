//! Closest-hit queries.

use super::{Competitor, Depth, Found, HitId, Query, outward};
use crate::geom::{Certainty, Meet};
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::trace::hits::Ids;
use std::marker::PhantomData;

/// Splits an id into its low and high word.
#[inline(always)]
fn words(id: u64) -> [u32; 2] {
    [id as u32, (id >> 32) as u32]
}

/// Closest hits of a packet's rays.
pub struct Closest<L: Lanes, C> {
    /// t of the closest hit; in `guarded` its upper bound.
    limit: L,
    /// `guarded`: lower bound of the closest hit's t.
    least: L,
    /// `guarded`: t of the closest hit as it is reported.
    t: L,
    /// Low and high words of instance ids, so that all columns have one type.
    instance: [L::Ids; 2],
    primitive: L::Ids,
    certainty: PhantomData<C>,
}

impl<L: Lanes, C: Certainty> Closest<L, C> {
    #[inline(always)]
    pub fn new(t_max: L) -> Closest<L, C> {
        Closest {
            limit: t_max,
            least: t_max,
            t: t_max,
            instance: [L::ids(u32::MAX); 2],
            primitive: L::ids(u32::MAX),
            certainty: PhantomData,
        }
    }

    /// Resets the query, as [`Closest::new`] would.
    #[inline(always)]
    pub fn restart(&mut self, t_max: L) {
        self.limit = t_max;
        if C::GUARDED {
            (self.least, self.t) = (t_max, t_max);
        }
        let [low, high] = &mut self.instance;
        for ids in [low, high, &mut self.primitive] {
            *ids = L::ids(u32::MAX);
        }
    }

    /// Returns a lane's id; [`HitId::NONE`] without a hit.
    #[inline(always)]
    pub fn id(&self, lane: usize) -> HitId {
        // By reference, since `map` would copy both columns for each lane.
        let [low, high] = &self.instance;
        let (low, high) = (low.as_ref()[lane], high.as_ref()[lane]);
        HitId {
            instance: u64::from(high) << 32 | u64::from(low),
            primitive: self.primitive.as_ref()[lane],
        }
    }

    /// Returns the reported t of all lanes.
    #[inline(always)]
    fn all_t(&self) -> L {
        if C::GUARDED { self.t } else { self.limit }
    }

    /// Returns a lane's t, at the lanes' precision.
    #[inline(always)]
    pub fn t(&self, lane: usize) -> f64 {
        self.all_t().lane(lane).to_f64()
    }

    /// Stores t of all lanes at the beginning of a column of f64.
    #[inline(always)]
    pub fn store_double(&self, t: &mut [f64]) {
        self.all_t().widen().store(t);
    }

    /// Stores t of all lanes at the beginning of a column of f32, rounded.
    #[inline(always)]
    pub fn store_single(&self, t: &mut [f32]) {
        let lanes = self.all_t().to_array();
        for (t, from) in t.iter_mut().zip(lanes.as_ref()) {
            *t = from.to_f64() as f32;
        }
    }

    /// Stores the ids of all lanes into columns, from row `first` on.
    #[inline(always)]
    pub fn store_ids(&self, ids: &mut Ids, first: usize) {
        let rows = first..first + L::COUNT;
        let [low, high] = &self.instance;
        let words = low.as_ref().iter().zip(high.as_ref());
        for (to, (low, high)) in ids.instance[rows.clone()].iter_mut().zip(words) {
            *to = u64::from(*high) << 32 | u64::from(*low);
        }
        ids.primitive[rows].copy_from_slice(self.primitive.as_ref());
    }

    /// Sets the ids of some lanes, by bit masks: a choice by `if` compiles to a branch per lane.
    #[inline(always)]
    fn set_ids(&mut self, lanes: u32, instance: u64, of: impl Fn(usize) -> u32) {
        let [low, high] = &mut self.instance;
        let (low, high, primitive) = (low.as_mut(), high.as_mut(), self.primitive.as_mut());
        let [id_low, id_high] = words(instance);
        for lane in 0..L::COUNT {
            let on = (lanes >> lane & 1).wrapping_neg();
            low[lane] ^= (low[lane] ^ id_low) & on;
            high[lane] ^= (high[lane] ^ id_high) & on;
            primitive[lane] ^= (primitive[lane] ^ of(lane)) & on;
        }
    }

    #[inline(always)]
    fn set_id(&mut self, lane: usize, id: HitId) {
        for (word, value) in self.instance.iter_mut().zip(words(id.instance)) {
            word.as_mut()[lane] = value;
        }
        self.primitive.as_mut()[lane] = id.primitive;
    }
}

impl<L: Lanes, C: Certainty> Query<L> for Closest<L, C> {
    const ANY: bool = false;

    #[inline(always)]
    fn limit(&self) -> L {
        self.limit
    }

    #[inline(always)]
    fn least(&self) -> L {
        self.least
    }

    #[inline(always)]
    fn accept(&mut self, hit: L::Mask, t: L, id: HitId) {
        let nearer = hit & t.lt(self.limit);
        let tied = hit & t.eq(self.limit);
        let mut taken = nearer.bits();
        if tied.any() {
            let mut bits = tied.bits();
            while bits != 0 {
                let lane = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                // A tie with t_max, where there is no hit yet, is no hit.
                let best = self.id(lane);
                if best != HitId::NONE && id < best {
                    taken |= 1 << lane;
                }
            }
        }
        self.limit = L::select(nearer, t, self.limit);
        self.set_ids(taken, id.instance, |_| id.primitive);
    }

    #[inline(always)]
    fn accept_sure(&mut self, meet: &Meet<L>, id: HitId) -> L::Mask {
        let [from, to] = meet.within;
        let sure = meet.hit & to.lt(self.least);
        let open = meet.hit & !sure & !from.gt(self.limit);
        self.limit = L::select(sure, to, self.limit);
        self.least = L::select(sure, from, self.least);
        self.t = L::select(sure, meet.t, self.t);
        if sure.any() {
            self.set_ids(sure.bits(), id.instance, |_| id.primitive);
        }
        open
    }

    fn competitor(&self, lane: usize) -> Option<Competitor> {
        Some(match self.id(lane) {
            HitId::NONE => Competitor::End(self.t(lane)),
            best => {
                let [from, to] = [self.least, self.limit].map(|x| x.lane(lane).to_f64());
                // A bound at the largest number of the type stands for anything beyond it.
                let most = L::Scalar::MAX.to_f64();
                let to = if to < most { to } else { f64::INFINITY };
                let from = if from > -most {
                    from
                } else {
                    f64::NEG_INFINITY
                };
                Competitor::Hit(best, [from, to])
            }
        })
    }

    fn commit(&mut self, lane: usize, at: impl FnOnce() -> Depth, id: HitId) {
        let Depth { t, within } = at();
        let scalar = |x: f64| L::Scalar::from_f64(x);
        if C::GUARDED {
            let [least, limit] = outward::<L::Scalar>(within);
            self.least = self.least.with_lane(lane, least);
            // A hit that precedes another has no greater upper bound: limits only decrease.
            let own = self.limit.lane(lane);
            let limit = if limit < own { limit } else { own };
            self.limit = self.limit.with_lane(lane, limit);
            // A t beyond the range of the lanes' type is reported as its largest number.
            let most = L::Scalar::MAX.to_f64();
            self.t = self.t.with_lane(lane, scalar(t.clamp(-most, most)));
        } else {
            self.limit = self.limit.with_lane(lane, scalar(t));
        }
        self.set_id(lane, id);
    }

    fn try_commit(&mut self, lane: usize, at: Depth, id: HitId) -> bool {
        if C::GUARDED {
            let [from, to] = at.within;
            if to < self.least.lane(lane).to_f64() {
                self.commit(lane, || at, id);
                return true;
            }
            return from > self.limit.lane(lane).to_f64();
        }
        let (limit, best) = (self.t(lane), self.id(lane));
        if at.t < limit || (at.t == limit && best != HitId::NONE && id < best) {
            self.commit(lane, || at, id);
        }
        true
    }

    #[inline(always)]
    fn accept_each(&mut self, hit: L::Mask, t: L, instance: u64, primitives: &L::Ids) {
        let nearer = hit & t.lt(self.limit);
        let mut taken = nearer.bits();
        let mut tied = (hit & t.eq(self.limit)).bits();
        while tied != 0 {
            let lane = tied.trailing_zeros() as usize;
            tied &= tied - 1;
            let (best, primitive) = (self.id(lane), primitives.as_ref()[lane]);
            let id = HitId {
                instance,
                primitive,
            };
            if best != HitId::NONE && id < best {
                taken |= 1 << lane;
            }
        }
        self.limit = L::select(nearer, t, self.limit);
        self.set_ids(taken, instance, |lane| primitives.as_ref()[lane]);
    }

    #[inline(always)]
    fn accept_each_sure(&mut self, meet: &Meet<L>, instance: u64, primitives: &L::Ids) {
        let [from, to] = meet.within;
        self.limit = L::select(meet.hit, to, self.limit);
        self.least = L::select(meet.hit, from, self.least);
        self.t = L::select(meet.hit, meet.t, self.t);
        self.set_ids(meet.hit.bits(), instance, |lane| primitives.as_ref()[lane]);
    }

    fn block(&mut self, _lanes: L::Mask, _id: HitId) {}

    type Together<W: Lanes> = Closest<W, C>;

    #[inline(always)]
    fn together<W: Lanes>(limit: W) -> Closest<W, C> {
        Closest::new(limit)
    }
}

impl<L: Lanes, C: Certainty> Found for Closest<L, C> {
    #[inline(always)]
    fn found(&self, lane: usize) -> Option<(Depth, HitId)> {
        let id = self.id(lane);
        let within = [self.least, self.limit].map(|x| x.lane(lane).to_f64());
        let at = Depth {
            t: self.t(lane),
            within,
        };
        (id != HitId::NONE).then_some((at, id))
    }
}
