//! Importances: how much light an emitter may bring to a point, without visibility.
//!
//! An importance is a bound, up to a factor near 1, of the irradiance in W/m² (mean of the
//! three channels): power over squared distance, times the greatest cosine at the surface and
//! at the emitter over the sphere that bounds it (pbrt 4, section 12.6.3, in the formula of
//! Conty Estevez and Kulla 2018). It is 0 only where no light can arrive. The exact emitter
//! takes part where it is cheap: a spot light's fade, and light without falloff.

use super::place::narrow;
use super::tree::Point;
use lanecast_numerics::math::Vec3;
use lanecast_numerics::math::lanes::{Lanes, Mask};

/// The greatest importance and squared distance, so that sums stay finite.
pub const MOST: f32 = 1e30;

/// What an importance needs to know of an emitter with a place.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub center: [f64; 3],
    /// The radius of a ball about the centre that contains the emitter.
    pub radius: f64,
    /// Unit normal of flat emitters, axis of spot lights; zero for all others.
    pub axis: [f32; 3],
    /// Radiance times area, area of the disc for spheres; intensity for lights without body.
    pub power: f32,
    pub facing: Facing,
}

/// How an emitter's light depends on the direction from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Facing {
    All,
    /// As the cosine to its axis, on both sides.
    Flat,
    /// As the cosine to its axis, on that side alone.
    Front,
    /// As the square of `slope`·cos + `start`, cut to [0, 1].
    Spot {
        slope: f32,
        start: f32,
    },
    /// No decrease with distance either.
    Everywhere,
}

/// A surface that is lit; the normal is zero if light counts from both sides.
#[derive(Clone, Copy, Debug)]
pub struct Receiver<L: Lanes> {
    pub point: Vec3<L::Double>,
    pub normal: Vec3<L>,
    one_sided: L::Mask,
}

impl<L: Lanes<Scalar = f32>> Receiver<L> {
    #[inline(always)]
    pub fn new(point: Vec3<L::Double>, normal: Vec3<L>) -> Receiver<L> {
        Receiver {
            point,
            normal,
            one_sided: normal.length_squared().gt(L::zero()),
        }
    }

    /// Returns the point and normal of a lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> Point {
        let (at, n) = (self.point, self.normal);
        Point {
            at: [at.x.lane(lane), at.y.lane(lane), at.z.lane(lane)],
            normal: [n.x.lane(lane), n.y.lane(lane), n.z.lane(lane)],
        }
    }

    /// Returns the importance of an emitter.
    #[inline(always)]
    pub fn importance(&self, bounds: &Bounds) -> L {
        let (zero, one) = (L::zero(), L::splat(1.0));
        let wide = Vec3::<L::Double>::splat(bounds.center) - self.point;
        // In f32 a point on a shining ball would lie in it or not by chance, and so waste its
        // samples on what is below its own horizon.
        let reach = L::Double::splat(bounds.radius * bounds.radius);
        let inside = L::Mask::from_bits(wide.length_squared().le(reach).bits());
        let to = narrow::<L>(wide);
        let radius = L::splat(bounds.radius as f32);
        let square = to
            .length_squared()
            .max(L::splat(1.0 / MOST))
            .min(L::splat(MOST));
        let near = (radius * radius).min(L::splat(MOST));
        let cone = Cone::new((near / square).min(one), inside);
        let nearness = one / square.sqrt();
        let surface = L::select(
            self.one_sided,
            cone.cosine(to.dot(self.normal) * nearness),
            one,
        );
        let axis = || to.dot(Vec3::splat(bounds.axis)) * nearness;
        let power = L::splat(bounds.power);
        // Nearer than its own radius no emitter is brighter than there.
        let decrease = one / square.max(near);
        let lit = match bounds.facing {
            Facing::All => decrease,
            Facing::Flat => decrease * cone.cosine(axis().abs()),
            Facing::Front => decrease * cone.cosine(-axis()),
            Facing::Spot { slope, start } => {
                // The addend covers what f32 loses in narrow cones.
                let ramp = L::splat(start) - axis() * L::splat(slope) + L::splat(1e-3);
                let ramp = ramp.max(zero).min(one);
                decrease * ramp * ramp
            }
            Facing::Everywhere => one,
        };
        (power * surface * lit).min(L::splat(MOST))
    }

    /// Returns the importance of a disc in the sky: its irradiance times the greatest cosine.
    /// `versine` is 1 − cos of its half angle.
    #[inline(always)]
    pub fn of_sun(&self, towards: [f32; 3], versine: f32, irradiance: f32) -> L {
        let sin_squared = versine * (2.0 - versine);
        let cone = Cone::new(
            L::splat(sin_squared.min(1.0)),
            <L::Mask as Mask>::splat(versine >= 1.0),
        );
        let cosine = cone.cosine(self.normal.dot(Vec3::splat(towards)));
        L::splat(irradiance) * L::select(self.one_sided, cosine, L::splat(1.0))
    }
}

/// The cone of directions to a ball.
#[derive(Clone, Copy, Debug)]
struct Cone<L: Lanes> {
    sin: L,
    cos: L,
    everywhere: L::Mask,
}

impl<L: Lanes<Scalar = f32>> Cone<L> {
    #[inline(always)]
    fn new(sin_squared: L, everywhere: L::Mask) -> Cone<L> {
        Cone {
            sin: sin_squared.sqrt(),
            cos: (L::splat(1.0) - sin_squared).max(L::zero()).sqrt(),
            everywhere,
        }
    }

    /// Returns the greatest cosine ≥ 0 to an axis in the cone about a direction whose cosine
    /// to the axis is `cos`.
    #[inline(always)]
    fn cosine(&self, cos: L) -> L {
        let one = L::splat(1.0);
        let sin = (one - cos * cos).max(L::zero()).sqrt();
        let turned = (cos * self.cos + sin * self.sin).max(L::zero());
        L::select(cos.ge(self.cos) | self.everywhere, one, turned)
    }
}
