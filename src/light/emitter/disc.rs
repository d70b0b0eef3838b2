//! Discs, sampled uniformly over their area where they are small, and else uniformly over the
//! solid angle of the square around them: near a wide disc the density over its area is that of
//! a few points that bring all the light. Of the square's samples one in five or fewer misses
//! the disc, and brings nothing.

use super::place::Place;
use super::rectangle;
use crate::sampling::concentric_disc;
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::lanes::Lanes;
use std::f64::consts::PI;

/// The solid angle of the square, in steradians, from which on it is sampled.
const WIDE: f32 = 1.0;

/// A disc as seen from points, one a lane.
struct Seen<L: Lanes> {
    square: Place<L>,
    seen: rectangle::Seen<L>,
    wide: L::Mask,
}

impl<L: Lanes<Scalar = f32>> Seen<L> {
    #[inline(always)]
    fn of(place: &Place<L>) -> Seen<L> {
        let two = L::Double::splat(2.0);
        let square = Place {
            origin: place.origin - (place.u + place.v) * place.s,
            s: place.s * two,
            t: place.s * two,
            ..*place
        };
        let seen = rectangle::Seen::of(&square);
        Seen {
            square,
            seen,
            wide: seen.angle.ge(L::splat(WIDE)),
        }
    }

    #[inline(always)]
    fn pdf(&self, place: &Place<L>, dir: Vec3<L::Double>) -> L {
        let area = place.s * place.s * L::Double::splat(PI);
        let by_area = rectangle::area_pdf::<L>(dir, place.n, area);
        L::select(self.wide, self.seen.pdf(&self.square, dir), by_area)
    }
}

/// Returns the density of [`sample`] over solid angle for points of discs at the ends of `dir`.
#[inline(always)]
pub fn pdf<L: Lanes<Scalar = f32>>(place: &Place<L>, dir: Vec3<L::Double>) -> L {
    Seen::of(place).pdf(place, dir)
}

/// Returns vectors to points of discs, the lanes that meet these, and the densities over solid
/// angle.
#[inline(always)]
pub fn sample<L: Lanes<Scalar = f32>>(
    place: &Place<L>,
    u: [L; 2],
) -> (Vec3<L::Double>, L::Mask, L) {
    let disc = Seen::of(place);
    let wide = disc.wide;
    let [a, b] = concentric_disc(u);
    let [c, d] = disc
        .seen
        .sample(u)
        .map(|x| L::splat(2.0) * x - L::splat(1.0));
    let (a, b) = (L::select(wide, c, a), L::select(wide, d, b));
    let dir = place.origin + (place.u * a.widen() + place.v * b.widen()) * place.s;
    let within = (a * a + b * b).le(L::splat(1.0)) | !wide;
    (dir, within, disc.pdf(place, dir))
}
