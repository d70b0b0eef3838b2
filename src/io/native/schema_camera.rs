//! Cameras of the native scene format as types: what may stand where.

use super::schema::{Named, Triple};
use super::source_spans::At;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Deserializer};
use std::borrow::Cow;

/// Cameras by name; a single one has an empty name. How a file writes a single one is mended
/// before it is read as types.
#[derive(Debug, Default)]
pub struct Cameras(pub Named<At<Camera>>);

impl<'de> Deserialize<'de> for Cameras {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Cameras, D::Error> {
        Named::deserialize(deserializer).map(Cameras)
    }
}

impl JsonSchema for Cameras {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Cameras".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let one = generator.subschema_for::<Camera>();
        schemars::json_schema!({
            "anyOf": [one, { "type": "object", "additionalProperties": one }]
        })
    }
}

/// Where the picture is taken from, by `eye` and `look_at` or by `pose`, and how: exactly one of
/// `fov_y`, `orthographic`, `k`, `panorama` and `fisheye`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// The point that is looked from.
    pub eye: Option<At<Triple>>,
    /// The point in the middle of the picture.
    pub look_at: Option<Triple>,
    /// Which way is up in the picture; +y if absent.
    pub up: Option<At<Triple>>,
    /// In place of the three: world_from_camera, 3 rows of 4, a rotation and the eye. The camera's
    /// axes are OpenCV's: x to the right, y down, z ahead.
    pub pose: Option<At<[[f64; 4]; 3]>>,
    /// In place of `look_at` and `up`: unit vectors to the right, upward and ahead, at right angles,
    /// which are taken as they are.
    pub axes: Option<At<[[f64; 3]; 3]>>,
    /// Degrees from the picture's bottom to its top, between 0 and 180.
    pub fov_y: Option<At<f64>>,
    /// In place of `fov_y`: half the picture's height at distance 1, greater than 0.
    pub half_height: Option<At<f64>>,
    /// Height of the picture in world units, greater than 0; rays are parallel.
    pub orthographic: Option<At<f64>>,
    /// A pinhole by its measured numbers.
    pub k: Option<At<Calibration>>,
    /// All directions: longitude across the picture, latitude up it.
    pub panorama: Option<Panorama>,
    /// A circle about the view axis, as high as the picture.
    pub fisheye: Option<At<Fisheye>>,
    /// Blurs what is not in focus; without it all is sharp.
    pub lens: Option<At<Lens>>,
    /// Where it is at later times of a sequence of frames, at least one key; not beside `pose`.
    pub motion: Option<At<Vec<At<CameraKey>>>>,
    /// When it takes light; for an instant if absent, and nothing blurs.
    pub shutter: Option<At<Shutter>>,
}

/// Where a camera is at a time. Between keys all three go straight.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraKey {
    /// Above 0 and the key before, at most 1.
    pub at: At<f64>,
    /// That of the key before if absent.
    pub eye: Option<Triple>,
    /// That of the key before if absent.
    pub look_at: Option<Triple>,
    /// That of the key before if absent; not 0.
    pub up: Option<At<Triple>>,
}

/// When a camera takes light: between two times about that of the frame. The unit is the time
/// from one frame to the next; of a single picture the whole motion.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Shutter {
    /// 0 is the frame's own time, negative is before it; 0 if absent.
    pub open: Option<f64>,
    /// Above `open`.
    pub close: f64,
    /// `box` if absent.
    pub shape: Option<ShutterShape>,
    /// Of a trapezoid: the share of the time in which it opens, from 0 to 1; 0.25 if absent.
    pub rise: Option<f64>,
    /// Of a trapezoid: the share of the time in which it closes; 0.25 if absent. `rise` and
    /// `fall` add up to 1 at most.
    pub fall: Option<f64>,
}

/// How much light a shutter lets in between its times.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ShutterShape {
    /// All light all the time.
    Box,
    /// It opens evenly and closes evenly.
    Trapezoid,
}

/// A pinhole camera as OpenCV has it: pixel (0, 0) has its centre at (0, 0), y points down.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Focal lengths in pixels.
    pub fx: f64,
    pub fy: f64,
    /// The pixel on the view axis.
    pub cx: f64,
    pub cy: f64,
    /// Size in pixels of the picture that these numbers are for, and of the picture that is
    /// rendered where none is asked for.
    pub width: u32,
    pub height: u32,
    /// OpenCV's distortion k1, k2, p1, p2, k3; none if absent.
    pub distortion: Option<[f64; 5]>,
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Panorama {
    Equirectangular,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fisheye {
    /// Degrees across the circle, greater than 0, up to 360.
    pub fov: f64,
    /// `equidistant` if absent.
    pub mapping: Option<FisheyeMapping>,
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FisheyeMapping {
    /// The distance from the middle grows with the angle.
    Equidistant,
    /// Equal solid angles have equal areas.
    Equisolid,
}

/// A thin lens; its size is `radius`, or `f_number` with `focal_length`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Lens {
    /// Radius of the opening in world units.
    pub radius: Option<f64>,
    /// Focal length over the width of the opening, greater than 0.
    pub f_number: Option<f64>,
    /// In world units: 0.05 of a 50 mm lens in a scene in metres.
    pub focal_length: Option<f64>,
    /// What is sharp: a depth along the view axis, or a point; the distance of `look_at` if absent.
    pub focus: Option<Focus>,
    /// Number of blades, from 3 to 64, whose corners are on the circle; a disc if absent.
    pub blades: Option<u32>,
    /// Degrees that the blades are turned by, counter-clockwise in the picture; 0 if absent.
    pub rotation: Option<f64>,
    /// How many times higher than wide the opening is; 1 if absent, 2 of anamorphic lenses.
    pub squeeze: Option<f64>,
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Focus {
    Depth(f64),
    Point(Triple),
}
