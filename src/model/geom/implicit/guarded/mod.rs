//! Meets polynomial surfaces with error bounds, in f64 and eight rays at a time whatever the
//! lanes' type, or four at a time for narrower packets.
//!
//! The segment of a ray in the surface's bounds or clip is parametrised by 0 ≤ s ≤ 1. On it the
//! polynomial is interpolated from its values at Chebyshev nodes ([`crate::roots::collocation`]);
//! a polynomial of low degree is expanded in its Taylor form about the ray's origin, which camera
//! rays share. The least root is isolated and refined with a bound on the error of the
//! coefficients ([`crate::roots::lanes`]; F1 to F12, docs/numerics/polynomials.md). Kernels exist
//! for a few degrees; the least that is no lower than the polynomial's is used.
//!
//! A ray's steps depend on nothing but the ray and the surface, so t has the same bits at any
//! width.

mod all_roots;
mod chebyshev_nodes;
mod double_double_form;
mod lane_regrouping;
mod operand_crossings;
mod taylor;

pub use all_roots::{SimpleCrossing, crossings};
pub use chebyshev_nodes::blur_at;
pub use double_double_form::nearest;
pub use operand_crossings::{OperandCrossings, operand_crossings};

use crate::geom::dense::Expanded;
use crate::geom::guarded::{Ends, ObjectRay, rounded};
use crate::geom::{Implicit, Meet, Ray};
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Mask, Scalar, f64x4, f64x8};
use crate::roots::lanes::{
    Segment, Waiting, changes_between, exists, leaves_between, nearly_nearest,
};
use chebyshev_nodes::segment_of;
use lane_regrouping::{ActiveLanes, by_degree};

type Eight = f64x8;
type Four = f64x4;

/// The first crossings of a group of rays.
struct Found<D> {
    t: D,
    from: D,
    to: D,
    hit: u32,
    unsure: u32,
}

/// Object rays.
struct Rays<D> {
    org: Vec3<D>,
    dir: Vec3<D>,
    t_min: D,
    limit: D,
}

/// Buffers for rays in lanes D, reused from ray to ray.
#[derive(Debug)]
struct Store<D: Lanes> {
    /// The values of a tape's steps at all nodes.
    values: Vec<D>,
    waiting: Waiting<D>,
    expanded: Expanded,
}

impl<D: Lanes> Default for Store<D> {
    fn default() -> Store<D> {
        Store {
            values: Vec::new(),
            waiting: Waiting::default(),
            expanded: Expanded::default(),
        }
    }
}

/// Buffers of the kernels of polynomial surfaces, reused from ray to ray.
#[derive(Debug, Default)]
pub struct PolynomialScratch {
    eight: Store<Eight>,
    four: Store<Four>,
    one: Store<f64>,
    /// The crossings that [`operand_crossings`] has found so far: one row per crossing of a ray,
    /// one column per lane.
    rows: Vec<[[f64; 16]; 3]>,
    /// All crossings of one line.
    pub crossings: Vec<SimpleCrossing>,
}

/// Returns where rays first meet the surface beyond t_min.
#[inline(never)]
pub fn meet<L: Lanes>(
    row: &Implicit,
    object: &ObjectRay<L>,
    active: L::Mask,
    scratch: &mut PolynomialScratch,
) -> Meet<L> {
    let none = L::splat(L::Scalar::INFINITY);
    let (hit, unsure, ends) = ask::<L, false>(row, object, none, active, scratch);
    let [from, t, to] = rounded::<L>(ends);
    // A t beyond the range of the lanes' type leaves the lane undecided.
    let is_number = t.abs().lt(none);
    Meet {
        hit: hit & is_number,
        t,
        within: [from, to],
        unsure: unsure | hit & !is_number,
    }
}

/// Returns rays that certainly meet the surface between t_min and a limit, and undecided rays.
#[inline(never)]
pub fn blocked<L: Lanes>(
    row: &Implicit,
    object: &ObjectRay<L>,
    limit: L,
    active: L::Mask,
    scratch: &mut PolynomialScratch,
) -> (L::Mask, L::Mask) {
    let (hit, unsure, _) = ask::<L, true>(row, object, limit, active, scratch);
    (hit, unsure)
}

type Answer<L> = (
    <L as Lanes>::Mask,
    <L as Lanes>::Mask,
    [<L as Lanes>::Double; 3],
);

/// Returns which rays meet the surface, which are undecided, and the bounds of t.
#[inline(always)]
fn ask<L: Lanes, const ANY: bool>(
    row: &Implicit,
    object: &ObjectRay<L>,
    limit: L,
    active: L::Mask,
    scratch: &mut PolynomialScratch,
) -> Answer<L> {
    // An inline constant leaves the other branch uncompiled.
    match const { L::COUNT <= Four::COUNT } {
        true => ask_by::<L, Four, ANY>(row, object, limit, active, &mut scratch.four),
        false => ask_by::<L, Eight, ANY>(row, object, limit, active, &mut scratch.eight),
    }
}

#[inline(always)]
fn ask_by<L: Lanes, D: Lanes<Scalar = f64, Double = D>, const ANY: bool>(
    row: &Implicit,
    object: &ObjectRay<L>,
    limit: L,
    active: L::Mask,
    store: &mut Store<D>,
) -> Answer<L> {
    let columns = [
        object.org.x,
        object.org.y,
        object.org.z,
        object.dir.x,
        object.dir.y,
        object.dir.z,
        object.ray.t_min.widen(),
        limit.widen(),
    ]
    .map(|column| column.to_array());
    let zero = <L::Double as Lanes>::zero();
    let mut answer = [zero; 3].map(|x| x.to_array());
    let (mut hit, mut unsure) = (0, 0);
    for group in ActiveLanes::new(active).groups::<L, D>(active) {
        let rays = group.rays(&columns);
        let asked = group.asked();
        let found: Found<D> = by_degree!(
            row.tape.degree(),
            N => found::<D, N, ANY>(row, &rays, asked, store),
            Found::nothing(asked)
        );
        hit |= group.scatter_bits(found.hit);
        unsure |= group.scatter_bits(found.unsure);
        let [from, t, to] = &mut answer;
        group.scatter(from, found.from);
        group.scatter(t, found.t);
        group.scatter(to, found.to);
    }
    let ends = answer.map(|column| <L::Double as Lanes>::load(column.as_ref()));
    (L::Mask::from_bits(hit), L::Mask::from_bits(unsure), ends)
}

impl<D: Lanes> Found<D> {
    fn nothing(unsure: u32) -> Found<D> {
        Found {
            t: D::zero(),
            from: D::zero(),
            to: D::zero(),
            hit: 0,
            unsure,
        }
    }
}

/// The segments of rays in the surface's bounds or clip, and f on them.
struct ClippedRays<D: Lanes, const N: usize> {
    ends: Ends<D>,
    start: D,
    width: D,
    segment: Segment<D, N>,
    /// Lanes whose ray has such a segment.
    reached: D::Mask,
    /// Those of them whose segment is certain and finite.
    live: D::Mask,
}

impl<D: Lanes<Scalar = f64, Double = D>, const N: usize> ClippedRays<D, N> {
    /// Clips rays to the surface's bounds or clip; `None` if no ray has a segment there.
    #[inline(always)]
    fn clip(
        row: &Implicit,
        rays: &Rays<D>,
        asked: D::Mask,
        store: &mut Store<D>,
    ) -> Option<ClippedRays<D, N>> {
        let ray = Ray::<D>::new(rays.org, rays.dir, rays.t_min);
        let object = ObjectRay::new(&rays.org, &rays.dir, &ray);
        let ends = row.region_ends(&object);
        let ends = ends.unwrap_or_else(|| Ends::none_or_unknown(D::Mask::splat(false)));
        let start = ends.enter[0].max(rays.t_min);
        let end = ends.exit[2].min(rays.limit);
        let misses = ends.none | ends.some & !start.lt(end);
        let reached = asked & !misses;
        if reached.none() {
            return None;
        }
        let width = (end - start) * D::from_f64(1.0 + 4.0 * UNIT);
        let infinity = D::from_f64(f64::INFINITY);
        let is_known = ends.some & width.lt(infinity) & start.abs().lt(infinity);
        let live = reached & is_known;
        let segment = segment_of::<D, N>(row, rays, (start, width), live, store);
        Some(ClippedRays {
            ends,
            start,
            width,
            segment,
            reached,
            live,
        })
    }

    /// Returns lanes whose t, known between two numbers, certainly lies in the clip (F12,
    /// docs/numerics/polynomials.md).
    #[inline(always)]
    fn in_clip(&self, row: &Implicit, [from, to]: [D; 2]) -> D::Mask {
        if row.clip.is_none() {
            return D::Mask::splat(true);
        }
        let begins = from.ge(self.ends.enter[2]) | self.start.ge(self.ends.enter[2]);
        begins & to.le(self.ends.exit[0])
    }

    /// Finds the least root in some lanes: t with its bounds, lanes that have one in the clip, and
    /// undecided lanes.
    #[inline(always)]
    fn first(
        &self,
        row: &Implicit,
        lanes: D::Mask,
        store: &mut Store<D>,
    ) -> ([D; 3], D::Mask, D::Mask) {
        let found = nearly_nearest(&self.segment, lanes, &mut store.waiting);
        let s_from = (found.t - found.error).max(D::zero());
        let s_to = (found.t + found.error).min(D::from_f64(1.0));
        let is_there = leaves_between(&self.segment, s_from, s_to);
        let at = |s: D| self.start + s * self.width;
        let slack = (self.start.abs() + self.width) * D::from_f64(3.01 * UNIT);
        let from = (at(s_from) - slack).max(self.start);
        let to = at(s_to) + slack;
        let hit = found.hit & is_there & self.in_clip(row, [from, to]);
        ([from, at(found.t), to], hit, found.doubt | found.hit & !hit)
    }

    /// Returns which of some lanes have a root, and which are undecided.
    #[inline(always)]
    fn any(&self, row: &Implicit, lanes: D::Mask, store: &mut Store<D>) -> (D::Mask, D::Mask) {
        let exists = exists(&self.segment, lanes, &mut store.waiting);
        if row.clip.is_none() || exists.some.none() {
            return (exists.some, exists.doubt);
        }
        // Different signs at two places in the clip suffice (F12, docs/numerics/polynomials.md).
        let place = |t: D| (t - self.start) / self.width;
        let one = D::from_f64(1.0);
        let from = place(self.ends.enter[2]) + D::from_f64(8.0 * UNIT);
        let from = D::select(
            self.start.ge(self.ends.enter[2]),
            D::zero(),
            from.max(D::zero()),
        );
        let to = (place(self.ends.exit[0]) - D::from_f64(8.0 * UNIT)).min(one);
        let odd = exists.some & from.lt(to) & changes_between(&self.segment, from, to);
        let rest = exists.some & !odd;
        if rest.none() {
            return (odd, exists.doubt);
        }
        let (_, hit, unsure) = self.first(row, rest, store);
        (odd | rest & hit, exists.doubt | rest & unsure)
    }
}

/// Meets polynomials of degree N − 1 at most.
#[inline(never)]
fn found<D: Lanes<Scalar = f64, Double = D>, const N: usize, const ANY: bool>(
    row: &Implicit,
    rays: &Rays<D>,
    asked: u32,
    store: &mut Store<D>,
) -> Found<D> {
    let Some(part) = ClippedRays::<D, N>::clip(row, rays, D::Mask::from_bits(asked), store) else {
        return Found::nothing(0);
    };
    let dark = part.reached & !part.live;
    if ANY {
        let (hit, unsure) = part.any(row, part.live, store);
        return Found {
            hit: (hit & part.live).bits(),
            ..Found::nothing((unsure & part.live | dark).bits())
        };
    }
    let ([from, t, to], hit, unsure) = part.first(row, part.live, store);
    Found {
        t,
        from,
        to,
        hit: (hit & part.live).bits(),
        unsure: (unsure & part.live | dark).bits(),
    }
}
