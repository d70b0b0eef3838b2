//! Meets truncated cones and cylinders, closed and open, with error bounds.
//!
//! As in [`crate::geom::cone`], the side is where F(t) = A t² + 2B t + C is 0 along the ray, which
//! is first moved next to the axis. Every coefficient has a bound (C1 to C3,
//! docs/numerics/cones.md), and these bound the error of the roots ([`Quadratic`]). Between the
//! planes of the caps F < 0 means inside, because the mirrored cone lies beyond them (C4).

use crate::geom::Meet;
use crate::geom::cone::Upright;
use crate::geom::guarded::quadratic::Quadratic;
use crate::geom::guarded::{
    Between, Ends, LEVEL, LEVEL_MOVES, LEVEL_SLACK, Near, ObjectRay, OnFace, Part, finite, no_face,
    range, roundings, tiny,
};
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::math::lanes::{Lanes, Mask, Scalar};

/// A cone, and a ray that has been moved next to it. `STRAIGHT` says that it is a cylinder: the
/// terms of its constant radius' growth are 0 and are not computed.
struct Frame<L: Lanes, const STRAIGHT: bool> {
    near: Near<L>,
    half: L,
    /// The height along the axis from the middle, and its rate along the ray.
    height: L,
    rise: L,
    a: L,
    b: L,
    c: L,
    /// The cone's radius at that height, and its rate along the ray.
    radius: L,
    widening: L,
    /// The largest coordinates of the vector across the axis, and of the direction.
    across: L,
    along: L,
    /// The cone's mean radius, and |k|, the growth of its radius along the axis.
    mean: L,
    slope: L,
    ordinary: L::Mask,
}

/// The quadratic F, and bounds on the errors of heights along the ray.
struct Side<L: Lanes> {
    roots: Quadratic<L>,
    /// Lanes whose line certainly misses the side's surface.
    passes: L::Mask,
    height: L,
    rise: L,
}

/// √3, rounded up.
const ROOT_3: f32 = 1.733;

/// Relative error of the axis and of what is computed from it (ν of lemma C1,
/// docs/numerics/cones.md): a dozen roundings in f64 lanes; in f32 lanes these are nothing beside
/// the one rounding to f32.
#[inline(always)]
fn derived<L: Lanes>() -> f32 {
    if L::is_double() { 12.0 } else { 1.01 }
}

/// ν of lemma C1 (docs/numerics/cones.md), in roundings.
#[inline(always)]
fn turned<L: Lanes>() -> f32 {
    2.0 * derived::<L>() + 7.25
}

#[inline(always)]
fn frame<L: Lanes, const STRAIGHT: bool>(
    row: &Upright,
    object: &ObjectRay<L>,
) -> Frame<L, STRAIGHT> {
    let (middle, order) = (row.middle, row.order);
    let n = order.of_axes(row.unit.to_array());
    let n: Vec3<L> = Vec3::splat(n.map(L::Scalar::from_f64));
    let (dir, squared) = (object.ray.dir.ordered(order), object.ray.dir_squared);
    let rise = dir.dot(n);
    let drift = dir - n * rise;
    let drift_squared = drift.length_squared();

    // Moves to the point nearest the axis or, if that may be far away, nearest the middle.
    let steep = (drift_squared * L::from_f32(16.0)).gt(squared);
    let (start, coarse) = object.start(middle);
    let (start, coarse) = (start.ordered(order), coarse.ordered(order));
    let toward = Vec3::select(steep, drift, dir);
    let over = L::select(steep, drift_squared, squared);
    let shift = -(coarse.dot(toward) / over);
    let mut near = Near::at(start, object.dir.ordered(order), coarse.max_abs(), shift);
    // The middle itself is rounded (C1, docs/numerics/cones.md).
    let far = middle.abs().max_element();
    near.error = near.error + L::from_f64(far * (1.5 * UNIT));

    let height = near.org.dot(n);
    let across = near.org - n * height;
    let mean = L::from_f64(row.radius);
    let slope = L::from_f64(row.growth);
    let (radius, widening) = if STRAIGHT {
        (mean, L::zero())
    } else {
        (mean + slope * height, slope * rise)
    };
    let (mut a, mut b) = (drift_squared, across.dot(drift));
    if !STRAIGHT {
        (a, b) = (a - widening * widening, b - radius * widening);
    }
    let (along, (small, large)) = (object.ray.shear.along.abs(), range::<L>());
    // F's coefficients are products of such numbers.
    let scale = along * along * (mean * mean);
    Frame {
        near,
        half: L::from_f64(row.half),
        height,
        rise,
        a,
        b,
        c: across.length_squared() - radius * radius,
        radius,
        widening,
        across: across.max_abs(),
        along,
        mean,
        slope: slope.abs(),
        ordinary: object.ordinary() & scale.gt(small) & scale.lt(large),
    }
}

impl<L: Lanes, const STRAIGHT: bool> Frame<L, STRAIGHT> {
    /// Adds the term that the growth of the radius contributes; a cylinder has none.
    #[inline(always)]
    fn with_slope(&self, x: L, more: impl FnOnce(L) -> L) -> L {
        if STRAIGHT { x } else { x + more(self.slope) }
    }

    /// Computes F and its bounds. `fine` asks for bounds that take twice the work and are half as
    /// wide (C2 and C3, docs/numerics/cones.md): they serve f64 lanes, whose undecided rays go to
    /// exact arithmetic, since rays leave a surface by hardly more.
    #[inline(always)]
    fn side(&self, fine: bool) -> Side<L> {
        let (nu, sums) = (turned::<L>(), 4.6);
        // Errors of the point across the axis, and of the radius.
        let moved =
            self.near.size * roundings(nu * ROOT_3) + self.near.error * L::from_f32(3.75) + tiny();
        let grown = self.with_slope(self.mean * roundings(nu), |slope| slope * moved);
        // Norms: a direction's is at most √3 times its largest component.
        let (across, radius) = (self.across * L::from_f32(ROOT_3), self.radius.abs());
        let speed = self.along * L::from_f32(ROOT_3);
        let spread = self.with_slope(speed, |slope| speed * slope);
        let squared = speed * speed;
        let wide = match fine {
            true => squared * self.with_slope(L::from_f32(1.0), |slope| slope * slope),
            false => spread * spread,
        };
        let a = wide * roundings(2.0 * nu + sums) + tiny();
        let new = |b, c| Quadratic::new([self.a, self.b, self.c], [a, b + tiny(), c + tiny()]);
        let (roots, rootless) = if fine {
            let c = moved * (across + across + moved)
                + grown * (radius + radius + grown)
                + (across * across + radius * radius) * roundings(sums);
            let both = self.with_slope(across, |slope| slope * radius);
            let off = self.with_slope(moved, |slope| slope * grown);
            let b = both * roundings(nu + sums) + off * L::from_f32(1.01);
            let roots = new(speed * b, c);
            let rootless = roots.is_rootless();
            (roots, rootless)
        } else {
            // The factors of F's coefficients, and their errors.
            let off = moved + grown;
            let extent = across + radius + off;
            let off = off * L::from_f32(2.01) + extent * roundings(nu + sums);
            let c = extent * off;
            let roots = new(spread * off, c);
            let least = c * (spread * spread) * L::from_f32(8.0) + tiny();
            let rootless = roots.squared.lt(-least);
            (roots, rootless)
        };
        Side {
            passes: self.ordinary & self.a.gt(a) & rootless,
            roots,
            height: moved + self.half * roundings(nu),
            rise: speed * roundings(nu) + tiny(),
        }
    }

    #[inline(always)]
    fn part(&self, active: L::Mask, fine: bool) -> Option<Part<L>> {
        let infinity = L::splat(L::Scalar::INFINITY);
        let error = self.side(fine);
        let [of_a, of_b, of_c] = error.roots.off;
        let passes = error.passes;
        if (active & !passes).none() {
            return None;
        }
        // The part between the caps' planes.
        let level = !self.rise.abs().gt(error.rise * L::from_f32(LEVEL));
        let inverse_rise = L::from_f32(1.0) / self.rise;
        let over = inverse_rise.abs() * L::from_f32(LEVEL_SLACK);
        let (low, high) = (-self.half - self.height, self.half - self.height);
        let caps = [low, high].map(|room| room * inverse_rise);
        let cap = |t: L, not: L| {
            let wide = (error.height + t.abs() * error.rise) * over + t.abs() * roundings(4.0);
            let wide = wide + tiny();
            let fine = level | finite(t, wide);
            let at = Between::select(level, Between::exactly(not), Between::new(t, wide));
            (at, fine)
        };
        let (cap_enter, first) = cap(caps[0].min(caps[1]), -infinity);
        let (cap_exit, last) = cap(caps[0].max(caps[1]), infinity);
        let mut sound = self.ordinary & first & last & finite(self.c, of_c);

        // The part inside the side: between the roots of a convex F; for a concave F, beyond the
        // root on whose side the cone widens.
        let roots = error.roots.roots();
        let most = roots.t[0].abs().max(roots.t[1].abs());
        let size = |t: L| if fine { t.abs() } else { most };
        // One by one: with `map` the compiler goes through memory.
        let [t0, t1] = roots.t;
        let t0 = roots.bounded(t0, size(t0));
        let t1 = roots.bounded(t1, size(t1));
        let known = |at: &Between<L>| at.most.lt(infinity);
        let between = self.a.gt(of_a) & known(&t0) & known(&t1);
        let (always, never) = (Between::exactly(-infinity), Between::exactly(infinity));
        let (mut cut, mut ends) = (between, [always, never]);
        if !STRAIGHT {
            let concave = self.a.lt(-of_a);
            let widens = self.widening.gt(self.slope * error.rise);
            let narrows = self.widening.lt(-(self.slope * error.rise));
            let ahead = concave & widens & known(&t1);
            let behind = concave & narrows & known(&t0);
            cut = cut | ahead | behind;
            ends = [
                Between::select(ahead, t1, always),
                Between::select(behind, t0, never),
            ];
        }
        let side_enter = Between::select(between, t0, ends[0]);
        let side_exit = Between::select(between, t1, ends[1]);
        let mut none = passes;
        if (active & !passes & !cut).any() {
            // F may keep its sign between the caps.
            let reach = cap_enter.least.abs().max(cap_exit.most.abs());
            let slope = L::from_f32(2.0) * (self.b.abs() + of_b);
            let off = (self.a.abs() + of_a) * reach + slope;
            let off = (off * reach + of_c) * L::from_f32(1.01);
            let open = !cut & !level;
            none = none | open & sound & self.c.gt(off);
            cut = cut | open & self.c.lt(-off);
        }
        let upward = self.rise.gt(L::zero());
        let (base, top) = (L::zero(), L::from_f32(1.0));
        // A cone of equal radii has the faces of a cylinder.
        let is_cylinder = L::Mask::splat(STRAIGHT) | self.slope.eq(L::zero());
        let side = |at| OnFace {
            at,
            face: L::select(is_cylinder, L::from_f32(2.0), no_face()),
            width: Between::width(&at),
        };
        let enter = side(side_enter).max(cap_enter, L::select(upward, base, top));
        let exit = side(side_exit).min(cap_exit, L::select(upward, top, base));
        let faces = [enter.face, exit.face];
        let widths = [enter.width, exit.width];
        let (enter, exit) = (enter.at, exit.at);
        if (active & level & !none).any() {
            let reach = enter.least.abs().max(exit.most.abs());
            let moved = error.height + reach * error.rise * L::from_f32(LEVEL_MOVES);
            let off = self.height.abs() - self.half;
            let (within, beside) = (off.lt(-moved), off.gt(moved));
            sound = sound & (!level | within | beside);
            none = none | sound & cut & level & beside;
        }
        Some(Part {
            enter,
            exit,
            sound: sound & cut & !none,
            none,
            faces,
            widths,
        })
    }

    #[inline(always)]
    fn closed(&self, t_min: L, active: L::Mask) -> Meet<L> {
        match self.part(active, L::is_double()) {
            Some(part) => part.first_beyond(&self.near, t_min, active),
            None => Meet::certain(L::Mask::splat(false), L::zero()),
        }
    }

    /// Finds the first root of the side alone beyond `t_min` and between the caps (C6,
    /// docs/numerics/cones.md).
    #[inline(always)]
    fn open(&self, t_min: L, active: L::Mask) -> Meet<L> {
        let error = self.side(L::is_double());
        let possible = active & !error.passes;
        if possible.none() {
            return Meet::certain(L::Mask::splat(false), L::zero());
        }
        let roots = error.roots.roots();
        let reach = roots.t[0].abs().max(roots.t[1].abs());
        let (wide, sure) = roots.bound(reach);
        let roots = roots.t;
        // Both roots exist, and it is certain which is the lower one.
        let apart = (roots[0] + wide).lt(roots[1] - wide);
        let two = self.ordinary & sure & self.a.abs().gt(error.roots.off[0]) & apart;
        let [low, high] = self.near.begin(t_min);
        let rise = self.rise.abs();
        let off = error.height
            + (error.rise + rise * roundings(2.6)) * reach
            + rise * wide * L::from_f32(1.01)
            + self.height.abs() * roundings(5.1);
        let (within, beyond) = (self.half - off, self.half + off);
        let (first, second) = (Between::new(roots[0], wide), Between::new(roots[1], wide));
        // Distances from the middle: certainly on the side, or certainly beyond its ends.
        let z0 = (self.height + self.rise * roots[0]).abs();
        let z1 = (self.height + self.rise * roots[1]).abs();
        let at_first = two & z0.lt(within) & first.least.gt(high);
        let first_off = two & (z0.gt(beyond) | first.most.le(low));
        let at_second = first_off & z1.lt(within) & second.least.gt(high);
        let none = first_off & (z1.gt(beyond) | second.most.le(low));
        let t = Between::select(at_first, first, second);
        let possible = possible & !none;
        self.near
            .hit(possible & (at_first | at_second), t, possible)
    }
}

#[inline(always)]
fn ends_of<L: Lanes, const STRAIGHT: bool>(row: &Upright, object: &ObjectRay<L>) -> Ends<L> {
    let frame = frame::<L, STRAIGHT>(row, object);
    match frame.part(L::Mask::splat(true), true) {
        Some(part) => part.ends(&frame.near),
        None => Ends {
            enter: [L::zero(); 3],
            exit: [L::zero(); 3],
            some: L::Mask::splat(false),
            none: L::Mask::splat(true),
            turned: L::Mask::splat(false),
            faces: [no_face(); 2],
            widths: [L::zero(); 2],
        },
    }
}

#[inline(always)]
fn meet_of<L: Lanes, const STRAIGHT: bool>(
    row: &Upright,
    object: &ObjectRay<L>,
    active: L::Mask,
) -> Meet<L> {
    let frame = frame::<L, STRAIGHT>(row, object);
    if row.open {
        frame.open(object.ray.t_min, active)
    } else {
        frame.closed(object.ray.t_min, active)
    }
}

/// Returns the ends of rays in a closed cone.
#[inline(always)]
pub fn ends<L: Lanes>(row: &Upright, object: &ObjectRay<L>) -> Ends<L> {
    ends_of::<L, false>(row, object)
}

/// Returns the ends of rays in a closed cylinder.
#[inline(always)]
pub fn cylinder_ends<L: Lanes>(row: &Upright, object: &ObjectRay<L>) -> Ends<L> {
    ends_of::<L, true>(row, object)
}

#[inline(always)]
pub fn meet<L: Lanes>(row: &Upright, object: &ObjectRay<L>, active: L::Mask) -> Meet<L> {
    meet_of::<L, false>(row, object, active)
}

/// Meets a cylinder, with the same bits as [`meet`] in less time.
#[inline(always)]
pub fn meet_cylinder<L: Lanes>(row: &Upright, object: &ObjectRay<L>, active: L::Mask) -> Meet<L> {
    meet_of::<L, true>(row, object, active)
}
