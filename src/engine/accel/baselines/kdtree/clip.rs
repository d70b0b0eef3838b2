//! Clipping of triangles to cells: the box of the region in which a triangle can be hit.
//!
//! The region must contain every point at which a kernel may report a hit, rounding included
//! (docs/numerics/boxes.md, X12 and X13). For a triangle it is a slab about its plane, inside
//! its box: with D the longest edge, ρ = D²/2A its square over twice the area and u the unit
//! roundoff, a reported point is off the plane by at most 20·u·D·ρ + 36·u·D·ρ², and in f32 by
//! another 16·u times the ray's reach. [`Clipped::margin`] is above that for ray origins within
//! 16 sizes of the scene.
//!
//! The triangle's own outline (Sutherland and Hodgman 1974, against the cell's six planes) is
//! smaller, and wrong for some rays: the t of a ray along the plane may be that of any point
//! in the box.

use super::quality::KdClip;
use crate::geom::triangle::Corners;
use crate::math::{Aabb32, round_down, round_up};
use glam::DVec3;

/// A triangle that can be clipped to cells.
pub(super) struct Clipped {
    outline: Option<[DVec3; 3]>,
    /// The unit normal of the plane.
    normal: DVec3,
    offset: f64,
    /// The half-width of the slab about the plane (X13).
    margin: f64,
}

impl Clipped {
    /// Makes the clipped form of a triangle; `None` if the whole box must be used. `extent` is
    /// the largest coordinate of the tree's bounds.
    pub(super) fn new(corners: &Corners, clip: KdClip, extent: f64) -> Option<Clipped> {
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
        // X13.
        let margin = longest * slender * (power(-19) + power(-46) * slender) + extent * power(-16);
        // The margin is NaN if the area is zero.
        if margin.is_nan() || margin >= 0.25 * longest {
            return None;
        }
        let normal = normal / double_area;
        Some(Clipped {
            outline: (clip == KdClip::Triangle).then_some([a, b, c]),
            normal,
            offset: normal.dot(a),
            margin,
        })
    }

    /// Returns the box of the region's part in `part`, which lies inside the triangle's box;
    /// `None` if that part is empty.
    pub(super) fn region(&self, part: &Aabb32) -> Option<Aabb32> {
        let low = DVec3::from_array(part.min.map(f64::from)) - self.margin;
        let high = DVec3::from_array(part.max.map(f64::from)) + self.margin;
        let polygon = match &self.outline {
            Some(corners) => {
                let mut polygon = Polygon::from_corners(corners);
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

    /// Returns the polygon of the plane in a box. Along the normal's largest component the
    /// plane is a height over the box's rectangle with slopes of at most 1.
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
        let mut polygon = Polygon::from_corners(&[
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

/// A convex polygon of four corners, to which each of six cuts adds one. Rounding may add
/// more; a full polygon counts as the whole part.
struct Polygon {
    corners: [DVec3; 12],
    len: usize,
}

impl Polygon {
    fn from_corners(corners: &[DVec3]) -> Polygon {
        let mut polygon = Polygon {
            corners: [DVec3::ZERO; 12],
            len: corners.len(),
        };
        polygon.corners[..corners.len()].copy_from_slice(corners);
        polygon
    }

    /// Keeps the side on which `sign`·(p\[axis\] − at) ≥ 0.
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
mod tests;
