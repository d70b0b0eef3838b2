//! Triangles: the watertight test of Woop, Benthin and Wald (JCGT 2013).
//!
//! Vertices are seen from the ray's origin and sheared along the ray. The three edge functions are
//! differences of products without FMA, so an edge that two triangles share has exactly opposite
//! values in them: no ray slips between, and a ray that meets the edge exactly meets both. This
//! differs from the paper in three points: lanes with different major axes run one after another,
//! both orientations are met, and there is no retry in f64, since [`Certainty`](super::Certainty)
//! takes its place. Callers bring corners into their [`canonical`] order.
//!
//! In f64 lanes t comes from the weights, as in the paper, with an error of a few roundings at any
//! angle. In f32 lanes it comes from the triangle's plane (T6, docs/numerics/triangles.md). Its
//! error grows with the inverse cosine of the angle to the normal, but t is clamped to the
//! corners' depths; it needs no weights, and rays of one origin share most of the computation.

pub mod exact;

use super::ray::{Meet, Ray};
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask, Scalar, unordered_sum};

/// Corners in f32, relative to the mesh's centre.
pub type Corners = [[f32; 3]; 3];

/// Orders the corners independently of the winding. Two triangles on the same three points, as
/// scans have, then give the same bits of t, and the lower id wins, as in exact arithmetic. The
/// kernel does not depend on the winding.
///
/// The first corner is the one that t is computed from; every step treats the other two alike. Its
/// opposite side is the longest, by the sum of magnitudes so that no axis counts more, or the
/// other two sides are equally long. If all three are, the corners' distances from the mesh's
/// centre decide in the same way. Hence t is invariant under permutations of the axes, except
/// where corners are equally far from the mesh centre, too.
pub fn canonical(corners: Corners) -> Corners {
    canonical_each::<f32>(corners)
}

/// Orders the corners of one triangle per lane: `[corner][axis]`.
#[inline(always)]
pub fn canonical_each<L: Lanes>(mut corners: [[L; 3]; 3]) -> [[L; 3]; 3] {
    let exchange = |corners: &mut [[L; 3]; 3], a: usize, b: usize, lanes: L::Mask| {
        let (p, q) = (corners[a], corners[b]);
        for k in 0..3 {
            corners[a][k] = L::select(lanes, q[k], p[k]);
            corners[b][k] = L::select(lanes, p[k], q[k]);
        }
    };
    // An insertion sort, so that equal corners keep their order.
    for (a, b) in [(0, 1), (1, 2), (0, 1)] {
        let less = |k: usize| corners[b][k].lt(corners[a][k]);
        let same = |k: usize| corners[b][k].eq(corners[a][k]);
        let swap = less(0) | same(0) & (less(1) | same(1) & less(2));
        exchange(&mut corners, a, b, swap);
    }
    let size = |p: [L; 3]| unordered_sum(p[0].abs(), p[1].abs(), p[2].abs());
    let [a, b, c] = corners;
    let side = |p: [L; 3], q: [L; 3]| size([p[0] - q[0], p[1] - q[1], p[2] - q[2]]);
    let sides = odd_or_largest([side(b, c), side(c, a), side(a, b)]);
    let corner = odd_or_largest([size(a), size(b), size(c)]);
    let equal = !(sides[0] | sides[1] | sides[2]);
    for which in 1..3 {
        exchange(&mut corners, 0, which, sides[which] | equal & corner[which]);
    }
    corners
}

/// Selects, if two numbers are equal, the third; if none are, the largest.
#[inline(always)]
fn odd_or_largest<L: Lanes>([a, b, c]: [L; 3]) -> [L::Mask; 3] {
    let (ab, bc, ca) = (a.eq(b), b.eq(c), c.eq(a));
    let differ = !(ab | bc | ca);
    [
        bc & !ab | differ & a.gt(b) & a.gt(c),
        ca & !bc | differ & b.gt(c) & b.gt(a),
        ab & !ca | differ & c.gt(a) & c.gt(b),
    ]
}

#[inline(always)]
pub fn meet<L: Lanes>(corners: &Corners, ray: &Ray<L>, active: L::Mask) -> Meet<L> {
    meet_each(&splat(corners), ray, active)
}

/// Returns the same corners in every lane.
#[inline(always)]
pub fn splat<L: Lanes>(corners: &Corners) -> [Vec3<L>; 3] {
    let corner = |c: &[f32; 3]| Vec3::new(L::from_f32(c[0]), L::from_f32(c[1]), L::from_f32(c[2]));
    [
        corner(&corners[0]),
        corner(&corners[1]),
        corner(&corners[2]),
    ]
}

/// Meets one triangle per lane, with the same bits as [`meet`].
#[inline(always)]
pub fn meet_each<L: Lanes>(corners: &[Vec3<L>; 3], ray: &Ray<L>, active: L::Mask) -> Meet<L> {
    let mut hit = L::Mask::splat(false);
    let mut t = L::zero();
    for (k, lanes) in ray.shear.groups() {
        let seen = Seen::by(corners, ray, k);
        let (inside, weights) = seen.inside();
        let inside = inside & lanes & active;
        if inside.none() {
            continue;
        }
        let (there, at) = if L::is_double() {
            seen.depth(weights, ray.shear.along)
        } else {
            depth_of_plane(corners, ray, k)
        };
        let here = inside & there & at.gt(ray.t_min);
        t = L::select(here, at, t);
        hit = hit | here;
    }
    Meet::certain(hit, t)
}

/// Meets a triangle with error bounds: every lane's answer is that of exact arithmetic on the
/// object ray and the corners, or undecided (T1 to T5, docs/numerics/triangles.md).
pub fn meet_guarded<L: Lanes>(corners: &Corners, ray: &Ray<L>, active: L::Mask) -> Meet<L> {
    let corners = splat(corners);
    let (mut hit, mut unsure) = (L::Mask::splat(false), L::Mask::splat(false));
    let (mut t, mut within) = (L::zero(), [L::zero(); 2]);
    for (k, lanes) in ray.shear.groups() {
        let seen = Seen::by(&corners, ray, k);
        let bounds = seen.bounds(&corners, ray);
        let [u, v, w] = seen.weights();
        let (least, most) = (u.min(v).min(w), u.max(v).max(w));
        let lanes = lanes & active;
        // Comparisons with NaN are false, which leaves the lane undecided.
        let outside = least.lt(-bounds.weight) & most.gt(bounds.weight);
        let inside = least.gt(bounds.weight) | most.lt(-bounds.weight);
        let near = lanes & !outside;
        if near.none() {
            continue;
        }
        let [from, to] = seen.depths([u, v, w], &bounds, ray.shear.along);
        let before = to.le(ray.t_min);
        let sure = inside & from.gt(ray.t_min) & to.lt(L::splat(L::Scalar::INFINITY));
        let (_, at) = if L::is_double() {
            seen.depth([u, v, w], ray.shear.along)
        } else {
            depth_of_plane(&corners, ray, k)
        };
        // The normal of a needle's plane may vanish in f32.
        let here = near & sure & at.abs().lt(L::splat(L::Scalar::INFINITY));
        t = L::select(here, at, t);
        within = [
            L::select(here, from, within[0]),
            L::select(here, to, within[1]),
        ];
        hit = hit | here;
        unsure = unsure | near & !here & !before;
    }
    Meet {
        hit,
        t,
        within,
        unsure,
    }
}

/// Returns t at which each lane's ray meets its triangle's plane, by the same operations as
/// [`meet`], whether or not it passes inside. Meaningless if the triangle is seen edge-on.
#[inline(always)]
pub fn depth_each<L: Lanes>(corners: &[Vec3<L>; 3], ray: &Ray<L>) -> L {
    let mut t = L::zero();
    for (k, lanes) in ray.shear.groups() {
        let at = if L::is_double() {
            let seen = Seen::by(corners, ray, k);
            seen.depth(seen.weights(), ray.shear.along).1
        } else {
            depth_of_plane(corners, ray, k).1
        };
        t = L::select(lanes, at, t);
    }
    t
}

/// Computes [`plane_depth`] of rays whose axis is k.
#[inline(always)]
fn depth_of_plane<L: Lanes>(corners: &[Vec3<L>; 3], ray: &Ray<L>, k: usize) -> (L::Mask, L) {
    let along_k = |p: Vec3<L>| [p.axis((k + 1) % 3), p.axis((k + 2) % 3), p.axis(k)];
    let [a, b, c] = *corners;
    let n = plane_normal(along_k(a - c), along_k(b - a));
    let seen = [a, b, c].map(|p| along_k(p - ray.org));
    plane_depth(seen, n, ([ray.shear.x, ray.shear.y], ray.shear.along))
}

/// Returns the normal (a − c) × (b − a). It is computed from the corners themselves: relative to a
/// far origin they would be rounded before the difference, which turns the plane of a small
/// triangle. Exchanging b and c negates it exactly.
#[inline(always)]
pub fn plane_normal<L: Lanes>(ac: [L; 3], ba: [L; 3]) -> [L; 3] {
    cross_with_size(ac, ba).0
}

/// Returns p × q, and the same of magnitudes with sums for differences, in whose roundings the
/// error of p × q is measured.
#[inline(always)]
pub fn cross_with_size<L: Lanes>(p: [L; 3], q: [L; 3]) -> ([L; 3], [L; 3]) {
    let terms = |i: usize, j: usize| {
        let (x, y) = (p[i] * q[j], p[j] * q[i]);
        (x - y, x.abs() + y.abs())
    };
    let (x, y, z) = (terms(1, 2), terms(2, 0), terms(0, 1));
    ([x.0, y.0, z.0], [x.1, y.1, z.1])
}

/// Returns lanes whose triangle is not seen edge-on, and t in its plane: a depth along the ray's
/// axis over `along`, the direction's component on that axis. The depth is (a·n) / (d·n), with
/// corners a, b, c relative to the ray's origin and that axis last, and d the direction over
/// `along`; `shear` is the rest of d, negated. The depth is clamped to the corners' depths, which
/// also repairs a quotient of the wrong sign (T6, docs/numerics/triangles.md).
#[inline(always)]
pub fn plane_depth<L: Lanes>(
    [a, b, c]: [[L; 3]; 3],
    n: [L; 3],
    (shear, along): ([L; 2], L),
) -> (L::Mask, L) {
    let [depth_times_det, det] = plane_ratio(a, n, shear);
    let edge_on = det.eq(L::zero()) | depth_times_det.eq(L::zero());
    let depth = depth_times_det / det;
    let (low, high) = (a[2].min(b[2]).min(c[2]), a[2].max(b[2]).max(c[2]));
    let backward = along.lt(L::zero());
    let depth = L::select(backward, depth.min(high), depth.max(low));
    (!edge_on, depth / along)
}

/// Returns (a·n) and (d·n) of [`plane_depth`].
#[inline(always)]
pub fn plane_ratio<L: Lanes>(a: [L; 3], n: [L; 3], shear: [L; 2]) -> [L; 2] {
    [
        plane_depth_times_det(a, n),
        plane_det(n, [-shear[0], -shear[1]]),
    ]
}

/// Returns a·n. The two axes across the ray come first and are treated alike.
#[inline(always)]
pub fn plane_depth_times_det<L: Lanes>(a: [L; 3], n: [L; 3]) -> L {
    a[2].mul_add(n[2], a[0] * n[0] + a[1] * n[1])
}

/// Returns (u, v, 1)·n in the same way, without FMA.
#[inline(always)]
pub fn plane_det<L: Lanes>(n: [L; 3], [u, v]: [L; 2]) -> L {
    (n[0] * u + n[1] * v) + n[2]
}

/// Error bounds of a triangle as a ray sees it (T1 and T2, docs/numerics/triangles.md).
struct Bounds<L> {
    /// The error bound of an edge function.
    weight: L,
    /// The error bound of a corner's depth.
    depth: L,
}

/// A triangle as a ray sees it: relative to its origin, sheared along it.
#[derive(Clone, Copy)]
pub struct Seen<L> {
    /// Coordinates across the ray, by corner.
    pub x: [L; 3],
    pub y: [L; 3],
    /// Depths along the ray's axis, by corner.
    pub z: [L; 3],
}

impl<L: Lanes> Seen<L> {
    #[inline(always)]
    fn by(corners: &[Vec3<L>; 3], ray: &Ray<L>, k: usize) -> Seen<L> {
        let seen = |v: usize| ray.shear.apply(k, corners[v] - ray.org);
        let ((ax, ay, az), (bx, by, bz)) = (seen(0), seen(1));
        let (cx, cy, cz) = seen(2);
        Seen {
            x: [ax, bx, cx],
            y: [ay, by, cy],
            z: [az, bz, cz],
        }
    }

    /// Returns the edge functions: barycentric weights, not divided by their sum.
    #[inline(always)]
    fn weights(&self) -> [L; 3] {
        let ([ax, bx, cx], [ay, by, cy]) = (self.x, self.y);
        [cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax]
    }

    /// Returns lanes whose ray passes inside or on the edge, and the weights.
    #[inline(always)]
    pub fn inside(&self) -> (L::Mask, [L; 3]) {
        let [u, v, w] = self.weights();
        let least = u.min(v).min(w);
        let most = u.max(v).max(w);
        (least.ge(L::zero()) | most.le(L::zero()), [u, v, w])
    }

    /// Returns the weighted mean of the corners' depths as t, and lanes where it is finite: det is
    /// 0 if the triangle is seen edge-on or has no area. `along` is the ray's direction along its
    /// axis.
    #[inline(always)]
    fn depth(&self, [u, v, w]: [L; 3], along: L) -> (L::Mask, L) {
        // The second and the third corner are treated alike.
        let det = u + (v + w);
        let t = (u * self.z[0] + (v * self.z[1] + w * self.z[2])) / (det * along);
        (t.abs().lt(L::splat(L::Scalar::INFINITY)), t)
    }

    /// Bounds how much rounding may displace the corners (T1) and change the edge functions (T2,
    /// docs/numerics/triangles.md).
    ///
    /// Let u be the unit roundoff, R the largest coordinate relative to the ray's origin and O
    /// that of the origin. The origin is rounded once, a difference once, the shear of a rounded
    /// direction three times, its product and the sum once each. So x is off by at most 8uR + 2uO,
    /// and z by uR + uO. The quarters added cover the roundings of the bounds.
    #[inline(always)]
    fn bounds(&self, corners: &[Vec3<L>; 3], ray: &Ray<L>) -> Bounds<L> {
        let u = L::splat(L::Scalar::UNIT_ROUNDOFF);
        let largest = |p: Vec3<L>| p.x.abs().max(p.y.abs()).max(p.z.abs());
        let reach = |v: usize| largest(corners[v] - ray.org);
        let reach = reach(0).max(reach(1)).max(reach(2));
        let origin = largest(ray.org);
        let moved = u * (reach * L::from_f32(8.25) + origin * L::from_f32(2.25));
        let tiny = L::splat(L::Scalar::MIN_POSITIVE);
        // Shorter directions lose bits when they are rounded, and so do the inverses of longer
        // ones.
        let along = ray.shear.along.abs();
        let long = along.gt(tiny / u) & along.lt(u / tiny);
        let infinity = L::splat(L::Scalar::INFINITY);
        Bounds {
            weight: L::select(long, self.margin(moved), infinity),
            depth: L::select(
                long,
                u * (reach + origin) * L::from_f32(1.25) + tiny,
                infinity,
            ),
        }
    }

    /// Bounds t of a point inside the triangle, if all edge functions are beyond their bound (T4
    /// and T5, docs/numerics/triangles.md).
    ///
    /// t is the weighted mean of the corners' depths: changing each weight by β changes it by at
    /// most 3β times the depths' extent over the sum of the weights.
    #[inline(always)]
    fn depths(&self, [u, v, w]: [L; 3], bounds: &Bounds<L>, along: L) -> [L; 2] {
        let [a, b, c] = self.z;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let det = u + v + w;
        let mean = (u * a + v * b + w * c) / det;
        let three = bounds.weight * L::from_f32(3.25);
        let rest = det.abs() - three;
        // The mean has five roundings of its own, of numbers no larger than those that `depth`
        // bounds; `tiny` covers underflow. The slack is infinite if products overflow, or if the
        // sum of the weights is within its error bound.
        let tiny = L::splat(L::Scalar::MIN_POSITIVE);
        let slack = (high - low).mul_add(three, tiny) / rest + bounds.depth * L::from_f32(8.0);
        let infinity = L::splat(L::Scalar::INFINITY);
        let known = three.le(rest) & mean.abs().lt(infinity);
        let slack = L::select(known, slack, infinity);
        let least = (mean - slack).max(low - bounds.depth);
        let most = (mean + slack).min(high + bounds.depth);
        // `along` and its inverse are rounded once each: five roundings at most (T5,
        // docs/numerics/triangles.md).
        let inverse = L::from_f32(1.0) / along;
        let (from, to) = (least * inverse, most * inverse);
        let relative = L::splat(L::Scalar::UNIT_ROUNDOFF) * L::from_f32(5.0);
        let (from, to) = (from.min(to), from.max(to));
        [
            from - from.abs() * relative - tiny,
            to + to.abs() * relative + tiny,
        ]
    }

    /// Bounds the error of an edge function if x and y are displaced by at most `moved` (T2,
    /// docs/numerics/triangles.md).
    ///
    /// With m the largest coordinate and e the displacement, a difference of two products is off
    /// by 4em + 2e², and by 4um² for its own roundings. m² overflows before the products do, and
    /// the last term covers underflow.
    #[inline(always)]
    fn margin(&self, moved: L) -> L {
        let m = self.size();
        let four = L::from_f32(4.1);
        let rounding = m * m * (four * L::splat(L::Scalar::UNIT_ROUNDOFF));
        let carried = moved * (m * four + moved * L::from_f32(2.1));
        carried + rounding + L::splat(L::Scalar::MIN_POSITIVE)
    }

    /// Returns the margin by which all edge functions have one sign; negative if they have not.
    /// With or without FMA their error is within [`Seen::margin`].
    #[inline(always)]
    pub fn agreement(&self) -> L {
        let ([ax, bx, cx], [ay, by, cy]) = (self.x, self.y);
        let u = cx.mul_add(by, -(cy * bx));
        let v = ax.mul_add(cy, -(ay * cx));
        let w = bx.mul_add(ay, -(by * ax));
        u.min(v).min(w).max(-u.max(v).max(w))
    }

    /// Returns the largest coordinate across the ray.
    #[inline(always)]
    pub fn size(&self) -> L {
        let corner = |v: usize| self.x[v].abs().max(self.y[v].abs());
        corner(0).max(corner(1)).max(corner(2))
    }
}
