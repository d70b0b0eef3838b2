//! Rectangles, sampled uniformly over the solid angle that they subtend: Ureña, Fajardo and
//! King 2013, "An Area-Preserving Parametrization for Spherical Rectangles".
//!
//! The normals of the four edge planes have two nonzero components each and are written out,
//! so that nothing cancels in them. The solid angle is that of two triangles by Van Oosterom
//! and Strackee (1983), multiplied as complex numbers, since the paper's sum of four angles
//! loses small ones. Below [`LEAST_ANGLE`], where errors of the angles in f32 would move the
//! samples, points are uniform over the area.

use super::place::{IN_PLANE, Place, narrow};
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::elementary::{acos, atan2, sin_cos_turns};
use lanecast_numerics::math::lanes::Lanes;
use std::f32::consts::{PI, TAU};

/// The least solid angle that is sampled as such, in steradians.
const LEAST_ANGLE: f32 = 1e-3;

/// A rectangle as seen from points, one a lane; lengths in units of the farthest corner's
/// greatest coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Seen<L> {
    /// The rectangle's interval along its edges, relative to the point's projection.
    x: [L; 2],
    y: [L; 2],
    /// The distance of the plane, ≥ 0.
    z: L,
    /// The solid angle in steradians, ≥ 0; 0 in the rectangle's plane.
    pub angle: L,
}

impl<L: Lanes<Scalar = f32>> Seen<L> {
    /// Looks at rectangles from the points that they are relative to.
    #[inline(always)]
    pub fn of(place: &Place<L>) -> Seen<L> {
        let zero = L::Double::splat(0.0);
        let o = place.origin;
        let (x0, y0, z) = (o.dot(place.u), o.dot(place.v), o.dot(place.n).abs());
        let (x1, y1) = (x0 + place.s, y0 + place.t);
        let far = Vec3::new(
            Lanes::max(x0.abs(), x1.abs()),
            Lanes::max(y0.abs(), y1.abs()),
            Lanes::max(z, L::Double::splat(1e-300)),
        );
        let unit = L::Double::splat(1.0) / far.max_abs();
        let low = narrow::<L>(Vec3::new(x0, y0, z) * unit);
        let high = narrow::<L>(Vec3::new(x1, y1, zero) * unit);
        let size = narrow::<L>(Vec3::new(place.s, place.t, zero) * unit);
        let (x, y, z) = ([low.x, high.x], [low.y, high.y], low.z);
        // Written out: closures that look into arrays of registers are not inlined.
        let corners = [
            Vec3::new(low.x, low.y, z),
            Vec3::new(high.x, low.y, z),
            Vec3::new(high.x, high.y, z),
            Vec3::new(low.x, high.y, z),
        ];
        let lengths = corners.map(Vec3::length);
        let volume = z * size.x * size.y;
        let across = corners[0].dot(corners[2]);
        // tan(Ω/2) = volume / base for each of the two triangles.
        let base = |k: usize| {
            let [near, far] = [corners[0].dot(corners[k]), corners[k].dot(corners[2])];
            let all = lengths[0] * lengths[k] * lengths[2];
            all + near * lengths[2] + far * lengths[0] + across * lengths[k]
        };
        let (b, c) = (base(1), base(3));
        let half = atan2(volume * (b + c), b * c - volume * volume);
        let angle = L::splat(2.0) * half.abs();
        let off_plane = z.gt(L::splat(IN_PLANE));
        Seen {
            x,
            y,
            z,
            angle: L::select(off_plane, angle, L::zero()),
        }
    }

    /// Returns the density of [`Seen::sample`] over solid angle for a point of the rectangle
    /// in direction `dir`, of any length: the point lies at its end.
    #[inline(always)]
    pub fn pdf(&self, place: &Place<L>, dir: Vec3<L::Double>) -> L {
        let by_area = area_pdf::<L>(dir, place.n, place.s * place.t);
        L::select(self.by_angle(), L::splat(1.0) / self.angle, by_area)
    }

    #[inline(always)]
    fn by_angle(&self) -> L::Mask {
        self.angle.ge(L::splat(LEAST_ANGLE))
    }

    /// Maps points of the unit square to fractions of the rectangle's edges, in [0, 1].
    #[inline(always)]
    pub fn sample(&self, u: [L; 2]) -> [L; 2] {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let least = L::splat(1e-30);
        let by_angle = self.by_angle();
        if !lanecast_numerics::math::lanes::Mask::any(by_angle) {
            return u;
        }
        let (x, y, z) = (self.x, self.y, self.z);
        let square = z * z;
        // Components along z of the normals of the planes through the edges.
        let slope = |x: L| x / Lanes::max((x * x + square).sqrt(), least);
        let (x0, y0, y1) = (slope(x[0]), slope(y[0]), slope(y[1]));
        let cut = |x: L| Lanes::max(Lanes::min(x, one), -one);
        let start = L::splat(PI) + acos(cut(x0 * y0)) - acos(cut(x0 * y1));
        let turn = (start + u[0] * self.angle) * L::splat(1.0 / TAU);
        let (sin, cos) = sin_cos_turns(Lanes::max(Lanes::min(turn, one), zero));
        // The strip's edge: cot of its azimuth is rise/√(…) (the paper's c_u without the
        // differences from 1).
        let rise = -(cos * y0) - y1;
        let flat = square / Lanes::max(y[0] * y[0] + square, least);
        let root = Lanes::max(rise * rise - flat * sin * sin, least).sqrt();
        let side = L::select(rise.lt(zero), -sin, sin);
        let at = Lanes::max(Lanes::min(z * side / root, x[1]), x[0]);
        // Along the strip the solid angle grows as the sine of the elevation.
        let near = at * at + square;
        let height = |y: L| y / Lanes::max((near + y * y).sqrt(), least);
        let (low, high) = (height(y[0]), height(y[1]));
        let h = low + u[1] * (high - low);
        let up = h * (near / Lanes::max(one - h * h, least)).sqrt();
        let up = Lanes::max(Lanes::min(up, y[1]), y[0]);
        let fraction = |at: L, [low, high]: [L; 2], u: L| {
            let within = (at - low) / Lanes::max(high - low, least);
            let within = Lanes::max(Lanes::min(within, one), zero);
            L::select(by_angle, within, u)
        };
        [fraction(at, x, u[0]), fraction(up, y, u[1])]
    }
}

/// Returns the density over solid angle of points uniform over a flat area with this unit
/// normal, for the point at the end of `dir`; infinite in the plane.
#[inline(always)]
pub fn area_pdf<L: Lanes<Scalar = f32>>(
    dir: Vec3<L::Double>,
    normal: Vec3<L::Double>,
    area: L::Double,
) -> L {
    let square = dir.length_squared();
    L::narrow(square * square.sqrt() / (dir.dot(normal).abs() * area))
}
