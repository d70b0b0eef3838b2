//! Many rays against a combination: Roth's walk in lanes.
//!
//! Every operand keeps each ray's next boundary, and which rays are inside. The
//! nearest boundaries are flipped, the program is asked, and where its answer
//! changes is the hit. Boundaries are known between two numbers; rays for which
//! that does not say what comes first are in doubt. Without bounds the two numbers
//! are one.

use crate::accel::{Combined, PlaneOf, Slabs};
use crate::csg::Restricted;
use crate::geom::guarded::{self, Ends, ObjectRay};
use crate::geom::{
    Certainty, HalfSpace, Ray, cone, cuboid, ellipsoid, half_space, quadric, sphere,
};
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::math::{Aabb32, Vec3, unit};
use crate::scene::{Shape, Tables};
use crate::trace::packet::Packet;
use glam::DVec3;
use std::cell::Cell;

/// What some rays meet of a combination first.
pub(in crate::trace) struct Met<L: Lanes> {
    pub hit: u32,
    pub unsure: u32,
    /// Rays that lanes are of no use for.
    pub left: u32,
    pub t: L,
    pub within: [L; 2],
    /// By lane: of hits, what [`super::Crossing`] says.
    pub primitive: [u32; 16],
}

/// Reused from packet to packet.
#[derive(Default)]
struct LaneScratch {
    operands: Vec<u32>,
    program: Restricted,
    values: Vec<u32>,
}

thread_local! {
    static SCRATCH: Cell<Option<Box<LaneScratch>>> = const { Cell::new(None) };
}

/// An operand's boundaries beyond the rays' start.
#[derive(Clone, Copy)]
struct Track<L: Lanes> {
    /// At least, as computed, at most; infinite where none is left.
    next: [L; 3],
    /// Where it is left, of rays that `next` says come in.
    exit: [L; 3],
    /// Rays inside, a bit each.
    inside: u32,
}

/// So many operands of a packet are met in lanes; of more than these each ray is
/// met by itself.
const MOST: usize = 64;

/// So many are the rule.
const FEW: usize = 8;

/// So many gates, at most.
const TALL: usize = 256;

/// The rays of `active` lanes up to `limit`.
#[inline]
pub(in crate::trace) fn first<L: Lanes, C: Certainty>(
    combined: &Combined,
    tables: &Tables,
    object: &Packet<L>,
    active: u32,
    limit: L,
) -> Met<L> {
    // Boundaries that are one within a distance are left to the other function; so
    // are tall programs, of which a ray changes few gates: here all are worked out.
    let solid = &combined.solid;
    let is_tall = solid.program.gates() > TALL;
    // So is all of a solid with meshes where an answer may depend on who gives it.
    let has_meshes = solid.has_meshes() && !C::GUARDED;
    if is_tall || has_meshes || solid.tolerance > 0.0 {
        return Met::left(active);
    }
    let mut scratch = SCRATCH.take().unwrap_or_default();
    let met = parts::<L, C>((combined, tables), object, active, limit, &mut scratch);
    SCRATCH.set(Some(scratch));
    met
}

/// Rays that together have too many operands before them are taken by halves.
#[inline(never)]
fn parts<L: Lanes, C: Certainty>(
    solid: (&Combined, &Tables),
    object: &Packet<L>,
    active: u32,
    limit: L,
    scratch: &mut LaneScratch,
) -> Met<L> {
    let ray = &object.ray;
    let asleep = -L::splat(L::Scalar::INFINITY);
    let until = L::select(L::Mask::from_bits(active), limit, asleep);
    let operands = &mut scratch.operands;
    solid
        .0
        .operands_along((ray.org, ray.dir), ray.t_min, until, operands);
    match operands.len() {
        0..=FEW => run::<L, C, FEW>(solid, object, active, limit, scratch),
        0..=MOST => run::<L, C, MOST>(solid, object, active, limit, scratch),
        _ if active.count_ones() < 2 => Met::left(active),
        _ => {
            let (mut low, mut rest) = (0_u32, active);
            while low.count_ones() < rest.count_ones() {
                low |= rest & rest.wrapping_neg();
                rest &= rest - 1;
            }
            let [mut met, more] =
                [low, rest].map(|part| parts::<L, C>(solid, object, part, limit, scratch));
            met.join(&more);
            met
        }
    }
}

impl<L: Lanes> Met<L> {
    pub(super) fn left(rays: u32) -> Met<L> {
        Met {
            hit: 0,
            unsure: 0,
            left: rays,
            t: L::splat(L::Scalar::INFINITY),
            within: [L::splat(L::Scalar::INFINITY); 2],
            primitive: [0; 16],
        }
    }

    /// Of other rays.
    fn join(&mut self, more: &Met<L>) {
        let lanes = L::Mask::from_bits(more.hit);
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

/// Of `N` operands at most.
#[inline(never)]
fn run<L: Lanes, C: Certainty, const N: usize>(
    (combined, tables): (&Combined, &Tables),
    object: &Packet<L>,
    active: u32,
    limit: L,
    scratch: &mut LaneScratch,
) -> Met<L> {
    let LaneScratch {
        operands,
        program,
        values,
    } = scratch;
    let (ray, infinity) = (&object.ray, L::splat(L::Scalar::INFINITY));
    let nothing = Track {
        next: [infinity; 3],
        exit: [infinity; 3],
        inside: 0,
    };
    // What lies before t_min may be one event with what lies behind it.
    let part = if combined.solid.is_exact() {
        let awake = L::Mask::from_bits(active);
        [ray.t_min, L::select(awake, limit, -infinity)]
    } else {
        [-infinity, infinity]
    };
    let mut tracks = [nothing; N];
    let tracks = &mut tracks[..operands.len()];
    let mut open = active;
    let mut unsure = 0;
    let wider = wider::<L, C>(combined, ray);
    let mut spaces = Spaces::new(object);
    for (track, number) in tracks.iter_mut().zip(operands.iter()) {
        let operand = &combined.solid.operands[*number as usize];
        if let (Shape::Mesh(_), Some(bounds)) = (operand.shape, &operand.bounds) {
            let missed = passes(&bounds.outward(), ray, part);
            unsure |= track.start(&Ends::none_or_unknown(missed), ray.t_min);
            continue;
        }
        let frame = spaces.of(combined, object, operand.frame);
        let ends = match (operand.shape, wider) {
            (Shape::Quadric(id), Some(_)) => {
                let astray = combined.astray(operand.frame, object.org.max_abs());
                let frame = ObjectRay::new(frame.org, frame.dir, &frame.ray);
                guarded::quadric::ends(&tables.quadrics.row(id), &frame, astray)
            }
            (shape, None) => ends::<L, C>(tables, shape, frame),
            (shape, Some(wider)) => {
                let ends = ends::<L, C>(tables, shape, frame).widened(wider);
                let planes = match shape {
                    Shape::Polyhedron(id) => tables.polyhedra.planes(id),
                    Shape::HalfSpace(id) => &[tables.half_spaces.row(id)],
                    _ => &[],
                };
                if planes.is_empty() {
                    ends
                } else {
                    let slack = combined.placement_per_reach(operand.frame).map(L::from_f64);
                    let slack = ray.org.max_abs() * slack[0] + slack[1];
                    ends.moved(slack / least_rate(planes, &frame.ray))
                }
            }
        };
        unsure |= track.start(&ends, ray.t_min);
    }
    unsure &= open;
    open &= !unsure;
    program.set(&combined.solid.program, operands);
    let mut ask = |tracks: &[Track<L>]| {
        let inside = tracks.iter().map(|track| track.inside);
        program.inside(inside, values)
    };
    let start = ask(tracks);
    let [blur, share] = blur::<L, C>(ray);
    let mut met = Met {
        unsure,
        ..Met::left(0)
    };
    while open != 0 {
        let mut least = infinity;
        for track in tracks.iter() {
            least = least.min(track.next[2]);
        }
        // Nothing is left that is not too far.
        open &= least.lt(infinity).bits();
        if open == 0 {
            break;
        }
        let event = least + (blur + least.abs() * share);
        let (mut once, mut twice) = (0, 0);
        for track in tracks.iter() {
            let here = track.next[0].le(event).bits();
            twice |= once & here;
            once |= here;
        }
        // Rays at boundaries of several operands that are one: in one plane. Of those
        // that are nearly in one, it is not known which comes first.
        let mut together = twice & open;
        let mut nearly = 0;
        if C::GUARDED && together != 0 {
            let asked = std::mem::take(&mut together);
            if !combined.coplanar.is_empty() {
                let all = (&operands[..], &*tracks);
                [together, nearly] =
                    in_one_plane::<L, C>((combined, tables), object, all, event, asked);
            }
            let apart = asked & !together;
            met.unsure |= apart;
            open &= !apart;
        }
        // Which operand's, and how it is met there, before they are flipped.
        let mut at = [infinity; 3];
        let (mut numbers, mut entering, mut taken) = ([0; 16], 0, 0);
        for i in 0..tracks.len() {
            let track = &mut tracks[i];
            let here = track.next[0].le(event).bits() & open;
            if here == 0 {
                continue;
            }
            let (next, outside) = (track.next, !track.inside);
            track.flip(here, infinity);
            let mut first = here & !taken;
            // Whose flip is the first to count, of those that are one.
            if together & first != 0 {
                first &= !together | (ask(tracks) ^ start);
            }
            let lanes = L::Mask::from_bits(first);
            for (at, next) in at.iter_mut().zip(&next) {
                *at = L::select(lanes, *next, *at);
            }
            let mut bits = first;
            while bits != 0 {
                let surface = combined.solid.surface(operands[i], 0);
                numbers[bits.trailing_zeros() as usize] = surface;
                bits &= bits - 1;
            }
            entering |= first & outside;
            taken |= first;
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
                let turned = if turned >> lane & 1 != 0 {
                    super::TURNED
                } else {
                    0
                };
                met.primitive[lane] = numbers[lane] | turned;
            }
            met.hit |= changed;
            open &= !changed;
        }
        // What begins beyond the limit is nothing to anybody.
        open &= !least.gt(limit).bits();
    }
    met
}

/// Of the rays asked for, those whose boundaries at an event are one by definition,
/// because they lie in one plane; and which of these know that only nearly, for
/// operands of several frames.
#[cold]
#[inline(never)]
fn in_one_plane<L: Lanes, C: Certainty>(
    (combined, tables): (&Combined, &Tables),
    object: &Packet<L>,
    (operands, tracks): (&[u32], &[Track<L>]),
    event: L,
    asked: u32,
) -> [u32; 2] {
    let mut spaces = Spaces::new(object);
    let (mut planes, mut one, mut nearly) = ([None::<PlaneOf>; 16], asked, 0);
    for (track, number) in tracks.iter().zip(operands) {
        let mut here = track.next[0].le(event).bits() & one;
        if here == 0 {
            continue;
        }
        let operand = &combined.solid.operands[*number as usize];
        let frame = spaces.of(combined, object, operand.frame);
        let [enter, exit] = ends::<L, C>(tables, operand.shape, frame).faces;
        while here != 0 {
            let lane = here.trailing_zeros() as usize;
            here &= here - 1;
            let inside = track.inside >> lane & 1 != 0;
            let face = if inside { exit } else { enter }.lane(lane).to_f64();
            let plane = combined.coplanar.plane(*number, face);
            match (plane, planes[lane]) {
                (Some(_), None) => planes[lane] = plane,
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
        let near = planes[lane].map_or(0, |plane| plane.near);
        if !combined.coplanar.is_crossed(near, dir) {
            one &= !(1 << lane);
        }
    }
    [one, nearly & one]
}

/// The lanes that are certainly not in a box between two t.
#[inline(always)]
fn passes<L: Lanes>(bounds: &Aabb32, ray: &Ray<L>, [from, to]: [L; 2]) -> L::Mask {
    let slabs = Slabs::new(ray.org, ray.dir, bounds);
    let (enter, exit) = slabs.interval(bounds.min, bounds.max);
    !enter.max(from).le(exit.min(to))
}

/// Whether t is known to eight bits at least: what is near the start, in units of
/// the operand, is better known by exact arithmetic.
#[inline(always)]
pub(in crate::trace) fn is_sharp<L: Lanes>([from, t, to]: &[L; 3]) -> L::Mask {
    ((*to - *from) * L::from_f32(256.0)).le(t.abs())
}

impl<L: Lanes> Track<L> {
    /// Brings a span to the rays' start. Returns the lanes for which that is not
    /// certain.
    #[inline(always)]
    fn start(&mut self, ends: &Ends<L>, t_min: L) -> u32 {
        let Ends {
            enter,
            exit,
            some,
            none,
            turned,
            ..
        } = ends;
        let some = *some;
        let gone = some & exit[2].le(t_min);
        let inside = some & !gone & enter[2].le(t_min);
        let ahead = some & enter[0].gt(t_min);
        let certain = *none | gone | ahead | inside & exit[0].gt(t_min);
        let infinity = L::splat(L::Scalar::INFINITY);
        for k in 0..3 {
            let next = L::select(ahead, enter[k], infinity);
            self.next[k] = L::select(inside, exit[k], next);
            self.exit[k] = L::select(ahead, exit[k], infinity);
        }
        self.inside = inside.bits() ^ turned.bits();
        (!certain).bits()
    }

    #[inline(always)]
    fn flip(&mut self, rays: u32, infinity: L) {
        let lanes = L::Mask::from_bits(rays);
        for k in 0..3 {
            self.next[k] = L::select(lanes, self.exit[k], self.next[k]);
            self.exit[k] = L::select(lanes, infinity, self.exit[k]);
        }
        self.inside ^= rays;
    }
}

/// A packet in the spaces of operands; the last one is kept.
struct Spaces<L: Lanes> {
    own: Frames<L>,
    moved: Option<(u32, Frames<L>)>,
}

impl<L: Lanes> Spaces<L> {
    #[inline(always)]
    fn new(object: &Packet<L>) -> Spaces<L> {
        Spaces {
            own: Frames {
                org: object.org,
                dir: object.dir,
                ray: object.ray,
            },
            moved: None,
        }
    }

    #[inline(always)]
    fn of(&mut self, combined: &Combined, object: &Packet<L>, frame: u32) -> &Frames<L> {
        if frame == 0 {
            return &self.own;
        }
        if !matches!(self.moved, Some((row, _)) if row == frame) {
            let map = &combined.solid.frames[frame as usize].operand_from_solid;
            let (org, dir) = (map.points(object.org), map.vectors(object.dir));
            self.moved = Some((frame, Frames::new(org, dir, object.ray.t_min)));
        }
        self.moved.as_ref().map_or(&self.own, |(_, frame)| frame)
    }
}

/// Rays in an operand's space.
pub(in crate::trace) struct Frames<L: Lanes> {
    org: Vec3<L::Double>,
    dir: Vec3<L::Double>,
    ray: Ray<L>,
}

impl<L: Lanes> Frames<L> {
    pub fn new(org: Vec3<L::Double>, dir: Vec3<L::Double>, t_min: L) -> Frames<L> {
        let narrow = |v: Vec3<L::Double>| Vec3::new(L::narrow(v.x), L::narrow(v.y), L::narrow(v.z));
        let ray = Ray::new(narrow(org), narrow(dir), t_min);
        Frames { org, dir, ray }
    }
}

/// By how much the bounds of boundaries grow: [`Combined::widening`].
#[inline(always)]
fn wider<L: Lanes, C: Certainty>(combined: &Combined, ray: &Ray<L>) -> Option<L> {
    if !C::GUARDED || combined.roughness == 0.0 {
        return None;
    }
    let unit = L::Scalar::UNIT_ROUNDOFF.to_f64();
    let [share, more] = combined.widening_per_reach(unit).map(L::from_f64);
    Some(L::from_f32(1.0) + (ray.org.max_abs() * share + more))
}

/// The least rate at which rays leave any of the planes, in their own space.
#[inline(always)]
fn least_rate<L: Lanes>(planes: &[HalfSpace], ray: &Ray<L>) -> L {
    let mut least = L::splat(L::Scalar::INFINITY);
    for plane in planes {
        let normal = unit(plane.normal).to_array();
        let normal: Vec3<L> = Vec3::splat(normal.map(L::Scalar::from_f64));
        least = least.min(normal.dot(ray.dir).abs());
    }
    least
}

/// Without bounds: how far apart boundaries are one, so that faces which were made
/// to coincide leave no skin: so much, and such a part of t; some roundings of the
/// coordinates there. What else the solid is made of does not matter.
#[inline(always)]
fn blur<L: Lanes, C: Certainty>(ray: &Ray<L>) -> [L; 2] {
    if C::GUARDED {
        return [L::zero(); 2];
    }
    let rounding = L::splat(L::Scalar::UNIT_ROUNDOFF) * L::from_f32(32.0);
    [
        ray.org.max_abs() * rounding / ray.shear.along.abs(),
        rounding,
    ]
}

#[inline(always)]
pub(in crate::trace) fn ends<L: Lanes, C: Certainty>(
    tables: &Tables,
    shape: Shape,
    Frames { org, dir, ray }: &Frames<L>,
) -> Ends<L> {
    if !C::GUARDED {
        if let Shape::Quadric(id) = shape {
            let (between, turned) = quadric::span(&tables.quadrics.row(id), ray);
            return Ends {
                turned,
                ..Ends::certain(&between)
            };
        }
        return Ends::certain(&match shape {
            Shape::HalfSpace(id) => half_space::span(&[tables.half_spaces.row(id)], ray),
            Shape::Polyhedron(id) => half_space::span(tables.polyhedra.planes(id), ray),
            Shape::Cuboid(id) => cuboid::span(&tables.cuboids.row(id), ray),
            Shape::Sphere(id) => sphere::span(&tables.spheres.row(id), ray),
            Shape::Ellipsoid(id) => ellipsoid::span(&tables.ellipsoids.row(id), ray),
            Shape::Cylinder(id) => cone::span(&tables.cylinders.row(id).as_cone(), ray),
            Shape::Cone(id) => cone::span(&tables.cones.row(id), ray),
            Shape::Quadric(_) | Shape::Polygon(_) | Shape::Mesh(_) | Shape::Combination(_) => {
                unreachable!("no surface is an operand, and meshes are not met in lanes")
            }
        });
    }
    let object = ObjectRay::new(*org, *dir, ray);
    match shape {
        Shape::HalfSpace(id) => guarded::half_space::ends(&tables.half_spaces.row(id), &object),
        Shape::Polyhedron(id) => {
            let (planes, corner) = (tables.polyhedra.planes(id), tables.polyhedra.points(id)[0]);
            guarded::half_space::polyhedron_ends(planes, corner, &object)
        }
        Shape::Cuboid(id) => guarded::cuboid::ends(&tables.cuboids.row(id), &object),
        Shape::Sphere(id) => guarded::sphere::sphere_ends(&tables.spheres.row(id), &object),
        Shape::Ellipsoid(id) => {
            guarded::sphere::ellipsoid_ends(&tables.ellipsoids.row(id), &object)
        }
        Shape::Cylinder(id) => guarded::cone::ends(&tables.cylinders.row(id).as_cone(), &object),
        Shape::Cone(id) => guarded::cone::ends(&tables.cones.row(id), &object),
        Shape::Quadric(id) => {
            let exactly = <L::Double as Lanes>::zero();
            guarded::quadric::ends(&tables.quadrics.row(id), &object, exactly)
        }
        Shape::Polygon(_) | Shape::Mesh(_) | Shape::Combination(_) => {
            unreachable!("no surface is an operand, and meshes are not met in lanes")
        }
    }
}
