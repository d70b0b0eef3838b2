//! Which part of a cell an entry can be hit in: its region's box.
//!
//! A region must hold every point where a hit may be said to lie, rounding
//! included (the argument is in [`super`]). Of a triangle, that is a slab about
//! its plane, inside its box. The kernel's weights are wrong by roundings, so
//! its t is that of a point which lies off the ray, but whose plane is not far
//! from it: by at most about 20·u·D·ρ, where D is the longest edge, ρ = D²/2A
//! its square over twice the area, and u the unit roundoff, and, where rays run
//! along the plane so closely that the area seen is itself rounding, by about
//! 36·u·D·ρ². In f32 t is that of the plane itself, whose normal is turned by
//! some u·ρ, and whose distance from the origin is wrong by at most 16·u·R, R the
//! reach of the ray. [`Shape::margin`] is above the first, in f64 above both, and
//! adds 256·u times the scene's extent: enough for ray origins within 16 sizes.
//!
//! The triangle's own outline (Sutherland and Hodgman 1974 against the cell's
//! six planes) is smaller, and wrong for some rays: where a ray runs along the
//! plane, t may be that of any point within the box.

use super::quality::KdClip;
use crate::geom::triangle::Corners;
use crate::math::{Aabb32, round_down, round_up};
use glam::DVec3;

/// A triangle as the clipper needs it.
pub(super) struct Shape {
    outline: Option<[DVec3; 3]>,
    /// Unit normal and offset of the plane.
    normal: DVec3,
    offset: f64,
    margin: f64,
}

impl Shape {
    /// `extent`: the largest coordinate of the tree's bounds, in magnitude.
    /// `None` where the box is all that can be said.
    pub(super) fn new(corners: &Corners, clip: KdClip, extent: f64) -> Option<Shape> {
        if clip == KdClip::Box {
            return None;
        }
        let [a, b, c] = corners.map(|p| DVec3::from_array(p.map(f64::from)));
        let edges = [b - a, c - b, a - c];
        let longest = edges.map(DVec3::length_squared);
        let longest = longest[0].max(longest[1]).max(longest[2]).sqrt();
        let normal = edges[0].cross(edges[1]);
        let double_area = normal.length();
        let slender = longest * longest / double_area;
        let power = |p: i32| f64::powi(2.0, p);
        let margin = longest * slender * (power(-19) + power(-46) * slender) + extent * power(-16);
        // NaN where the area is zero.
        if margin.is_nan() || margin >= 0.25 * longest {
            return None;
        }
        let normal = normal / double_area;
        Some(Shape {
            outline: (clip == KdClip::Triangle).then_some([a, b, c]),
            normal,
            offset: normal.dot(a),
            margin,
        })
    }

    /// The box of the region's part inside `part`, which lies inside the
    /// triangle's box; `None` where there is nothing.
    pub(super) fn clipped(&self, part: &Aabb32) -> Option<Aabb32> {
        let low = DVec3::from_array(part.min.map(f64::from)) - self.margin;
        let high = DVec3::from_array(part.max.map(f64::from)) + self.margin;
        let polygon = match &self.outline {
            Some(corners) => {
                let mut polygon = Polygon::of(corners);
                for axis in 0..3 {
                    polygon.cut(axis, low[axis], 1.0);
                    polygon.cut(axis, high[axis], -1.0);
                }
                polygon
            }
            None => self.cross_section(low, high),
        };
        if polygon.is_full() {
            return Some(*part);
        }
        let (least, most) = polygon.bounds()?;
        let (least, most) = (least - self.margin, most + self.margin);
        let region = Aabb32 {
            min: std::array::from_fn(|k| round_down(least[k]).max(part.min[k])),
            max: std::array::from_fn(|k| round_up(most[k]).min(part.max[k])),
        };
        let some = (0..3).all(|k| region.min[k] <= region.max[k]);
        some.then_some(region)
    }

    /// The plane inside a box. Along the normal's largest component the plane is
    /// a gently sloping height over the box's rectangle.
    fn cross_section(&self, low: DVec3, high: DVec3) -> Polygon {
        let n = self.normal.abs();
        let up = if n.x >= n.y && n.x >= n.z {
            0
        } else if n.y >= n.z {
            1
        } else {
            2
        };
        let (i, j) = ((up + 1) % 3, (up + 2) % 3);
        let corner = |x: f64, y: f64| {
            let mut p = DVec3::ZERO;
            p[i] = x;
            p[j] = y;
            p[up] = (self.offset - self.normal[i] * x - self.normal[j] * y) / self.normal[up];
            p
        };
        let mut polygon = Polygon::of(&[
            corner(low[i], low[j]),
            corner(high[i], low[j]),
            corner(high[i], high[j]),
            corner(low[i], high[j]),
        ]);
        polygon.cut(up, low[up], 1.0);
        polygon.cut(up, high[up], -1.0);
        polygon
    }
}

/// A convex polygon: four corners, and each of six cuts adds one. Rounding may
/// add more; a full one stands for anything.
struct Polygon {
    corners: [DVec3; 12],
    len: usize,
}

impl Polygon {
    fn of(corners: &[DVec3]) -> Polygon {
        let mut polygon = Polygon {
            corners: [DVec3::ZERO; 12],
            len: corners.len(),
        };
        polygon.corners[..corners.len()].copy_from_slice(corners);
        polygon
    }

    /// Keeps the side where `sign`·(p\[axis\] − at) ≥ 0.
    fn cut(&mut self, axis: usize, at: f64, sign: f64) {
        let from = self.corners;
        let len = self.len;
        self.len = 0;
        for i in 0..len {
            let (p, q) = (from[i], from[if i + 1 == len { 0 } else { i + 1 }]);
            let (dp, dq) = (sign * (p[axis] - at), sign * (q[axis] - at));
            if dp >= 0.0 {
                self.push(p);
            }
            if (dp < 0.0) != (dq < 0.0) {
                let mut between = p + (q - p) * (dp / (dp - dq));
                between[axis] = at;
                self.push(between);
            }
        }
    }

    fn push(&mut self, p: DVec3) {
        if self.len < self.corners.len() {
            self.corners[self.len] = p;
            self.len += 1;
        }
    }

    fn is_full(&self) -> bool {
        self.len == self.corners.len()
    }

    fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let corners = self.corners[..self.len].iter();
        corners.fold(None, |bounds, p| match bounds {
            None => Some((*p, *p)),
            Some((low, high)) => Some((p.min(low), p.max(high))),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::slabs::Slabs;
    use crate::geom::Ray;
    use crate::geom::triangle::{canonical, meet};
    use crate::math::Vec3;
    use crate::math::lanes::{Lanes, Scalar};
    use proptest::prelude::*;

    fn box_of(corners: &Corners) -> Aabb32 {
        corners
            .iter()
            .fold(Aabb32::EMPTY, |b, p| b.union(&Aabb32 { min: *p, max: *p }))
    }

    /// Where a hit is said to lie, moved into the triangle's box; rays run along
    /// the plane and nearly so.
    fn said<L: Lanes<Scalar = T>, T: Scalar>(
        corners: &Corners,
        org: [f32; 3],
        dir: [f32; 3],
    ) -> Option<[f64; 3]> {
        let own = box_of(corners);
        let [org, dir] = [org, dir].map(|v| Vec3::splat(v.map(L::Scalar::from_f32)));
        let ray = Ray::<L>::new(org, dir, L::zero());
        let slabs = Slabs::new(org, dir, &own);
        let met = meet(corners, &ray, L::zero().le(L::zero()));
        let (enter, exit) = slabs.interval(own.min, own.max);
        if crate::math::lanes::Mask::none(met.hit & enter.le(exit)) {
            return None;
        }
        let t = met.t.max(enter).min(exit).lane(0).to_f64();
        let at = |k: usize| org.axis(k).lane(0).to_f64() + t * dir.axis(k).lane(0).to_f64();
        Some(std::array::from_fn(|k| {
            at(k).clamp(f64::from(own.min[k]), f64::from(own.max[k]))
        }))
    }

    fn check(corners: &Corners, p: [f64; 3]) {
        let Some(shape) = Shape::new(corners, KdClip::Plane, box_of(corners).widened().max_abs())
        else {
            return;
        };
        let cell = Aabb32 {
            min: p.map(round_down),
            max: p.map(round_up),
        };
        let region = shape.clipped(&cell);
        assert!(region.is_some(), "{corners:?} {p:?}");
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 20_000, ..ProptestConfig::default() })]

        /// The margin is wide enough, at both precisions.
        #[test]
        fn regions_hold_where_hits_are_said_to_lie(
            points in proptest::array::uniform3(proptest::array::uniform3(-1.0_f32..1.0)),
            thin in 0_i32..12,
            far in -1_i32..4,
            weights in proptest::array::uniform4(-1.0_f64..1.0),
            tilt in -10_i32..0,
        ) {
            let [a, b, mut c] = points.map(|p| DVec3::from_array(p.map(f64::from)));
            c = a + (b - a) * 0.3 + (c - a) * f64::powi(4.0, -thin);
            let corners = [a, b, c].map(|p| p.to_array().map(|x| x as f32));
            let corners = canonical(corners);
            let inside = |u: f64, v: f64| {
                let (u, v) = (u.abs(), v.abs());
                let sum = u + v + 1.0;
                (a + b * u + c * v) / sum
            };
            let at = inside(weights[0], weights[1]);
            let along = (b - a) * weights[2] + (c - a) * weights[3];
            let off = (b - a).cross(c - a).normalize_or_zero() * f64::powi(8.0, tilt);
            let org = at + (along + off * along.length()) * f64::powi(4.0, far);
            let narrow = |v: DVec3| v.to_array().map(|x| x as f32);
            let (org, dir) = (narrow(org), narrow(at - org));
            let reach = org.iter().chain(corners.as_flattened()).fold(0.0, |m, x| x.abs().max(m));
            let extent = f64::from(corners.as_flattened().iter().fold(0.0, |m, x| x.abs().max(m)));
            if f64::from(reach) <= 16.0 * extent
                && let Some(p) = said::<f32, f32>(&corners, org, dir)
            {
                check(&corners, p);
            }
            if let Some(p) = said::<f64, f64>(&corners, org, dir) {
                check(&corners, p);
            }
        }
    }
}
