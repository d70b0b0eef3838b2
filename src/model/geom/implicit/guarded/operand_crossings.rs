//! All crossings of rays with a polynomial operand of CSG, root after root (F13,
//! docs/numerics/polynomials.md).

use super::chebyshev_nodes::interpolated;
use super::lane_regrouping::{self, ActiveLanes, by_degree, scatter_bits};
use super::{Eight, PolynomialScratch, Rays, Store};
use crate::geom::Tape;
use crate::geom::guarded::rounded;
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Mask};
use crate::roots::lanes::{leaves_between, nearly_nearest};

/// The crossings of rays with an operand between two t.
pub struct OperandCrossings<L: Lanes> {
    /// Lanes that are inside at the first t.
    pub inside: L::Mask,
    pub unsure: L::Mask,
}

/// Finds all crossings of rays, in the operand's own space, between two t each. Row k of `ends`
/// holds each ray's crossing k as lower bound, value and upper bound, infinite if the ray has no
/// more. `astray` bounds how far the surface itself may be displaced.
#[inline(never)]
pub fn operand_crossings<L: Lanes>(
    tape: &Tape,
    (org, dir): (Vec3<L::Double>, Vec3<L::Double>),
    [from, to]: [L::Double; 2],
    (astray, active): (L::Double, L::Mask),
    ends: &mut Vec<[L; 3]>,
    scratch: &mut PolynomialScratch,
) -> OperandCrossings<L> {
    let columns = [org.x, org.y, org.z, dir.x, dir.y, dir.z, from, to];
    let columns = columns.map(|column| column.to_array());
    let astray = astray.to_array();
    let (mut inside, mut unsure) = (0, 0);
    let PolynomialScratch {
        eight: store,
        rows: all,
        ..
    } = scratch;
    all.clear();
    for some in ActiveLanes::new(active).chunks(Eight::COUNT) {
        let rays = lane_regrouping::rays::<Eight, _>(&columns, some);
        let astray = lane_regrouping::gather::<Eight, _>(&astray, some);
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
        let (begins, open) = by_degree!(
            tape.degree(),
            N => passes::<Eight, N>(tape, &rays, astray, asked, store, &mut found),
            (0, asked)
        );
        inside |= scatter_bits(begins, some);
        unsure |= scatter_bits(open, some);
    }
    let mut lost = L::Mask::splat(false);
    let infinity = f64::INFINITY;
    ends.extend(all.iter().map(|columns| {
        let wide = columns.map(|column| <L::Double as Lanes>::load(&column[..L::COUNT]));
        let ends = rounded::<L>(wide);
        // A t beyond the range of the lanes' type leaves the lane undecided.
        let met = wide[0].lt(<L::Double as Lanes>::splat(infinity));
        let far = ends[1].abs().ge(L::from_f64(infinity)) | ends[2].ge(L::from_f64(infinity));
        lost = lost | L::Mask::from_bits(met.bits()) & far;
        ends
    }));
    OperandCrossings {
        inside: L::Mask::from_bits(inside),
        unsure: L::Mask::from_bits(unsure) | lost,
    }
}

/// Finds root after root, each from the end of the last one's interval: calls `found` with the
/// pass, the lanes that have another root, and its bounds. Returns the lanes inside at the start,
/// and undecided lanes.
#[inline(never)]
fn passes<D: Lanes<Scalar = f64, Double = D>, const N: usize>(
    tape: &Tape,
    rays: &Rays<D>,
    astray: D,
    asked: u32,
    store: &mut Store<D>,
    found: &mut dyn FnMut(usize, u32, [D; 3]),
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
        // Each pass begins where f is close to zero; its sign there is most certain from values at
        // nodes.
        let part = (start, width, astray);
        let segment = interpolated::<D, N>(tape, rays, part, &mut store.values);
        let at = segment.scaled[0];
        let (over, under) = (at.gt(segment.first), at.lt(-segment.first));
        let is_known = width.lt(infinity) & start.abs().lt(infinity) & (over | under);
        if pass == 0 {
            below = under;
            inside = live & under;
        }
        // Every root found changes the sign.
        let known = live & is_known & ((below & under) | (!below & over));
        unsure = unsure | live & !known;
        let next = nearly_nearest(&segment, known, &mut store.waiting);
        let s_from = (next.t - next.error).max(D::zero());
        let s_to = (next.t + next.error).min(D::from_f64(1.0));
        let is_there = leaves_between(&segment, s_from, s_to);
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
