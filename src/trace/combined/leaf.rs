//! A combination before a packet: from its boundaries to hits in a query.

use super::lanes::{self, Met, Spaces};
use super::{TURNED, first};
use crate::accel::{Combined, Entry};
use crate::geom::exact::Line;
use crate::geom::guarded::implicit::nearest_each;
use crate::geom::{Certainty, Meet};
use crate::math::Aabb32;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::scene::{CombinationId, Shape, Tables};
use crate::trace::decide::depth_of;
use crate::trace::leaf::{Everything, Tester, Window, doubted};
use crate::trace::packet::Packet;
use crate::trace::query::{HitId, Query};
use glam::DVec3;

impl<L: Lanes, C: Certainty> Tester<'_, L, C, Everything> {
    /// A solid made of others: in lanes, and one ray at a time where that does not
    /// say.
    #[inline(never)]
    pub(in crate::trace) fn combination<Q: Query<L>>(
        &self,
        entry: &Entry,
        id: CombinationId,
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
        let (solid, tables) = (self.world.combined(id), self.world.scene);
        let id = |primitive| HitId {
            instance: entry.appearance,
            primitive,
        };
        let met = if C::DOUBTS_ALL {
            Met::left(active.bits())
        } else {
            lanes::first::<L, C>(solid, tables, object, active.bits(), query.limit())
        };
        let mut bits = if C::GUARDED { 0 } else { met.left };
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let (org, dir) = object.lane(lane);
            let t_min = object.ray.t_min.lane(lane).to_f64();
            let first = first(solid, tables, &Line { org, dir }, t_min);
            if let Some(crossing) = first {
                let t = L::from_f64(depth_of::<L>(&crossing.root).t);
                let meet = Meet::certain(L::Mask::from_bits(1 << lane), t);
                let id = id(crossing.primitive);
                self.offer(object, &window, &entry.own, meet, id, query);
            }
        }
        // Surface by surface.
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
                t: sharp((solid, tables), object, surface, lanes, &met),
                within: met.within,
                unsure: L::Mask::splat(false),
            };
            let meet = doubted::<L, C>(meet, lanes, id(surface));
            self.offer(object, &window, &entry.own, meet, id(surface), query);
        }
        let limit = query.limit();
        let unsure = L::Mask::from_bits(met.unsure | met.left) & limit.gt(self.packet.ray.t_min);
        if !C::GUARDED || unsure.none() {
            return;
        }
        let mut bits = unsure.bits();
        if !(C::DOUBTS_ALL || L::is_double()) {
            let (solid, limit) = ((solid, &**tables), limit.widen());
            let [may, must] = in_f64::<L, C>(solid, object, &entry.own, bits, limit);
            bits = may;
            // Where does not matter.
            if Q::ANY && must != 0 {
                query.block(L::Mask::from_bits(must), id(0));
                bits &= !must;
            }
        }
        self.decide(L::Mask::from_bits(bits), id(0), query);
    }
}

/// t of some lanes that meet a surface: as of a polynomial's by itself.
#[inline(always)]
fn sharp<L: Lanes>(
    (solid, tables): (&Combined, &Tables),
    object: &Packet<L>,
    surface: u32,
    lanes: L::Mask,
    met: &Met<L>,
) -> L {
    if !L::is_double() {
        return met.t;
    }
    let (number, _) = solid.solid.operand_of(surface & !TURNED);
    let operand = &solid.solid.operands[number as usize];
    let Shape::Implicit(id) = operand.shape else {
        return met.t;
    };
    let tape = &tables.implicits.tape[id.index()];
    let mut spaces = Spaces::new(object);
    let frame = spaces.of(solid, operand.frame);
    let [from, to] = met.within;
    nearest_each(tape, &frame, lanes, [from, met.t, to])
}

/// Which of some lanes may meet a solid before a limit, and which certainly do, in f64:
/// lanes of f32 hardly know whether a ray meets what it has just left.
#[inline(never)]
fn in_f64<L: Lanes, C: Certainty>(
    (solid, tables): (&Combined, &Tables),
    object: &Packet<L>,
    own: &Aabb32,
    asked: u32,
    limit: L::Double,
) -> [u32; 2] {
    let t_min = object.ray.t_min.widen();
    let packet = Packet::<L::Double>::new(object.org, object.dir, t_min, own);
    let met = lanes::first::<L::Double, C>(solid, tables, &packet, asked, limit);
    let [from, to] = met.within;
    let may = met.unsure | met.left | met.hit & from.le(limit).bits();
    [may, met.hit & to.lt(limit).bits()]
}
