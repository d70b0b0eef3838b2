//! A record of indirect light: what it is worth at a point near it.

use crate::scene::Rgb;
use glam::{DMat2, DVec2, DVec3};

/// The cosine of 45°: records serve no surfaces whose normals differ by more from theirs.
const LEAST_COSINE: f64 = 0.707;

/// Records serve no points that lie below them by more than this part of their least radius, which
/// see other things; nor points above them by the second part.
const BELOW: f64 = 0.1;
const ABOVE: f64 = 0.4;

/// Nor points farther above or below their plane than this part of their greatest radius: a disc
/// has a thinner box than a ball.
const THICK: f64 = 0.25;

/// Directions along the surface, in which a record may serve differently far.
pub const SECTORS: usize = 32;

/// A record's weight fades between these parts of the way to what stands around it.
const FADES: [f64; 2] = [0.85, 0.98];

/// Indirect light at a point, and how it changes around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IrradianceRecord {
    pub point: DVec3,
    /// The shading normal, unit.
    pub normal: DVec3,
    /// The x and y axes of the frame along the surface, unit.
    pub axes: [DVec3; 2],
    /// Irradiance over π, which is the radiance of a white surface.
    pub light: Rgb,
    /// By channel: change along the surface, and with the normal; in the frame.
    pub gradient: [DVec2; 3],
    pub turn: [DVec2; 3],
    /// The record serves points p of the frame with pᵀ·metric·p < 1.
    pub metric: DMat2,
    /// Distances from the point: what it serves goes as far as the first in all directions, but
    /// for what stands around, and nowhere beyond the second.
    pub radii: [f64; 2],
    /// The least cosine between its normal and those of the surfaces that it serves; and the
    /// distance, about a pixel's width, within which it serves more, so that the records of bumps
    /// are not more than the pixels that see them.
    pub least_cosine: f64,
    pub close: f64,
    /// One over the distance of what stands around, in the directions in which sectors begin.
    pub blocked: [f32; SECTORS],
}

impl IrradianceRecord {
    /// Returns how much the record counts at a point, from 0 to 1: it falls to 0 with distance
    /// and with the angle between normals, so that no edge of a record shows.
    pub fn weight(&self, point: DVec3, normal: DVec3) -> f64 {
        let away = point - self.point;
        let squared = away.length_squared();
        let cosine = normal.dot(self.normal);
        // Also where something is NaN.
        if !(squared < self.radii[1] * self.radii[1] && cosine > LEAST_COSINE) {
            return 0.0;
        }
        let off = away.dot(self.normal);
        if off.abs() > THICK * self.radii[1] {
            return 0.0;
        }
        let height = 0.5 * (off + away.dot(normal));
        if height < -BELOW * self.radii[0] || height > ABOVE * self.radii[0] {
            return 0.0;
        }
        let beside = self.frame(away);
        let of_radius = beside.dot(self.metric * beside);
        // Also where something is NaN.
        if !(of_radius < 1.0) {
            return 0.0;
        }
        let of_way = squared.sqrt() * self.blocked_towards(beside);
        let faded = (FADES[1] - of_way) / (FADES[1] - FADES[0]);
        let near = (1.0 - of_radius.max(0.0).sqrt()) * faded.min(1.0);
        let least = match squared < self.close * self.close {
            true => LEAST_COSINE,
            false => self.least_cosine.max(LEAST_COSINE),
        };
        let alike = 1.0 - ((1.0 - cosine).max(0.0) / (1.0 - least)).sqrt();
        near.min(alike).max(0.0)
    }

    /// Returns half of the sides of a box around what it serves.
    pub fn half_extent(&self) -> DVec3 {
        let reach = |n: f64| (1.0 - n * n).max(0.0).sqrt() + THICK * n.abs();
        // A hair more than roundings take.
        self.normal.map(reach) * (self.radii[1] * (1.0 + 1e-9))
    }

    /// Returns the light that the record tells of a point near it; it may be below 0.
    pub fn at(&self, point: DVec3, normal: DVec3) -> [f64; 3] {
        let beside = self.frame(point - self.point);
        let turned = self.frame(normal);
        std::array::from_fn(|k| {
            let change = self.gradient[k].dot(beside) + self.turn[k].dot(turned);
            f64::from(self.light[k]) + change
        })
    }

    /// Returns the farthest that it serves, from the radius and what stands around.
    pub fn extent(&self) -> f64 {
        let distance = |sector: usize| {
            let toward = sector_direction(sector);
            let squared = toward.dot(self.metric * toward);
            // A sector's widest place may be half a sector away.
            let [a, b] = [sector, (sector + 1) % SECTORS].map(|i| f64::from(self.blocked[i]));
            (1.1 / squared.sqrt()).min(FADES[1] / a.min(b))
        };
        (0..SECTORS).map(distance).fold(0.0, f64::max)
    }

    /// Takes a vector to the frame along the surface.
    fn frame(&self, vector: DVec3) -> DVec2 {
        DVec2::from(self.axes.map(|axis| vector.dot(axis)))
    }

    /// Returns one over the distance that the record serves in a direction, from its neighbours'.
    fn blocked_towards(&self, beside: DVec2) -> f64 {
        let place = diamond_angle(beside) * (SECTORS as f64 / 4.0);
        let (sector, part) = (place as usize % SECTORS, place.fract());
        let [a, b] = [sector, (sector + 1) % SECTORS].map(|i| f64::from(self.blocked[i]));
        a + (b - a) * part
    }
}

/// Returns the length of the way around the square |x| + |y| = 1, whose sides count 1, to a
/// direction: an angle from 0 to 4, without trigonometry.
fn diamond_angle(v: DVec2) -> f64 {
    let sum = v.x.abs() + v.y.abs();
    if !(sum > 0.0) {
        return 0.0;
    }
    let part = v.y / sum;
    match (v.x >= 0.0, v.y >= 0.0) {
        (true, true) => part,
        (false, _) => 2.0 - part,
        (true, false) => 4.0 + part,
    }
}

/// Returns the direction in which a sector begins, unit.
pub fn sector_direction(sector: usize) -> DVec2 {
    let side = SECTORS / 4;
    let part = (sector % side) as f64 / side as f64;
    let first = DVec2::new(1.0 - part, part).normalize();
    (0..sector / side).fold(first, |v, _| v.perp())
}

impl IrradianceRecord {
    /// Returns the sector that a direction of the frame lies in.
    pub fn sector_of(beside: DVec2) -> usize {
        (diamond_angle(beside) * (SECTORS as f64 / 4.0)) as usize % SECTORS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sectors_begin_where_their_directions_say() {
        for sector in 0..SECTORS {
            let toward = sector_direction(sector);
            assert!((toward.length() - 1.0).abs() < 1e-12);
            let angle = diamond_angle(toward) * (SECTORS as f64 / 4.0);
            assert!((angle - sector as f64).abs() < 1e-9, "{sector} {angle}");
        }
        let turned = |degrees: f64| DVec2::from_angle(degrees.to_radians());
        let all: Vec<f64> = (1..360).map(|d| diamond_angle(turned(d.into()))).collect();
        assert!(all.is_sorted() && all[0] > 0.0 && all[358] < 4.0);
    }
}
