//! Triangles, sampled uniformly over the solid angle that they subtend.
//!
//! The map of the unit square is Arvo's (SIGGRAPH 1995): the first number picks a smaller
//! triangle of the same vertex by its solid angle, the second a point on the arc from the
//! vertex to the opposite side. The formulas are those of Peters (2021, "BRDF Importance
//! Sampling for Polygonal Lights", section 4), which need no difference of angles: the solid
//! angle is 2·atan2(G₀, G₁ + G₂) (Van Oosterom and Strackee 1983), with the determinant G₀
//! from the distance to the triangle's plane. So it holds for solid angles from nothing to
//! 2π, and no triangle falls back to its area.

use super::place::{IN_PLANE, Place, narrow};
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::elementary::{atan2, sin_cos_turns};
use lanecast_numerics::math::lanes::Lanes;
use std::f32::consts::FRAC_1_PI;

/// A triangle as seen from points, one a lane.
#[derive(Clone, Copy, Debug)]
pub struct Seen<L> {
    /// Directions to the corners, of unit length.
    corners: [Vec3<L>; 3],
    /// Reciprocals of the corners' distances, in units of the farthest.
    nearness: [L; 3],
    /// G₀, G₁ and G₂ of Peters, equation 11.
    g: [L; 3],
    /// The solid angle in steradians, ≥ 0; 0 in the triangle's plane.
    pub angle: L,
}

impl<L: Lanes<Scalar = f32>> Seen<L> {
    /// Looks at triangles from the points that they are relative to.
    #[inline(always)]
    pub fn of(place: &Place<L>) -> Seen<L> {
        let (origin, n) = (place.origin, place.n);
        let corners = [origin, origin + place.u, origin + place.v];
        // In units of the farthest coordinate nothing leaves the range of f32.
        let [p, q, r] = corners.map(Vec3::max_abs);
        let far = Lanes::max(Lanes::max(p, q), Lanes::max(r, double::<L>(1e-300)));
        let unit = double::<L>(1.0) / far;
        let height = L::narrow(origin.dot(n) * unit * unit * unit).abs();
        let corners = corners.map(|corner| narrow::<L>(corner * unit));
        let least = L::splat(1e-18);
        let nearness = corners.map(|p| L::splat(1.0) / Lanes::max(p.length(), least));
        let corners: [Vec3<L>; 3] = std::array::from_fn(|i| corners[i] * nearness[i]);
        let [p, q, r] = corners;
        let g = [
            height * nearness[0] * nearness[1] * nearness[2],
            p.dot(r) + q.dot(r),
            L::splat(1.0) + p.dot(q),
        ];
        let angle = L::splat(2.0) * atan2(g[0], g[1] + g[2]);
        // The height is over the plane, times twice the area.
        let area = narrow::<L>(n * (unit * unit)).length();
        let off_plane = height.gt(L::splat(IN_PLANE) * area);
        Seen {
            corners,
            nearness,
            g,
            angle: L::select(off_plane, angle, L::zero()),
        }
    }

    /// Maps points of the unit square to the weights of the triangle's second and third
    /// corner.
    #[inline(always)]
    pub fn sample(&self, u: [L; 2]) -> [L; 2] {
        let (zero, one, two) = (L::zero(), L::splat(1.0), L::splat(2.0));
        let least = L::splat(f32::MIN_POSITIVE);
        let [p, q, r] = self.corners;
        let [g0, g1, g2] = self.g;
        // Half of the smaller triangle's angle, at most π.
        let half = u[0] * self.angle * L::splat(0.25 * FRAC_1_PI);
        let (sin, cos) = sin_cos_turns(half);
        // Its corner s lies between p and r: s = kp·p + kr·r.
        let y = g2 * sin;
        let x = Lanes::max(g0 * cos - g1 * sin, y);
        let pr = p.dot(r);
        let square = Lanes::max(x * x + y * y + two * (x * y) * pr, least);
        let kp = (x - y) * (x + y) / square;
        let kr = two * (x + y * pr) * y / square;
        // On the arc from q to s the sample lies where 1 − cos = u₁·(1 − q·s).
        // Both 1 − q·s and 1 + q·s are needed to their last digits: s may be close to q, and
        // close to −q if the point almost lies in the triangle.
        let s = p * kp + r * kr;
        let bend = L::splat(0.5) * (q - s).length_squared();
        let rest = Lanes::max(L::splat(0.5) * (q + s).length_squared(), least);
        let turn = u[1] * bend;
        let ks = (u[1] * Lanes::max(two - turn, zero) / rest).sqrt();
        let kq = (one - turn) - ks * (one - bend);
        // Weights of unit vectors become weights of corners by the corners' distances.
        let wp = Lanes::max(kp * ks, zero) * self.nearness[0];
        let wq = Lanes::max(kq, zero) * self.nearness[1];
        let wr = Lanes::max(kr * ks, zero) * self.nearness[2];
        let sum = Lanes::max(wp + wq + wr, least);
        [wq / sum, wr / sum]
    }
}

#[inline(always)]
fn double<L: Lanes>(x: f64) -> L::Double {
    L::Double::splat(x)
}
