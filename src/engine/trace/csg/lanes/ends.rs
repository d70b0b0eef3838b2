//! Spans of operands along a packet, each computed in the operand's frame.

use crate::accel::{PreparedCsg, Slabs};
use crate::geom::exact::Line;
use crate::geom::guarded::implicit::OperandCrossings;
use crate::geom::guarded::{self, Ends, ObjectRay};
use crate::geom::primitive::Blur;
use crate::geom::{Certainty, Ray, Scratch, by_solver};
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::math::{Aabb, Vec3};
use crate::scene::{CsgOperand, ImplicitId, Shape, Tables};
use crate::trace::packet::Packet;
use crate::trace::query::next_up;
use glam::DVec3;

/// Largest |t| in which roots are sought. Slabs left open reach beyond it.
const FARTHEST: f64 = 1e300;

/// Intersects rays with a box in the solid's space, padded for the roundings on the way to
/// operands' frames, each times `condition` (X11). The interval is empty (enter > exit) for
/// a miss.
#[inline(always)]
fn part_in<L: Lanes>((org, dir): (Vec3<L>, Vec3<L>), bounds: &Aabb, condition: f64) -> (L, L) {
    let slabs = Slabs::new(org, dir, &bounds.outward());
    // The padding of `Line::part_in` (X11); the slabs pad for their own roundings (X1).
    let slack = org.max_abs() * L::from_f64(condition * (32.0 * f64::EPSILON));
    let side = |side: DVec3, slack: L| side.to_array().map(|x| L::from_f64(x) + slack);
    slabs.interval_each(side(bounds.min, -slack), side(bounds.max, slack))
}

/// Returns where rays enter a box, and the lanes that certainly miss it between two t.
#[inline(always)]
pub(super) fn passes<L: Lanes>(
    (bounds, condition): (&Aabb, f64),
    ray: &Ray<L>,
    [from, to]: [L; 2],
) -> (L, L::Mask) {
    let (enter, exit) = part_in((ray.org, ray.dir), bounds, condition);
    (enter, !enter.max(from).le(exit.min(to)))
}

/// A packet's rays in the frames of operands; the rays of the last frame are kept.
pub(in crate::trace) struct Spaces<'a, L: Lanes> {
    own: &'a Packet<L>,
    moved: Option<(u32, Frames<L>)>,
}

impl<'a, L: Lanes> Spaces<'a, L> {
    #[inline(always)]
    pub fn new(own: &'a Packet<L>) -> Spaces<'a, L> {
        Spaces { own, moved: None }
    }

    #[inline(always)]
    pub fn in_frame(&mut self, csg: &PreparedCsg, frame: u32) -> ObjectRay<'_, L> {
        let own = self.own;
        if frame != 0 && !matches!(self.moved, Some((row, _)) if row == frame) {
            let map = &csg.solid.frames[frame as usize].operand_from_solid;
            let (org, dir) = (map.points(own.org), map.vectors(own.dir));
            self.moved = Some((frame, Frames::new(org, dir, own.ray.t_min)));
        }
        match &self.moved {
            Some((_, moved)) if frame != 0 => moved.rays(),
            _ => ObjectRay::new(&own.org, &own.dir, &own.ray),
        }
    }

    /// Finds all boundaries of a polynomial operand beyond the rays' start: the lanes inside
    /// at the start, and one row per boundary in the order of t, as (least, t, greatest).
    pub fn boundaries(
        &mut self,
        (csg, tables): (&PreparedCsg, &Tables),
        (operand, row): (&CsgOperand, ImplicitId),
        active: L::Mask,
        rows: &mut Vec<[L; 3]>,
        kernels: &mut Scratch,
    ) -> OperandCrossings<L> {
        let Some((bounds, condition)) = csg.box_around(operand) else {
            return OperandCrossings {
                inside: L::Mask::splat(false),
                unsure: active,
            };
        };
        let own = self.own;
        let t_min = own.ray.t_min.widen();
        let (enter, exit) = part_in((own.org, own.dir), &bounds, condition);
        let (start, end) = (enter.max(t_min), exit);
        let farthest = start.abs().max(end.abs());
        let bits = |mask: <L::Double as Lanes>::Mask| L::Mask::from_bits(mask.bits());
        let apart = bits(!start.lt(end));
        let known = active & !apart & bits(farthest.lt(<L::Double as Lanes>::from_f64(FARTHEST)));
        let zero = <L::Double as Lanes>::zero();
        let astray = match csg.solid.frames.len() {
            1 => zero,
            // A polynomial takes the whole placement error, twice that of a quadric (K5).
            _ => csg.astray(operand.frame, own.org.max_abs()) * <L::Double as Lanes>::from_f64(2.0),
        };
        let tape = &tables.implicits.tape[row.index()];
        let frame = self.in_frame(csg, operand.frame);
        let rays = (*frame.org, *frame.dir);
        let found = guarded::implicit::operand_crossings::<L>(
            tape,
            rays,
            [start, end],
            (astray, known),
            rows,
            &mut kernels.polynomial,
        );
        OperandCrossings {
            inside: found.inside,
            unsure: found.unsure | active & !apart & !known,
        }
    }

    /// [`Spaces::boundaries`] by the solver that the scene chooses, without bounds: `fast`.
    #[inline(never)]
    pub fn boundaries_by(
        &mut self,
        (csg, tables): (&PreparedCsg, &Tables),
        (operand, row): (&CsgOperand, ImplicitId),
        active: L::Mask,
        found: &mut Vec<f64>,
        rows: &mut Vec<[L; 3]>,
    ) -> OperandCrossings<L> {
        let (solver, first) = (tables.implicits.solver(row), rows.len());
        let tape = &tables.implicits.tape[row.index()];
        let bounds = csg.box_around(operand);
        let mut inside = 0;
        let mut bits = active.bits();
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let at = |v: &Vec3<L::Double>| [v.x.lane(lane), v.y.lane(lane), v.z.lane(lane)];
            let own = Line {
                org: at(&self.own.org),
                dir: at(&self.own.dir),
            };
            let t_min = self.own.ray.t_min.lane(lane).to_f64();
            let all = [t_min, f64::INFINITY];
            let part = match &bounds {
                Some((bounds, condition)) => own.part_in(bounds, *condition),
                None => Some(all),
            };
            let Some([from, to]) = part.map(|[from, to]| [from.max(t_min), to]) else {
                continue;
            };
            if !(from < to) {
                continue;
            }
            let frame = self.in_frame(csg, operand.frame);
            let line = (at(frame.org), at(frame.dir));
            let is_inside = by_solver::crossings(tape, solver, line, [from, to], found);
            inside |= u32::from(is_inside) << lane;
            for (pass, t) in found.iter().enumerate() {
                if rows.len() <= first + pass {
                    rows.push([L::splat(L::Scalar::INFINITY); 3]);
                }
                // t rounded to the lanes' type stays beyond t_min.
                let least = next_up(self.own.ray.t_min.lane(lane));
                let t = L::Scalar::from_f64(t.max(least.to_f64()));
                rows[first + pass] = rows[first + pass].map(|row| row.with_lane(lane, t));
            }
        }
        OperandCrossings {
            inside: L::Mask::from_bits(inside),
            unsure: L::Mask::splat(false),
        }
    }

    /// Computes an operand's span. Ends of shapes with [`Blur::Apart`] already include the
    /// placement error if the solid has several frames (K5).
    #[inline(always)]
    pub fn ends<C: Certainty>(
        &mut self,
        (csg, tables): (&PreparedCsg, &Tables),
        operand: &CsgOperand,
        wider: Option<L>,
    ) -> Ends<L> {
        let own = self.own;
        let frame = self.in_frame(csg, operand.frame);
        let astray = match (operand.shape.blur(), wider) {
            (Blur::Apart, Some(_)) => csg.astray(operand.frame, own.org.max_abs()),
            _ => <L::Double as Lanes>::zero(),
        };
        ends::<L, C>(tables, operand.shape, &frame, astray)
    }

    /// Widens a span's ends by the slack between frames (K3, K4) and that of a tolerance (K17): see
    /// [`widening`].
    #[inline(always)]
    pub fn widened(&mut self, csg: &PreparedCsg, number: u32, ends: &Ends<L>, wider: L) -> Ends<L> {
        let operand = &csg.solid.operands[number as usize];
        if operand.shape.blur() == Blur::Apart {
            return *ends;
        }
        let tolerance = csg.tolerance(number);
        let unit = L::Scalar::UNIT_ROUNDOFF.to_f64();
        // The bound once more, for the roundings of the wider one (K17).
        let more = tolerance.map_or(0.0, |tolerance| 1.0 + tolerance.factor / unit);
        let wide = ends.widened(wider + L::from_f64(more));
        let normals = csg.unit_normals(number);
        if normals.is_empty() {
            return wide;
        }
        let own = self.own;
        let frame = self.in_frame(csg, operand.frame);
        let slack = csg.placement_per_reach(operand.frame).map(L::from_f64);
        let more = tolerance.map_or(0.0, |tolerance| tolerance.plane);
        let slack = own.ray.org.max_abs() * slack[0] + slack[1] + L::from_f64(more);
        wide.moved(slack / least_rate(normals, frame.ray))
    }
}

/// Rays in an operand's frame, in f64 and at the lanes' precision.
pub(in crate::trace) struct Frames<L: Lanes> {
    org: Vec3<L::Double>,
    dir: Vec3<L::Double>,
    ray: Ray<L>,
}

impl<L: Lanes> Frames<L> {
    // Inlined so that the half kilobyte is written in place.
    #[inline(always)]
    pub fn new(org: Vec3<L::Double>, dir: Vec3<L::Double>, t_min: L) -> Frames<L> {
        let narrow = |v: Vec3<L::Double>| Vec3::new(L::narrow(v.x), L::narrow(v.y), L::narrow(v.z));
        let ray = Ray::new(narrow(org), narrow(dir), t_min);
        Frames { org, dir, ray }
    }

    #[inline(always)]
    pub fn rays(&self) -> ObjectRay<'_, L> {
        ObjectRay::new(&self.org, &self.dir, &self.ray)
    }
}

/// Factor by which intervals of boundaries grow (K3), if the solid has several frames or a
/// tolerance: see [`PreparedCsg::widening_per_reach`].
#[inline(always)]
pub(super) fn widening<L: Lanes, C: Certainty>(csg: &PreparedCsg, ray: &Ray<L>) -> Option<L> {
    if !C::GUARDED || csg.solid.is_exact() {
        return None;
    }
    let unit = L::Scalar::UNIT_ROUNDOFF.to_f64();
    let [share, more] = csg.widening_per_reach(unit).map(L::from_f64);
    Some(L::from_f32(1.0) + (ray.org.max_abs() * share + more))
}

/// Least rate at which rays leave the planes of these unit normals (S48).
#[inline(always)]
fn least_rate<L: Lanes>(normals: &[DVec3], ray: &Ray<L>) -> L {
    let mut least = L::splat(L::Scalar::INFINITY);
    for normal in normals {
        let normal: Vec3<L> = Vec3::splat(normal.to_array().map(L::Scalar::from_f64));
        least = least.min(normal.dot(ray.dir).abs());
    }
    least
}

/// Width in t within which `fast` takes boundaries for one event, so that faces meant to
/// coincide leave no skin: an absolute part, and a part relative to t (K16). It depends on
/// the ray alone.
#[inline(always)]
pub(super) fn event_width<L: Lanes, C: Certainty>(ray: &Ray<L>) -> [L; 2] {
    if C::GUARDED {
        return [L::zero(); 2];
    }
    let rounding = L::splat(L::Scalar::UNIT_ROUNDOFF) * L::from_f32(32.0);
    [
        ray.org.max_abs() * rounding / ray.shear.along.abs(),
        rounding,
    ]
}

/// Computes the span of an operand. `astray`: the surface's placement error (K5).
#[inline(always)]
pub(in crate::trace) fn ends<L: Lanes, C: Certainty>(
    tables: &Tables,
    shape: Shape,
    object: &ObjectRay<L>,
    astray: L::Double,
) -> Ends<L> {
    if C::GUARDED {
        tables.ends(shape, object, astray)
    } else {
        tables.ends_fast(shape, object)
    }
}
