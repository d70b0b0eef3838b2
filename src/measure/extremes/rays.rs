//! A seeded generator, and the rays of the sweeps.

use glam::DVec3;
use lanecast_engine::trace::BEAM;
use lanecast_numerics::math::unit;
use lanecast_picture::render::mix;

/// A world ray as it is traced; hits count where 0 < t < t_max.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SweepRay {
    pub org: [f64; 3],
    pub dir: [f64; 3],
    pub t_max: f32,
}

/// Vigna's SplitMix64 generator.
pub struct Random(pub u64);

impl Random {
    /// Returns a number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        let bits = mix(self.0);
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (bits >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.unit()
    }

    pub fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f64) as usize).min(n - 1)
    }

    /// Returns a uniformly distributed unit direction (Archimedes: its height is
    /// uniform).
    pub fn direction(&mut self) -> DVec3 {
        let z = self.between(-1.0, 1.0);
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * self.unit());
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }

    /// Returns a uniformly distributed point of the unit ball.
    pub fn in_ball(&mut self) -> DVec3 {
        loop {
            let p = DVec3::from_array([(); 3].map(|()| self.between(-1.0, 1.0)));
            if p.length_squared() <= 1.0 {
                return p;
            }
        }
    }
}

/// Returns t_max: for a quarter of the rays near the target at t = `distance`, else
/// infinity.
pub fn end(distance: f64, random: &mut Random) -> f32 {
    if random.below(4) > 0 {
        return f32::INFINITY;
    }
    (distance * random.between(0.5, 1.5)) as f32
}

/// Returns the ray of this direction that meets `target` at t = `distance`. The origin
/// is f64, so the aim has f64 accuracy.
pub fn through(target: DVec3, dir: [f64; 3], distance: f64, random: &mut Random) -> SweepRay {
    let org = target - DVec3::from_array(dir) * distance;
    SweepRay {
        org: org.to_array(),
        dir,
        t_max: end(distance, random),
    }
}

/// Aims rays at random targets from about `distance` away. The rays of the first half
/// share one eye per tile, as camera rays do, with directions rounded to f32; each ray
/// of the other half has the origin that f64 arithmetic requires.
pub fn at_targets(
    count: usize,
    distance: f64,
    random: &mut Random,
    mut target: impl FnMut(&mut Random) -> DVec3,
) -> Vec<SweepRay> {
    let mut rays = Vec::with_capacity(count);
    let mut eye = DVec3::ZERO;
    for i in 0..count {
        let at = target(random);
        if i >= count / 2 {
            let away = distance * random.between(0.5, 1.5);
            let dir = random.direction().to_array();
            rays.push(through(at, dir, away, random));
            continue;
        }
        if i.is_multiple_of(BEAM) {
            eye = at + random.direction() * distance;
        }
        let dir = unit(at - eye);
        rays.push(SweepRay {
            org: eye.to_array(),
            dir: dir.to_array(),
            t_max: end((at - eye).dot(dir), random),
        });
    }
    rays
}
