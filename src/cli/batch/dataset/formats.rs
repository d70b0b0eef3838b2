//! The files of a data set as a whole, made of the notes of its pictures.

use super::doubts::Doubts;
use super::files::{Beside, SPLIT, bop_place};
use super::kubric;
use super::note::{Note, VERSION};
use super::objects::place;
use super::settings::{DatasetSettings, Format};
use crate::batch::tasks::{Task, Tasks};
use crate::error::CliError;
use crate::output::complain;
use glam::DMat3;
use lanecast_io::{Outputs, SaveError};
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Files by their names, from the folder of the run.
type Files = BTreeMap<PathBuf, Value>;

/// Writes the files of a data set, of the tasks that are done, in their order. Fails if a note cannot
/// be read.
pub fn write(
    (tasks, settings): (&Tasks, &DatasetSettings),
    done: &[Task],
    out: &Path,
    outputs: &mut Outputs,
) -> Result<Vec<PathBuf>, CliError> {
    let mut bop = Bop::default();
    let mut coco = Coco::default();
    let mut nerf: BTreeMap<usize, Vec<Value>> = BTreeMap::new();
    let mut kubric: BTreeMap<usize, Vec<Note>> = BTreeMap::new();
    let mut doubts = Doubts::default();
    for task in done {
        let note = read(task, settings, out)?;
        doubts.add(&note);
        if settings.writes(Format::Bop) {
            bop.add(&note);
        }
        if settings.writes(Format::Coco) {
            coco.add(&note);
        }
        if settings.writes(Format::Nerf) {
            let frames = nerf.entry(tasks.loading(task)).or_default();
            frames.push(nerf_frame(&note, settings));
        }
        if settings.writes(Format::Kubric) {
            let frames = kubric.entry(tasks.sequence(task)).or_default();
            // Masks are what a note is large by, and no part of it is written.
            frames.push(note.without_masks());
        }
    }
    for doubt in doubts.said(settings) {
        complain(&format!("warning: {doubt}"));
    }
    let mut files = Files::new();
    if settings.writes(Format::Bop) {
        bop.files(&mut files);
    }
    if settings.writes(Format::Coco) {
        files.insert("coco.json".into(), coco.value(settings));
    }
    let numbered = |name: &str, number: usize, count: usize| -> PathBuf {
        match count {
            1 => format!("{name}.json").into(),
            _ => format!("{name}_{number:06}.json").into(),
        }
    };
    for (number, frames) in nerf {
        let value = json!({ "camera_model": "OPENCV", "frames": frames });
        files.insert(numbered("transforms", number, tasks.loadings()), value);
    }
    for (number, notes) in kubric {
        let name = numbered("metadata", number, tasks.sequences());
        files.insert(name, kubric::metadata(&notes));
    }
    let mut names = Vec::new();
    for (name, value) in files {
        outputs.add(&out.join(&name), text(&value, &name)?)?;
        names.push(name);
    }
    Ok(names)
}

fn read(task: &Task, settings: &DatasetSettings, out: &Path) -> Result<Note, CliError> {
    let beside = Beside {
        picture: &task.output,
        in_folders: settings.writes(Format::Bop),
    };
    let path = out.join(beside.note());
    let failed = |why: String| CliError::Input(format!("{}: {why}", path.display()));
    let bytes = std::fs::read(&path).map_err(|e| failed(format!("cannot be read: {e}")))?;
    let note: Note = serde_json::from_slice(&bytes).map_err(|e| failed(e.to_string()))?;
    match note.v {
        VERSION => Ok(note),
        other => Err(failed(format!(
            "it is a note of version {other}, and this program reads version {VERSION}"
        ))),
    }
}

/// Writes JSON with a line for each row of what it lists.
fn text(value: &Value, name: &Path) -> Result<Vec<u8>, SaveError> {
    let mut text = String::from("{");
    let separate = |text: &mut String, i: usize| text.push_str(if i == 0 { "\n" } else { ",\n" });
    for (i, (key, value)) in value.as_object().into_iter().flatten().enumerate() {
        separate(&mut text, i);
        text += &format!("{}: ", line(key, name)?);
        match value {
            Value::Array(rows) if rows.iter().any(Value::is_object) => {
                text.push('[');
                for (i, row) in rows.iter().enumerate() {
                    separate(&mut text, i);
                    text += &line(row, name)?;
                }
                text.push(']');
            }
            value => text += &line(value, name)?,
        }
    }
    Ok((text + "\n}\n").into_bytes())
}

fn line(value: &impl Serialize, name: &Path) -> Result<String, SaveError> {
    serde_json::to_string(value).map_err(|e| SaveError::Encode {
        path: name.into(),
        message: e.to_string(),
    })
}

fn by_rows(m: &DMat3) -> [f64; 9] {
    m.transpose().to_cols_array()
}

/// The files of BOP, by chunk and picture.
#[derive(Default)]
struct Bop {
    camera: Option<Value>,
    chunks: BTreeMap<u32, [Map<String, Value>; 3]>,
}

impl Bop {
    fn add(&mut self, note: &Note) {
        let (chunk, number) = bop_place(note.task);
        let (turn, eye) = note.rotation_and_eye();
        let [fx, fy, cx, cy] = note.k;
        self.camera.get_or_insert_with(|| {
            json!({
                "fx": fx, "fy": fy, "cx": cx, "cy": cy,
                "width": note.size[0], "height": note.size[1], "depth_scale": note.depth_scale,
            })
        });
        let camera = json!({
            "cam_K": [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
            "cam_R_w2c": by_rows(&turn),
            "cam_t_w2c": (turn * -eye * note.unit).to_array(),
            "depth_scale": note.depth_scale,
        });
        let truth = note.objects.iter().map(|seen| {
            let (own, _, origin) = place(seen);
            json!({
                "cam_R_m2c": by_rows(&(turn * own)),
                "cam_t_m2c": (turn * (origin - eye) * note.unit).to_array(),
                "obj_id": seen.category,
            })
        });
        let about = note.objects.iter().map(|seen| {
            let visible = seen.box_visible.map_or([-1; 4], |extent| extent.of_bop());
            json!({
                "bbox_obj": seen.box_all.of_bop(),
                "bbox_visib": visible,
                "px_count_all": seen.all,
                "px_count_valid": seen.valid,
                "px_count_visib": seen.visible,
                "visib_fract": seen.visible as f64 / seen.all as f64,
            })
        });
        let parts = [
            camera,
            Value::Array(truth.collect()),
            Value::Array(about.collect()),
        ];
        let files = self.chunks.entry(chunk).or_default();
        for (file, part) in files.iter_mut().zip(parts) {
            file.insert(number.to_string(), part);
        }
    }

    fn files(self, files: &mut Files) {
        files.extend(self.camera.map(|camera| ("camera.json".into(), camera)));
        for (chunk, parts) in self.chunks {
            let folder = PathBuf::from(format!("{SPLIT}/{chunk:06}"));
            let names = ["scene_camera.json", "scene_gt.json", "scene_gt_info.json"];
            let named = names.map(|name| folder.join(name)).into_iter().zip(parts);
            files.extend(named.map(|(name, part)| (name, Value::Object(part))));
        }
    }
}

/// The file of COCO.
#[derive(Default)]
struct Coco {
    images: Vec<Value>,
    annotations: Vec<Value>,
}

impl Coco {
    fn add(&mut self, note: &Note) {
        let [width, height] = note.size;
        self.images.push(json!({
            "id": note.task, "file_name": note.picture, "width": width, "height": height,
        }));
        for seen in &note.objects {
            let Some(extent) = seen.box_visible else {
                continue;
            };
            self.annotations.push(json!({
                "id": self.annotations.len() + 1,
                "image_id": note.task,
                "category_id": seen.category,
                "bbox": extent.rectangle(),
                "area": seen.visible,
                "iscrowd": 0,
                "segmentation": { "size": [height, width], "counts": seen.mask_visible },
            }));
        }
    }

    fn value(self, settings: &DatasetSettings) -> Value {
        let categories = settings.categories().into_iter();
        let categories = categories.map(|(id, name)| json!({ "id": id, "name": name }));
        json!({
            "info": { "description": "rendered by lanecast" },
            "images": self.images,
            "annotations": self.annotations,
            "categories": categories.collect::<Vec<_>>(),
        })
    }
}

/// Returns a picture as a frame of `transforms.json`: the camera has x to the right, y up and z
/// towards the viewer, and the first pixel begins at 0, 0.
fn nerf_frame(note: &Note, settings: &DatasetSettings) -> Value {
    let [fx, fy, cx, cy] = note.k;
    let [k1, k2, p1, p2, k3] = note.distortion;
    let row = |[a, b, c, d]: [f64; 4]| [a, 0.0 - b, 0.0 - c, d];
    let [first, second, third] = note.world_from_camera.map(row);
    let beside = Beside {
        picture: note.picture.as_ref(),
        in_folders: settings.writes(Format::Bop),
    };
    json!({
        "file_path": note.picture,
        "depth_file_path": beside.depth().to_string_lossy(),
        "fl_x": fx, "fl_y": fy, "cx": cx + 0.5, "cy": cy + 0.5,
        "w": note.size[0], "h": note.size[1],
        "k1": k1, "k2": k2, "p1": p1, "p2": p2, "k3": k3,
        "transform_matrix": [first, second, third, [0.0, 0.0, 0.0, 1.0]],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::dataset::note::tests::note;

    #[test]
    fn bop_has_poses_in_the_camera_in_millimetres() {
        let mut bop = Bop::default();
        bop.add(&note());
        let mut files = Files::new();
        bop.files(&mut files);
        let of = |name: &str| &files[Path::new(&format!("train_pbr/000001/{name}.json"))]["2"];
        let truth = &of("scene_gt")[0];
        assert_eq!(truth["cam_t_m2c"], json!([0.0, 0.0, 6000.0]));
        let turn = [0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0];
        let near = |list: &Value, to: &[f64]| {
            let list = list.as_array().unwrap().iter().zip(to);
            list.for_each(|(a, b)| assert!((a.as_f64().unwrap() - b).abs() < 1e-12, "{a} {b}"));
        };
        near(&truth["cam_R_m2c"], &turn);
        assert_eq!(truth["obj_id"], 5);
        near(&of("scene_camera")["cam_t_w2c"], &[-1000.0, 2000.0, 9000.0]);
        let about = &of("scene_gt_info")[0];
        assert_eq!(about["bbox_obj"], json!([-3, 0, 9, 3]));
        assert_eq!(about["visib_fract"], 0.25);
        assert_eq!(files[Path::new("camera.json")]["width"], 64);
    }

    #[test]
    fn what_nerf_is_told_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let settings: DatasetSettings = toml::from_str("write = \"nerf\"").unwrap();
        let value = json!({ "frames": [nerf_frame(&note(), &settings)] });
        std::fs::write(folder.path().join("t.json"), value.to_string()).unwrap();
        let file: super::super::CameraFile = toml::from_str("file = \"t.json\"").unwrap();
        let posed = file.read(folder.path(), None).unwrap();
        assert_eq!(
            posed[0].arguments,
            [
                "--pose=1,0,0,1,0,-1,0,2,0,0,-1,9",
                "--k=50,51,31.5,23.5,64,48"
            ]
        );
    }

    #[test]
    fn coco_counts_what_is_seen() {
        let mut coco = Coco::default();
        coco.add(&note());
        let settings: DatasetSettings = toml::from_str("write = \"coco\"").unwrap();
        let value = coco.value(&settings);
        let annotation = &value["annotations"][0];
        assert_eq!(annotation["bbox"], json!([0, 1, 5, 2]));
        assert_eq!(
            (&annotation["area"], &annotation["id"]),
            (&json!(10), &json!(1))
        );
        assert_eq!(annotation["segmentation"]["size"], json!([48, 64]));
        let lines = text(&value, Path::new("x")).unwrap();
        assert_eq!(serde_json::from_slice::<Value>(&lines).unwrap(), value);
    }
}
