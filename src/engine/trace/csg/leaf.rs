//! The test of a CSG solid: from boundaries along a packet to hits in a query.

use super::TURNED;
use super::first;
use super::lanes::{self, CsgHits};
use crate::accel::{PreparedCsg, TlasEntry};
use crate::geom::exact::Line;
use crate::geom::{Certainty, Meet};
use crate::math::Aabb32;
use crate::math::lanes::{Lanes, Mask, Scalar, f64x8};
use crate::scene::{CsgId, Tables};
use crate::trace::certain_hits::CertainHits;
use crate::trace::double_pass::{DoublePass, SecondLook, look_again};
use crate::trace::exact_fallback::depth_of;
use crate::trace::leaf::{Tester, Window, mark_undecided};
use crate::trace::packet::Packet;
use crate::trace::query::{Depth, HitId, Query};
use crate::trace::scratch::TraceScratch;
use glam::DVec3;
use std::marker::PhantomData;

impl<L: Lanes, C: Certainty> Tester<'_, L, C> {
    /// Tests a CSG solid in lanes, and undecided rays one by one.
    #[inline(never)]
    pub(in crate::trace) fn csg<Q: Query<L>>(
        &mut self,
        entry: &TlasEntry,
        id: CsgId,
        active: L::Mask,
        query: &mut Q,
    ) {
        let (window, active) = if entry.placed {
            self.window(entry, active, query.limit())
        } else {
            (Window::all(), active)
        };
        if active.none() {
            return;
        }
        let placed = entry.placed.then(|| self.object_packet(entry, DVec3::ZERO));
        let object = placed.as_ref().unwrap_or(self.packet);
        let world = self.world;
        let (solid, tables) = (world.csg(id), &world.scene);
        let id = |primitive| HitId {
            instance: entry.instance,
            primitive,
        };
        let met = if C::DOUBTS_ALL {
            CsgHits::for_fallback(active.bits())
        } else {
            let mut limit = query.limit();
            if !C::GUARDED {
                // `offer` clamps a t beyond the box to the box's end.
                let (_, exit) = object.slabs.interval(entry.own.min, entry.own.max);
                let end = exit.min(window.exit);
                limit = L::select(limit.lt(end), limit, L::splat(L::Scalar::INFINITY));
            }
            let scratch = &mut *self.scratch;
            lanes::first::<L, C>(solid, tables, object, active.bits(), limit, scratch)
        };
        let mut bits = if C::GUARDED { 0 } else { met.left };
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let (org, dir) = object.lane(lane);
            let t_min = object.ray.t_min.max(met.t).lane(lane).to_f64();
            let line = Line { org, dir };
            if let Some(crossing) = first(solid, tables, &line, t_min, self.scratch) {
                let t = L::from_f64(depth_of(&crossing.root).t);
                let meet = Meet::certain(L::Mask::from_bits(1 << lane), t);
                let id = id(crossing.primitive);
                self.offer(object, &window, &entry.own, meet, id, query);
            }
        }
        // Each surface is offered with the lanes that hit it.
        let mut bits = met.hit;
        while bits != 0 {
            let surface = met.primitive[bits.trailing_zeros() as usize];
            let mut here = 0;
            for (lane, other) in met.primitive.iter().enumerate() {
                here |= u32::from(*other == surface) << lane;
            }
            here &= bits;
            bits &= !here;
            let lanes = L::Mask::from_bits(here);
            let meet = Meet {
                hit: lanes,
                t: met.t,
                within: met.within,
                unsure: L::Mask::splat(false),
            };
            let meet = mark_undecided::<L, C>(meet, lanes, id(surface));
            self.offer(object, &window, &entry.own, meet, id(surface), query);
        }
        let limit = query.limit();
        let unsure = L::Mask::from_bits(met.unsure | met.left) & limit.gt(self.packet.ray.t_min);
        if !C::GUARDED || unsure.none() {
            return;
        }
        let mut bits = unsure.bits();
        if !C::DOUBTS_ALL {
            let mut look = InF64::<C> {
                solid,
                tables,
                own: &entry.own,
                scratch: self.scratch,
                certain: (!Q::ANY).then(CertainHits::default),
                certainty: PhantomData,
            };
            let [may, must] = look_again(object, limit, bits, &mut look);
            bits = may;
            // Any-hit rays need no t.
            if Q::ANY && must != 0 {
                query.block(L::Mask::from_bits(must), id(0));
                bits &= !must;
            }
            if let Some(certain) = look.certain {
                bits &=
                    !take_certain::<L, C, Q>((solid, tables), object, (certain, may), id, query);
            }
        }
        self.decide(L::Mask::from_bits(bits), id(0), query);
    }
}

/// Offers hits that the double pass is certain of, of the lanes in `may`, where the operand's
/// span tells their t. Returns the lanes whose order is certain, too.
#[inline(never)]
fn take_certain<L: Lanes, C: Certainty, Q: Query<L>>(
    (csg, tables): (&PreparedCsg, &Tables),
    object: &Packet<L>,
    (certain, may): (CertainHits, u32),
    id: impl Fn(u32) -> HitId,
    query: &mut Q,
) -> u32 {
    let number = |primitive: u32| csg.solid.operand_of(primitive & !TURNED).0;
    let (mut bits, mut taken) = (certain.hit & may, 0);
    while bits != 0 {
        let own = number(certain.primitive[bits.trailing_zeros() as usize]);
        let operand = &csg.solid.operands[own as usize];
        let mut here = 0;
        for (lane, primitive) in certain.primitive.iter().enumerate() {
            here |= u32::from(bits >> lane & 1 != 0 && number(*primitive) == own) << lane;
        }
        bits &= !here;
        let (mut org, mut dir) = (object.org, object.dir);
        if operand.frame != 0 {
            let map = &csg.solid.frames[operand.frame as usize].operand_from_solid;
            (org, dir) = (map.points(org), map.vectors(dir));
        }
        let rays = (org, dir, object.ray.t_min);
        certain.with_t((tables, operand.shape), rays, here, |lane, t| {
            let (id, within) = (id(certain.primitive[lane]), certain.within[lane]);
            let is_doubted = C::doubts(id.instance, id.primitive) >> lane & 1 != 0;
            let t = t.to_f64();
            if !is_doubted && query.try_commit(lane, Depth { t, within }, id) {
                taken |= 1 << lane;
            }
        });
    }
    taken
}

/// The double pass of a CSG solid. f32 rarely decides whether a ray hits the surface that
/// it has just left.
struct InF64<'a, C> {
    solid: &'a PreparedCsg,
    tables: &'a Tables,
    own: &'a Aabb32,
    scratch: &'a mut TraceScratch,
    /// Hits, if they are asked for.
    certain: Option<CertainHits>,
    certainty: PhantomData<C>,
}

impl<C: Certainty> SecondLook for InF64<'_, C> {
    #[inline(never)]
    fn look<D: Lanes<Scalar = f64, Double = D>>(
        &mut self,
        pass: &DoublePass<D>,
        asked: u32,
        lanes: &[usize; f64x8::COUNT],
    ) -> [u32; 2] {
        let packet = Packet::<D>::new(pass.org, pass.dir, pass.t_min, self.own);
        let (solid, tables, limit) = (self.solid, self.tables, pass.limit);
        let met = lanes::first::<D, C>(solid, tables, &packet, asked, limit, self.scratch);
        if let Some(certain) = &mut self.certain {
            let hit = met.hit & !(met.unsure | met.left);
            certain.take(hit, (met.within, |i: usize| met.primitive[i]), lanes);
        }
        let [from, to] = met.within;
        let may = met.unsure | met.left | met.hit & from.le(pass.limit).bits();
        [may, met.hit & to.lt(pass.limit).bits()]
    }
}
