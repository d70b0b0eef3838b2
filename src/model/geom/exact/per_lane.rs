//! The kernel of kinds without a kernel in lanes: the exact predicate, one ray after the other.

use super::{Line, first_beyond_of};
use crate::geom::guarded::{ObjectRay, rounded};
use crate::geom::primitive::Exact;
use crate::geom::{Meet, Scratch};
use crate::math::bounds::ErrorBounded;
use crate::math::lanes::{Lanes, Scalar};

/// The relative error of a t that is as good as any kernel's: a quarter of f32's unit roundoff.
const KNOWN: f64 = 1.0 / (1 << 26) as f64;

/// Returns where rays first meet a row beyond t_min, with the error bound that f64 gives.
#[inline(always)]
pub fn meet_per_lane<'a, L: Lanes>(
    row: &impl Exact<'a>,
    object: &ObjectRay<L>,
    active: L::Mask,
    scratch: &mut Scratch,
) -> Meet<L> {
    let (mut t, mut off) = (
        <L::Double as Lanes>::splat(f64::INFINITY),
        <L::Double as Lanes>::zero(),
    );
    let hit = object.each_lane(active, |lane, (org, dir), t_min| {
        let root = first_beyond_of(row, &Line { org, dir }, t_min, scratch);
        if let Some(root) = &root {
            let ErrorBounded {
                mut value,
                mut error,
            } = root.t;
            // Along a face the bound of t may be large or infinite.
            let is_known = value.is_finite() && error <= value.abs() * KNOWN;
            if !is_known && error != 0.0 {
                value = root.rounded();
                error = value.abs().next_up() - value.abs();
            }
            t = t.with_lane(lane, value);
            off = off.with_lane(lane, error);
        }
        root.is_some()
    });
    let [from, t, to] = rounded::<L>([t - off, t, t + off]);
    // A t beyond the range of the lanes' type leaves the lane undecided.
    let is_number = t.abs().lt(L::splat(L::Scalar::INFINITY));
    Meet {
        hit: hit & is_number,
        t,
        within: [from, to],
        unsure: hit & !is_number,
    }
}
