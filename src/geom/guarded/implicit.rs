//! Polynomial surfaces, in f64 and eight rays at a time whatever the lanes.
//!
//! The part of a ray that is in the surface's bounds or in its clip is 0 ≤ s ≤ 1. There
//! the polynomial is interpolated from its values at Chebyshev's nodes
//! ([`crate::roots::collocation`]), and its least root isolated and refined with a bound
//! of what its coefficients are off by ([`crate::roots::lanes`]). docs/NUMERICS.md
//! derives that bound. The degree that counts is one of a few, no less than the
//! polynomial's own.
//!
//! All rays take the same steps, which depend on nothing but the ray and the surface,
//! so that t has the same bits at any width.

use super::{Ends, ObjectRay, cuboid, rounded, sphere};
use crate::geom::implicit::error_at;
use crate::geom::tape::{Step, Tape};
use crate::geom::{Clip, Cuboid, Implicit, Meet, Ray};
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Mask, Scalar, f64x8};
use crate::roots::collocation::{Collocation, collocation};
use crate::roots::lanes::{
    self as roots, Segment, Simple, Waiting, changes_between, exists, nearly_nearest,
};
use std::cell::Cell;
use std::cmp::Ordering;

type Eight = f64x8;

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
#[derive(Default)]
struct Store<D: Lanes> {
    /// Of steps, at all nodes.
    values: Vec<D>,
    waiting: Waiting<D>,
}

thread_local! {
    static EIGHT: Cell<Option<Box<Store<Eight>>>> = const { Cell::new(None) };
    static ONE: Cell<Option<Box<Store<f64>>>> = const { Cell::new(None) };
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

/// Rays by eights: which meet the surface, of which that is not known, and where.
#[inline(always)]
fn ask<L: Lanes, const ANY: bool>(
    row: &Implicit,
    object: &ObjectRay<L>,
    limit: L,
    active: L::Mask,
) -> Answer<L> {
    let mut lanes = [0; 16];
    let mut count = 0;
    let mut bits = active.bits();
    while bits != 0 {
        lanes[count] = bits.trailing_zeros() as usize;
        count += 1;
        bits &= bits - 1;
    }
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
    let mut store = EIGHT.take().unwrap_or_default();
    for some in lanes[..count].chunks(8) {
        let load = |column: usize| {
            let from = columns[column].as_ref();
            let mut values = [from[some[0]]; 8];
            for (value, lane) in values.iter_mut().zip(some) {
                *value = from[*lane];
            }
            Eight::load(&values)
        };
        let rays = Rays {
            org: Vec3::new(load(0), load(1), load(2)),
            dir: Vec3::new(load(3), load(4), load(5)),
            t_min: load(6),
            limit: load(7),
        };
        let asked = (1 << some.len()) - 1;
        let found = of_any_degree::<Eight, ANY>(row, &rays, asked, &mut store);
        let ends = [found.from, found.t, found.to].map(|column| column.to_array());
        for (i, lane) in some.iter().enumerate() {
            hit |= (found.hit >> i & 1) << lane;
            unsure |= (found.unsure >> i & 1) << lane;
            for (column, from) in answer.iter_mut().zip(&ends) {
                column.as_mut()[*lane] = from[i];
            }
        }
    }
    EIGHT.set(Some(store));
    let ends = answer.map(|column| <L::Double as Lanes>::load(column.as_ref()));
    (L::Mask::from_bits(hit), L::Mask::from_bits(unsure), ends)
}

fn of_any_degree<D: Lanes<Scalar = f64, Double = D>, const ANY: bool>(
    row: &Implicit,
    rays: &Rays<D>,
    asked: u32,
    store: &mut Store<D>,
) -> Found<D> {
    match row.tape.degree() {
        0..=2 => found::<D, 3, ANY>(row, rays, asked, store),
        3 => found::<D, 4, ANY>(row, rays, asked, store),
        4 => found::<D, 5, ANY>(row, rays, asked, store),
        5..=6 => found::<D, 7, ANY>(row, rays, asked, store),
        7..=8 => found::<D, 9, ANY>(row, rays, asked, store),
        9..=10 => found::<D, 11, ANY>(row, rays, asked, store),
        11..=12 => found::<D, 13, ANY>(row, rays, asked, store),
        13..=16 => found::<D, 17, ANY>(row, rays, asked, store),
        17..=24 => found::<D, 25, ANY>(row, rays, asked, store),
        _ => Found::nothing(asked),
    }
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
struct Part<D: Lanes, const N: usize> {
    ends: Ends<D>,
    start: D,
    width: D,
    segment: Segment<D, N>,
    /// Lanes that come there.
    reached: D::Mask,
    /// Of those, what is known well enough to be looked at.
    live: D::Mask,
}

impl<D: Lanes<Scalar = f64, Double = D>, const N: usize> Part<D, N> {
    /// `None`: no ray comes there.
    #[inline(always)]
    fn of(
        row: &Implicit,
        rays: &Rays<D>,
        asked: D::Mask,
        store: &mut Store<D>,
    ) -> Option<Part<D, N>> {
        let ray = Ray::<D>::new(rays.org, rays.dir, rays.t_min);
        let object = ObjectRay::new(rays.org, rays.dir, &ray);
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
        let segment = along::<D, N>(row.tape, rays, (start, width, D::zero()), store);
        Some(Part {
            ends,
            start,
            width,
            segment,
            reached,
            live: reached & is_known,
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
        let is_there = changes_between(&self.segment, s_from, s_to);
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
    let Some(part) = Part::<D, N>::of(row, rays, D::Mask::from_bits(asked), store) else {
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

/// What rays have of an operand: all boundaries between two t.
pub struct Boundaries<L: Lanes> {
    /// Lanes that are inside at the first t.
    pub inside: L::Mask,
    pub unsure: L::Mask,
}

/// Of rays in the operand's own space, between two t each. `ends` gets what each ray
/// crosses first, second, and so on: at least, as computed, at most, and infinite where
/// there is no more. `astray`: how far off the surface itself may be.
#[inline(never)]
pub fn boundaries<L: Lanes>(
    tape: &Tape,
    (org, dir): (Vec3<L::Double>, Vec3<L::Double>),
    [from, to]: [L::Double; 2],
    astray: L::Double,
    active: L::Mask,
    ends: &mut Vec<[L; 3]>,
) -> Boundaries<L> {
    let columns = [org.x, org.y, org.z, dir.x, dir.y, dir.z, from, to, astray];
    let columns = columns.map(|column| column.to_array());
    let mut lanes = [0; 16];
    let mut count = 0;
    let mut bits = active.bits();
    while bits != 0 {
        lanes[count] = bits.trailing_zeros() as usize;
        count += 1;
        bits &= bits - 1;
    }
    let mut all: Vec<[[f64; 16]; 3]> = Vec::new();
    let (mut inside, mut unsure) = (0, 0);
    let mut store = EIGHT.take().unwrap_or_default();
    for some in lanes[..count].chunks(8) {
        let load = |column: usize| {
            let from = columns[column].as_ref();
            let mut values = [from[some[0]]; 8];
            for (value, lane) in values.iter_mut().zip(some) {
                *value = from[*lane];
            }
            Eight::load(&values)
        };
        let rays = Rays {
            org: Vec3::new(load(0), load(1), load(2)),
            dir: Vec3::new(load(3), load(4), load(5)),
            t_min: load(6),
            limit: load(7),
        };
        let asked = (1 << some.len()) - 1;
        let mut found = |pass: usize, hit: u32, at: [Eight; 3]| {
            if all.len() <= pass {
                all.push([[f64::INFINITY; 16]; 3]);
            }
            for (column, at) in all[pass].iter_mut().zip(at) {
                let at = at.to_array();
                for (i, lane) in some.iter().enumerate() {
                    if hit >> i & 1 != 0 {
                        column[*lane] = at[i];
                    }
                }
            }
        };
        let (begins, open) = match tape.degree() {
            0..=2 => passes::<Eight, 3>(tape, &rays, load(8), asked, &mut store, &mut found),
            3 => passes::<Eight, 4>(tape, &rays, load(8), asked, &mut store, &mut found),
            4 => passes::<Eight, 5>(tape, &rays, load(8), asked, &mut store, &mut found),
            5..=6 => passes::<Eight, 7>(tape, &rays, load(8), asked, &mut store, &mut found),
            7..=8 => passes::<Eight, 9>(tape, &rays, load(8), asked, &mut store, &mut found),
            9..=10 => passes::<Eight, 11>(tape, &rays, load(8), asked, &mut store, &mut found),
            11..=12 => passes::<Eight, 13>(tape, &rays, load(8), asked, &mut store, &mut found),
            13..=16 => passes::<Eight, 17>(tape, &rays, load(8), asked, &mut store, &mut found),
            17..=24 => passes::<Eight, 25>(tape, &rays, load(8), asked, &mut store, &mut found),
            _ => (0, asked),
        };
        for (i, lane) in some.iter().enumerate() {
            inside |= (begins >> i & 1) << lane;
            unsure |= (open >> i & 1) << lane;
        }
    }
    EIGHT.set(Some(store));
    ends.extend(all.iter().map(|columns| {
        let wide = columns.map(|column| <L::Double as Lanes>::load(&column[..L::COUNT]));
        rounded::<L>(wide)
    }));
    Boundaries {
        inside: L::Mask::from_bits(inside),
        unsure: L::Mask::from_bits(unsure),
    }
}

/// Root after root, each sought beyond the last: calls `found` with the pass, the lanes
/// that have one more, and where. Returns the lanes inside at the start, and those that
/// are not settled.
#[inline(never)]
fn passes<D: Lanes<Scalar = f64, Double = D>, const N: usize>(
    tape: &Tape,
    rays: &Rays<D>,
    astray: D,
    asked: u32,
    store: &mut Store<D>,
    found: &mut impl FnMut(usize, u32, [D; 3]),
) -> (u32, u32) {
    let asked = D::Mask::from_bits(asked);
    let none = D::Mask::splat(false);
    let infinity = D::from_f64(f64::INFINITY);
    let mut start = rays.t_min;
    let (mut inside, mut unsure) = (none, none);
    let mut live = asked & start.lt(rays.limit);
    // Where f is below zero from `start` on.
    let mut below = none;
    for pass in 0..N {
        let width = (rays.limit - start) * D::from_f64(1.0 + 4.0 * UNIT);
        let segment = along::<D, N>(tape, rays, (start, width, astray), store);
        let at = segment.scaled[0];
        let (over, under) = (at.gt(segment.first), at.lt(-segment.first));
        let is_known = width.lt(infinity) & start.abs().lt(infinity) & (over | under);
        if pass == 0 {
            below = under;
            inside = live & under;
        }
        // A root changes the sign.
        let known = live & is_known & ((below & under) | (!below & over));
        unsure = unsure | live & !known;
        let next = nearly_nearest(&segment, known, &mut store.waiting);
        let s_from = (next.t - next.error).max(D::zero());
        let s_to = (next.t + next.error).min(D::from_f64(1.0));
        let is_there = changes_between(&segment, s_from, s_to);
        let hit = known & next.hit & is_there;
        unsure = unsure | known & (next.doubt | next.hit & !hit);
        live = hit;
        if live.none() {
            break;
        }
        let place = |s: D| start + s * width;
        let slack = (start.abs() + width) * D::from_f64(3.01 * UNIT);
        let (least, most) = ((place(s_from) - slack).max(start), place(s_to) + slack);
        found(pass, live.bits(), [least, place(next.t), most]);
        start = D::select(live, most, start);
        live = live & start.lt(rays.limit);
        below = !below;
    }
    (inside.bits(), unsure.bits())
}

/// A simple root along a line, the only one between `from` and `to` and a little beyond.
pub type Crossing = Simple;

/// All of a line's crossings between two t, ascending; and the sign of f at the first t.
/// `None`: f64 does not know them all.
pub fn crossings(
    tape: &Tape,
    line: ([f64; 3], [f64; 3]),
    between: [f64; 2],
    found: &mut Vec<Crossing>,
) -> Option<Ordering> {
    found.clear();
    match tape.degree() {
        0..=2 => all::<3>(tape, line, between, found),
        3 => all::<4>(tape, line, between, found),
        4 => all::<5>(tape, line, between, found),
        5..=6 => all::<7>(tape, line, between, found),
        7..=8 => all::<9>(tape, line, between, found),
        9..=10 => all::<11>(tape, line, between, found),
        11..=12 => all::<13>(tape, line, between, found),
        13..=16 => all::<17>(tape, line, between, found),
        17..=24 => all::<25>(tape, line, between, found),
        _ => None,
    }
}

#[inline(never)]
fn all<const N: usize>(
    tape: &Tape,
    (org, dir): ([f64; 3], [f64; 3]),
    [from, to]: [f64; 2],
    found: &mut Vec<Crossing>,
) -> Option<Ordering> {
    let width = (to - from) * (1.0 + 4.0 * UNIT);
    if !(width > 0.0 && width.is_finite() && from.is_finite()) {
        return None;
    }
    let rays = Rays {
        org: Vec3::<f64>::splat(org),
        dir: Vec3::splat(dir),
        t_min: from,
        limit: to,
    };
    let mut store = ONE.take().unwrap_or_default();
    let segment = along::<f64, N>(tape, &rays, (from, width, 0.0), &mut store);
    let begins = segment.scaled[0];
    let is_known = begins.abs() > segment.first;
    // The map from s to t rounds; and there is room for an interval a little wider.
    let slack = (from.abs() + width) * (3.01 * UNIT);
    let room = 4.0 * slack / width;
    let is_known = is_known && roots::all(&segment, room, &mut store.waiting, found);
    ONE.set(Some(store));
    if !is_known {
        return None;
    }
    for root in found {
        let at = |s: f64| from + s * width;
        *root = Crossing {
            t: at(root.t),
            from: at(root.from) - slack,
            to: at(root.to) + slack,
        };
    }
    Some(begins.total_cmp(&0.0))
}

/// How far off a surface rays begin that lanes shall know to have left it, times its
/// slope there, in units of [`crate::math::bounds::LEAVING`]: what f may be off by at
/// points that are themselves rounded, grown by interpolation.
#[inline(always)]
pub fn blur_at<D: Lanes<Scalar = f64>>(tape: &Tape, p: Vec3<D>) -> D {
    let size = p.abs();
    let grown = collocation(nodes(tape.degree())).norm / 16.0;
    error_at(tape, size, size * D::from_f64(UNIT)) * D::from_f64(grown.max(1.0))
}

/// How many a polynomial is interpolated from.
fn nodes(degree: u32) -> usize {
    const COUNTS: [usize; 9] = [3, 4, 5, 7, 9, 11, 13, 17, 25];
    let enough = COUNTS.into_iter().find(|n| degree < *n as u32);
    enough.unwrap_or(25)
}

/// A tape's polynomial on the parts of rays that begin at `start`. `astray`: how far off the surface itself may be.
#[inline(always)]
fn along<D: Lanes<Scalar = f64>, const N: usize>(
    tape: &Tape,
    rays: &Rays<D>,
    (start, width, astray): (D, D, D),
    store: &mut Store<D>,
) -> Segment<D, N> {
    let table: &Collocation = collocation(N);
    let point = rays.org.along(rays.dir, start);
    let step = rays.dir * width;
    let last = point + step;
    let values = values::<D, N>(tape, (point, step), &table.nodes, &mut store.values);
    // What coordinates are off by, of nodes and of the first one.
    let unit = D::from_f64(1.01 * UNIT);
    let begun = D::select(start.eq(D::zero()), D::zero(), unit);
    let (moved, near) = ((rays.dir * start).abs(), point.abs());
    let far = last.abs();
    let reach = Vec3::new(near.x.max(far.x), near.y.max(far.y), near.z.max(far.z));
    let reach = reach * D::from_f64(1.0 + 8.0 * UNIT);
    let astray = Vec3::new(astray, astray, astray);
    let off = (moved + near + reach + step.abs() * D::from_f64(2.0)) * unit + astray;
    let of_values = error_at(tape, reach, off);
    let first = error_at(tape, near, (moved + near) * begun + astray);
    let mut largest = values[0].abs();
    for value in &values[1..] {
        largest = largest.max(value.abs());
    }
    let rounding = D::from_f64((N as f64 + 3.0) * UNIT);
    let error = (of_values + largest * rounding) * D::from_f64(table.norm);
    let mut scaled = [values[0]; N];
    for (to, row) in scaled.iter_mut().zip(&table.rows).skip(1) {
        let mut sum = values[0] * D::from_f64(row[0]);
        for (value, factor) in values.iter().zip(row).skip(1) {
            sum = sum + *value * D::from_f64(*factor);
        }
        *to = sum;
    }
    Segment {
        scaled,
        error,
        first,
    }
}

/// A tape at nodes between a point and `step` farther.
#[inline(always)]
fn values<D: Lanes<Scalar = f64>, const N: usize>(
    tape: &Tape,
    (point, step): (Vec3<D>, Vec3<D>),
    nodes: &[f64],
    all: &mut Vec<D>,
) -> [D; N] {
    all.resize(all.len().max(tape.slot_count() * N), D::zero());
    let place = |i: u32| usize::from(tape.slots()[i as usize]) * N;
    for (i, what) in tape.steps().iter().enumerate() {
        let to = place(i as u32);
        match *what {
            Step::Coordinate(axis) => {
                let (from, by) = (point.axis(usize::from(axis)), step.axis(usize::from(axis)));
                for (value, s) in all[to..to + N].iter_mut().zip(nodes) {
                    *value = from + by * D::from_f64(*s);
                }
            }
            Step::Constant(value) => all[to..to + N].fill(D::from_f64(value)),
            Step::Sum(a, b) => combine::<D, N>(all, (place(a), place(b)), to, |a, b| a + b),
            Step::Difference(a, b) => {
                combine::<D, N>(all, (place(a), place(b)), to, |a, b| a - b);
            }
            Step::Product(a, b) => combine::<D, N>(all, (place(a), place(b)), to, |a, b| a * b),
        }
    }
    let last = place(tape.steps().len() as u32 - 1);
    let mut result = [D::zero(); N];
    result.copy_from_slice(&all[last..last + N]);
    result
}

/// One step at all nodes: the places of its operands, and of the result, which may be
/// one of theirs.
#[inline(always)]
fn combine<D: Lanes, const N: usize>(
    all: &mut [D],
    (a, b): (usize, usize),
    to: usize,
    of: impl Fn(D, D) -> D,
) {
    let mut result = [D::zero(); N];
    let (first, second) = (&all[a..a + N], &all[b..b + N]);
    for ((value, x), y) in result.iter_mut().zip(first).zip(second) {
        *value = of(*x, *y);
    }
    all[to..to + N].copy_from_slice(&result);
}
