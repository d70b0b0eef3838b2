//! From the typed file to cameras.

use super::lower::{Result, not_one, not_zero};
use super::schema_camera::{self as schema, Focus};
use super::source_spans::At;
use super::tree::Source;
use crate::scene::{Calibration, Camera, FisheyeMapping, Lens, Projection};
use glam::DVec3;

/// Makes a camera.
pub(super) fn camera(source: &Source, row: &At<schema::Camera>) -> Result<Camera> {
    let projection = projection(source, row)?;
    let camera = placed(source, row, projection)?;
    let lens = match &row.value.lens {
        Some(lens) => Some(opening(source, lens, &row.value, &camera)?),
        None => None,
    };
    Ok(Camera { lens, ..camera })
}

/// Reads how directions come to be positions in the picture.
fn projection(source: &Source, row: &At<schema::Camera>) -> Result<Projection> {
    let camera = &row.value;
    let given = [
        ("fov_y", camera.fov_y.is_some()),
        ("half_height", camera.half_height.is_some()),
        ("orthographic", camera.orthographic.is_some()),
        ("k", camera.k.is_some()),
        ("panorama", camera.panorama.is_some()),
        ("fisheye", camera.fisheye.is_some()),
    ];
    if given.iter().filter(|(_, is)| *is).count() != 1 {
        return Err(not_one(source, row.at, "the camera's projection", &given));
    }
    if let Some(angle) = &camera.fov_y {
        let fov_y = angle.value;
        if !(fov_y > 0.0 && fov_y < 180.0) {
            let message = format!("fov_y = {fov_y}; it must be between 0 and 180 degrees");
            return Err(source.error(angle.at, message));
        }
        return Ok(Projection::Perspective {
            half_height: libm::tan(fov_y.to_radians() * 0.5),
        });
    }
    if let Some(half) = &camera.half_height {
        if !(half.value > 0.0) {
            let message = format!("half_height = {}; it must be greater than 0", half.value);
            return Err(source.error(half.at, message));
        }
        return Ok(Projection::Perspective {
            half_height: half.value,
        });
    }
    if let Some(height) = &camera.orthographic {
        if !(height.value > 0.0) {
            let message = format!("orthographic = {}; it must be greater than 0", height.value);
            return Err(source.error(height.at, message));
        }
        return Ok(Projection::Orthographic {
            half_height: height.value * 0.5,
        });
    }
    if let Some(k) = &camera.k {
        let k = &k.value;
        return Ok(Projection::Calibrated(Calibration {
            focal: [k.fx, k.fy],
            center: [k.cx, k.cy],
            size: [k.width, k.height],
            distortion: k.distortion.unwrap_or_default(),
        }));
    }
    match &camera.fisheye {
        None => Ok(Projection::Panorama),
        Some(fisheye) => {
            let fov = fisheye.value.fov;
            if !(fov > 0.0 && fov <= 360.0) {
                let message = format!("fov = {fov}; it must be greater than 0, up to 360 degrees");
                return Err(source.error(fisheye.at, message));
            }
            Ok(Projection::Fisheye {
                half_angle: fov.to_radians() * 0.5,
                mapping: match fisheye.value.mapping {
                    Some(schema::FisheyeMapping::Equisolid) => FisheyeMapping::Equisolid,
                    Some(schema::FisheyeMapping::Equidistant) | None => FisheyeMapping::Equidistant,
                },
            })
        }
    }
}

/// Reads where the camera stands.
fn placed(source: &Source, row: &At<schema::Camera>, projection: Projection) -> Result<Camera> {
    let camera = &row.value;
    if let Some(pose) = &camera.pose {
        let others = [
            ("eye", camera.eye.is_some()),
            ("look_at", camera.look_at.is_some()),
            ("up", camera.up.is_some()),
            ("axes", camera.axes.is_some()),
        ];
        if let Some((name, _)) = others.iter().find(|(_, is)| *is) {
            let message = format!("the camera has a pose and {name}; leave out one of them");
            return Err(source.error(pose.at, message));
        }
        return Camera::at_pose(pose.value, projection).ok_or_else(|| {
            let message = "pose is no rotation: the first three columns must be at right angles, \
                           of length 1, and right-handed (x to the right, y down, z ahead)";
            source.error(pose.at, message)
        });
    }
    if let Some(axes) = &camera.axes {
        return by_axes(source, camera, axes, projection);
    }
    let (Some(at), Some(look_at)) = (&camera.eye, camera.look_at) else {
        let missing = match camera.eye {
            None => "eye",
            Some(_) => "look_at",
        };
        let message = format!("the camera has no {missing}; give eye and look_at, or pose");
        return Err(source.error(row.at, message));
    };
    let (eye, look_at) = (DVec3::from_array(at.value), DVec3::from_array(look_at));
    if eye == look_at {
        let message = "eye and look_at are the same point; the camera looks nowhere";
        return Err(source.error(at.at, message));
    }
    if !(look_at - eye).is_finite() {
        let message = "eye and look_at are farther apart than f64 can tell, 1.8e308; bring \
                       them nearer";
        return Err(source.error(at.at, message));
    }
    let up = match &camera.up {
        Some(up) => not_zero(source, "up", up)?,
        None => DVec3::Y,
    };
    Ok(Camera::looking_at(eye, look_at, up, projection))
}

/// Places a camera by its axes.
fn by_axes(
    source: &Source,
    camera: &schema::Camera,
    axes: &At<[[f64; 3]; 3]>,
    projection: Projection,
) -> Result<Camera> {
    /// How far lengths and angles may be off: some roundings.
    const NEAR: f64 = 1e-12;
    let Some(eye) = &camera.eye else {
        return Err(source.error(axes.at, "the camera has axes and no eye; give it one"));
    };
    if camera.look_at.is_some() || camera.up.is_some() {
        let message = "axes are in place of look_at and up; leave out one or the other";
        return Err(source.error(axes.at, message));
    }
    let [right, up, forward] = axes.value.map(DVec3::from_array);
    let off = [
        right.length_squared() - 1.0,
        up.length_squared() - 1.0,
        (right.cross(forward) - up).length(),
        right.dot(forward),
    ];
    if !off.iter().all(|off| off.abs() < NEAR) {
        let message = "axes must be unit vectors to the right, upward and ahead, at right angles \
                       to within 1e-12; give eye, look_at and up, or pose, for others";
        return Err(source.error(axes.at, message));
    }
    Ok(Camera {
        eye: DVec3::from_array(eye.value),
        right,
        up,
        forward,
        projection,
        lens: None,
    })
}

/// Reads a lens.
fn opening(
    source: &Source,
    row: &At<schema::Lens>,
    of: &schema::Camera,
    camera: &Camera,
) -> Result<Lens> {
    let lens = &row.value;
    let wrong = |message: &str| Err(source.error(row.at, message));
    let radius = match (lens.radius, lens.f_number, lens.focal_length) {
        (Some(radius), None, None) => radius,
        (None, Some(number), Some(length)) if number > 0.0 => length / (2.0 * number),
        (None, Some(number), Some(_)) => {
            return wrong(&format!("f_number = {number}; it must be greater than 0"));
        }
        _ => return wrong("the lens must have radius, or both f_number and focal_length"),
    };
    let depth = |point: DVec3| (point - camera.eye).dot(camera.forward);
    let focus = match (lens.focus, of.look_at) {
        (Some(Focus::Depth(depth)), _) => depth,
        (Some(Focus::Point(point)), _) => depth(DVec3::from_array(point)),
        (None, Some(point)) => depth(DVec3::from_array(point)),
        (None, None) => return wrong("the lens has no focus, and a pose has no look_at; give one"),
    };
    if !(focus > 0.0) {
        return wrong(&format!(
            "the plane of focus is {focus} before the camera; it must lie ahead of it"
        ));
    }
    Ok(Lens {
        radius,
        focus,
        blades: lens.blades.unwrap_or(0),
        rotation: lens.rotation.unwrap_or(0.0),
        squeeze: lens.squeeze.unwrap_or(1.0),
    })
}
