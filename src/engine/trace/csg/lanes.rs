//! Many rays against a CSG solid: Roth's walk in lanes.
//!
//! Every operand keeps each ray's next boundary, and which rays are inside. The
//! nearest boundaries are flipped, the program is asked, and where its answer
//! changes is the hit. Boundaries are known between two numbers; rays for which
//! that does not say what comes first are in doubt. Without bounds the two numbers
//! are one.

mod ends;
mod track;
mod walk;

use crate::accel::{PreparedCsg, Slabs};
use crate::csg::Restricted;
use crate::geom::Certainty;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::scene::Tables;
use crate::trace::packet::Packet;
use crate::trace::scratch::{TraceScratch, TypedSlots};
use ends::event_width;
pub(in crate::trace) use ends::{Frames, Spaces, ends};
pub(in crate::trace) use walk::is_sharp;
use walk::run;

/// What some rays meet of a CSG solid first.
pub(in crate::trace) struct CsgHits<L: Lanes> {
    pub hit: u32,
    pub unsure: u32,
    /// Rays that lanes are of no use for, beyond `t`.
    pub left: u32,
    pub t: L,
    pub within: [L; 2],
    /// By lane: of hits, what [`super::Crossing`] says.
    pub primitive: [u32; 16],
}

/// Reused from packet to packet.
#[derive(Default)]
pub(in crate::trace) struct LaneScratch {
    operands: Vec<u32>,
    /// In `fast` the same, with their boxes.
    boxed: Vec<u64>,
    program: Restricted,
    values: Vec<u32>,
    /// A `Vec<[L; 3]>` per width: the boundaries of operands that may have many.
    pub(in crate::trace) rows: TypedSlots,
    /// Of one line, what a chosen solver has found.
    roots: Vec<f64>,
}

/// So many operands of a packet are met in lanes; of more than these each ray is
/// met by itself.
const MAX_OPERANDS: usize = 64;

/// So many gates, at most.
const MAX_GATES: usize = 256;

/// The rays of `active` lanes up to `limit`.
#[inline]
pub(in crate::trace) fn first<L: Lanes, C: Certainty>(
    csg: &PreparedCsg,
    tables: &Tables,
    object: &Packet<L>,
    active: u32,
    limit: L,
    scratch: &mut TraceScratch,
) -> CsgHits<L> {
    // Boundaries that are one within a distance are left to the other function; so
    // are tall programs, of which a ray changes few gates: here all are worked out.
    let solid = &csg.solid;
    let is_tall = solid.program.gates() > MAX_GATES;
    // So is all of a solid with meshes where an answer may depend on who gives it.
    let has_meshes = solid.has_meshes() && !C::GUARDED;
    if is_tall || has_meshes || solid.tolerance > 0.0 {
        return CsgHits::for_fallback(active);
    }
    first_by_parts::<L, C>((csg, tables), object, active, limit, scratch)
}

/// Rays that together have too many operands before them are taken by halves.
#[inline(never)]
fn first_by_parts<L: Lanes, C: Certainty>(
    solid: (&PreparedCsg, &Tables),
    object: &Packet<L>,
    active: u32,
    limit: L,
    scratch: &mut TraceScratch,
) -> CsgHits<L> {
    let ray = &object.ray;
    let asleep = -L::splat(L::Scalar::INFINITY);
    let awake = L::Mask::from_bits(active);
    let LaneScratch {
        operands, boxed, ..
    } = &mut scratch.lanes;
    let mut known = L::splat(L::Scalar::INFINITY);
    if C::GUARDED {
        // And what may be one with boundaries between start and limit.
        let beside = solid.0.farthest_event(&ray.org, &ray.dir);
        let until = L::select(awake, limit + beside, asleep);
        let rays = (ray.org, ray.dir);
        let from = ray.t_min - beside;
        solid.0.operands_along(rays, from, until, operands);
    } else {
        // What is one with a boundary before the limit, too, and more than that.
        let [blur, share] = event_width::<L, C>(ray);
        let far = limit + (blur + limit.abs() * share) * L::from_f32(2.0);
        let until = L::select(awake, far, asleep);
        let slabs = solid.0.slabs(ray.org, ray.dir);
        solid.0.operands_in_boxes(&slabs, ray.t_min, until, boxed);
        if boxed.len() > MAX_OPERANDS && active.count_ones() < 2 {
            known = keep_nearest(solid.0, &slabs, ray.t_min, active, boxed);
        }
        operands.clear();
        operands.extend(boxed.iter().map(|entry| (entry >> 32) as u32));
    }
    if operands.len() <= MAX_OPERANDS {
        return run::<L, C>(solid, object, (active, limit, known), scratch);
    }
    if active.count_ones() < 2 {
        return CsgHits::for_fallback(active);
    }
    let (mut low, mut rest) = (0_u32, active);
    while low.count_ones() < rest.count_ones() {
        low |= rest & rest.wrapping_neg();
        rest &= rest - 1;
    }
    let [mut met, more] =
        [low, rest].map(|part| first_by_parts::<L, C>(solid, object, part, limit, scratch));
    met.join(&more);
    met
}

/// Keeps those of a ray's operands that it comes to first. Returns where it comes to the
/// next: lanes know no more than what lies before.
#[cold]
#[inline(never)]
fn keep_nearest<L: Lanes>(
    csg: &PreparedCsg,
    slabs: &Slabs<L>,
    t_min: L,
    active: u32,
    boxed: &mut Vec<u64>,
) -> L {
    let lane = active.trailing_zeros() as usize;
    let enter = |entry: u64| csg.part_of(entry, slabs, t_min).1.lane(lane).to_f64();
    boxed.sort_by(|a, b| enter(*a).total_cmp(&enter(*b)));
    let next = enter(boxed[MAX_OPERANDS]);
    boxed.truncate(MAX_OPERANDS);
    boxed.sort_unstable();
    L::from_f64(next)
}

impl<L: Lanes> CsgHits<L> {
    pub(super) fn for_fallback(rays: u32) -> CsgHits<L> {
        let infinity = L::splat(L::Scalar::INFINITY);
        CsgHits {
            hit: 0,
            unsure: 0,
            left: rays,
            t: L::select(L::Mask::from_bits(rays), -infinity, infinity),
            within: [infinity; 2],
            primitive: [0; 16],
        }
    }

    /// Of other rays.
    fn join(&mut self, more: &CsgHits<L>) {
        let lanes = L::Mask::from_bits(more.hit | more.left);
        self.t = L::select(lanes, more.t, self.t);
        for (own, other) in self.within.iter_mut().zip(more.within) {
            *own = L::select(lanes, other, *own);
        }
        for (lane, (own, other)) in self.primitive.iter_mut().zip(more.primitive).enumerate() {
            if more.hit >> lane & 1 != 0 {
                *own = other;
            }
        }
        self.hit |= more.hit;
        self.unsure |= more.unsure;
        self.left |= more.left;
    }
}
