//! Hits that a double pass is certain of, with t as it is reported (D19).
//!
//! A ray that has just left a solid is rarely decided in f32: whether it meets the surface that
//! it left is open. f64 decides that and finds the hit, but t has to be what any other way to
//! the same hit reports: the end of the solid's, or the operand's, span at one lane of f32 that
//! holds the hit. The span is asked for in all lanes together, and its end is taken where it
//! certainly holds the hit. Other hits are left to the exact fallback.

use super::csg::lanes::{Frames, ends, is_sharp};
use crate::geom::Guarded;
use crate::geom::primitive::Boundaries;
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::scene::{Shape, Tables};

/// The part of an end's interval that the double pass's may have (D19). Kernels that compute in
/// f32 have one of 2⁻²⁹, those that compute in f64 anyway hardly any smaller one.
const FINER: f64 = 1.0 / 1_048_576.0;

/// The part of an end's interval that the root's f64 value may be off: 2¹⁰ times the interval of
/// the double pass, which comes of the same numbers in the same format (D19).
const SPARE: f64 = 1024.0 * FINER;

/// Certain hits, by lane of the packet.
#[derive(Default)]
pub(super) struct CertainHits {
    pub hit: u32,
    /// Of a CSG solid, as [`super::csg::Crossing::primitive`].
    pub primitive: [u32; 16],
    /// Bounds of the exact t.
    pub within: [[f64; 2]; 16],
}

impl CertainHits {
    /// Takes over the hits of an f64 pass; `lanes` are those of the packet.
    #[inline(always)]
    pub fn take<D: Lanes<Scalar = f64>>(
        &mut self,
        hit: u32,
        (within, primitive): ([D; 2], impl Fn(usize) -> u32),
        lanes: &[usize],
    ) {
        let mut bits = hit;
        while bits != 0 {
            let i = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let lane = lanes[i];
            self.hit |= 1 << lane;
            self.primitive[lane] = primitive(i);
            self.within[lane] = within.map(|end| end.lane(i));
        }
    }

    /// Calls `offer` with the lane and t of each of the `asked` hits whose t is known, for rays in
    /// the space of the shape that they meet.
    #[inline(always)]
    pub fn with_t<L: Lanes>(
        &self,
        (tables, shape): (&Tables, Shape),
        (org, dir, t_min): (Vec3<L::Double>, Vec3<L::Double>, L),
        asked: u32,
        mut offer: impl FnMut(usize, L::Scalar),
    ) {
        if !has_span(shape) {
            return;
        }
        let rays = Frames::<L>::new(org, dir, t_min);
        let exactly = <L::Double as Lanes>::zero();
        let ends = ends::<L, Guarded>(tables, shape, &rays.rays(), exactly);
        let sharp = [&ends.enter, &ends.exit].map(|end| is_sharp(end).bits());
        let mut bits = asked & self.hit & ends.some.bits();
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let of = |end: &[L; 3]| end.each_ref().map(|x| x.lane(lane).to_f64());
            let both = [&ends.enter, &ends.exit];
            if let Some(k) = end_around(both.map(of), self.within[lane])
                && sharp[k] >> lane & 1 != 0
            {
                offer(lane, both[k][1].lane(lane));
            }
        }
    }
}

/// Says whether the shape is met in a span whose ends are known in lanes.
fn has_span(shape: Shape) -> bool {
    shape.boundaries() == Boundaries::Span && !matches!(shape, Shape::Polygon(_))
}

/// Returns the t of the first end of a shape's span at one lane that holds a root, where it is
/// sharp.
pub(super) fn t_of_end<L: Lanes>(
    (tables, shape): (&Tables, Shape),
    (org, dir, t_min): ([f64; 3], [f64; 3], f64),
    root: f64,
) -> Option<f64> {
    if !has_span(shape) {
        return None;
    }
    let splat = |v: [f64; 3]| Vec3::<L::Double>::splat(v);
    let rays = Frames::<L>::new(splat(org), splat(dir), L::from_f64(t_min));
    let holds = |end: &[L; 3]| {
        let [from, _, to] = end.map(|x| x.lane(0).to_f64());
        from <= root && root <= to && to.is_finite()
    };
    let exactly = <L::Double as Lanes>::zero();
    let ends = ends::<L, Guarded>(tables, shape, &rays.rays(), exactly);
    let end = [ends.enter, ends.exit].into_iter().find(holds)?;
    let known = ends.some.any() && is_sharp(&end).any();
    known.then(|| end[1].lane(0).to_f64())
}

/// Returns which of a span's ends is the first that holds a hit; none if that is not certain.
fn end_around(ends: [[f64; 3]; 2], [from, to]: [f64; 2]) -> Option<usize> {
    for (k, [least, _, greatest]) in ends.into_iter().enumerate() {
        // A span without this end.
        if least == greatest && least.is_infinite() {
            continue;
        }
        let spare = SPARE * (greatest - least);
        if !(to - from <= FINER * (greatest - least)) {
            return None;
        }
        if least + spare <= from && to <= greatest - spare && greatest.is_finite() {
            return Some(k);
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
        let at = |t: f64| [t - 1e-9, t + 1e-9];
        assert_eq!(end_around(span, at(1.05)), Some(0));
        assert_eq!(end_around(span, at(3.05)), Some(1));
        // At the border of an interval, beyond both, and where the first end is not known.
        assert_eq!(end_around(span, at(1.0)), None);
        assert_eq!(end_around(span, at(1.2)), None);
        assert_eq!(end_around(span, at(2.0)), None);
        let unknown = [[f64::NAN; 3], span[1]];
        assert_eq!(end_around(unknown, at(3.05)), None);
        let open = [span[0], [3.0, 3.1, f64::INFINITY]];
        assert_eq!(end_around(open, at(3.05)), None);
        // As wide as the end's own interval, and of a span that begins nowhere.
        assert_eq!(end_around(span, [3.05, 3.06]), None);
        let endless = [[f64::NEG_INFINITY; 3], span[1]];
        assert_eq!(end_around(endless, at(3.05)), Some(1));
    }
}
