//! Hits of a CSG solid that its double pass is certain of, with t as it is reported.
//!
//! A ray that has just left the solid is rarely decided in f32: whether it meets the surface
//! that it left is open. f64 decides that and finds the hit, but t has to be what any other way
//! to the same hit reports: that of the operand's kernel at one lane, where it is certain (D19).
//! The kernel is asked again for all lanes together, and its end is taken where it certainly
//! holds the hit. Other hits are left to the exact fallback.

use super::TURNED;
use super::lanes::{CsgHits, Frames, ends, is_sharp};
use crate::accel::PreparedCsg;
use crate::geom::Guarded;
use crate::geom::primitive::Boundaries;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::scene::{Shape, Tables};
use crate::trace::packet::Packet;

/// The part of an f32 interval's width that f64 roots may be off: their errors come of the same
/// magnitudes as the interval, at 2⁻²⁹ of its unit of rounding, by at most 2¹⁹ times the
/// operations (D19).
const SPARE: f64 = 1.0 / 1024.0;

/// Certain hits, by lane of the packet.
#[derive(Default)]
pub(super) struct CertainHits {
    pub hit: u32,
    /// As [`super::Crossing::primitive`].
    pub primitive: [u32; 16],
    /// Bounds of the exact t.
    pub within: [[f64; 2]; 16],
}

impl CertainHits {
    /// Takes over the hits of some lanes of an f64 pass; `lanes` are those of the packet.
    #[inline(always)]
    pub fn take<D: Lanes<Scalar = f64>>(&mut self, met: &CsgHits<D>, lanes: &[usize]) {
        let mut bits = met.hit & !(met.unsure | met.left);
        while bits != 0 {
            let i = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let lane = lanes[i];
            self.hit |= 1 << lane;
            self.primitive[lane] = met.primitive[i];
            self.within[lane] = met.within.map(|end| end.lane(i));
        }
    }

    /// Calls `offer` with the lane, the primitive, t and its bounds of every hit whose t is known.
    #[inline(always)]
    pub fn with_t<L: Lanes>(
        &self,
        (csg, tables): (&PreparedCsg, &Tables),
        object: &Packet<L>,
        mut offer: impl FnMut(usize, u32, f64, [f64; 2]),
    ) {
        let number = |primitive: u32| csg.solid.operand_of(primitive & !TURNED).0;
        let mut bits = self.hit;
        while bits != 0 {
            let own = number(self.primitive[bits.trailing_zeros() as usize]);
            let operand = &csg.solid.operands[own as usize];
            let mut here = 0;
            for (lane, primitive) in self.primitive.iter().enumerate() {
                here |= u32::from(bits >> lane & 1 != 0 && number(*primitive) == own) << lane;
            }
            bits &= !here;
            if operand.shape.boundaries() == Boundaries::Crossings
                || matches!(operand.shape, Shape::Implicit(_))
            {
                continue;
            }
            let (mut org, mut dir) = (object.org, object.dir);
            if operand.frame != 0 {
                let map = &csg.solid.frames[operand.frame as usize].operand_from_solid;
                (org, dir) = (map.points(org), map.vectors(dir));
            }
            let rays = Frames::<L>::new(org, dir, object.ray.t_min);
            let exactly = <L::Double as Lanes>::zero();
            let ends = ends::<L, Guarded>(tables, operand.shape, &rays.rays(), exactly);
            let sharp = [&ends.enter, &ends.exit].map(|end| is_sharp(end).bits());
            here &= ends.some.bits();
            while here != 0 {
                let lane = here.trailing_zeros() as usize;
                here &= here - 1;
                let both = [&ends.enter, &ends.exit]
                    .map(|end| end.each_ref().map(|x| x.lane(lane).to_f64()));
                if let Some((k, t)) = end_around(both, self.within[lane])
                    && sharp[k] >> lane & 1 != 0
                {
                    offer(lane, self.primitive[lane], t, self.within[lane]);
                }
            }
        }
    }
}

/// Returns the first of a span's ends that holds a hit, with its t; none if that is not certain.
fn end_around(ends: [[f64; 3]; 2], [from, to]: [f64; 2]) -> Option<(usize, f64)> {
    for (k, [least, t, greatest]) in ends.into_iter().enumerate() {
        let spare = SPARE * (greatest - least);
        if least + spare <= from && to <= greatest - spare && greatest.is_finite() {
            return Some((k, t));
        }
        if !(greatest + spare < from || to < least - spare) {
            return None;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_end_that_certainly_holds_a_hit_is_found() {
        let span = [[1.0, 1.1, 1.2], [3.0, 3.1, 3.2]];
        assert_eq!(end_around(span, [1.05, 1.06]), Some((0, 1.1)));
        assert_eq!(end_around(span, [3.05, 3.06]), Some((1, 3.1)));
        // At the border of an interval, beyond both, and where the first end is not known.
        assert_eq!(end_around(span, [0.99, 1.06]), None);
        assert_eq!(end_around(span, [1.2, 1.2]), None);
        assert_eq!(end_around(span, [2.0, 2.1]), None);
        let unknown = [[f64::NAN; 3], span[1]];
        assert_eq!(end_around(unknown, [3.05, 3.06]), None);
        let open = [span[0], [3.0, 3.1, f64::INFINITY]];
        assert_eq!(end_around(open, [3.05, 3.06]), None);
    }
}
