//! The metadata of Kubric: tracks of objects over the frames of a view.

use super::note::{Note, Seen};
use super::objects::place;
use glam::{DMat3, DQuat};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The width of a camera's sensor in Kubric's files, in millimetres.
const SENSOR: f64 = 36.0;

/// Returns a quaternion as Kubric has it: w first.
fn quaternion(turn: &DMat3) -> [f64; 4] {
    let q = DQuat::from_mat3(turn).normalize();
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    [q.w, q.x, q.y, q.z].map(|x| x * sign)
}

/// Returns the metadata of a sequence, as Kubric's workers write them: tracks of its objects, a value
/// for each frame.
pub fn metadata(notes: &[Note]) -> Value {
    let Some(first) = notes.first() else {
        return Value::Null;
    };
    let [width, height] = first.size.map(f64::from);
    let [fx, fy, cx, cy] = first.k;
    // The camera has y up and looks along -z.
    let poses = notes.iter().map(|note| {
        let (turn, eye) = note.rotation_and_eye();
        let axes = turn.transpose();
        let turn = DMat3::from_cols(axes.x_axis, -axes.y_axis, -axes.z_axis);
        (eye.to_array(), quaternion(&turn))
    });
    let (positions, quaternions): (Vec<_>, Vec<_>) = poses.unzip();
    let mut tracks: BTreeMap<u32, Vec<(usize, &Seen)>> = BTreeMap::new();
    for (frame, note) in notes.iter().enumerate() {
        for seen in &note.objects {
            tracks.entry(seen.number).or_default().push((frame, seen));
        }
    }
    let count = tracks.len();
    let instances = tracks.into_values().map(|track| {
        let (_, seen) = track[0];
        let at = |seen: &Seen| place(seen);
        let image = |frame: usize, seen: &Seen| {
            let (turn, eye) = notes[frame].rotation_and_eye();
            let p = turn * (place(seen).2 - eye);
            let [fx, fy, cx, cy] = notes[frame].k;
            [
                (fx * p.x / p.z + cx + 0.5) / width,
                (fy * p.y / p.z + cy + 0.5) / height,
            ]
        };
        let shown = || track.iter().filter_map(|(f, s)| Some((*f, s.box_visible?)));
        let boxes = shown().map(|(_, extent)| {
            let [x, y, w, h] = extent.rectangle().map(f64::from);
            [y / height, x / width, (y + h) / height, (x + w) / width]
        });
        let corners = |seen: &Seen| -> Option<Vec<[f64; 3]>> {
            let [min, max] = seen.bounds?;
            let corner = |i: usize| {
                let p = [0, 1, 2].map(|k| {
                    if i >> (2 - k) & 1 == 1 {
                        max[k]
                    } else {
                        min[k]
                    }
                });
                seen.world_from_object
                    .map(|[a, b, c, d]| a * p[0] + b * p[1] + c * p[2] + d)
            };
            Some((0..8).map(corner).collect())
        };
        json!({
            "asset_id": seen.name,
            "category": seen.category,
            "segmentation_id": seen.number,
            "scale": at(seen).1.to_array(),
            "frames": track.iter().map(|(f, _)| f).collect::<Vec<_>>(),
            "positions": track.iter().map(|(_, s)| at(s).2.to_array()).collect::<Vec<_>>(),
            "quaternions": track.iter().map(|(_, s)| quaternion(&at(s).0)).collect::<Vec<_>>(),
            "image_positions": track.iter().map(|(f, s)| image(*f, s)).collect::<Vec<_>>(),
            "visibility": track.iter().map(|(_, s)| s.visible).collect::<Vec<_>>(),
            "bboxes_3d": track.iter().map(|(_, s)| corners(s)).collect::<Vec<_>>(),
            "bboxes": boxes.collect::<Vec<_>>(),
            "bbox_frames": shown().map(|(f, _)| f).collect::<Vec<_>>(),
        })
    });
    let instances: Vec<Value> = instances.collect();
    json!({
        "metadata": {
            "resolution": first.size,
            "num_frames": notes.len(),
            "num_instances": count,
            "scene": first.scene, "camera": first.camera, "variant": first.variant,
            "frames": notes.iter().map(|note| note.frame).collect::<Vec<_>>(),
            "pictures": notes.iter().map(|note| &note.picture).collect::<Vec<_>>(),
        },
        "camera": {
            "sensor_width": SENSOR,
            "focal_length": SENSOR * fx / width,
            "field_of_view": 2.0 * libm::atan(0.5 * width / fx),
            // In widths and heights of the picture, and along -z.
            "K": [
                [fx / width, 0.0, -(cx + 0.5) / width],
                [0.0, -fy / height, -(cy + 0.5) / height],
                [0.0, 0.0, -1.0],
            ],
            "positions": positions,
            "quaternions": quaternions,
        },
        "instances": instances,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::dataset::note::tests::note;

    #[test]
    fn objects_have_tracks() {
        let value = metadata(&[note(), note()]);
        let track = &value["instances"][0];
        assert_eq!(track["image_positions"][1], json!([0.5, 0.5]));
        assert_eq!(track["bboxes_3d"][0][0], json!([3.0, 0.0, 1.0]));
        assert_eq!(track["frames"], json!([0, 1]));
        assert_eq!(value["camera"]["positions"][0], json!([1.0, 2.0, 9.0]));
    }
}
