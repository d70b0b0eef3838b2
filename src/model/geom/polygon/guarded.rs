//! Polygons, seen along the ray as triangles are.
//!
//! How often the outline crosses a half-line is a property of how it winds about
//! the ray: moving corners by no more than their error changes it only if an
//! edge passes over the ray. So it is certain where every edge function is
//! beyond its bound, and no corner's side of the half-line need be. What lanes of
//! f32 leave in doubt those of f64 see once more, from next to the polygon.

use crate::geom::guarded::{Between, LEVEL, LEVEL_SLACK, Near, ObjectRay, finite, roundings, tiny};
use crate::geom::polygon::{QUADRANGLE, STEEP};
use crate::geom::{Meet, Polygon};
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask, Scalar, max, min};
use glam::DVec3;

/// One bound for all edges.
const COARSE: u8 = 0;
/// A bound for each edge, by its length.
const FINE: u8 = 1;
/// Edges that pass the ray beyond their ends are certain too.
const CAREFUL: u8 = 2;
/// Edges of polygons with no more corners are nearly as long as the polygon.
const FEW: usize = 8;

/// Lanes whose half-line the outline crosses an odd number of times, and lanes
/// for which that is certain.
struct Winding<L: Lanes> {
    odd: L::Mask,
    sure: L::Mask,
}

/// A polygon's corners before some rays.
struct Outline<'a, L: Lanes> {
    points: &'a [DVec3],
    /// What corners are relative to, and where the rays are from there.
    center: DVec3,
    org: Vec3<L>,
    object: &'a ObjectRay<'a, L>,
    /// The longest side of its box.
    extent: L,
    /// No corner is farther from the ray, along an axis.
    reach: L,
    /// By how much a corner may be seen out of place.
    moved: L,
}

fn splat<L: Lanes>(v: DVec3) -> Vec3<L> {
    Vec3::splat(v.to_array().map(L::Scalar::from_f64))
}

impl<L: Lanes> Outline<'_, L> {
    /// A corner as rays whose longest axis is `k` see it.
    #[inline(always)]
    fn seen(&self, k: usize, point: DVec3) -> (L, L) {
        let corner = splat::<L>(point - self.center) - self.org;
        let (x, y, _) = self.object.ray.shear.apply(k, corner);
        (x, y)
    }

    /// More than edge functions may be off, with one bound for all.
    #[inline(always)]
    fn coarse(&self) -> L {
        let along = self.moved * L::from_f32(1.75);
        // Sheared, a side is at most twice as long.
        self.extent * L::from_f32(4.01) * along + self.least()
    }

    /// More than edge functions may be off besides what grows with their edge.
    #[inline(always)]
    fn least(&self) -> L {
        self.moved * self.moved * L::from_f32(15.0) + tiny()
    }

    /// Lanes in which nothing has left the format, so nothing is not a number.
    #[inline(always)]
    fn finite(&self) -> L::Mask {
        let room = self.reach + self.reach;
        finite(room * room, L::zero())
    }

    /// Lanes about which all edges of a quadrangle turn one way for certain.
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

    /// Of rays whose longest axis is `k`. `CARE`: [`COARSE`], [`FINE`] or
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
            // Zero is in doubt, but where an edge's ends alone tell.
            let down = if CARE == CAREFUL { side.lt(zero) } else { !up };
            let right = (b_above & up) | (a_above & down);
            let flips = straddles & right;
            odd = (odd & !flips) | (flips & !odd);

            let size = side.abs();
            let length = || (bx - ax).abs() + (by - ay).abs();
            // Comparisons are dear: what is left of the least edge is compared in the end.
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

/// What a first look leaves in doubt: from next to the first corner.
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

/// `extent`: no less than the longest side of the polygon's box. Lanes of f32 leave to
/// those of f64 what a first look leaves in doubt: [`meet_again`].
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

/// What lanes of f32 are not certain of, in those of f64.
pub fn meet_again<L: Lanes>(
    polygon: &Polygon,
    extent: f32,
    object: &ObjectRay<L>,
    active: L::Mask,
) -> Meet<L> {
    let seen = careful(polygon.points, L::from_f32(extent), object, active);
    at_plane(polygon, object, seen, active)
}

/// Where the plane is met, of lanes of which the outline is or may be around the ray.
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
    // Of grazing rays it is in doubt whether they meet the plane near the outline.
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
