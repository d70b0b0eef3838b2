//! The probability with which an emitter is chosen at a point: its share of all importances,
//! each a bound of the irradiance that it may bring (Conty Estevez and Kulla 2018).

use super::{Emitter, Kind};
use glam::DVec3;

/// The largest importance, and the reciprocal of the least squared distance.
const MOST: f64 = 1e30;

/// The least share of what is infinitely far, and of what is not, where both bring light.
const LEAST_SHARE: f64 = 0.25;

/// A point that is lit; the normal is zero if light counts from both sides.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    pub point: DVec3,
    pub normal: DVec3,
}

/// Returns the greatest cosine to an axis within an angle (of which sine and cosine are given)
/// of a direction with the cosine `cos` to it.
fn turned(cos: f64, (sin_of, cos_of): (f64, f64)) -> f64 {
    match cos >= cos_of {
        true => 1.0,
        false => (cos * cos_of + (1.0 - cos * cos).max(0.0).sqrt() * sin_of).max(0.0),
    }
}

impl Receiver {
    fn is_one_sided(&self) -> bool {
        self.normal != DVec3::ZERO
    }

    /// The importance of an emitter with a place.
    pub fn importance(&self, emitter: &Emitter) -> f64 {
        let bounds = &emitter.bounds;
        let to = bounds.center - self.point;
        let square = to.length_squared().clamp(1.0 / MOST, MOST);
        let near = (bounds.radius * bounds.radius).min(MOST);
        let within = near >= square;
        let sin2 = (near / square).min(1.0);
        let cone = (sin2.sqrt(), (1.0 - sin2).sqrt());
        let dir = to / square.sqrt();
        let greatest = |cos: f64| if within { 1.0 } else { turned(cos, cone) };
        let surface = match self.is_one_sided() {
            true => greatest(dir.dot(self.normal)),
            false => 1.0,
        };
        let decrease = 1.0 / square.max(near);
        let cos = dir.dot(bounds.axis);
        let lit = match emitter.kind {
            Kind::Triangle(_) | Kind::Rectangle(_) => decrease * greatest(cos.abs()),
            Kind::Lamp {
                ramp: Some(ramp), ..
            } => {
                let [slope, start] = ramp;
                // 1e-3 is the model's allowance for narrow cones.
                let ramp = (start - cos * slope + 1e-3).clamp(0.0, 1.0);
                decrease * ramp * ramp
            }
            Kind::Lamp { constant: true, .. } => 1.0,
            _ => decrease,
        };
        (bounds.power * surface * lit).min(MOST)
    }

    /// The importance of a disc in the sky: its irradiance times the greatest cosine.
    pub fn of_sun(&self, towards: DVec3, versine: f64, irradiance: f64) -> f64 {
        if !self.is_one_sided() {
            return irradiance;
        }
        if versine >= 1.0 {
            return irradiance;
        }
        let sin2 = versine * (2.0 - versine);
        let cone = (sin2.sqrt(), (1.0 - sin2).sqrt());
        irradiance * turned(self.normal.dot(towards), cone)
    }
}

/// Importances at a point.
#[derive(Clone, Debug)]
pub struct Chances {
    near: Vec<f64>,
    far: Vec<f64>,
    far_share: f64,
}

impl Chances {
    /// Weighs emitters with a place and those infinitely far. One alone needs no weight.
    pub fn new(near: Vec<f64>, far: Vec<f64>) -> Chances {
        let near = match (near.len(), far.len()) {
            (1, 0) => vec![1.0],
            _ => near,
        };
        let [near_sum, far_sum] = [&near, &far].map(|all| all.iter().sum::<f64>());
        let far_share = match (near_sum > 0.0, far_sum > 0.0) {
            (true, true) => (far_sum / (far_sum + near_sum)).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE),
            (false, true) => 1.0,
            _ => 0.0,
        };
        Chances {
            near,
            far,
            far_share,
        }
    }

    /// The probability of an emitter with a place.
    pub fn of_near(&self, k: usize) -> f64 {
        let sum: f64 = self.near.iter().sum();
        match self.near[k] > 0.0 {
            true => self.near[k] / sum * (1.0 - self.far_share),
            false => 0.0,
        }
    }

    /// The probability of one infinitely far: half by importance, half evenly.
    pub fn of_far(&self, k: usize) -> f64 {
        let sum: f64 = self.far.iter().sum();
        let count = self.far.iter().filter(|x| **x > 0.0).count() as f64;
        match self.far[k] > 0.0 {
            true => 0.5 * (self.far[k] / sum + 1.0 / count) * self.far_share,
            false => 0.0,
        }
    }

    /// Picks by a number in [0, 1): what is far first, then what has a place, each in the
    /// order of the list.
    pub fn pick(&self, number: f64) -> Option<(Pick, f64)> {
        let all = (0..self.far.len())
            .map(|k| (Pick::Far(k), self.of_far(k)))
            .chain((0..self.near.len()).map(|k| (Pick::Near(k), self.of_near(k))));
        let mut before = 0.0;
        let mut last = None;
        for (pick, chance) in all.filter(|(_, chance)| *chance > 0.0) {
            last = Some((pick, chance));
            before += chance;
            if number < before {
                break;
            }
        }
        last
    }
}

/// One of the emitters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pick {
    Near(usize),
    Far(usize),
}
