//! From the typed file to how a camera moves, and when it takes light.

use super::lower::{Result, not_zero};
use super::schema_camera::{self as schema, Camera};
use super::source_spans::At;
use super::tree::Source;
use crate::scene::{CameraKey, Shutter, ShutterShape};
use glam::DVec3;

/// Returns the keys of a camera, its own pose first.
pub(super) fn camera_keys(
    source: &Source,
    camera: &Camera,
    motion: &At<Vec<At<schema::CameraKey>>>,
) -> Result<Vec<CameraKey>> {
    if motion.value.is_empty() {
        let message = "motion has no keys; give one, such as { at = 1.0, eye = [0, 1, 5] }, or \
                       leave it out";
        return Err(source.error(motion.at, message));
    }
    let (Some(eye), Some(look_at)) = (&camera.eye, camera.look_at) else {
        let message =
            "motion goes from eye and look_at, and the camera has a pose; give it the two";
        return Err(source.error(motion.at, message));
    };
    let up = camera
        .up
        .as_ref()
        .map_or(DVec3::Y, |up| DVec3::from_array(up.value));
    let mut keys = vec![CameraKey {
        at: 0.0,
        eye: DVec3::from_array(eye.value),
        look_at: DVec3::from_array(look_at),
        up,
    }];
    for row in &motion.value {
        let last = keys[keys.len() - 1];
        let key = &row.value;
        let time = key.at.value;
        if !(time > last.at && time <= 1.0) {
            let message = format!(
                "at = {time}; it must be above that of the key before, {}, and at most 1",
                last.at
            );
            return Err(source.error(key.at.at, message));
        }
        let eye = key.eye.map_or(last.eye, DVec3::from_array);
        let look_at = key.look_at.map_or(last.look_at, DVec3::from_array);
        if eye == look_at {
            let message = "eye and look_at are the same point; the camera looks nowhere";
            return Err(source.error(row.at, message));
        }
        let up = match &key.up {
            Some(up) => not_zero(source, "up", up)?,
            None => last.up,
        };
        keys.push(CameraKey {
            at: time,
            eye,
            look_at,
            up,
        });
    }
    Ok(keys)
}

pub(super) fn shutter(source: &Source, row: &At<schema::Shutter>) -> Result<Shutter> {
    let refuse = |message: String| Err(source.error(row.at, message));
    let schema::Shutter {
        open,
        close,
        shape,
        rise,
        fall,
    } = row.value;
    let open = open.unwrap_or(0.0);
    if close <= open {
        return refuse(format!(
            "the shutter opens at {open} and closes at {close}; close must be above open, or \
             leave the shutter out for a still picture"
        ));
    }
    let shape = match shape.unwrap_or(schema::ShutterShape::Box) {
        schema::ShutterShape::Box if rise.is_some() || fall.is_some() => {
            return refuse(
                "rise and fall are of a shutter with shape = \"trapezoid\"; leave them out, or \
                 give it that shape"
                    .into(),
            );
        }
        schema::ShutterShape::Box => ShutterShape::Box,
        schema::ShutterShape::Trapezoid => {
            let (rise, fall) = (rise.unwrap_or(0.25), fall.unwrap_or(0.25));
            if !(rise >= 0.0 && fall >= 0.0 && rise + fall <= 1.0) {
                return refuse(format!(
                    "rise = {rise} and fall = {fall}; both must be 0 or greater, and their sum at \
                     most 1"
                ));
            }
            ShutterShape::Trapezoid { rise, fall }
        }
    };
    Ok(Shutter { open, close, shape })
}
