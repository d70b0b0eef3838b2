//! Level sets: one ray at a time in every kernel, for where a ray meets them is what one
//! search says.

use super::{ObjectRay, rounded};
use crate::geom::exact::{Line, Solid, first_beyond};
use crate::geom::{LevelSet, Meet};
use crate::math::lanes::{Lanes, Mask, Scalar};

/// Where rays first meet the surface beyond t_min: there is no doubt.
#[inline(never)]
pub fn meet<L: Lanes>(row: &LevelSet, object: &ObjectRay<L>, active: L::Mask) -> Meet<L> {
    let solid = Solid::LevelSet(*row);
    let infinity = <L::Double as Lanes>::splat(f64::INFINITY);
    let (mut hit, mut t) = (0, infinity);
    let mut bits = active.bits();
    while bits != 0 {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits - 1;
        let of =
            |v: &crate::math::Vec3<L::Double>| [v.x.lane(lane), v.y.lane(lane), v.z.lane(lane)];
        let (org, dir) = (of(object.org), of(object.dir));
        let t_min = object.ray.t_min.lane(lane).to_f64();
        if let Some(root) = first_beyond(&solid, &Line { org, dir }, t_min) {
            hit |= 1 << lane;
            t = t.with_lane(lane, root.t.value);
        }
    }
    let [from, t, to] = rounded::<L>([t, t, t]);
    let hit = L::Mask::from_bits(hit);
    // What is beyond the lanes' numbers is left to others.
    let is_number = t.abs().lt(L::splat(L::Scalar::INFINITY));
    Meet {
        hit: hit & is_number,
        t,
        within: [from, to],
        unsure: hit & !is_number,
    }
}
