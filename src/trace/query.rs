//! What a packet asks: the closest hit, or any.
//!
//! A query keeps each lane's limit, the t beyond which nothing matters to it.
//! Equal t's go to the lower id, so the order of visits never shows.

use super::hits::Ids;
use crate::geom::Certainty;
use crate::math::lanes::{Lanes, Mask, Scalar, max};
use crate::math::round_up;
use std::marker::PhantomData;

/// A primitive of an appearance: what ties are broken by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct HitId {
    /// Id of one of [`Appearances`](crate::scene::Appearances).
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

/// Low and high.
#[inline(always)]
fn words(id: u64) -> [u32; 2] {
    [id as u32, (id >> 32) as u32]
}

pub trait Query<L: Lanes> {
    /// A ray is done with its first hit.
    const ANY: bool;
    /// Each lane's t_max so far; −∞ where the lane is done.
    fn limit(&self) -> L;
    /// Hits that the kernel is certain of.
    fn accept(&mut self, hit: L::Mask, t: L, id: HitId);
    /// A hit that the resolver has settled for one lane.
    fn settle(&mut self, lane: usize, t: f64, id: HitId);
    /// Hits of one appearance, each lane's with a primitive of its own.
    fn accept_each(&mut self, hit: L::Mask, t: L, instance: u64, primitives: &L::Ids);
    /// Any-hit: these rays are blocked, wherever.
    fn block(&mut self, lanes: L::Mask, id: HitId);
    /// The same question of as many rays as `W` has lanes.
    type Together<W: Lanes>: Query<W> + Found;
    fn together<W: Lanes>(limit: W) -> Self::Together<W>;
}

/// What a query has found.
pub trait Found {
    /// A lane's t and id, if it has a hit: what [`Query::settle`] takes.
    fn found(&self, lane: usize) -> Option<(f64, HitId)>;
}

/// The nearest hit of each lane.
pub struct Closest<L: Lanes, C> {
    limit: L,
    /// Guarded: the limit in f64, of which `limit` is the upper rounding.
    exact: L::Double,
    /// Low and high word, so that all columns of ids are alike.
    instance: [L::Ids; 2],
    primitive: L::Ids,
    certainty: PhantomData<C>,
}

impl<L: Lanes, C: Certainty> Closest<L, C> {
    #[inline(always)]
    pub fn new(t_max: L) -> Closest<L, C> {
        Closest {
            limit: t_max,
            exact: if C::GUARDED {
                t_max.widen()
            } else {
                L::Double::zero()
            },
            instance: [L::ids(u32::MAX); 2],
            primitive: L::ids(u32::MAX),
            certainty: PhantomData,
        }
    }

    /// [`Closest::new`] in place.
    #[inline(always)]
    pub fn restart(&mut self, t_max: L) {
        self.limit = t_max;
        if C::GUARDED {
            self.exact = t_max.widen();
        }
        let [low, high] = &mut self.instance;
        for ids in [low, high, &mut self.primitive] {
            *ids = L::ids(u32::MAX);
        }
    }

    #[inline(always)]
    pub fn id(&self, lane: usize) -> HitId {
        // By reference: mapping the pair would copy it for each lane.
        let [low, high] = &self.instance;
        let (low, high) = (low.as_ref()[lane], high.as_ref()[lane]);
        HitId {
            instance: u64::from(high) << 32 | u64::from(low),
            primitive: self.primitive.as_ref()[lane],
        }
    }

    /// Of the hit, at the lanes' precision (f64 where guarded).
    #[inline(always)]
    pub fn t(&self, lane: usize) -> f64 {
        if C::GUARDED {
            self.exact.lane(lane)
        } else {
            self.limit.lane(lane).to_f64()
        }
    }

    /// t of every lane into the first places of a column.
    #[inline(always)]
    pub fn store_double(&self, t: &mut [f64]) {
        if C::GUARDED {
            self.exact.store(t);
        } else {
            self.limit.widen().store(t);
        }
    }

    /// The same, rounded.
    #[inline(always)]
    pub fn store_single(&self, t: &mut [f32]) {
        let t = &mut t[..L::COUNT];
        if C::GUARDED {
            for (lane, t) in t.iter_mut().enumerate() {
                *t = self.exact.lane(lane) as f32;
            }
        } else {
            let lanes = self.limit.to_array();
            for (t, from) in t.iter_mut().zip(lanes.as_ref()) {
                *t = from.to_f64() as f32;
            }
        }
    }

    /// Every lane's id into columns, from row `first` on.
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

    #[inline(always)]
    fn take(&mut self, lane: usize, id: HitId) {
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
    fn accept(&mut self, hit: L::Mask, t: L, id: HitId) {
        if C::GUARDED {
            // Against the f64 limits, of which the lanes' own are roundings.
            let mut bits = hit.bits();
            while bits != 0 {
                let lane = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                self.settle(lane, t.lane(lane).to_f64(), id);
            }
            return;
        }
        let nearer = hit & t.lt(self.limit);
        let tied = hit & t.eq(self.limit);
        let mut taken = nearer.bits();
        if tied.any() {
            let mut bits = tied.bits();
            while bits != 0 {
                let lane = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                // A tie with t_max itself, before any hit, is not a hit.
                let best = self.id(lane);
                if best != HitId::NONE && id < best {
                    taken |= 1 << lane;
                }
            }
        }
        self.limit = L::select(nearer, t, self.limit);
        let [low, high] = &mut self.instance;
        let (low, high, primitive) = (low.as_mut(), high.as_mut(), self.primitive.as_mut());
        let [id_low, id_high] = words(id.instance);
        for lane in 0..L::COUNT {
            let on = taken >> lane & 1 != 0;
            low[lane] = if on { id_low } else { low[lane] };
            high[lane] = if on { id_high } else { high[lane] };
            primitive[lane] = if on { id.primitive } else { primitive[lane] };
        }
    }

    fn settle(&mut self, lane: usize, t: f64, id: HitId) {
        let (limit, best) = (self.t(lane), self.id(lane));
        if t < limit || (t == limit && best != HitId::NONE && id < best) {
            if C::GUARDED {
                self.exact = self.exact.with_lane(lane, t);
            }
            let above = L::Scalar::from_f64(f64::from(round_up(t)));
            let above = if size_of::<L::Scalar>() == 8 {
                L::Scalar::from_f64(t)
            } else {
                above
            };
            self.limit = self.limit.with_lane(lane, above);
            self.take(lane, id);
        }
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
        let [low, high] = &mut self.instance;
        let (low, high, primitive) = (low.as_mut(), high.as_mut(), self.primitive.as_mut());
        let ([id_low, id_high], primitives) = (words(instance), primitives.as_ref());
        for lane in 0..L::COUNT {
            let on = taken >> lane & 1 != 0;
            low[lane] = if on { id_low } else { low[lane] };
            high[lane] = if on { id_high } else { high[lane] };
            primitive[lane] = if on {
                primitives[lane]
            } else {
                primitive[lane]
            };
        }
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
    fn found(&self, lane: usize) -> Option<(f64, HitId)> {
        let id = self.id(lane);
        (id != HitId::NONE).then(|| (self.t(lane), id))
    }
}

/// Whether anything lies in each lane's range.
pub struct AnyHit<L: Lanes> {
    limit: L,
    /// What blocked a lane last.
    pub occluder: HitId,
}

impl<L: Lanes> AnyHit<L> {
    #[inline(always)]
    pub fn new(t_max: L) -> AnyHit<L> {
        AnyHit {
            // −∞ would say that something has blocked it.
            limit: max(t_max, L::from_f32(f32::MIN)),
            occluder: HitId::NONE,
        }
    }

    /// Lanes that were blocked; `t_max` as at the start.
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
    fn accept(&mut self, hit: L::Mask, t: L, id: HitId) {
        let blocked = hit & t.lt(self.limit);
        if blocked.any() {
            self.block(blocked, id);
        }
    }

    fn settle(&mut self, lane: usize, t: f64, id: HitId) {
        if t < self.limit.lane(lane).to_f64() {
            self.block(L::Mask::from_bits(1 << lane), id);
        }
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
    /// The t of no hit matters.
    #[inline(always)]
    fn found(&self, lane: usize) -> Option<(f64, HitId)> {
        let blocked = self.blocked().bits() >> lane & 1 != 0;
        blocked.then_some((f64::NEG_INFINITY, self.occluder))
    }
}
