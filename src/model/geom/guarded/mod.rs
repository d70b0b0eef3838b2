//! Common parts of the kernels with error bounds, each of which lies in its kind's folder. Every
//! answer is that of exact arithmetic on the object ray and the primitive's numbers, or undecided
//! (N1 to N8, docs/numerics/moved-rays.md).
//!
//! The ray is moved along itself, in f64, to a point near the primitive's centre ([`Near`]). The
//! remaining coordinates and t have the primitive's size and are rounded at that size, so f32
//! lanes see a far primitive as accurately as a near one.

pub(super) mod quadratic;

pub use super::cone::guarded as cone;
pub use super::cuboid::guarded as cuboid;
pub use super::half_space::guarded as half_space;
pub use super::implicit::guarded as implicit;
pub use super::level_set::guarded as level_set;
pub use super::polygon::guarded as polygon;
pub use super::quadric::guarded as quadric;
pub use super::sphere::guarded as sphere;

use super::ray::{Meet, Ray, Span};
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Mask, Scalar};
use glam::DVec3;

/// Object rays in f64, and rounded to the lanes' type. By reference, because they are 900 bytes of
/// lanes.
#[derive(Clone, Copy, Debug)]
pub struct ObjectRay<'a, L: Lanes> {
    pub org: &'a Vec3<L::Double>,
    pub dir: &'a Vec3<L::Double>,
    /// The rays, rounded to the lanes' type.
    pub ray: &'a Ray<L>,
}

impl<'a, L: Lanes> ObjectRay<'a, L> {
    #[inline(always)]
    pub fn new(org: &'a Vec3<L::Double>, dir: &'a Vec3<L::Double>, ray: &'a Ray<L>) -> Self {
        ObjectRay { org, dir, ray }
    }

    /// Calls `ask` for each of some lanes with the lane, its line and its t_min; returns the lanes
    /// for which it said yes.
    #[inline(always)]
    pub fn each_lane(
        &self,
        lanes: L::Mask,
        mut ask: impl FnMut(usize, ([f64; 3], [f64; 3]), f64) -> bool,
    ) -> L::Mask {
        let of = |v: &Vec3<L::Double>, i: usize| [v.x.lane(i), v.y.lane(i), v.z.lane(i)];
        let (mut bits, mut met) = (lanes.bits(), 0);
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let t_min = self.ray.t_min.lane(lane).to_f64();
            let line = (of(self.org, lane), of(self.dir, lane));
            met |= u32::from(ask(lane, line, t_min)) << lane;
        }
        L::Mask::from_bits(met)
    }

    /// Returns the origin relative to a point, in f64 and rounded.
    #[inline(always)]
    pub(super) fn start(&self, center: DVec3) -> (Vec3<L::Double>, Vec3<L>) {
        let start = *self.org - Vec3::splat(center.to_array());
        (start, narrow(start))
    }

    /// Returns lanes whose direction is neither so short that its components lose bits when
    /// rounded, nor so long that squares overflow.
    #[inline(always)]
    pub(super) fn ordinary(&self) -> L::Mask {
        let (small, large) = range::<L>();
        self.ray.dir_squared.gt(small) & self.ray.dir_squared.lt(large)
    }
}

#[inline(always)]
pub(super) fn narrow<L: Lanes>(v: Vec3<L::Double>) -> Vec3<L> {
    Vec3::new(L::narrow(v.x), L::narrow(v.y), L::narrow(v.z))
}

/// Returns x unit roundoffs of the lanes' type.
#[inline(always)]
pub(super) fn roundings<L: Lanes>(x: f32) -> L {
    L::splat(L::Scalar::UNIT_ROUNDOFF) * L::from_f32(x)
}

/// Returns the least normal number, which covers the loss of products that underflow.
#[inline(always)]
pub(super) fn tiny<L: Lanes>() -> L {
    L::splat(L::Scalar::MIN_POSITIVE)
}

/// Rounds a lower bound, a value and an upper bound to the lanes' type: down, to nearest, and up.
#[inline(always)]
pub(super) fn rounded<L: Lanes>([least, value, most]: [L::Double; 3]) -> [L; 3] {
    let [from, t, to] = [least, value, most].map(L::narrow);
    if L::is_double() {
        return [from, t, to];
    }
    let infinity = L::splat(L::Scalar::INFINITY);
    let pad = |x: L| x.abs() * roundings(1.01) + tiny();
    let met = |x: L, wider: L| L::select(x.abs().lt(infinity), wider, x);
    // A bound that is finite in f64 stays finite in narrower lanes.
    let wide = <L::Double as Lanes>::splat(f64::INFINITY);
    let most = L::splat(L::Scalar::MAX);
    let kept =
        |x: L::Double, y: L| L::select(mask::<L>(x.abs().lt(wide)), y.min(most).max(-most), y);
    [
        kept(least, met(from, from - pad(from))),
        t,
        met(to, to + pad(to)),
    ]
}

#[inline(always)]
pub(super) fn mask<L: Lanes>(wide: <L::Double as Lanes>::Mask) -> L::Mask {
    L::Mask::from_bits(wide.bits())
}

/// Returns the range in which squares of lengths are accurate.
#[inline(always)]
pub(super) fn range<L: Lanes>() -> (L, L) {
    let small = tiny::<L>() / L::splat(L::Scalar::UNIT_ROUNDOFF);
    (small, L::from_f32(1.0) / small)
}

/// The least speed, in units of its error, at which a ray meets a plane; a slower ray counts as
/// level with it (P3 and P4, docs/numerics/planes.md).
pub(super) const LEVEL: f32 = 16.0;
/// The most that the inverse of the exact speed then exceeds that of the computed one: 16/15 (P3,
/// docs/numerics/planes.md).
pub(super) const LEVEL_SLACK: f32 = 1.07;
/// The most that the exact speed of a level ray is, in units of its error: 16 + 1, and the
/// roundings of the bound (P4, docs/numerics/planes.md).
pub(super) const LEVEL_MOVES: f32 = 17.5;

/// Rays moved along themselves to the neighbourhood of a primitive (N1,
/// docs/numerics/moved-rays.md).
#[derive(Clone, Copy, Debug)]
pub(super) struct Near<L: Lanes> {
    /// The t by which they were moved; any number is correct.
    pub(super) shift: L,
    /// Their places relative to the primitive's centre.
    pub(super) org: Vec3<L>,
    /// The largest coordinate of these.
    pub(super) size: L,
    /// The error bound of a coordinate, besides one rounding of itself.
    pub(super) error: L,
}

impl<L: Lanes> Near<L> {
    /// Moves rays by `shift`. `start` is relative to the centre; it and `dir` may carry three
    /// roundings of f64. `far` is no less than `start` or the distance moved, up to roundings and
    /// the remaining size (N1, docs/numerics/moved-rays.md).
    #[inline(always)]
    pub(super) fn at(start: Vec3<L::Double>, dir: Vec3<L::Double>, far: L, shift: L) -> Near<L> {
        let org = narrow::<L>(start.along(dir, shift.widen()));
        let size = org.max_abs();
        Near {
            shift,
            org,
            size,
            error: (far + size) * L::from_f64(7.0 * UNIT),
        }
    }

    /// Moves rays to the plane through a centre and perpendicular to the ray's longest axis: at
    /// most √3 times as far from the centre as the nearest point.
    #[inline(always)]
    pub(super) fn to_center(object: &ObjectRay<L>, center: DVec3) -> Near<L> {
        let (start, coarse) = object.start(center);
        let mut along = L::zero();
        for (k, lanes) in object.ray.shear.groups() {
            along = L::select(lanes, coarse.axis(k), along);
        }
        let shift = -(along * object.ray.shear.inverse);
        Near::at(start, *object.dir, along.abs(), shift)
    }

    /// Returns t where the ray begins.
    #[inline(always)]
    pub(super) fn unmoved(org: Vec3<L>) -> Near<L> {
        Near {
            shift: L::zero(),
            org,
            size: L::zero(),
            error: L::zero(),
        }
    }

    /// Returns bounds below and above a ray's t_min relative to the moved origin.
    #[inline(always)]
    pub(super) fn begin(&self, t_min: L) -> [L; 2] {
        let at = t_min - self.shift;
        let slack = at.abs() * roundings(1.25);
        [at - slack, at + slack]
    }

    /// Makes the answer with hits in the lanes `hit`, where t is finite.
    #[inline(always)]
    pub(super) fn hit(&self, hit: L::Mask, t: Between<L>, near: L::Mask) -> Meet<L> {
        let (from, to) = (self.shift + t.least, self.shift + t.most);
        let from = from - from.abs() * roundings(2.0) - tiny();
        let to = to + to.abs() * roundings(2.0) + tiny();
        let hit = hit & to.lt(L::splat(L::Scalar::INFINITY));
        Meet {
            hit,
            t: self.shift + t.value,
            within: [from, to],
            unsure: near & !hit,
        }
    }
}

/// A number with a lower and an upper bound of the exact one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Between<L> {
    pub(super) least: L,
    pub(super) value: L,
    pub(super) most: L,
}

impl<L: Lanes> Between<L> {
    #[inline(always)]
    pub(super) fn new(value: L, error: L) -> Between<L> {
        Between {
            least: value - error,
            value,
            most: value + error,
        }
    }

    #[inline(always)]
    pub(super) fn exactly(value: L) -> Between<L> {
        Between {
            least: value,
            value,
            most: value,
        }
    }

    /// Returns half the width; NaN for infinite bounds.
    #[inline(always)]
    pub(super) fn width(&self) -> L {
        (self.most - self.least) * L::from_f32(0.5)
    }

    #[inline(always)]
    pub(super) fn max(self, o: Between<L>) -> Between<L> {
        Between {
            least: self.least.max(o.least),
            value: self.value.max(o.value),
            most: self.most.max(o.most),
        }
    }

    #[inline(always)]
    pub(super) fn min(self, o: Between<L>) -> Between<L> {
        Between {
            least: self.least.min(o.least),
            value: self.value.min(o.value),
            most: self.most.min(o.most),
        }
    }

    #[inline(always)]
    pub(super) fn select(mask: L::Mask, yes: Between<L>, no: Between<L>) -> Between<L> {
        Between {
            least: L::select(mask, yes.least, no.least),
            value: L::select(mask, yes.value, no.value),
            most: L::select(mask, yes.most, no.most),
        }
    }
}

/// Returns lanes whose number and bound are both finite. Kernels check this before
/// [`Between::max`] and [`Between::min`], which drop NaN (N6, docs/numerics/moved-rays.md).
#[inline(always)]
pub(super) fn finite<L: Lanes>(value: L, error: L) -> L::Mask {
    (value.abs() + error).lt(L::splat(L::Scalar::INFINITY))
}

/// The t at which rays enter a convex solid and leave it, as lower bound, value and upper bound;
/// infinite if they always were inside, or stay. For a solid that is not convex the part between
/// may be outside.
#[derive(Clone, Copy, Debug)]
pub struct Ends<L: Lanes> {
    pub enter: [L; 3],
    pub exit: [L; 3],
    /// Lanes that certainly have both ends, and lanes that certainly have none.
    pub some: L::Mask,
    pub none: L::Mask,
    /// The number of the face that each end lies on. Faces of a box are numbered by axis, lower
    /// ones first; of a cylinder or cone base, top, side; of a polyhedron as its planes. NaN if
    /// the face is not certain, and for quadrics and the sides of cones.
    pub faces: [L; 2],
    /// Half-width of t of the face that made each end. CSG needs the face's own, which near an
    /// edge is wider than the combined interval. The largest among the faces that may have made
    /// it.
    pub widths: [L; 2],
    /// Lanes that are inside before the first end and behind the second or, if there are none, all
    /// along.
    pub turned: L::Mask,
}

impl<L: Lanes> Ends<L> {
    /// Makes ends without error bounds.
    #[inline(always)]
    pub fn certain(span: &Span<L>) -> Ends<L> {
        Ends {
            enter: [span.enter; 3],
            exit: [span.exit; 3],
            some: span.some,
            none: !span.some,
            turned: L::Mask::splat(false),
            faces: [no_face(); 2],
            widths: [L::zero(); 2],
        }
    }

    /// Makes ends for lanes that certainly miss the solid, and leaves all others unknown.
    #[inline(always)]
    pub fn none_or_unknown(none: L::Mask) -> Ends<L> {
        let infinity = L::splat(L::Scalar::INFINITY);
        Ends {
            enter: [infinity; 3],
            exit: [infinity; 3],
            some: none & !none,
            none,
            turned: L::Mask::splat(false),
            faces: [no_face(); 2],
            widths: [L::zero(); 2],
        }
    }
}

impl<L: Lanes> Ends<L> {
    /// Removes the ends of all other lanes.
    #[inline(always)]
    pub fn keep(&mut self, lanes: L::Mask) {
        self.some = self.some & lanes;
        self.none = self.none | !lanes;
        self.turned = self.turned & lanes;
    }

    /// Cuts off the part before t, where a ray enters the solid's box.
    #[inline(always)]
    pub fn begin_at(&mut self, t: L) {
        let before = self.exit[1].le(t);
        self.some = self.some & !before;
        self.none = self.none | before;
        self.enter = self.enter.map(|enter| enter.max(t));
        self.exit = self.exit.map(|exit| exit.max(t));
    }

    /// Widens the bounds by a distance on both sides.
    #[inline(always)]
    pub fn moved(&self, by: L) -> Ends<L> {
        self.bounded(|[least, _, most], _| [least - by, most + by])
    }

    /// Multiplies the width of the bounds, of which each side counts as no narrower than the
    /// half-width of its face.
    #[inline(always)]
    pub fn widened(&self, times: L) -> Ends<L> {
        self.bounded(|[least, value, most], width| {
            let below = (value - least).max(width) * times;
            let above = (most - value).max(width) * times;
            [value - below, value + above]
        })
    }

    /// Replaces the bounds by wider ones; spans that may then be empty are no longer certain.
    #[inline(always)]
    pub(super) fn bounded(&self, wider: impl Fn([L; 3], L) -> [L; 2]) -> Ends<L> {
        let infinity = L::splat(L::Scalar::INFINITY);
        let end = |end: [L; 3], width: L| {
            let [least, most] = wider(end, width);
            // The bounds of an infinite end may be NaN.
            let met = end[1].abs().lt(infinity);
            [
                L::select(met, least, end[0]),
                end[1],
                L::select(met, most, end[2]),
            ]
        };
        let enter = end(self.enter, self.widths[0]);
        let exit = end(self.exit, self.widths[1]);
        Ends {
            enter,
            exit,
            some: self.some & enter[2].lt(exit[0]),
            ..*self
        }
    }
}

/// The part of a ray inside a convex solid, with error bounds (N5, docs/numerics/moved-rays.md).
pub(super) struct Part<L: Lanes> {
    pub(super) enter: Between<L>,
    pub(super) exit: Between<L>,
    /// Lanes whose bounds hold: the solid is met if and only if enter ≤ exit.
    pub(super) sound: L::Mask,
    /// Lanes that certainly miss the solid.
    pub(super) none: L::Mask,
    /// As in [`Ends`].
    pub(super) faces: [L; 2],
    pub(super) widths: [L; 2],
}

#[inline(always)]
pub(super) fn no_face<L: Lanes>() -> L {
    L::from_f32(f32::NAN)
}

/// The latest or earliest boundary so far, and its face.
#[derive(Clone, Copy, Debug)]
pub(super) struct OnFace<L: Lanes> {
    pub(super) at: Between<L>,
    pub(super) face: L,
    /// As in [`Ends`].
    pub(super) width: L,
}

impl<L: Lanes> OnFace<L> {
    /// Takes the later boundary, and its face if that is certain.
    #[inline(always)]
    pub(super) fn max(self, at: Between<L>, face: L) -> OnFace<L> {
        let (this, other) = (self.at.least.gt(at.most), at.least.gt(self.at.most));
        OnFace {
            at: self.at.max(at),
            face: self.chosen(this, other, face),
            width: self.wider(this, other, &at),
        }
    }

    /// Takes the earlier boundary.
    #[inline(always)]
    pub(super) fn min(self, at: Between<L>, face: L) -> OnFace<L> {
        let (this, other) = (self.at.most.lt(at.least), at.most.lt(self.at.least));
        OnFace {
            at: self.at.min(at),
            face: self.chosen(this, other, face),
            width: self.wider(this, other, &at),
        }
    }

    #[inline(always)]
    pub(super) fn chosen(&self, this: L::Mask, other: L::Mask, face: L) -> L {
        L::select(this, self.face, L::select(other, face, no_face()))
    }

    #[inline(always)]
    pub(super) fn wider(&self, this: L::Mask, other: L::Mask, at: &Between<L>) -> L {
        let width = at.width();
        let either = self.width.max(width);
        L::select(this, self.width, L::select(other, width, either))
    }
}

impl<L: Lanes> Part<L> {
    #[inline(always)]
    pub(super) fn ends(&self, near: &Near<L>) -> Ends<L> {
        let none = self.none | self.sound & self.enter.least.gt(self.exit.most);
        let some = self.sound & !none & self.enter.most.lt(self.exit.least);
        let infinity = L::splat(L::Scalar::INFINITY);
        let at = |end: &Between<L>| {
            let (from, to) = (near.shift + end.least, near.shift + end.most);
            // Infinite ends stay infinite instead of becoming NaN.
            let met = |x: L, wider: L| L::select(x.abs().lt(infinity), wider, x);
            [
                met(from, from - from.abs() * roundings(2.0) - tiny()),
                near.shift + end.value,
                met(to, to + to.abs() * roundings(2.0) + tiny()),
            ]
        };
        Ends {
            enter: at(&self.enter),
            exit: at(&self.exit),
            some,
            none,
            turned: L::Mask::splat(false),
            faces: self.faces,
            widths: self.widths,
        }
    }

    /// Returns the first boundary beyond `t_min`.
    #[inline(always)]
    pub(super) fn first_beyond(&self, near: &Near<L>, t_min: L, active: L::Mask) -> Meet<L> {
        let [low, high] = near.begin(t_min);
        let (enter, exit) = (self.enter, self.exit);
        let none = self.none | self.sound & (enter.least.gt(exit.most) | exit.most.le(low));
        let some = self.sound & enter.most.le(exit.least);
        let at_enter = some & enter.least.gt(high);
        let at_exit = some & enter.most.le(low) & exit.least.gt(high);
        let t = Between::select(at_enter, enter, exit);
        let possible = active & !none;
        near.hit(possible & (at_enter | at_exit), t, possible)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_begin_where_they_are_told() {
        let ends = Ends::certain(&Span {
            enter: 1.0_f32,
            exit: 2.0,
            some: true,
        });
        let begun = |t: f32| {
            let mut ends = ends;
            ends.begin_at(t);
            (ends.some, ends.none, ends.enter[0], ends.exit[2])
        };
        assert_eq!(begun(0.5), (true, false, 1.0, 2.0));
        assert_eq!(begun(1.5), (true, false, 1.5, 2.0));
        let (some, none, ..) = begun(2.0);
        assert!(!some && none);
    }
}
