//! What shines, as types of the native scene format ([`schema`](super::schema)).

use super::schema::{Color, Scale, Triple};
use super::source_spans::At;
use schemars::JsonSchema;
use serde::Deserialize;

/// The radiance from all directions, which lights the scene and shows where a ray meets nothing,
/// in place of the background: a picture, or one colour.
///
/// The picture is longitude by latitude, its top row the zenith, +y; its middle column shows
/// what lies towards -z, and its right half what lies towards +x.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Environment {
    /// A picture (.exr, .hdr, .png), relative to this file. Numbers are W/(sr·m²), linear Rec. 709;
    /// of a .png those of sRGB, from 0 to 1.
    pub file: Option<At<String>>,
    /// The same radiance from everywhere, in W/(sr·m²).
    pub color: Option<At<Color>>,
    /// Degrees to turn the picture about +y, counter-clockwise seen from above; 0 if absent.
    pub rotate_y: Option<f64>,
    /// A factor of the radiance, or one for each of red, green and blue, 0 or greater; 1 if
    /// absent.
    pub scale: Option<At<Scale>>,
}

/// A clear sky by day (Preetham 1999), and its sun as a light, in W/(sr·m²): some hundred times
/// brighter than a scene of ordinary numbers.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sky {
    /// The direction towards the sun, of any length but 0; not below the horizon.
    pub sun_direction: At<Triple>,
    /// How hazy the air is, from 1.7 (as clear as air can be) to 10; 3 if absent.
    pub turbidity: Option<At<f64>>,
    /// The colour of the ground below the horizon; 0.3 grey if absent.
    pub ground: Option<Color>,
    /// A factor of the radiance and of the sun, or one for each of red, green and blue, 0 or greater;
    /// 1 if absent.
    pub scale: Option<At<Scale>>,
}

/// A light; exactly one kind.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Light {
    pub point: Option<PointLight>,
    pub spot: Option<SpotLight>,
    pub directional: Option<DirectionalLight>,
    pub rectangle: Option<RectangleLight>,
    pub disc: Option<DiscLight>,
    pub sphere: Option<SphereLight>,
    /// At most one of a scene, or one sky.
    pub environment: Option<At<Environment>>,
    /// At most one of a scene, or one environment.
    pub sky: Option<At<Sky>>,
    /// The group of lights that it belongs to, for `render --aov light_groups`: letters, digits,
    /// - and _; none if absent.
    pub name: Option<At<String>>,
    /// Keys of a light that moves, which is as above at time 0; from key to key all goes straight.
    pub motion: Option<At<Vec<At<LightKey>>>>,
}

/// A light that shines from one point to all sides.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PointLight {
    pub position: Triple,
    /// W/sr; with `falloff = "none"` the irradiance at any distance, W/m².
    pub intensity: Color,
    /// How it fades with distance; `inverse_square` if absent.
    pub falloff: Option<Falloff>,
    /// Radius of a ball in place of the point, which softens shadows; 0 if absent.
    pub radius: Option<f64>,
}

/// A light that shines from one point into a cone.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpotLight {
    pub position: Triple,
    /// The way the light travels along the cone's axis, of any length but 0.
    pub direction: At<Triple>,
    /// Along the axis, W/sr.
    pub intensity: Color,
    /// Degrees from the axis within which all of the intensity shines; 0 if absent.
    pub inner: Option<f64>,
    /// Degrees from the axis to where the light ends, up to 90; it fades from `inner` on.
    pub outer: f64,
    /// Radius of a ball in place of the point, which softens shadows; 0 if absent.
    pub radius: Option<f64>,
}

/// How a point light fades with distance.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Falloff {
    InverseSquare,
    None,
}

/// A light from infinitely far away.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DirectionalLight {
    /// The way the light travels, of any length but 0.
    pub direction: At<Triple>,
    /// On a surface that faces it, W/m².
    pub irradiance: Color,
    /// Degrees across the light's disc in the sky, as 0.53 for the sun; 0 if absent.
    pub angle: Option<f64>,
}

/// A rectangle that shines, and that is only seen mirrored.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RectangleLight {
    pub center: Triple,
    /// A whole edge; the light shines along edge_u × edge_v.
    pub edge_u: Triple,
    /// The other whole edge, at a right angle to the first.
    pub edge_v: Triple,
    /// W/(sr·m²).
    pub radiance: Color,
    /// Shines on both sides; false if absent.
    pub two_sided: Option<bool>,
}

/// A disc that shines, and that is only seen mirrored.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiscLight {
    pub center: Triple,
    /// The way it shines, of any length but 0.
    pub normal: At<Triple>,
    /// Greater than 0.
    pub radius: At<f64>,
    /// W/(sr·m²).
    pub radiance: Color,
    /// Shines on both sides; false if absent.
    pub two_sided: Option<bool>,
}

/// A ball that shines, and that no ray meets.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SphereLight {
    pub center: Triple,
    /// Greater than 0.
    pub radius: At<f64>,
    /// W/(sr·m²).
    pub radiance: Color,
}

/// What a light is like at a time; what is absent is as at the key before.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LightKey {
    /// Above 0 and the key before, at most 1.
    pub at: At<f64>,
    /// The position of a point or spot light, or the center of a rectangle, disc or sphere.
    pub position: Option<Triple>,
    /// The direction of a spot or directional light, or the normal of a disc; not 0.
    pub direction: Option<At<Triple>>,
    /// The intensity of a point or spot light, the irradiance of a directional one, the radiance
    /// of a rectangle, disc or sphere.
    pub color: Option<Color>,
    /// The edges of a rectangle, at a right angle.
    pub edges: Option<[Triple; 2]>,
    /// The radius of a point, spot, disc or sphere light.
    pub radius: Option<At<f64>>,
}
