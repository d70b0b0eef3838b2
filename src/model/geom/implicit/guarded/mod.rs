//! Polynomial surfaces, in f64 and eight rays at a time whatever the lanes, or four, where
//! there are no more.
//!
//! The part of a ray that is in the surface's bounds or in its clip is 0 ≤ s ≤ 1. There
//! the polynomial is interpolated from its values at Chebyshev's nodes
//! ([`crate::roots::collocation`]), or, of a low degree, made of forms about the ray's
//! origin, which rays of a camera have in common; and its least root isolated and refined with a bound
//! of what its coefficients are off by ([`crate::roots::lanes`]). docs/NUMERICS.md
//! derives that bound. The degree that counts is one of a few, no less than the
//! polynomial's own.
//!
//! All rays take the same steps, which depend on nothing but the ray and the surface,
//! so that t has the same bits at any width.

mod all_roots;
mod chebyshev_nodes;
mod double_double_form;
mod lane_regrouping;
mod operand_crossings;
mod taylor;

pub use all_roots::{Crossing, crossings};
pub use chebyshev_nodes::blur_at;
pub use double_double_form::nearest;
pub use operand_crossings::{OperandCrossings, operand_crossings};

use crate::geom::dense::Expanded;
use crate::geom::guarded::{Ends, ObjectRay, cuboid, rounded, sphere};
use crate::geom::{Clip, Cuboid, Implicit, Meet, Ray};
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Mask, Scalar, f64x4, f64x8};
use crate::roots::lanes::{
    Segment, Waiting, changes_between, exists, leaves_between, nearly_nearest,
};
use chebyshev_nodes::segment_of;
use lane_regrouping::{ActiveLanes, by_degree};
use std::cell::Cell;
use std::thread::LocalKey;

type Eight = f64x8;
type Four = f64x4;

/// What some rays meet first.
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

/// Reused from ray to ray.
struct Store<D: Lanes> {
    /// Of steps, at all nodes.
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

type Kept<D> = Cell<Option<Box<Store<D>>>>;

thread_local! {
    static EIGHT: Kept<Eight> = const { Cell::new(None) };
    static FOUR: Kept<Four> = const { Cell::new(None) };
    static ONE: Kept<f64> = const { Cell::new(None) };
}

/// Where rays first meet the surface beyond t_min.
#[inline(never)]
pub fn meet<L: Lanes>(row: &Implicit, object: &ObjectRay<L>, active: L::Mask) -> Meet<L> {
    let none = L::splat(L::Scalar::INFINITY);
    let (hit, unsure, ends) = ask::<L, false>(row, object, none, active);
    let [from, t, to] = rounded::<L>(ends);
    // What is beyond the lanes' numbers is left to others.
    let is_number = t.abs().lt(none);
    Meet {
        hit: hit & is_number,
        t,
        within: [from, to],
        unsure: unsure | hit & !is_number,
    }
}

/// Rays that certainly meet the surface between t_min and a limit; and those of which it
/// is not certain.
#[inline(never)]
pub fn blocked<L: Lanes>(
    row: &Implicit,
    object: &ObjectRay<L>,
    limit: L,
    active: L::Mask,
) -> (L::Mask, L::Mask) {
    let (hit, unsure, _) = ask::<L, true>(row, object, limit, active);
    (hit, unsure)
}

type Answer<L> = (
    <L as Lanes>::Mask,
    <L as Lanes>::Mask,
    [<L as Lanes>::Double; 3],
);

/// Which rays meet the surface, of which that is not known, and where.
#[inline(always)]
fn ask<L: Lanes, const ANY: bool>(
    row: &Implicit,
    object: &ObjectRay<L>,
    limit: L,
    active: L::Mask,
) -> Answer<L> {
    match L::COUNT <= Four::COUNT {
        true => ask_by::<L, Four, ANY>(row, object, limit, active, &FOUR),
        false => ask_by::<L, Eight, ANY>(row, object, limit, active, &EIGHT),
    }
}

#[inline(always)]
fn ask_by<L: Lanes, D: Lanes<Scalar = f64, Double = D>, const ANY: bool>(
    row: &Implicit,
    object: &ObjectRay<L>,
    limit: L,
    active: L::Mask,
    kept: &'static LocalKey<Kept<D>>,
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
    let mut store = kept.take().unwrap_or_default();
    for group in ActiveLanes::new(active).groups::<L, D>(active) {
        let rays = group.rays(&columns);
        let asked = group.asked();
        let found: Found<D> = by_degree!(
            row.tape.degree(),
            N => found::<D, N, ANY>(row, &rays, asked, &mut store),
            Found::nothing(asked)
        );
        hit |= group.scatter_bits(found.hit);
        unsure |= group.scatter_bits(found.unsure);
        let [from, t, to] = &mut answer;
        group.scatter(from, found.from);
        group.scatter(t, found.t);
        group.scatter(to, found.to);
    }
    kept.set(Some(store));
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

/// Rays in the surface's bounds or in its clip, and f there.
struct ClippedRays<D: Lanes, const N: usize> {
    ends: Ends<D>,
    start: D,
    width: D,
    segment: Segment<D, N>,
    /// Lanes that come there.
    reached: D::Mask,
    /// Of those, what is known well enough to be looked at.
    live: D::Mask,
}

impl<D: Lanes<Scalar = f64, Double = D>, const N: usize> ClippedRays<D, N> {
    /// `None`: no ray comes there.
    #[inline(always)]
    fn clip(
        row: &Implicit,
        rays: &Rays<D>,
        asked: D::Mask,
        store: &mut Store<D>,
    ) -> Option<ClippedRays<D, N>> {
        let ray = Ray::<D>::new(rays.org, rays.dir, rays.t_min);
        let object = ObjectRay::new(&rays.org, &rays.dir, &ray);
        let ends: Ends<D> = match (row.clip, row.bounds) {
            (Some(Clip::Sphere(ball)), _) => sphere::sphere_ends(&ball, &object),
            (Some(Clip::Cuboid(row)), _) => cuboid::ends(&row, &object),
            (None, Some(bounds)) => {
                let (min, max) = (bounds.min, bounds.max);
                cuboid::ends(&Cuboid { min, max }, &object)
            }
            (None, None) => Ends::none_or_unknown(D::Mask::splat(false)),
        };
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

    /// Lanes whose t, between two numbers, is certainly in the clip.
    #[inline(always)]
    fn in_clip(&self, row: &Implicit, [from, to]: [D; 2]) -> D::Mask {
        if row.clip.is_none() {
            return D::Mask::splat(true);
        }
        let begins = from.ge(self.ends.enter[2]) | self.start.ge(self.ends.enter[2]);
        begins & to.le(self.ends.exit[0])
    }

    /// The least root of some lanes: t and between what it lies, lanes that have one in
    /// the clip, and those of which that is not known.
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

    /// Whether some lanes have a root, and of which that is not known.
    #[inline(always)]
    fn any(&self, row: &Implicit, lanes: D::Mask, store: &mut Store<D>) -> (D::Mask, D::Mask) {
        let exists = exists(&self.segment, lanes, &mut store.waiting);
        if row.clip.is_none() || exists.some.none() {
            return (exists.some, exists.doubt);
        }
        // Different signs at two places in the clip are enough.
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

/// Of polynomials of degree N − 1.
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
