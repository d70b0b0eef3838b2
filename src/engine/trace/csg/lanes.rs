//! CSG solids in lanes: Roth's walk (1982) for a packet of rays.
//!
//! For each operand the walk keeps every ray's next boundary, and whether the ray is
//! inside. It flips the operand of the nearest boundary and evaluates the program; the hit
//! is where the program's value changes. In `guarded` a boundary is an interval of t, and
//! rays whose intervals overlap are undecided (K1). In `fast` both ends of the interval
//! are equal.

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

/// First hits of a packet's rays on a CSG solid; one bit or entry per lane.
pub(in crate::trace) struct CsgHits<L: Lanes> {
    pub hit: u32,
    pub unsure: u32,
    /// Rays that the scalar walk has to trace from `t` on.
    pub left: u32,
    pub t: L,
    pub within: [L; 2],
    /// Of hits, as [`super::Crossing::primitive`].
    pub primitive: [u32; 16],
}

/// Buffers of the walk in lanes, reused from packet to packet.
#[derive(Default)]
pub(in crate::trace) struct LaneScratch {
    operands: Vec<u32>,
    /// In `fast`: operand in the upper half of a word, box in the lower.
    boxed: Vec<u64>,
    program: Restricted,
    values: Vec<u32>,
    /// A `Vec<[L; 3]>` per width: the boundaries of operands that may have many.
    pub(in crate::trace) rows: TypedSlots,
    /// Roots that a chosen solver finds on one line.
    roots: Vec<f64>,
}

/// Number of operands along a packet up to which it is traced in lanes; packets with more
/// are split. In `fast` it is one that single rays may have as well (K16).
const MAX_OPERANDS: usize = 256;
const MAX_OPERANDS_FAST: usize = 64;

/// Number of gates up to which programs are evaluated in lanes.
const MAX_GATES: usize = 256;

/// Finds the first hits of the `active` rays up to `limit`.
#[inline]
pub(in crate::trace) fn first<L: Lanes, C: Certainty>(
    csg: &PreparedCsg,
    tables: &Tables,
    object: &Packet<L>,
    active: u32,
    limit: L,
    scratch: &mut TraceScratch,
) -> CsgHits<L> {
    // The scalar walk handles tall programs: it updates the few gates that a ray changes, while
    // lanes evaluate all of them.
    let solid = &csg.solid;
    let is_tall = solid.program.gates() > MAX_GATES;
    // In `fast` it also handles solids with meshes or a tolerance, so that answers do not depend
    // on whether lanes or the scalar walk give them.
    let is_scalar = match C::GUARDED {
        true => csg.is_beyond_lanes(),
        false => solid.has_meshes() || solid.tolerance > 0.0,
    };
    if is_tall || is_scalar {
        return CsgHits::for_fallback(active);
    }
    first_by_parts::<L, C>((csg, tables), object, active, limit, scratch)
}

/// Finds first hits, halving the set of rays while too many operands lie along it.
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
        // Includes boundaries that may be one event with one between start and limit (K7).
        let beside = solid.0.farthest_event(&ray.org, &ray.dir);
        let until = L::select(awake, limit + beside, asleep);
        let rays = (ray.org, ray.dir);
        let from = ray.t_min - beside;
        solid.0.operands_along(rays, from, until, operands);
    } else {
        // Includes boundaries that are one event with one before the limit (K16).
        let [width, share] = event_width::<L, C>(ray);
        let far = limit + (width + limit.abs() * share) * L::from_f32(2.0);
        let until = L::select(awake, far, asleep);
        let slabs = solid.0.slabs(ray.org, ray.dir);
        solid.0.operands_in_boxes(&slabs, ray.t_min, until, boxed);
        if boxed.len() > MAX_OPERANDS_FAST && active.count_ones() < 2 {
            known = keep_nearest(solid.0, &slabs, ray.t_min, active, boxed);
        }
        operands.clear();
        operands.extend(boxed.iter().map(|entry| (entry >> 32) as u32));
    }
    let most = match C::GUARDED {
        true => MAX_OPERANDS,
        false => MAX_OPERANDS_FAST,
    };
    if operands.len() <= most {
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

/// Keeps the operands that a single ray reaches first. Returns the t at which it reaches
/// the next one; hits are known up to there.
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
    boxed.sort_unstable_by(|a, b| enter(*a).total_cmp(&enter(*b)).then(a.cmp(b)));
    let next = enter(boxed[MAX_OPERANDS_FAST]);
    boxed.truncate(MAX_OPERANDS_FAST);
    boxed.sort_unstable();
    L::from_f64(next)
}

impl<L: Lanes> CsgHits<L> {
    /// No hits; all of `rays` are left to the scalar walk.
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

    /// Merges the hits of other rays.
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
