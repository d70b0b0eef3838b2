//! Lights without a body, and the environment. Shapes of an emissive material are lights, too,
//! and stand in no table.

use super::materials::Rgb;
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    Point {
        /// The position in world space.
        position: DVec3,
        /// The radiant intensity in W/sr; with [`Falloff::None`] the irradiance at any
        /// distance, in W/m².
        intensity: Rgb,
        falloff: Falloff,
        /// The radius of a ball that shines instead of the point and softens shadows, in world
        /// units; 0 for a point.
        radius: f64,
    },
    Spot {
        /// The position in world space.
        position: DVec3,
        /// The axis of the cone, in which the light travels, of any length > 0.
        direction: DVec3,
        /// The radiant intensity along the axis, in W/sr.
        intensity: Rgb,
        /// Half the angles of the cones of full light and of any light, in radians; the first
        /// is the smaller, and the second at most π/2.
        inner: f64,
        outer: f64,
        /// As of a point light.
        radius: f64,
    },
    Directional {
        /// The direction in which the light travels, in world space, of any length > 0.
        direction: DVec3,
        /// The irradiance on a surface that faces the light, in W/m².
        irradiance: Rgb,
        /// Half the angle that the light's disc subtends in the sky, in radians; 0 for none.
        angle: f64,
    },
    /// A rectangle that shines as Lambert's law says, and that camera rays do not see.
    Rectangle {
        center: DVec3,
        /// Whole edges in world space, at right angles; the light shines along u × v.
        edges: [DVec3; 2],
        /// The radiance in W/(sr·m²).
        radiance: Rgb,
        /// Whether it shines on its other side as well.
        two_sided: bool,
    },
    /// A disc that shines as Lambert's law says, and that camera rays do not see.
    Disc {
        center: DVec3,
        /// The direction in which it shines, of any length > 0.
        normal: DVec3,
        radius: f64,
        /// The radiance in W/(sr·m²).
        radiance: Rgb,
        /// Whether it shines on its other side as well.
        two_sided: bool,
    },
}

impl Light {
    /// Returns the middle of a light that has a place.
    pub fn position(&self) -> Option<DVec3> {
        match *self {
            Light::Point { position, .. } | Light::Spot { position, .. } => Some(position),
            Light::Rectangle { center, .. } | Light::Disc { center, .. } => Some(center),
            Light::Directional { .. } => None,
        }
    }

    /// Returns the area, 0 of lights that are none.
    pub fn area(&self) -> f64 {
        match *self {
            Light::Rectangle { edges: [u, v], .. } => u.cross(v).length(),
            Light::Disc { radius, .. } => PI * radius * radius,
            _ => 0.0,
        }
    }

    /// Returns the radiant intensity, in W/sr, of a point that radiates the power of a
    /// rectangle or disc evenly to all sides: πAL over 4π for each side that shines.
    pub fn mean_intensity(&self) -> Rgb {
        match *self {
            Light::Rectangle {
                radiance,
                two_sided,
                ..
            }
            | Light::Disc {
                radiance,
                two_sided,
                ..
            } => {
                let share = if two_sided { 0.5 } else { 0.25 };
                radiance.map(|c| (f64::from(c) * self.area() * share) as f32)
            }
            _ => [0.0; 3],
        }
    }
}

/// The decrease of a point light with distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Falloff {
    InverseSquare,
    /// No decrease, for formats whose lights have none (NFF, POV SDL).
    None,
}

/// A map of the radiance from all directions, at infinite distance: longitude by latitude.
///
/// Direction (x, y, z), y up, lies in the map at column (½ + atan2(x, −z)/2π)·width and row
/// acos(y)/π·height, from the left upper corner: the middle column is −z, as in glTF viewers.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    pub width: u32,
    pub height: u32,
    /// Radiance in W/(sr·m²), linear Rec. 709, row by row from the zenith.
    pub pixels: Arc<[Rgb]>,
    /// The turn of the map about +y in radians: from −z at the middle towards −x.
    pub rotation: f64,
    /// A factor of all radiance.
    pub scale: Rgb,
}

impl Environment {
    /// Makes the sky that has one radiance in all directions, in W/(sr·m²).
    pub fn uniform(radiance: Rgb) -> Environment {
        Environment {
            width: 1,
            height: 1,
            pixels: Arc::new([radiance]),
            rotation: 0.0,
            scale: [1.0; 3],
        }
    }

    /// Returns the radiance of a sky that has one in all directions.
    pub fn uniform_radiance(&self) -> Option<Rgb> {
        match *self.pixels {
            [radiance] => Some(std::array::from_fn(|k| radiance[k] * self.scale[k])),
            _ => None,
        }
    }

    /// Returns the radiance of a white matte surface of a normal, unit, that nothing hides from
    /// the map; the map's rotation is left out.
    pub fn radiance_of_white(&self, normal: DVec3) -> [f64; 3] {
        if let Some(radiance) = self.uniform_radiance() {
            return radiance.map(f64::from);
        }
        let (height, width) = (f64::from(self.height), f64::from(self.width));
        let mut sum = [0.0; 3];
        for row in 0..self.height {
            let (sin, y) = libm::sincos((f64::from(row) + 0.5) / height * PI);
            let area = sin * (PI / height) * (2.0 * PI / width);
            for column in 0..self.width {
                let (x, z) = libm::sincos(((f64::from(column) + 0.5) / width - 0.5) * 2.0 * PI);
                let towards = DVec3::new(sin * x, y, -sin * z);
                let share = towards.dot(normal).max(0.0) * area / PI;
                let pixel = self.pixels[(row * self.width + column) as usize];
                for k in 0..3 {
                    sum[k] += f64::from(pixel[k] * self.scale[k]) * share;
                }
            }
        }
        sum
    }

    /// Returns the bytes of the map.
    pub fn bytes(&self) -> usize {
        self.pixels.len() * size_of::<Rgb>()
    }
}
