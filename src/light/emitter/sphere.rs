//! Spheres, sampled uniformly over the cone that they subtend (Shirley, Wang and Zimmerman
//! 1996), or over their area from inside.
//!
//! Everything is in f64 but the sine and cosine of the azimuth, and 1 − cos of the cone is
//! sin²/(1 + cos), so spheres of 10⁻¹⁰ radians keep their shape, and points a hair above the
//! surface their cone.

use super::place::Place;
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::elementary::sin_cos_turns;
use lanecast_numerics::math::lanes::Lanes;
use std::f64::consts::{PI, TAU};

/// A sphere as seen from points, one a lane.
#[derive(Clone, Copy, Debug)]
pub struct Seen<L: Lanes> {
    pub inside: <L::Double as Lanes>::Mask,
    /// The squared distance of the centre.
    square: L::Double,
    /// The squared sine of the cone's half angle, at most 1.
    pub sin_squared: L::Double,
    /// 1 − cos of the cone's half angle, in [0, 1].
    versine: L::Double,
}

impl<L: Lanes<Scalar = f32>> Seen<L> {
    /// Looks at spheres from the points that they are relative to.
    #[inline(always)]
    pub fn of(place: &Place<L>) -> Seen<L> {
        let one = L::Double::splat(1.0);
        let radius_squared = place.s * place.s;
        let square = Lanes::max(place.origin.length_squared(), least::<L>());
        let sin_squared = Lanes::min(radius_squared / square, one);
        // Not 1 − sin², which would lose the height of points near the surface.
        let cos_squared = Lanes::max(square - radius_squared, L::Double::splat(0.0)) / square;
        Seen {
            inside: square.lt(radius_squared),
            square,
            sin_squared,
            versine: sin_squared / (one + cos_squared.sqrt()),
        }
    }

    /// Returns the density of [`Seen::sample`] over solid angle for a point of the sphere at
    /// the end of `dir`.
    #[inline(always)]
    pub fn pdf(&self, place: &Place<L>, dir: Vec3<L::Double>) -> L {
        let cone = L::Double::splat(1.0 / TAU) / Lanes::max(self.versine, least::<L>());
        // |dir|³/(4πr² |dir·n|) with the normal n = (dir − centre)/r.
        let square = dir.length_squared();
        let slope = dir.dot(dir - place.origin).abs();
        let area = square * square.sqrt() / (L::Double::splat(4.0 * PI) * place.s * slope);
        L::narrow(L::Double::select(self.inside, area, cone))
    }

    /// Maps points of the unit square to vectors that end on the sphere. From outside they
    /// end at most 2⁻²⁴ of the distance before its surface, and never behind it.
    #[inline(always)]
    pub fn sample(&self, place: &Place<L>, u: [L; 2]) -> Vec3<L::Double> {
        let [zero, one, two] = [0.0, 1.0, 2.0].map(L::Double::splat);
        let (sin, cos) = sin_cos_turns(u[1]);
        let (sin, cos) = (sin.widen(), cos.widen());
        // From inside: uniform over directions from the centre.
        let versine = u[0].widen() * L::Double::select(self.inside, two, self.versine);
        let sin_squared = versine * (two - versine);
        let radial = sin_squared.sqrt();
        let distance = self.square.sqrt();
        // In the centre any axis will do.
        let up = Vec3::new(zero, zero, one);
        let central = distance.le(L::Double::splat(1e-140));
        let axis = Vec3::select(central, up, place.origin * (one / distance));
        let [x, y] = tangents::<L>(axis);
        let along = one - versine;
        let dir = x * (radial * cos) + y * (radial * sin) + axis * along;
        // The nearer of the two crossings; the term 2⁻⁵⁰ covers rounding, so that the point
        // lies before the crossing also where the direction grazes the sphere.
        let inner = place.s * place.s - self.square * sin_squared;
        let rounding = self.square * L::Double::splat(f64::EPSILON * 4.0);
        let reach = distance * along - (Lanes::max(inner, zero) + rounding).sqrt();
        let from_outside = dir * Lanes::max(reach, zero);
        let from_inside = place.origin + dir * place.s;
        Vec3::select(self.inside, from_inside, from_outside)
    }
}

/// Returns two unit vectors at right angles to a unit vector and to each other: Duff et al.
/// 2017, "Building an Orthonormal Basis, Revisited".
#[inline(always)]
pub fn tangents<L: Lanes>(n: Vec3<L::Double>) -> [Vec3<L::Double>; 2] {
    let (zero, one) = (L::Double::splat(0.0), L::Double::splat(1.0));
    let sign = L::Double::select(n.z.lt(zero), -one, one);
    let a = -(one / (sign + n.z));
    let b = n.x * n.y * a;
    [
        Vec3::new(one + sign * n.x * n.x * a, sign * b, -(sign * n.x)),
        Vec3::new(b, sign + n.y * n.y * a, -n.y),
    ]
}

/// The least divisor.
#[inline(always)]
fn least<L: Lanes>() -> L::Double {
    L::Double::splat(1e-300)
}
