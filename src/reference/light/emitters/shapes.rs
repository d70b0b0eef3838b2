//! Sampling of luminous shapes by solid angle, in f64 and in the papers' own forms.
//!
//! All functions see a shape from the origin: callers subtract the point. A sample is a vector
//! to the sampled point of the shape.

use super::super::maps::{Frame, cap};
use super::super::rounding::{ROUNDED, UNIT};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// A direction with the point at its end, and the density over solid angle.
#[derive(Clone, Copy, Debug)]
pub struct Aimed {
    pub dir: DVec3,
    pub pdf: f64,
    /// How far the point lies from where f32 may put it.
    pub blur: f64,
}

/// Where a flat shape is seen edge-on to within this, it brings no light.
const IN_PLANE: f64 = 1e-9;

/// Rectangles below this solid angle are sampled by area.
const LEAST_ANGLE: f64 = 1e-3;

/// A rectangle: its corner, unit edges and their lengths.
#[derive(Clone, Copy, Debug)]
pub struct Rectangle {
    pub corner: DVec3,
    pub edges: [DVec3; 2],
    pub lengths: [f64; 2],
}

impl Rectangle {
    pub fn seen_from(mut self, point: DVec3) -> Rectangle {
        self.corner -= point;
        self
    }

    /// Samples uniformly over solid angle (Ureña, Fajardo and King 2013, listing in section
    /// 4); `None` in the rectangle's plane.
    pub fn sample(&self, [u, v]: [f64; 2]) -> Option<Aimed> {
        let spherical = self.spherical()?;
        let (dir, blur) = match spherical.angle < LEAST_ANGLE {
            true => {
                let dir = self.corner
                    + self.edges[0] * (u * self.lengths[0])
                    + self.edges[1] * (v * self.lengths[1]);
                (dir, UNIT * dir.length())
            }
            false => (
                spherical.point([u, v], self.edges),
                spherical.blur([u, v], self.edges),
            ),
        };
        Some(Aimed {
            dir,
            pdf: self.pdf(dir),
            blur,
        })
    }

    /// Returns the density of the point at the end of `dir`.
    pub fn pdf(&self, dir: DVec3) -> f64 {
        let Some(spherical) = self.spherical() else {
            return 0.0;
        };
        match spherical.angle < LEAST_ANGLE {
            true => {
                let n = self.edges[0].cross(self.edges[1]);
                let area = self.lengths[0] * self.lengths[1];
                dir.length().powi(3) / (dir.dot(n).abs() * area)
            }
            false => 1.0 / spherical.angle,
        }
    }

    fn spherical(&self) -> Option<Spherical> {
        let [ex, ey] = self.edges;
        let mut n = ex.cross(ey);
        let mut z = self.corner.dot(n);
        if z > 0.0 {
            (n, z) = (-n, -z);
        }
        let (x0, y0) = (self.corner.dot(ex), self.corner.dot(ey));
        let (x1, y1) = (x0 + self.lengths[0], y0 + self.lengths[1]);
        let far = x0.abs().max(x1.abs()).max(y0.abs()).max(y1.abs()).max(-z);
        if -z <= IN_PLANE * far {
            return None;
        }
        let corner = |x: f64, y: f64| DVec3::new(x, y, z);
        let [v00, v01, v10, v11] = [
            corner(x0, y0),
            corner(x0, y1),
            corner(x1, y0),
            corner(x1, y1),
        ];
        // Normals of the planes through the edges, and the angles between them.
        let n0 = v00.cross(v10).normalize();
        let n1 = v10.cross(v11).normalize();
        let n2 = v11.cross(v01).normalize();
        let n3 = v01.cross(v00).normalize();
        let between = |a: DVec3, b: DVec3| libm::acos((-a.dot(b)).clamp(-1.0, 1.0));
        let g = [
            between(n0, n1),
            between(n1, n2),
            between(n2, n3),
            between(n3, n0),
        ];
        // For small angles the sum of four angles loses digits; two triangles keep them.
        let by_triangles = triangle_angle([v00, v10, v11]) + triangle_angle([v00, v11, v01]);
        let by_sum = g.iter().sum::<f64>() - TAU;
        debug_assert!((by_sum - by_triangles).abs() < 1e-6);
        Some(Spherical {
            x: [x0, x1],
            y: [y0, y1],
            z,
            n,
            b: [n0.z, n2.z],
            k: TAU - g[2] - g[3],
            angle: by_triangles,
        })
    }
}

/// The constants of a spherical rectangle.
struct Spherical {
    x: [f64; 2],
    y: [f64; 2],
    z: f64,
    n: DVec3,
    b: [f64; 2],
    k: f64,
    angle: f64,
}

impl Spherical {
    /// Bounds how far f32 moves a sample, to first order.
    ///
    /// The azimuth of the strip's edge is a sum of π, two arc cosines and a part of the angle,
    /// each within 8 units of rounding; and an arc cosine of x magnifies the three roundings of
    /// x by 1/√(1 − x²), up to where x is 1. The height along the strip is a difference of two
    /// numbers below 1, and the strip's edge has the root of a difference.
    fn blur(&self, [u, v]: [f64; 2], edges: [DVec3; 2]) -> f64 {
        let slope = |x: f64| x / (x * x + self.z * self.z).sqrt();
        let [x0, y0, y1] = [self.x[0], self.y[0], self.y[1]].map(slope);
        let steep = |x: f64| (1.0 / (1.0 - x * x).max(UNIT).sqrt()).min(1.0 / UNIT.sqrt());
        let azimuth = UNIT * (32.0 + 3.0 * steep(x0 * y0) + 3.0 * steep(x0 * y1));
        let far = |x: [f64; 2]| x[0].abs().max(x[1].abs());
        let size = far(self.x).max(far(self.y)).max(-self.z);
        let own = self.point([u, v], edges);
        let moved = |u: f64, v: f64| {
            let at = [u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)];
            self.point(at, edges).distance(own)
        };
        let across = azimuth / self.angle;
        let first = moved(u - across, v).max(moved(u + across, v));
        let at = (self.x[0].abs().min(self.x[1].abs())).hypot(self.z);
        let [low, high] = self.y.map(|y| y / at.hypot(y));
        let along = 8.0 * UNIT / (high - low).abs().max(UNIT);
        let second = moved(u, v - along).max(moved(u, v + along));
        // x = z sin/√(r² − f sin²): the root is right to some roundings of r².
        let (sin, cos) = libm::sincos(u * self.angle + self.k);
        let rise = cos * self.b[0] - self.b[1];
        let root = rise * rise + (self.b[0] * self.b[0] - 1.0) * sin * sin;
        let edge = 4.0 * UNIT * (rise * rise + sin * sin) / root.abs().max(UNIT);
        first + second + edge.min(1.0) * own.dot(edges[0]).abs() + 8.0 * UNIT * size
    }

    fn point(&self, [u, v]: [f64; 2], [ex, ey]: [DVec3; 2]) -> DVec3 {
        let z2 = self.z * self.z;
        let (sin, cos) = libm::sincos(u * self.angle + self.k);
        let fu = (cos * self.b[0] - self.b[1]) / sin;
        let cu = (1.0 / (fu * fu + self.b[0] * self.b[0]).sqrt()).copysign(fu);
        let cu = cu.clamp(-1.0, 1.0);
        let xu = -(cu * self.z) / (1.0 - cu * cu).max(1e-300).sqrt();
        let xu = xu.clamp(self.x[0], self.x[1]);
        let d = (xu * xu + z2).sqrt();
        let [h0, h1] = self.y.map(|y| y / (d * d + y * y).sqrt());
        let hv = h0 + v * (h1 - h0);
        let yv = (hv * d / (1.0 - hv * hv).max(1e-300).sqrt()).clamp(self.y[0], self.y[1]);
        ex * xu + ey * yv + self.n * self.z
    }
}

/// Returns the solid angle of a triangle (Van Oosterom and Strackee 1983).
pub fn triangle_angle(corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners.map(DVec3::normalize);
    let volume = a.dot(b.cross(c)).abs();
    2.0 * libm::atan2(volume, 1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

/// Returns whether the origin lies in a triangle's plane.
fn is_edge_on([a, b, c]: [DVec3; 3]) -> bool {
    let n = (b - a).cross(c - a);
    let far = [a, b, c].map(|p| p.abs().max_element());
    let far = far.into_iter().fold(0.0, f64::max);
    a.dot(n).abs() <= IN_PLANE * n.length() * far
}

/// Samples a triangle uniformly over solid angle (Arvo 1995, figure 4).
pub fn sample_triangle(corners: [DVec3; 3], [u, v]: [f64; 2]) -> Option<Aimed> {
    let pdf = triangle_pdf(corners);
    if pdf == 0.0 {
        return None;
    }
    let [a, b, c] = corners.map(DVec3::normalize);
    let aside = |p: DVec3, q: DVec3| (p - q * p.dot(q)).normalize_or_zero();
    // The angle at A, and the side from A to B.
    let alpha = libm::acos(aside(b, a).dot(aside(c, a)).clamp(-1.0, 1.0));
    let (sin_alpha, cos_alpha) = libm::sincos(alpha);
    let cos_c = a.dot(b);
    let (s, t) = libm::sincos(u / pdf - alpha);
    let (p, q) = (t - cos_alpha, s + sin_alpha * cos_c);
    let cos_b = ((q * t - p * s) * cos_alpha - q) / ((q * s + p * t) * sin_alpha);
    let cos_b = if u == 0.0 {
        1.0
    } else {
        cos_b.clamp(-1.0, 1.0)
    };
    let on_side = a * cos_b + aside(c, a) * (1.0 - cos_b * cos_b).sqrt();
    let z = 1.0 - v * (1.0 - on_side.dot(b));
    let dir = b * z + aside(on_side, b) * (1.0 - z * z).max(0.0).sqrt();
    // Where the direction meets the plane.
    let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let t = corners[0].dot(n) / dir.dot(n);
    // The weights of the corners are right to some roundings of the angles between them, which
    // a plane seen edge-on magnifies.
    let steep = dir.dot(n).abs() / n.length();
    let size = corners.map(DVec3::length).into_iter().fold(0.0, f64::max);
    Some(Aimed {
        dir: dir * t,
        pdf,
        blur: ROUNDED * size / steep.max(ROUNDED),
    })
}

/// Returns the density of [`sample_triangle`], 0 in the triangle's plane.
pub fn triangle_pdf(corners: [DVec3; 3]) -> f64 {
    match is_edge_on(corners) {
        true => 0.0,
        false => 1.0 / triangle_angle(corners),
    }
}

/// A ball as seen from the origin.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    pub center: DVec3,
    pub radius: f64,
}

impl Ball {
    fn is_inside(&self) -> bool {
        self.center.length() < self.radius
    }

    /// The squared sine of the half angle of the cone that it subtends.
    pub fn sin2(&self) -> f64 {
        (self.radius / self.center.length()).powi(2).min(1.0)
    }

    /// 1 − cos of that half angle.
    fn versine(&self) -> f64 {
        let d2 = self.center.length_squared();
        let apart = (self.center.length() - self.radius) * (self.center.length() + self.radius);
        self.sin2() / (1.0 + (apart.max(0.0) / d2).sqrt())
    }

    /// Samples uniformly over the cone that the ball subtends (Shirley, Wang and Zimmerman
    /// 1996), from inside uniformly over its area.
    pub fn sample(&self, [u, v]: [f64; 2]) -> Aimed {
        let distance = self.center.length();
        let axis = match distance > 1e-140 {
            true => self.center / distance,
            false => DVec3::Z,
        };
        let versine = if self.is_inside() {
            2.0
        } else {
            self.versine()
        };
        let unit = Frame::about(axis).to_world(cap(u * versine, v));
        let dir = match self.is_inside() {
            true => self.center + unit * self.radius,
            false => {
                // The nearer crossing of the line, t = d cos θ − √(r² − d² sin² θ).
                let cos = 1.0 - u * versine;
                let sin2 = u * versine * (2.0 - u * versine);
                let inner = self.radius * self.radius - distance * distance * sin2;
                unit * (distance * cos - inner.max(0.0).sqrt())
            }
        };
        Aimed {
            dir,
            pdf: self.pdf(dir),
            // The azimuth alone is of f32.
            blur: 8.0 * UNIT * self.radius.min(distance),
        }
    }

    /// Returns the density of the point at the end of `dir`.
    pub fn pdf(&self, dir: DVec3) -> f64 {
        match self.is_inside() {
            false => 1.0 / (TAU * self.versine()),
            true => {
                let slope = dir.dot(dir - self.center).abs();
                dir.length().powi(3) / (4.0 * PI * self.radius * slope)
            }
        }
    }
}
