//! Cameras of nodes: where they are, and what they see.

use super::File;
use super::nodes::{label, name};
use crate::math::Affine;
use crate::scene::{Camera, CameraKey, SceneBuilder};
use crate::shared::messages::one_line;
use crate::{ImportReport, LoadError};
use glam::DVec3;
use gltf::json::camera::Type as CameraType;
use gltf::json::validation::Checked;

/// Adds the camera of a node, if it has one; `worlds` are the times and places of its node, one
/// if it does not move. A camera looks along -z of its node, with +y up; the node's scale is
/// ignored.
pub(super) fn camera(
    file: &File,
    node: usize,
    worlds: &[(f64, Affine)],
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let Some(id) = file.root.nodes[node].camera else {
        return Ok(());
    };
    let cameras = &file.root.cameras;
    let Some(source) = cameras.get(id.value()) else {
        let message = format!(
            "refers to camera {}, but there are {}",
            id.value(),
            cameras.len()
        );
        return Err(file.invalid(&label(file, node), &message));
    };
    // The pose is computed at the origin, because at a far eye the point to look at would
    // round the direction.
    let axes = |world: &Affine| {
        let axis = |v| DVec3::from_array(world.vector(v));
        let (forward, up) = (axis([0.0, 0.0, -1.0]), axis([0.0, 1.0, 0.0]));
        (forward.cross(up) != DVec3::ZERO).then_some((forward, up))
    };
    let Some((forward, up)) = worlds.first().and_then(|(_, world)| axes(world)) else {
        report.add("camera of a node scaled to nothing");
        return Ok(());
    };
    let place = format!("camera {}", id.value());
    let posed = match (&source.type_, &source.perspective, &source.orthographic) {
        (Checked::Valid(CameraType::Perspective), Some(p), _) => {
            let fov = f64::from(p.yfov).to_degrees();
            if fov >= 180.0 {
                report.add("camera with a field of view of 180 degrees or more");
                return Ok(());
            }
            Camera::perspective(DVec3::ZERO, forward, up, fov)
        }
        (Checked::Valid(CameraType::Orthographic), _, Some(o)) => {
            let height = 2.0 * f64::from(o.ymag).abs();
            Camera::orthographic(DVec3::ZERO, forward, up, height)
        }
        _ => {
            let message =
                "its type must be 'perspective' or 'orthographic', with the property of that name";
            return Err(file.invalid(&place, message));
        }
    };
    let eye = DVec3::from_array(worlds[0].1.translation);
    let own = one_line(source.name.as_deref().unwrap_or_default());
    let node = name(file, node);
    let name = if own.is_empty() { &node } else { &own };
    let id = scene.camera_on(name, &node, Camera { eye, ..posed });
    let key = |(at, world): &(f64, Affine)| {
        let (forward, up) = axes(world)?;
        let eye = DVec3::from_array(world.translation);
        Some(CameraKey {
            at: *at,
            eye,
            look_at: eye + forward.normalize(),
            up: up.normalize(),
        })
    };
    if worlds.len() > 1 {
        let keys: Option<Vec<CameraKey>> = worlds.iter().map(key).collect();
        match keys {
            Some(keys) => scene.move_camera(id, &keys),
            None => report.add("motion of a camera of a node scaled to nothing"),
        }
    }
    Ok(())
}
