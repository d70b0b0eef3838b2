//! Meets polygons with error bounds, seen along the ray as triangles are.
//!
//! The parity of the outline's crossings of a half-line depends only on how the outline winds
//! about the ray: moving the corners by no more than their error changes it only if an edge passes
//! over the ray. So it is certain where every edge function is beyond its bound (G3,
//! docs/numerics/polygons.md), even if it is not certain on which side of the half-line a corner
//! lies. Lanes that f32 leaves undecided are evaluated again in f64, from next to the polygon.

use crate::geom::guarded::{Between, LEVEL, LEVEL_SLACK, Near, ObjectRay, finite, roundings, tiny};
use crate::geom::polygon::{QUADRANGLE, STEEP};
use crate::geom::{Meet, Polygon};
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask, Scalar, max, min};
use glam::DVec3;

/// One bound for all edges (G4, docs/numerics/polygons.md).
const COARSE: u8 = 0;
/// A bound for each edge by its length (G3, docs/numerics/polygons.md).
const FINE: u8 = 1;
/// As [`FINE`], where edges that pass the ray beyond their ends are certain as well.
const CAREFUL: u8 = 2;
/// Polygons with no more corners than these have edges nearly as long as themselves, so that
/// [`COARSE`] serves.
const FEW: usize = 8;

/// Lanes whose half-line the outline crosses an odd number of times, and lanes in which that is
/// certain.
struct Winding<L: Lanes> {
    odd: L::Mask,
    sure: L::Mask,
}

/// A polygon's corners as some rays see them.
struct Outline<'a, L: Lanes> {
    points: &'a [DVec3],
    /// The point that corners are relative to, and the rays' origins from there.
    center: DVec3,
    org: Vec3<L>,
    object: &'a ObjectRay<'a, L>,
    /// The longest side of the polygon's box.
    extent: L,
    /// The largest coordinate of a corner relative to the ray's origin.
    reach: L,
    /// The most that a corner may be seen out of place: μ of lemmas G1 and G2,
    /// docs/numerics/polygons.md.
    moved: L,
}

fn splat<L: Lanes>(v: DVec3) -> Vec3<L> {
    Vec3::splat(v.to_array().map(L::Scalar::from_f64))
}

impl<L: Lanes> Outline<'_, L> {
    /// Returns a corner as rays whose longest axis is `k` see it.
    #[inline(always)]
    fn seen(&self, k: usize, point: DVec3) -> (L, L) {
        let corner = splat::<L>(point - self.center) - self.org;
        let (x, y, _) = self.object.ray.shear.apply(k, corner);
        (x, y)
    }

    /// Bounds the error of every edge function by one number (G4, docs/numerics/polygons.md).
    #[inline(always)]
    fn coarse(&self) -> L {
        let along = self.moved * L::from_f32(1.75);
        // Sheared, a side is at most twice as long along each of two axes.
        self.extent * L::from_f32(4.01) * along + self.least()
    }

    /// Bounds the part of an edge function's error that does not grow with its edge: 15μ² of lemma
    /// G3, docs/numerics/polygons.md.
    #[inline(always)]
    fn least(&self) -> L {
        self.moved * self.moved * L::from_f32(15.0) + tiny()
    }

    /// Returns lanes in which nothing has overflowed, so that no number is NaN.
    #[inline(always)]
    fn finite(&self) -> L::Mask {
        let room = self.reach + self.reach;
        finite(room * room, L::zero())
    }

    /// Returns lanes about which all edges of a quadrangle certainly turn one way (G5,
    /// docs/numerics/polygons.md).
    #[inline(always)]
    fn is_around(&self, k: usize) -> L::Mask {
        let infinity = L::splat(L::Scalar::INFINITY);
        let (mut low, mut high, mut reach) = (infinity, -infinity, L::zero());
        let (mut ax, mut ay) = self.seen(k, self.points[self.points.len() - 1]);
        for point in self.points {
            let (bx, by) = self.seen(k, *point);
            let side = ax * by - ay * bx;
            low = min(side, low);
            high = max(side, high);
            reach = max(max(bx.abs(), by.abs()), reach);
            (ax, ay) = (bx, by);
        }
        let off = reach * (self.moved * L::from_f32(4.1) + reach * roundings(6.1));
        let off = off + self.least();
        (low.gt(off) | high.lt(-off)) & self.finite()
    }

    /// Computes the winding for rays whose longest axis is `k`. `CARE` is [`COARSE`], [`FINE`] or
    /// [`CAREFUL`].
    #[inline(always)]
    fn winding<const CARE: u8>(&self, k: usize) -> Winding<L> {
        let (zero, points) = (L::zero(), self.points);
        let along = self.moved * L::from_f32(1.75);
        let least = self.least();
        let mut odd = L::Mask::splat(false);
        let mut sure = L::Mask::splat(true);
        let mut beyond = L::splat(L::Scalar::INFINITY);
        let (mut ax, mut ay) = self.seen(k, points[points.len() - 1]);
        for point in points {
            let (bx, by) = self.seen(k, *point);
            let (a_above, b_above) = (ay.gt(zero), by.gt(zero));
            let straddles = (a_above & !b_above) | (b_above & !a_above);
            let side = ax * by - ay * bx;
            let up = side.gt(zero);
            // An edge function of zero is undecided, unless the edge's ends alone decide.
            let down = if CARE == CAREFUL { side.lt(zero) } else { !up };
            let right = (b_above & up) | (a_above & down);
            let flips = straddles & right;
            odd = (odd & !flips) | (flips & !odd);

            let size = side.abs();
            let length = || (bx - ax).abs() + (by - ay).abs();
            // Comparisons are costly, so only the least edge function is compared, at the end.
            match CARE {
                COARSE => beyond = min(size, beyond),
                FINE => beyond = min(size - length() * along, beyond),
                _ => {}
            }
            if CARE == CAREFUL {
                let e = self.moved;
                let clear = size.gt(length() * along + least)
                    | ax.gt(e) & bx.gt(e) & side.abs().gt(tiny())
                    | ax.lt(-e) & bx.lt(-e)
                    | ay.gt(e) & by.gt(e)
                    | ay.lt(-e) & by.lt(-e);
                sure = sure & clear;
            }
            (ax, ay) = (bx, by);
        }
        match CARE {
            COARSE => sure = beyond.gt(self.coarse()),
            FINE => sure = beyond.gt(least),
            _ => {}
        }
        Winding {
            odd,
            sure: sure & self.finite(),
        }
    }
}

/// Evaluates the lanes that the first pass left undecided again, from next to the first corner
/// (G2, docs/numerics/polygons.md).
#[inline(never)]
fn careful<L: Lanes>(
    points: &[DVec3],
    extent: L,
    object: &ObjectRay<L>,
    lanes: L::Mask,
) -> Winding<L> {
    let off = L::Mask::splat(false);
    let center = points[0];
    let near = Near::to_center(object, center);
    let reach = near.size + extent;
    let outline = Outline {
        points,
        center,
        org: near.org,
        object,
        extent,
        reach,
        moved: reach * roundings(10.5) + near.error * L::from_f32(2.25) + tiny(),
    };
    let (mut odd, mut sure) = (off, off);
    for (k, axis) in object.ray.shear.groups() {
        let axis = axis & lanes;
        let seen = outline.winding::<CAREFUL>(k);
        odd = odd | seen.odd & axis;
        sure = sure | seen.sure & axis;
    }
    Winding { odd, sure }
}

/// Meets a polygon. `extent` is no less than the longest side of its box. Lanes that stay
/// undecided in f32 are for [`meet_again`] in f64.
pub fn meet<L: Lanes>(
    polygon: &Polygon,
    extent: f32,
    object: &ObjectRay<L>,
    active: L::Mask,
) -> Meet<L> {
    let (ray, points) = (object.ray, polygon.points);
    let off = L::Mask::splat(false);
    let sides = L::from_f32(extent);
    let first = splat::<L>(points[0]) - ray.org;
    let origin = ray.org.max_abs();
    let reach = first.max_abs() + sides;
    let outline = Outline {
        points,
        center: DVec3::ZERO,
        org: ray.org,
        object,
        extent: sides,
        reach,
        moved: reach * roundings(10.5) + origin * roundings(4.25) + tiny(),
    };
    let (mut odd, mut sure) = (off, off);
    for (k, lanes) in ray.shear.groups() {
        let lanes = lanes & active;
        let around = match points.len() {
            QUADRANGLE => outline.is_around(k),
            _ => off,
        };
        let mut seen: Winding<L> = Winding {
            odd: around,
            sure: around,
        };
        if (lanes & !around).any() {
            let more = if points.len() <= FEW {
                outline.winding::<COARSE>(k)
            } else {
                outline.winding::<FINE>(k)
            };
            seen.odd = seen.odd | more.odd;
            seen.sure = seen.sure | more.sure;
        }
        odd = odd | seen.odd & lanes;
        sure = sure | seen.sure & lanes;
    }
    let open = active & !sure;
    if L::is_double() && open.any() {
        let again = careful(points, sides, object, open);
        odd = odd & !open | again.odd & open;
        sure = sure | again.sure & open;
    }
    at_plane(polygon, object, Winding { odd, sure }, active)
}

/// Meets a polygon again in f64 lanes, from next to its first corner.
pub fn meet_again<L: Lanes>(
    polygon: &Polygon,
    extent: f32,
    object: &ObjectRay<L>,
    active: L::Mask,
) -> Meet<L> {
    let seen = careful(polygon.points, L::from_f32(extent), object, active);
    at_plane(polygon, object, seen, active)
}

/// Finds t in the plane, for lanes whose ray the outline surrounds or may surround (G6,
/// docs/numerics/polygons.md).
#[inline(always)]
fn at_plane<L: Lanes>(
    polygon: &Polygon,
    object: &ObjectRay<L>,
    Winding { odd, sure }: Winding<L>,
    active: L::Mask,
) -> Meet<L> {
    let ray = object.ray;
    let ordinary = object.ordinary();
    let sure = sure & ordinary;
    let possible = active & (odd | !sure);
    if possible.none() {
        return Meet::certain(L::Mask::splat(false), L::zero());
    }
    let first = splat::<L>(polygon.points[0]) - ray.org;
    let (far, origin) = (first.max_abs(), ray.org.max_abs());
    let normal = splat::<L>(polygon.normal);
    let length = L::from_f64(polygon.normal.abs().element_sum());
    let (room, speed) = (normal.unordered_dot(first), normal.unordered_dot(ray.dir));
    let room_error = length * far * roundings(6.5) + length * origin * roundings(2.25) + tiny();
    let speed_error = length * ray.shear.along.abs() * roundings(5.5) + tiny();
    let inverse = L::from_f32(1.0) / speed;
    let t = room * inverse;
    let error = (room_error + t.abs() * speed_error) * inverse.abs();
    let error = error * L::from_f32(LEVEL_SLACK) + t.abs() * roundings(4.0) + tiny();
    // Grazing rays may meet the plane far from the outline, so they are undecided (G7,
    // docs/numerics/polygons.md).
    let steep = speed
        .abs()
        .gt(ray.shear.along.abs() * L::from_f64(1.25 * STEEP));
    let level = speed.abs().gt(speed_error * L::from_f32(LEVEL));
    let sound = ordinary & steep & level & finite(t, error);
    let t = Between::new(t, error);
    let possible = possible & !(sound & t.most.le(ray.t_min));
    let hit = possible & sure & sound & t.least.gt(ray.t_min);
    Near::unmoved(ray.org).hit(hit, t, possible)
}
