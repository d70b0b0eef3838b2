//! Many rays against a combination: Roth's walk in lanes.
//!
//! Every operand keeps each ray's next boundary, and which rays are inside. The
//! nearest boundaries are flipped, the program is asked, and where its answer
//! changes is the hit. Boundaries are known between two numbers; rays for which
//! that does not say what comes first are in doubt. Without bounds the two numbers
//! are one.

use crate::accel::Combined;
use crate::csg::Restricted;
use crate::geom::guarded::{self, Ends, ObjectRay};
use crate::geom::{Certainty, Ray, cone, cuboid, ellipsoid, half_space, quadric, sphere};
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::scene::{Shape, Tables};
use crate::trace::packet::Packet;
use std::cell::Cell;

/// What some rays meet of a combination first.
pub(in crate::trace) struct Met<L: Lanes> {
    pub hit: u32,
    pub unsure: u32,
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

/// So many gates, at most.
const TALL: usize = 256;

/// The rays of `active` lanes up to `limit`. `None` where lanes are of no use for
/// this solid.
#[inline]
pub(in crate::trace) fn first<L: Lanes, C: Certainty>(
    combined: &Combined,
    tables: &Tables,
    object: &Packet<L>,
    active: u32,
    limit: L,
) -> Option<Met<L>> {
    // Boundaries that are one within a distance are left to the other function; so
    // are tall programs, of which a ray changes few gates: here all are worked out.
    let is_tall = combined.solid.program.gates() > TALL;
    if is_tall || combined.solid.tolerance > 0.0 {
        return None;
    }
    let mut scratch = SCRATCH.take().unwrap_or_default();
    let met = run::<L, C>(combined, tables, object, active, limit, &mut scratch);
    SCRATCH.set(Some(scratch));
    met
}

#[inline(always)]
fn run<L: Lanes, C: Certainty>(
    combined: &Combined,
    tables: &Tables,
    object: &Packet<L>,
    active: u32,
    limit: L,
    scratch: &mut LaneScratch,
) -> Option<Met<L>> {
    let LaneScratch {
        operands,
        program,
        values,
    } = scratch;
    let (ray, infinity) = (&object.ray, L::splat(L::Scalar::INFINITY));
    let asleep = L::select(L::Mask::from_bits(active), limit, -infinity);
    combined.operands_along((ray.org, ray.dir), ray.t_min, asleep, operands);
    if operands.len() > MOST {
        return None;
    }
    let nothing = Track {
        next: [infinity; 3],
        exit: [infinity; 3],
        inside: 0,
    };
    let mut tracks = [nothing; MOST];
    let tracks = &mut tracks[..operands.len()];
    let mut open = active;
    let mut unsure = 0;
    let wider = wider::<L, C>(combined, ray);
    let mut moved: Option<(u32, Frames<L>)> = None;
    let own = Frames {
        org: object.org,
        dir: object.dir,
        ray: *ray,
    };
    for (track, number) in tracks.iter_mut().zip(operands.iter()) {
        let operand = &combined.solid.operands[*number as usize];
        let frame = match (operand.frame, &mut moved) {
            (0, _) => &own,
            (row, Some((last, frame))) if *last == row => frame,
            (row, moved) => {
                let map = &combined.solid.frames[row as usize].operand_from_solid;
                let org = map.points(object.org);
                let dir = map.vectors(object.dir);
                &moved.insert((row, Frames::new(org, dir, ray.t_min))).1
            }
        };
        let mut ends = match (operand.shape, wider) {
            (Shape::Quadric(id), Some(_)) => {
                let astray = combined.astray(operand.frame, object.org.max_abs());
                let frame = ObjectRay::new(frame.org, frame.dir, &frame.ray);
                guarded::quadric::ends(&tables.quadrics.row(id), &frame, astray)
            }
            (shape, _) => ends::<L, C>(tables, shape, frame),
        };
        if let Some(wider) = wider {
            match operand.shape {
                // Where that is known already.
                Shape::Quadric(_) => {}
                shape => {
                    if matches!(shape, Shape::Polyhedron(_) | Shape::HalfSpace(_)) {
                        unsure = open;
                    }
                    ends = ends.widened(wider);
                }
            }
        }
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
        hit: 0,
        unsure,
        t: infinity,
        within: [infinity; 2],
        primitive: [0; 16],
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
        if C::GUARDED {
            met.unsure |= twice & open;
            open &= !twice;
        }
        // Which operand's, and how it is met there, before they are flipped.
        let mut at = [infinity; 3];
        let (mut numbers, mut entering, mut taken) = ([0; 16], 0, 0);
        for (track, number) in tracks.iter_mut().zip(operands.iter()) {
            let here = track.next[0].le(event).bits() & open;
            if here == 0 {
                continue;
            }
            let first = L::Mask::from_bits(here & !taken);
            for (at, next) in at.iter_mut().zip(&track.next) {
                *at = L::select(first, *next, *at);
            }
            let mut bits = here & !taken;
            while bits != 0 {
                numbers[bits.trailing_zeros() as usize] = *number;
                bits &= bits - 1;
            }
            entering |= here & !taken & !track.inside;
            taken |= here;
            track.flip(here, infinity);
        }
        let now = ask(tracks);
        let mut changed = (now ^ start) & open;
        if C::GUARDED {
            let vague = changed & !is_sharp(&at).bits();
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
    Some(met)
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

/// By how much the bounds of boundaries grow, so that those of operands in
/// different frames which are one by definition overlap. A boundary's bound is at
/// least 2.5 roundings of the operand's least extent over the rate at which the ray
/// leaves its surface (but for planes: beside a corner, or near the start, they may be known better);
/// its placement is 32 roundings of f64, of coordinates that count `roughness` times
/// in that extent. Twice that, for the roundings of these numbers.
#[inline(always)]
fn wider<L: Lanes, C: Certainty>(combined: &Combined, ray: &Ray<L>) -> Option<L> {
    if !C::GUARDED || combined.roughness == 0.0 {
        return None;
    }
    let reach = ray.org.max_abs() + L::from_f64(combined.size());
    let unit = L::Scalar::UNIT_ROUNDOFF.to_f64();
    let share = combined.roughness * (2.0 * 32.0 / 2.5 * UNIT / unit);
    Some(L::from_f32(1.0) + reach * L::from_f64(share))
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
                unreachable!("the check lets no surface be an operand")
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
            unreachable!("the check lets no surface be an operand")
        }
    }
}
