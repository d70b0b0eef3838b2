//! Cameras: where rays start, before pixels.
//!
//! The frame is right-handed: `right × up = -forward`. Perspective and calibrated rays have the
//! direction `forward + x·right + y·up`, so that t is the depth along the view axis.

use super::calibration::Calibration;
use super::camera_motion::CameraMotions;
use super::names::Names;
use super::shutter::Shutter;
use glam::DVec3;
use thiserror::Error;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The eye in world space.
    pub eye: DVec3,
    /// The unit vector to the right, orthogonal to `up` and `forward`.
    pub right: DVec3,
    /// The unit vector upward.
    pub up: DVec3,
    /// The unit vector into the picture.
    pub forward: DVec3,
    pub projection: Projection,
    /// Without a lens all of the picture is sharp.
    pub lens: Option<Lens>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Half the picture's height at distance 1: tan(fov_y / 2).
    Perspective { half_height: f64 },
    /// Half the picture's height, world units.
    Orthographic { half_height: f64 },
    /// A pinhole whose numbers were measured, with its distortion.
    Calibrated(Calibration),
    /// All directions: longitude across the picture, latitude up it; the middle is ahead.
    Panorama,
    /// A circle about the view axis. Directions beyond `half_angle` radians from the axis, which
    /// lie half the picture's height from its middle, have no ray.
    Fisheye {
        half_angle: f64,
        mapping: FisheyeMapping,
    },
}

impl Projection {
    /// Says whether rays are parallel, and not from the eye.
    pub fn is_parallel(&self) -> bool {
        matches!(self, Projection::Orthographic { .. })
    }

    /// Returns half the picture's height in the units of the image plane: at distance 1 of
    /// pinholes, in world units of parallel rays, and 1 of what has no plane.
    pub fn half_height(&self) -> f64 {
        match self {
            Projection::Perspective { half_height } | Projection::Orthographic { half_height } => {
                *half_height
            }
            Projection::Calibrated(k) => 0.5 * f64::from(k.size[1]) / k.focal[1],
            Projection::Panorama | Projection::Fisheye { .. } => 1.0,
        }
    }

    /// Says whether there is an image plane: what lies on a line is seen on a line, but for
    /// distortion.
    pub fn has_plane(&self) -> bool {
        !matches!(self, Projection::Panorama | Projection::Fisheye { .. })
    }
}

/// How a fisheye maps the angle from its axis to the distance from the picture's middle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FisheyeMapping {
    /// Distance is proportional to the angle.
    Equidistant,
    /// Equal solid angles have equal areas: the sine of half the angle.
    Equisolid,
}

/// A thin lens: what is nearer or farther than its plane of focus is blurred.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Radius of the opening in world units.
    pub radius: f64,
    /// Depth of the plane of focus along the view axis, in world units.
    pub focus: f64,
    /// Blades that bound the opening, corners on the circle; 0 for a disc.
    pub blades: u32,
    /// Degrees that the blades are turned by, counter-clockwise in the picture.
    pub rotation: f64,
    /// How many times higher than wide the opening is; 2 for anamorphic lenses.
    pub squeeze: f64,
}

impl Camera {
    /// Builds a pinhole camera at `eye`, with `fov_y` degrees from the picture's bottom to
    /// its top.
    ///
    /// A wrong direction or angle gives NaN or infinite fields, which the scene's check
    /// reports. If `up` is parallel to the view, another axis replaces it.
    pub fn perspective(eye: DVec3, look_at: DVec3, up: DVec3, fov_y: f64) -> Camera {
        let half_height = if fov_y > 0.0 && fov_y < 180.0 {
            libm::tan(fov_y.to_radians() * 0.5)
        } else {
            f64::NAN
        };
        Camera::posed(
            eye,
            look_at - eye,
            up,
            Projection::Perspective { half_height },
        )
    }

    /// Builds a camera of parallel rays; `height` is the picture's, in world units.
    pub fn orthographic(eye: DVec3, look_at: DVec3, up: DVec3, height: f64) -> Camera {
        let half_height = if height > 0.0 { height * 0.5 } else { f64::NAN };
        Camera::posed(
            eye,
            look_at - eye,
            up,
            Projection::Orthographic { half_height },
        )
    }

    /// Returns the camera as it is elsewhere, with all else its own.
    pub(super) fn moved(&self, eye: DVec3, look_at: DVec3, up: DVec3) -> Camera {
        let there = Camera::posed(eye, look_at - eye, up, self.projection);
        Camera {
            eye: there.eye,
            right: there.right,
            up: there.up,
            forward: there.forward,
            ..*self
        }
    }

    /// Builds a camera from the rows of world_from_camera, whose camera has x to the right, y
    /// down and z ahead. Returns `None` unless the first three columns are orthonormal within
    /// 1e-3 and right-handed; what they are off is taken from the picture's right and up.
    pub fn at_pose(rows: [[f64; 4]; 3], projection: Projection) -> Option<Camera> {
        let column = |k: usize| DVec3::from_array(rows.map(|row| row[k]));
        let [right, down, forward, eye] = [0, 1, 2, 3].map(column);
        let near = |x: f64, y: f64| (x - y).abs() < 1e-3;
        let units = [right, down, forward].iter().all(|v| near(v.length(), 1.0));
        let square = [right.dot(down), right.dot(forward), down.dot(forward)];
        let handed = near(right.cross(down).dot(forward), 1.0);
        if !units || !handed || square.iter().any(|c| !near(*c, 0.0)) {
            return None;
        }
        Some(Camera::posed(eye, forward, -down, projection))
    }

    /// Builds a camera at `eye`, with a projection and any lens.
    pub fn looking_at(eye: DVec3, look_at: DVec3, up: DVec3, projection: Projection) -> Camera {
        Camera::posed(eye, look_at - eye, up, projection)
    }

    pub(super) fn posed(eye: DVec3, forward: DVec3, up: DVec3, projection: Projection) -> Camera {
        // Scaled before it is squared, because views may span any range of f64.
        let unit = |v: DVec3| {
            let size = v.abs().max_element();
            if size > 0.0 && size.is_finite() {
                (v / size).normalize()
            } else {
                DVec3::NAN
            }
        };
        let forward = unit(forward);
        let mut right = forward.cross(unit(up));
        // NaN stays NaN, and the check reports it.
        if right.length_squared() < 1e-24 {
            right = forward.cross(forward.any_orthonormal_vector());
        }
        let right = right.normalize();
        Camera {
            eye,
            right,
            up: right.cross(forward),
            forward,
            projection,
            lens: None,
        }
    }
}

#[derive(Clone, Debug, Default)]
pub struct Cameras {
    pub rows: Vec<Camera>,
    pub names: Names,
    /// Names of the nodes of a file that place the cameras, where these differ.
    pub node_names: Names,
    /// The keys of the cameras that move.
    pub motions: CameraMotions,
    /// Rows of the cameras that have a shutter, rising, and the shutters.
    pub shutters: Vec<(u32, Shutter)>,
}

/// A camera that was asked for and is not there.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("no camera '{asked}': {known}")]
pub struct UnknownCamera {
    asked: String,
    known: String,
}

impl Cameras {
    /// Sets the cameras that move to a time.
    pub(super) fn set_time(&mut self, time: f64) {
        for row in 0..self.motions.of.len() {
            let camera = &mut self.rows[self.motions.of[row] as usize];
            *camera = self.motions.at(row, camera, time);
        }
    }

    /// Returns the shutter of the camera of a row, if it has one.
    pub fn shutter(&self, row: usize) -> Option<Shutter> {
        let mut shutters = self.shutters.iter();
        let found = shutters.find(|(of, _)| *of as usize == row);
        found.map(|(_, shutter)| *shutter)
    }

    /// Finds the row of the camera of a name, or else of a node's name, or else of a number
    /// from 0; the first if none is asked for. Returns `None` if none is asked for and there is none.
    pub fn pick(&self, asked: Option<&str>) -> Result<Option<usize>, UnknownCamera> {
        let count = self.rows.len();
        let Some(asked) = asked else {
            return Ok((count > 0).then_some(0));
        };
        let by = |names: &Names| (0..count).find(|row| names.get(*row as u32) == Some(asked));
        let named = by(&self.names).or_else(|| by(&self.node_names));
        let numbered = || asked.parse().ok().filter(|row| *row < count);
        let label = |row: u32| match self.node_names.get(row) {
            Some(node) => format!("{} on node '{node}'", self.names.label(row)),
            None => self.names.label(row),
        };
        let labels = || (0..count as u32).map(label);
        named
            .or_else(numbered)
            .map(Some)
            .ok_or_else(|| UnknownCamera {
                asked: asked.to_owned(),
                known: match count {
                    0 => "the scene has none; leave it out for a framed view".into(),
                    _ => format!("the scene has {}", labels().collect::<Vec<_>>().join(", ")),
                },
            })
    }
}
