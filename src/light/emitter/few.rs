//! The choice among few emitters: all importances, exactly, in every lane.
//!
//! What is infinitely far takes its share by its estimated irradiance, but at least
//! [`LEAST_SHARE`] and at most the rest of it where both kinds may bring light: an estimate
//! knows nothing of shadows, and a lamp must be found in the shadow of the sun. For the same
//! reason half of that share is divided evenly.

use super::importance::Receiver;
use super::tree::Tree;
use super::{Emitters, NONE};
use lanecast_numerics::math::lanes::{Lanes, Mask};

/// How many emitters with a place are weighed one by one.
pub const FEW: usize = 16;

/// The least share of what is infinitely far, and of what is not, where both bring light.
const LEAST_SHARE: f32 = 0.25;

/// The importances at the points of a step.
#[derive(Clone, Copy, Debug)]
pub struct Chances<L> {
    local: [L; FEW],
    local_total: L,
    far_total: L,
    /// How many suns bring light.
    far_count: L,
    /// The share of what is infinitely far.
    far_share: L,
}

impl<L: Lanes<Scalar = f32>> Chances<L> {
    /// Weighs all emitters.
    #[inline(always)]
    pub fn of(emitters: &Emitters, receiver: &Receiver<L>) -> Chances<L> {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let mut local = [zero; FEW];
        let mut local_total = zero;
        let (mut far_total, mut far_count) = (zero, zero);
        if emitters.local.len() == 1 && emitters.far_count() == 0 {
            local[0] = one;
            local_total = one;
        } else {
            if let Some(tree) = &emitters.tree {
                // Only the shares of what is near and far need it.
                local_total = match emitters.far_count() {
                    0 => one,
                    _ => by_lane(|lane| tree.importance(&receiver.lane(lane))),
                };
            } else {
                for (weight, bounds) in local.iter_mut().zip(&emitters.bounds) {
                    *weight = receiver.importance(bounds);
                    local_total = local_total + *weight;
                }
            }
            for k in 0..emitters.far_count() {
                let weight = far_weight(emitters, receiver, k);
                far_total = far_total + weight;
                far_count = far_count + L::select(weight.gt(zero), one, zero);
            }
        }
        let share = far_total / (far_total + local_total).max(L::splat(f32::MIN_POSITIVE));
        let least = L::splat(LEAST_SHARE);
        let share = share.max(least).min(one - least);
        let share = L::select(far_total.gt(zero), share, zero);
        let far_share = L::select(
            local_total.gt(zero),
            share,
            L::select(far_total.gt(zero), one, zero),
        );
        Chances {
            local,
            local_total,
            far_total,
            far_count,
            far_share,
        }
    }

    /// Chooses an emitter for each active lane; returns ids, [`NONE`] where no light can
    /// arrive, and their probabilities, 1 there.
    #[inline(always)]
    pub fn choose(
        &self,
        emitters: &Emitters,
        receiver: &Receiver<L>,
        active: L::Mask,
        pick: L,
    ) -> (L::Ids, L) {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let none = L::splat(-1.0);
        let far = pick.lt(self.far_share);
        let near_share = one - self.far_share;
        let pick = L::select(
            far,
            pick / self.far_share,
            (pick - self.far_share) / near_share,
        );
        // The last emitter that begins at or before the number, so that rounding of the sums
        // leaves none without.
        let (mut slot, mut weight, mut before) = (none, one, zero);
        let target = pick * self.local_total;
        let few = match &emitters.tree {
            Some(_) => 0,
            None => emitters.local.len(),
        };
        for k in 0..few {
            let own = self.local[k];
            let begun = before.le(target) & own.gt(zero) & !far;
            slot = L::select(begun, L::splat(k as f32), slot);
            weight = L::select(begun, own, weight);
            before = before + own;
        }
        let mut chance = weight / self.local_total * near_share;
        let mut ids = L::ids(NONE);
        let mut found = L::Mask::splat(false);
        if let Some(tree) = &emitters.tree {
            let (slots, chances) = in_tree(tree, receiver, active & !far, pick);
            let mut bits = 0;
            for (lane, (id, &slot)) in ids.as_mut().iter_mut().zip(slots.as_ref()).enumerate() {
                if slot != NONE {
                    *id = emitters.local[slot as usize];
                    bits |= 1 << lane;
                }
            }
            found = L::Mask::from_bits(bits);
            chance = L::select(found, chances * near_share, chance);
        }
        let locals = emitters.local.len();
        before = zero;
        for k in 0..emitters.far_count() {
            let weight = self.far_part(far_weight(emitters, receiver, k));
            let begun = before.le(pick) & weight.gt(zero) & far;
            slot = L::select(begun, L::splat((locals + k) as f32), slot);
            chance = L::select(begun, weight * self.far_share, chance);
            before = before + weight;
        }
        let (slots, active) = (slot.to_array(), active.bits());
        for (lane, (id, &slot)) in ids.as_mut().iter_mut().zip(slots.as_ref()).enumerate() {
            if slot >= 0.0 && active >> lane & 1 != 0 {
                let slot = slot as usize;
                *id = match slot.checked_sub(locals) {
                    None => emitters.local[slot],
                    Some(far) => emitters.far_id(far),
                };
            }
        }
        (ids, L::select(slot.ge(zero) | found, chance, one))
    }

    /// Returns the probability with which emitters with a place are chosen, 0 for other ids.
    #[inline(always)]
    pub fn of_local(&self, emitters: &Emitters, receiver: &Receiver<L>, ids: L::Ids) -> L {
        let near_share = L::splat(1.0) - self.far_share;
        if let Some(tree) = &emitters.tree {
            let chances: L = by_lane(|lane| {
                let slot = emitters.slots.get(ids.as_ref()[lane] as usize);
                match slot {
                    Some(&slot) if slot != NONE => tree.chance(&receiver.lane(lane), slot),
                    _ => 0.0,
                }
            });
            return chances * near_share;
        }
        let mut slots = L::zero().to_array();
        for (slot, &id) in slots.as_mut().iter_mut().zip(ids.as_ref()) {
            *slot = match emitters.slots.get(id as usize) {
                Some(&slot) if slot != NONE => slot as f32,
                _ => -1.0,
            };
        }
        let slots = L::load(slots.as_ref());
        let mut weight = L::zero();
        for k in 0..emitters.local.len().min(FEW) {
            let own = slots.eq(L::splat(k as f32));
            weight = L::select(own, self.local[k], weight);
        }
        let chance = weight / self.local_total * near_share;
        L::select(weight.gt(L::zero()), chance, L::zero())
    }

    /// Returns the probability with which what is infinitely far is chosen: sun k, or the
    /// environment after the last sun.
    #[inline(always)]
    pub fn of_far(&self, emitters: &Emitters, receiver: &Receiver<L>, k: usize) -> L {
        self.far_part(far_weight(emitters, receiver, k)) * self.far_share
    }

    /// Returns the part of [`Chances::far_share`] that goes to an importance: half by
    /// importance, half evenly.
    #[inline(always)]
    fn far_part(&self, weight: L) -> L {
        let (half, one) = (L::splat(0.5), L::splat(1.0));
        let part = weight / self.far_total + one / self.far_count;
        L::select(weight.gt(L::zero()), half * part, L::zero())
    }
}

/// Chooses slots in the active lanes, [`NONE`] where no light can arrive, and their
/// probabilities.
#[inline(always)]
fn in_tree<L: Lanes<Scalar = f32>>(
    tree: &Tree,
    receiver: &Receiver<L>,
    active: L::Mask,
    pick: L,
) -> (L::Ids, L) {
    let active = active.bits();
    let picks = pick.to_array();
    let (mut slots, mut chances) = (L::ids(NONE), L::splat(1.0).to_array());
    for lane in (0..L::COUNT).filter(|lane| active >> lane & 1 != 0) {
        let chosen = tree.choose(&receiver.lane(lane), picks.as_ref()[lane]);
        if let Some((slot, chance)) = chosen {
            slots.as_mut()[lane] = slot;
            chances.as_mut()[lane] = chance;
        }
    }
    (slots, L::load(chances.as_ref()))
}

/// Makes lanes of a function of their index.
#[inline(always)]
fn by_lane<L: Lanes<Scalar = f32>>(of: impl Fn(usize) -> f32) -> L {
    let mut lanes = L::zero().to_array();
    for (lane, x) in lanes.as_mut().iter_mut().enumerate() {
        *x = of(lane);
    }
    L::load(lanes.as_ref())
}

/// Returns the importance of sun k, or of the environment after the last sun.
#[inline(always)]
fn far_weight<L: Lanes<Scalar = f32>>(emitters: &Emitters, receiver: &Receiver<L>, k: usize) -> L {
    match emitters.suns.get(k) {
        Some(sun) => receiver.of_sun(sun.towards, sun.versine, sun.irradiance),
        None => L::splat(emitters.sky_irradiance),
    }
}
