//! Meets quadrics with error bounds, in f64 whatever the lanes' type.
//!
//! Ten coefficients about the origin describe a small solid far away by differences of large
//! numbers, which f32 cannot represent. In f64 the bounds are so narrow (Q4 to Q7,
//! docs/numerics/quadratics.md) that only rays next to a silhouette, an apex or an asymptote are
//! undecided. As in [`crate::geom::quadric`], F is twice q along the ray, which is moved to the
//! point nearest the origin.

use crate::geom::guarded::quadratic::Quadratic;
use crate::geom::guarded::{
    Between, Ends, LEVEL, LEVEL_SLACK, Near, ObjectRay, Part, mask, no_face, range, rounded,
    roundings, tiny,
};
use crate::geom::quadric::Lifted;
use crate::geom::{Meet, Quadric};
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask, Scalar};

/// A quadric along rays, in f64.
struct Curve<D: Lanes> {
    near: Near<D>,
    roots: Quadratic<D>,
    /// Lanes in which F is linear or constant because every product in its higher coefficients has
    /// a factor 0 (Q7, docs/numerics/quadratics.md).
    linear: D::Mask,
    constant: D::Mask,
    ordinary: D::Mask,
}

impl<D: Lanes<Scalar = f64, Double = D>> Curve<D> {
    /// Computes F and its bounds (Q5, docs/numerics/quadratics.md). `astray` bounds how far the
    /// surface itself may be displaced.
    #[inline(always)]
    fn new(row: &Quadric, org: Vec3<D>, dir: Vec3<D>, astray: D) -> Curve<D> {
        let abs = |v: Vec3<D>| Vec3::new(v.x.abs(), v.y.abs(), v.z.abs());
        let sum = |v: Vec3<D>| v.x + v.y + v.z;
        let dir_squared = dir.unordered_dot(dir);
        let shift = -(org.unordered_dot(dir) / dir_squared);
        let p = org.along(dir, shift);
        let (step, size) = (abs(dir) * shift.abs(), abs(p));
        let off = (step + size) * roundings(1.01);
        let off = Vec3::new(off.x + tiny(), off.y + tiny(), off.z + tiny());

        let form = Lifted::<D>::new(row);
        let along = form.times(dir);
        let gradient = form.times(p) + form.linear;
        let a = along.unordered_dot(dir);
        let b = gradient.unordered_dot(dir);
        let c = (p.unordered_dot(gradient) + form.linear.unordered_dot(p)) + form.constant;

        // The same with magnitudes.
        let (form, reach) = (form.abs(), size + off);
        let (all_along, length) = (form.times(abs(dir)), abs(dir));
        let all_gradient = form.times(reach) + form.linear;
        let all_b = all_gradient.dot(length);
        let all_c = reach.dot(all_gradient + form.linear) + form.constant;
        let lost = |size: D| (size + D::from_f32(1.0)) * tiny();
        let constant_form = form.is_nothing_times(dir);
        let level = constant_form & form.is_nothing_along(dir);
        let of_a = all_along.dot(length) * roundings(6.25) + lost(dir.max_abs());
        // A linear F is crossed as far off as the surface is displaced, not four times as far.
        let astray = D::select(constant_form, astray + astray, astray);
        let of_b = all_b * roundings(7.25)
            + all_along.dot(off) * D::from_f32(1.01)
            + sum(all_along) * astray
            + lost(dir.max_abs());
        let of_c = all_c * roundings(9.25)
            + (all_gradient.dot(off) * D::from_f32(1.01) + sum(all_gradient) * astray)
                * D::from_f32(2.0)
            + lost(reach.max_abs());
        let (small, large) = range::<D>();
        Curve {
            near: Near {
                shift,
                org: p,
                size: D::zero(),
                error: D::zero(),
            },
            roots: Quadratic::new([a, b, c], [of_a, of_b, of_c]),
            linear: constant_form & !level,
            constant: level,
            ordinary: dir_squared.gt(small) & dir_squared.lt(large),
        }
    }

    /// Returns the part between the roots, or on the inner side of the only root; and the lanes in
    /// which the solid is the rest of the line (Q6, docs/numerics/quadratics.md).
    #[inline(always)]
    fn part(&self) -> (Part<D>, D::Mask) {
        let infinity = D::splat(f64::INFINITY);
        let ([a, b, c], [of_a, of_b, of_c]) = (self.roots.f, self.roots.off);
        let roots = self.roots.roots();
        let [t0, t1] = roots.t;
        let t0 = roots.bounded(t0, t0.abs());
        let t1 = roots.bounded(t1, t1.abs());
        let known = |at: &Between<D>| at.most.lt(infinity) & at.least.gt(-infinity);
        let bends = a.abs().gt(of_a) & !self.linear & !self.constant;
        let concave = bends & a.lt(D::zero());
        let rootless = bends & self.roots.is_rootless();
        let between = bends & known(&t0) & known(&t1);
        let (mut enter, mut exit) = (t0, t1);
        let (mut sound, mut none) = (between, rootless);
        let flat = self.linear | self.constant;
        if flat.any() {
            let (always, never) = (Between::exactly(-infinity), Between::exactly(infinity));
            let t = -(c / (b + b));
            let wide = (t.abs() * of_b + of_c * D::from_f32(0.5)) / b.abs()
                * D::from_f32(LEVEL_SLACK)
                + t.abs() * roundings(4.0)
                + tiny();
            let at = Between::new(t, wide);
            let met = self.linear & b.abs().gt(of_b * D::from_f32(LEVEL)) & known(&at);
            let rises = b.gt(D::zero());
            enter = Between::select(met & !rises, at, enter);
            exit = Between::select(met & !rises, never, exit);
            enter = Between::select(met & rises, always, enter);
            exit = Between::select(met & rises, at, exit);
            let within = self.constant & c.lt(-of_c);
            enter = Between::select(within, always, enter);
            exit = Between::select(within, never, exit);
            sound = sound | met | within;
            none = none | self.constant & c.gt(of_c);
        }
        let part = Part {
            enter,
            exit,
            sound: self.ordinary & sound & !none,
            none: self.ordinary & none,
            faces: [no_face(); 2],
            widths: [D::zero(); 2],
        };
        (part, concave)
    }
}

#[inline(always)]
pub fn meet<L: Lanes>(row: &Quadric, object: &ObjectRay<L>, active: L::Mask) -> Meet<L> {
    let zero = <L::Double as Lanes>::zero();
    let curve = Curve::<L::Double>::new(row, *object.org, *object.dir, zero);
    let (mut part, _) = curve.part();
    let t_min = object.ray.t_min.widen();
    // A ray that stays on one side from here on has no further boundary.
    let infinity = <L::Double as Lanes>::splat(f64::INFINITY);
    let [low, _] = curve.near.begin(t_min);
    let stays = part.sound & part.exit.least.eq(infinity) & part.enter.most.le(low);
    part.none = part.none | stays;
    let all = <<L::Double as Lanes>::Mask as Mask>::from_bits(active.bits());
    let met = part.first_beyond(&curve.near, t_min, all);
    let [from, t, to] = rounded::<L>([met.within[0], met.t, met.within[1]]);
    let (hit, unsure) = (mask::<L>(met.hit), mask::<L>(met.unsure));
    // A t beyond the range of the lanes' type leaves the lane undecided.
    let is_number = t.abs().lt(L::splat(L::Scalar::INFINITY));
    Meet {
        hit: hit & is_number,
        t,
        within: [from, to],
        unsure: unsure | hit & !is_number,
    }
}

/// Returns the ends of rays in a quadric. `astray` bounds how far its surface may be displaced in
/// the operand's space (Q8, docs/numerics/quadratics.md).
#[inline(always)]
pub fn ends<L: Lanes>(row: &Quadric, object: &ObjectRay<L>, astray: L::Double) -> Ends<L> {
    let curve = Curve::<L::Double>::new(row, *object.org, *object.dir, astray);
    let (part, concave) = curve.part();
    let Ends {
        enter,
        exit,
        some,
        none,
        ..
    } = part.ends(&curve.near);
    let (enter, exit) = (rounded::<L>(enter), rounded::<L>(exit));
    // A t beyond the range of the lanes' type leaves the lane undecided.
    let infinity = L::splat(L::Scalar::INFINITY);
    let far = |end: &[L; 3]| end[1].abs().eq(infinity) & end[0].abs().lt(infinity);
    let lost = far(&enter) | far(&exit);
    Ends {
        enter,
        exit,
        some: mask::<L>(some) & !lost & enter[2].lt(exit[0]),
        none: mask::<L>(none),
        turned: mask::<L>(concave),
        faces: [no_face(); 2],
        widths: [L::zero(); 2],
    }
}
