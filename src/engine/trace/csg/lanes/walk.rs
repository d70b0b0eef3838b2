//! The walk of a packet along the boundaries of a CSG solid's operands.

use super::ends::{Spaces, event_width, passes, widening};
use super::track::{Track, last_behind};
use super::{CsgHits, LaneScratch, MAX_OPERANDS};
use crate::accel::{CoincidentFace, PreparedCsg};
use crate::geom::Certainty;
use crate::geom::guarded::Ends;
use crate::geom::primitive::Boundaries;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::roots::Solver;
use crate::scene::{Shape, Tables};
use crate::trace::csg::TURNED;
use crate::trace::packet::Packet;
use crate::trace::scratch::TraceScratch;
use arrayvec::ArrayVec;
use glam::DVec3;
use std::iter::repeat_n;

/// Walks the boundaries of at most [`MAX_OPERANDS`] operands; in `fast` up to `known`.
///
/// `fast` has no error bounds, so a result must not depend on `limit`: packets and single
/// rays carry different ones (K16).
#[inline(never)]
pub(super) fn run<L: Lanes, C: Certainty>(
    (csg, tables): (&PreparedCsg, &Tables),
    object: &Packet<L>,
    (active, limit, mut known): (u32, L, L),
    scratch: &mut TraceScratch,
) -> CsgHits<L> {
    let LaneScratch {
        operands,
        boxed,
        program,
        values,
        rows,
        roots,
    } = &mut scratch.lanes;
    let kernels = &mut scratch.kernels;
    let (ray, infinity) = (&object.ray, L::splat(L::Scalar::INFINITY));
    let nothing = Track {
        next: [infinity; 3],
        exit: [infinity; 3],
        inside: 0,
        more: [0; 2],
    };
    // Where boundaries beyond t_min may be one event with earlier ones, none is left out.
    let part = if !C::GUARDED {
        [ray.t_min, infinity]
    } else if csg.solid.is_exact() {
        let awake = L::Mask::from_bits(active);
        [ray.t_min, L::select(awake, limit, -infinity)]
    } else {
        [-infinity, infinity]
    };
    let more: &mut Vec<[L; 3]> = rows.slot();
    more.clear();
    let mut tracks = ArrayVec::<_, MAX_OPERANDS>::new();
    tracks.extend(repeat_n(nothing, operands.len()));
    let tracks = &mut tracks[..];
    // Numbers of the faces at each operand's ends, if the solid has coincident faces; NaN
    // for operands without numbered faces, such as polynomials.
    let mut faces = ArrayVec::<_, MAX_OPERANDS>::new();
    let shares_faces = C::GUARDED && !csg.coincident_faces.is_empty();
    if shares_faces {
        faces.extend(repeat_n([L::from_f32(f32::NAN); 2], operands.len()));
    }
    let mut open = active;
    let mut unsure = 0;
    let wider = widening::<L, C>(csg, ray);
    let mut reached = -infinity;
    let slabs = (!C::GUARDED).then(|| csg.slabs(ray.org, ray.dir));
    let mut spaces = Spaces::new(object);
    for (i, (track, number)) in tracks.iter_mut().zip(operands.iter()).enumerate() {
        let operand = &csg.solid.operands[*number as usize];
        let (here, begin) = match &slabs {
            Some(slabs) => csg.part_of(boxed[i], slabs, ray.t_min),
            None => (L::Mask::splat(true), -infinity),
        };
        let mut leave_open = |track: &mut Track<L>, lanes: u32, begin: L| {
            if C::GUARDED {
                unsure |= lanes;
            } else if lanes != 0 {
                track.inside &= !lanes;
                known = L::select(L::Mask::from_bits(lanes), known.min(begin), known);
            }
        };
        if operand.shape.boundaries() == Boundaries::Crossings {
            let (enter, missed) = match &operand.bounds {
                Some(bounds) => {
                    let frame = &csg.solid.frames[operand.frame as usize];
                    passes((bounds, frame.condition), ray, part)
                }
                None => (-infinity, L::Mask::splat(false)),
            };
            let ends = Ends::none_or_unknown(missed | !here);
            let unknown = track.start(&ends, &ends, ray.t_min);
            leave_open(track, unknown, enter.max(begin));
            continue;
        }
        if let Shape::Implicit(id) = operand.shape {
            let at = more.len();
            let lanes = L::Mask::from_bits(open) & here;
            let row = (operand, id);
            let solid = (csg, tables);
            let all = if !C::GUARDED && tables.implicits.solver(id) != Solver::Auto {
                spaces.boundaries_by(solid, row, lanes, roots, more)
            } else {
                spaces.boundaries(solid, row, lanes, more, kernels)
            };
            if !C::GUARDED {
                for t in more[at..].as_flattened_mut() {
                    *t = t.max(begin);
                }
            }
            track.inside = all.inside.bits();
            track.next = more.get(at).copied().unwrap_or([infinity; 3]);
            track.exit = more.get(at + 1).copied().unwrap_or([infinity; 3]);
            track.more = [(at + 2).min(more.len()), more.len()];
            leave_open(track, all.unsure.bits(), begin);
            // Boundaries before the start were not sought; they reach to the start at most,
            // since the polynomial's sign is certain there despite the placement error.
            if let (Some(_), Some((bounds, condition))) = (wider, csg.box_around(operand)) {
                let from = ray.t_min - csg.farthest_event(&ray.org, &ray.dir);
                let before = [from, ray.t_min];
                let (_, missed) = passes((&bounds, condition), ray, before);
                reached = reached.max(L::select(missed, -infinity, ray.t_min));
            }
            continue;
        }
        let mut ends = spaces.ends::<C>((csg, tables), operand, wider);
        if !C::GUARDED {
            ends.keep(here);
            ends.begin_at(begin);
        }
        if shares_faces {
            faces[i] = ends.faces;
        }
        let unknown = match wider {
            Some(wider) => {
                let wide = spaces.widened(csg, *number, &ends, wider);
                reached = reached.max(last_behind(&ends, &wide, ray.t_min));
                track.start(&ends, &wide, ray.t_min)
            }
            None => track.start(&ends, &ends, ray.t_min),
        };
        leave_open(track, unknown, begin);
    }
    // A ray is undecided if a boundary before t_min reaches the next one (K8).
    if wider.is_some() {
        let nexts = tracks.iter().map(|track| track.next[0]);
        let next = nexts.fold(infinity, |least, next| least.min(next));
        unsure |= (!reached.lt(next)).bits();
    }
    unsure &= open;
    open &= !unsure;
    program.set(&csg.solid.program, operands);
    let mut ask = |tracks: &[Track<L>]| {
        let inside = tracks.iter().map(|track| track.inside);
        program.inside(inside, values)
    };
    let start = ask(tracks);
    let [width, share] = event_width::<L, C>(ray);
    let mut met = CsgHits {
        unsure,
        ..CsgHits::for_fallback(0)
    };
    let ends_somewhere = if C::GUARDED {
        0
    } else {
        known.lt(infinity).bits()
    };
    // In `fast` a boundary lies where it was computed.
    let [from, to] = if C::GUARDED { [0, 2] } else { [1, 1] };
    while open != 0 {
        let mut least = infinity;
        for track in tracks.iter() {
            least = least.min(track.next[to]);
        }
        let event = least + (width + least.abs() * share);
        if open & ends_somewhere != 0 {
            let left = open & ends_somewhere & known.le(event).bits();
            open &= !left;
            met.left |= left & known.le(limit).bits();
            met.t = L::select(L::Mask::from_bits(left), known, met.t);
        }
        // Rays without a further boundary are done.
        open &= least.lt(infinity).bits();
        if open == 0 {
            break;
        }
        let (mut once, mut twice) = (0, 0);
        for track in tracks.iter() {
            let here = track.next[from].le(event).bits();
            twice |= once & here;
            once |= here;
        }
        // `together`: rays at boundaries of several operands that are one event, since they
        // lie in one surface (K9). `nearly`: of these, rays at planes of different frames
        // whose order is not known (K10).
        let mut together = twice & open;
        let mut nearly = 0;
        if C::GUARDED && together != 0 {
            let asked = std::mem::take(&mut together);
            if shares_faces {
                let all = (&operands[..], &*tracks, &faces[..]);
                [together, nearly] = on_one_face(csg, object, all, event, asked);
            }
            let apart = asked & !together;
            met.unsure |= apart;
            open &= !apart;
        }
        // The event's t, surface and sense, taken before the operands are flipped.
        let mut at = [infinity; 3];
        let (mut numbers, mut entering, mut taken) = ([0; 16], 0, 0);
        let mut farthest = -infinity;
        for i in 0..tracks.len() {
            let track = &mut tracks[i];
            let here = track.next[from].le(event).bits() & open;
            if here == 0 {
                continue;
            }
            let (next, outside) = (track.next, !track.inside);
            track.flip(here, infinity);
            if here & nearly != 0 {
                let reaches = L::select(L::Mask::from_bits(here), next[to], -infinity);
                farthest = farthest.max(reaches);
            }
            let [from, to] = track.more;
            if from < to {
                track.follow(L::Mask::from_bits(here), &mut more[from..to]);
            }
            let mut first = here & !taken;
            // Of boundaries that are one event, the hit is the first to change the program.
            if together & first != 0 {
                first &= !together | (ask(tracks) ^ start);
            }
            let lanes = L::Mask::from_bits(first);
            for (at, next) in at.iter_mut().zip(&next) {
                *at = L::select(lanes, *next, *at);
            }
            let mut bits = first;
            while bits != 0 {
                let surface = csg.solid.surface(operands[i], 0);
                numbers[bits.trailing_zeros() as usize] = surface;
                bits &= bits - 1;
            }
            entering |= first & outside;
            taken |= first;
        }
        // A boundary that follows nearly coincident planes may belong to their event.
        if nearly & open != 0 {
            let mut late = 0;
            for track in tracks.iter() {
                late |= track.next[from].le(farthest).bits();
            }
            late &= nearly & open;
            met.unsure |= late;
            open &= !late;
        }
        let now = ask(tracks);
        let mut changed = (now ^ start) & open;
        if C::GUARDED {
            let vague = changed & (nearly | !is_sharp(&at).bits());
            met.unsure |= vague;
            open &= !vague;
            changed &= !vague;
        }
        if changed != 0 {
            let lanes = L::Mask::from_bits(changed);
            met.t = L::select(lanes, at[1], met.t);
            met.within = [
                L::select(lanes, at[0], met.within[0]),
                L::select(lanes, at[2], met.within[1]),
            ];
            let turned = now ^ entering;
            let mut bits = changed;
            while bits != 0 {
                let lane = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let turned = if turned >> lane & 1 != 0 { TURNED } else { 0 };
                met.primitive[lane] = numbers[lane] | turned;
            }
            met.hit |= changed;
            open &= !changed;
        }
        // Events beyond the limit do not matter.
        open &= !least.gt(limit).bits();
    }
    met
}

/// Finds the rays whose boundaries at an event are one by definition, because the faces
/// coincide (K9); and of these, the rays at planes of several frames that only nearly
/// coincide (K10).
#[cold]
#[inline(never)]
fn on_one_face<L: Lanes>(
    csg: &PreparedCsg,
    object: &Packet<L>,
    (operands, tracks, ends): (&[u32], &[Track<L>], &[[L; 2]]),
    event: L,
    asked: u32,
) -> [u32; 2] {
    let (mut faces, mut one, mut nearly) = ([None::<CoincidentFace>; 16], asked, 0);
    for ((track, [enter, exit]), number) in tracks.iter().zip(ends).zip(operands) {
        let mut here = track.next[0].le(event).bits() & one;
        if here == 0 {
            continue;
        }
        while here != 0 {
            let lane = here.trailing_zeros() as usize;
            here &= here - 1;
            let inside = track.inside >> lane & 1 != 0;
            let face = if inside { exit } else { enter }.lane(lane).to_f64();
            let shared = csg.coincident_faces.of_face(*number, face);
            match (shared, faces[lane]) {
                (Some(_), None) => faces[lane] = shared,
                (Some(this), Some(other)) if this.exact == other.exact => {}
                (Some(this), Some(other)) if this.near == other.near && this.near != 0 => {
                    nearly |= 1 << lane;
                }
                _ => one &= !(1 << lane),
            }
        }
    }
    let mut bits = nearly & one;
    while bits != 0 {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits - 1;
        let dir = DVec3::from_array(object.lane(lane).1);
        let near = faces[lane].map_or(0, |face| face.near);
        if !csg.coincident_faces.is_crossed(near, dir) {
            one &= !(1 << lane);
        }
    }
    [one, nearly & one]
}

/// Whether t is known to at least eight bits (K2). A t nearer to the start than that is
/// left to exact arithmetic.
#[inline(always)]
pub(in crate::trace) fn is_sharp<L: Lanes>([from, t, to]: &[L; 3]) -> L::Mask {
    ((*to - *from) * L::from_f32(256.0)).le(t.abs())
}
