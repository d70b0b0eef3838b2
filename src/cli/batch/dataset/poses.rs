//! Cameras from files of poses: `transforms.json` of NeRF and `scene_camera.json` of BOP.
//!
//! Each becomes the options `--pose` and `--k` of a view, so that a task reads no such file, and a
//! file of which one pose has changed makes that one's tasks undone.

use crate::batch::ranges::Ranges;
use glam::{DMat3, DVec3};
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Map, Value};
use std::fs;
use std::path::Path;

/// The most bytes of a file of poses.
const MOST_BYTES: u64 = 1 << 28;

/// Cameras of a file.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraFile {
    /// `transforms.json` of NeRF or `scene_camera.json` of BOP.
    pub file: String,
    /// Numbers of its frames, of BOP its pictures; all without it.
    pub frames: Option<String>,
    /// WIDTHxHEIGHT of the pictures that its numbers are for, if the file does not say.
    pub size: Option<String>,
    /// Units of the scene in one of the file: 1 of NeRF, 0.001 of BOP, which has millimetres.
    pub scale: Option<f64>,
}

/// A camera of a file, as options of `lanecast render`.
#[derive(Clone, Debug, PartialEq)]
pub struct Posed {
    /// Its number in the file.
    pub number: u32,
    pub arguments: [String; 2],
}

/// A measured pinhole: focal lengths, the pixel on the axis as OpenCV counts, size, distortion.
struct Lens {
    focal: [f64; 2],
    center: [f64; 2],
    size: [u32; 2],
    distortion: [f64; 5],
}

impl CameraFile {
    /// Reads the file, whose path counts from `folder`. `size` is that of the job's pictures. Fails
    /// with the place and the remedy.
    pub fn read(&self, folder: &Path, size: Option<&str>) -> Result<Vec<Posed>, String> {
        let path = folder.join(&self.file);
        let of_file = |why: String| format!("{}: {why}", path.display());
        let unread = |e: std::io::Error| of_file(format!("cannot be read: {e}"));
        let about = fs::metadata(&path).map_err(unread)?;
        if !about.is_file() || about.len() > MOST_BYTES {
            return Err(of_file("it is no file of poses".into()));
        }
        let bytes = fs::read(&path).map_err(unread)?;
        let value: Value = serde_json::from_slice(&bytes).map_err(|e| of_file(e.to_string()))?;
        if self.scale.is_some_and(|s| !(s > 0.0 && s.is_finite())) {
            return Err("scale is a number above 0".into());
        }
        let size = match self.size.as_deref().or(size) {
            None => None,
            Some(text) => Some(size_of(text).ok_or(format!(
                "size '{text}' is not written as WIDTHxHEIGHT, such as 640x480"
            ))?),
        };
        let wanted: Option<Vec<u32>> = match &self.frames {
            None => None,
            Some(text) => Some(Ranges::parse(text)?.numbers().collect()),
        };
        let all = match &value {
            Value::Object(map) if map.contains_key("frames") => self.nerf(map, size),
            Value::Object(map) if map.keys().all(|key| key.parse::<u32>().is_ok()) => {
                self.bop(map, size.or_else(|| size_beside(&path)))
            }
            _ => Err(
                "it has neither the frames of a transforms.json of NeRF nor the pictures of a \
                      scene_camera.json of BOP"
                    .into(),
            ),
        };
        let mut all = all.map_err(of_file)?;
        all.sort_by_key(|posed| posed.number);
        let Some(wanted) = wanted else {
            return Ok(all);
        };
        let find = |number: u32| {
            let found = all.binary_search_by_key(&number, |posed| posed.number);
            found.map(|row| all[row].clone()).map_err(|_| {
                of_file(format!(
                    "frames: it has no number {number}, of {}",
                    all.len()
                ))
            })
        };
        wanted.into_iter().map(find).collect()
    }

    fn nerf(&self, map: &Map<String, Value>, size: Option<[u32; 2]>) -> Result<Vec<Posed>, String> {
        let frames = map["frames"].as_array().ok_or("frames is no list")?;
        let each = frames.iter().enumerate().map(|(number, frame)| {
            let of_frame = |why: String| format!("frame {number}: {why}");
            let number_of = |key: &str| -> Result<Option<f64>, String> {
                match frame.get(key).or(map.get(key)) {
                    None | Some(Value::Null) => Ok(None),
                    Some(value) => match value.as_f64().filter(|x| x.is_finite()) {
                        Some(x) => Ok(Some(x)),
                        None => Err(of_frame(format!("{key} is no number"))),
                    },
                }
            };
            for key in ["camera_model", "is_fisheye"] {
                let model = frame.get(key).or(map.get(key));
                let is_known = match model {
                    None | Some(Value::Null | Value::Bool(false)) => true,
                    Some(Value::String(model)) => {
                        ["OPENCV", "PINHOLE", "SIMPLE_PINHOLE"].contains(&&model[..])
                    }
                    Some(_) => false,
                };
                if !is_known {
                    return Err(of_frame(format!(
                        "{key} is {}; pinholes are read, with k1, k2, p1, p2 and k3",
                        model.unwrap_or(&Value::Null)
                    )));
                }
            }
            if number_of("k4")?.is_some_and(|k4| k4 != 0.0) {
                return Err(of_frame(
                    "k4 is of another model of lenses than is read".into(),
                ));
            }
            let sides = (number_of("w")?, number_of("h")?);
            let own = match sides {
                (Some(w), Some(h)) => Some(size_of(&format!("{w}x{h}")).ok_or_else(|| {
                    of_frame(format!("w and h are {w} and {h}, and no size of pictures"))
                })?),
                _ => None,
            };
            let size = own.or(size).ok_or_else(|| of_frame(no_size()))?;
            let [w, h] = size.map(f64::from);
            let by_angle = |side: f64, angle: f64| side / (2.0 * libm::tan(0.5 * angle));
            let across = match number_of("fl_x")? {
                Some(focal) => Some(focal),
                None => number_of("camera_angle_x")?.map(|angle| by_angle(w, angle)),
            };
            let up = match number_of("fl_y")? {
                Some(focal) => Some(focal),
                None => number_of("camera_angle_y")?.map(|angle| by_angle(h, angle)),
            };
            let focal = match (across, up) {
                (Some(x), Some(y)) => [x, y],
                (Some(one), None) | (None, Some(one)) => [one, one],
                (None, None) => {
                    return Err(of_frame("it has neither fl_x nor camera_angle_x".into()));
                }
            };
            // NeRF's pixel 0 begins at 0; OpenCV's has its centre there.
            let cx = number_of("cx")?.unwrap_or(0.5 * w) - 0.5;
            let cy = number_of("cy")?.unwrap_or(0.5 * h) - 0.5;
            let mut distortion = [0.0; 5];
            for (number, key) in distortion.iter_mut().zip(["k1", "k2", "p1", "p2", "k3"]) {
                *number = number_of(key)?.unwrap_or(0.0);
            }
            let lens = Lens {
                focal,
                center: [cx, cy],
                size,
                distortion,
            };
            let rows = frame.get("transform_matrix").and_then(matrix);
            let rows = rows.ok_or_else(|| {
                of_frame("transform_matrix is no matrix of 3 or 4 rows of 4 numbers".into())
            })?;
            let column = |k: usize| DVec3::from_array(rows.map(|row| row[k]));
            let turn = DMat3::from_cols(column(0), -column(1), -column(2));
            let eye = column(3) * self.scale.unwrap_or(1.0);
            posed(number as u32, (turn, eye), &lens).map_err(of_frame)
        });
        each.collect()
    }

    fn bop(&self, map: &Map<String, Value>, size: Option<[u32; 2]>) -> Result<Vec<Posed>, String> {
        let each = map.iter().map(|(key, picture)| {
            let of_picture = |why: &str| format!("picture {key}: {why}");
            let list = |name: &str| picture.get(name).and_then(numbers);
            let k = list("cam_K").filter(|k| k.len() == 9);
            let k = k.ok_or_else(|| of_picture("cam_K is no list of 9 numbers"))?;
            let turn = list("cam_R_w2c").filter(|r| r.len() == 9);
            let shift = list("cam_t_w2c").filter(|t| t.len() == 3);
            let (Some(turn), Some(shift)) = (turn, shift) else {
                return Err(of_picture(
                    "it has no cam_R_w2c of 9 numbers with a cam_t_w2c of 3, so its place in the \
                     scene is not known",
                ));
            };
            if k[1] != 0.0 {
                return Err(of_picture("cam_K is skewed, and no camera here is"));
            }
            let lens = Lens {
                focal: [k[0], k[4]],
                center: [k[2], k[5]],
                size: size.ok_or_else(|| of_picture(&no_size()))?,
                distortion: [0.0; 5],
            };
            // Rows of the rotation to the camera are the camera's axes in the world.
            let row = |i: usize| DVec3::new(turn[3 * i], turn[3 * i + 1], turn[3 * i + 2]);
            let turn = DMat3::from_cols(row(0), row(1), row(2));
            let shift = DVec3::new(shift[0], shift[1], shift[2]);
            let eye = turn * -shift * self.scale.unwrap_or(0.001);
            let number = key.parse().map_err(|_| of_picture("it is no number"))?;
            posed(number, (turn, eye), &lens).map_err(|why| of_picture(&why))
        });
        each.collect()
    }
}

fn no_size() -> String {
    "the size of its pictures is not known; add size = \"640x480\" to the camera, or to [render]"
        .into()
}

/// Writes a camera as options. Fails if its axes are no rotation.
fn posed(number: u32, (turn, eye): (DMat3, DVec3), lens: &Lens) -> Result<Posed, String> {
    let near = |x: f64, y: f64| (x - y).abs() < 1e-3;
    let square = turn.transpose() * turn - DMat3::IDENTITY;
    let is_turn = near(turn.determinant(), 1.0)
        && square.to_cols_array().iter().all(|x| near(*x, 0.0))
        && eye.is_finite();
    if !is_turn {
        return Err("its matrix is no rotation and a place".into());
    }
    if !lens.focal.iter().all(|f| *f > 0.0) {
        return Err("its focal lengths are not above 0".into());
    }
    let rows = (0..3).flat_map(|k| [turn.x_axis[k], turn.y_axis[k], turn.z_axis[k], eye[k]]);
    let mut k = vec![lens.focal[0], lens.focal[1], lens.center[0], lens.center[1]];
    k.extend(lens.size.map(f64::from));
    if lens.distortion != [0.0; 5] {
        k.extend(lens.distortion);
    }
    let text = |numbers: &mut dyn Iterator<Item = f64>| {
        // -0 is 0 everywhere here.
        let texts: Vec<String> = numbers.map(|x| (x + 0.0).to_string()).collect();
        texts.join(",")
    };
    Ok(Posed {
        number,
        arguments: [
            format!("--pose={}", text(&mut rows.into_iter())),
            format!("--k={}", text(&mut k.into_iter())),
        ],
    })
}

fn numbers(value: &Value) -> Option<Vec<f64>> {
    let number = |x: &Value| x.as_f64().filter(|x| x.is_finite());
    value.as_array()?.iter().map(number).collect()
}

fn matrix(value: &Value) -> Option<[[f64; 4]; 3]> {
    let rows: Vec<Vec<f64>> = value
        .as_array()?
        .iter()
        .map(numbers)
        .collect::<Option<_>>()?;
    let row = |i: usize| rows.get(i)?.as_slice().try_into().ok();
    matches!(rows.len(), 3 | 4).then_some(())?;
    Some([row(0)?, row(1)?, row(2)?])
}

/// Reads WIDTHxHEIGHT.
fn size_of(text: &str) -> Option<[u32; 2]> {
    let (w, h) = text.split_once(['x', 'X'])?;
    let side = |text: &str| {
        text.trim()
            .parse()
            .ok()
            .filter(|side| (1..=65_535).contains(side))
    };
    Some([side(w)?, side(h)?])
}

/// Returns the size in BOP's `camera.json`, which lies beside the file or above its two folders.
fn size_beside(path: &Path) -> Option<[u32; 2]> {
    let folders = path.parent()?.ancestors().take(3);
    let read = |folder: &Path| {
        let bytes = fs::read(folder.join("camera.json")).ok()?;
        let value: Value = serde_json::from_slice(&bytes).ok()?;
        let side = |key: &str| value.get(key)?.as_f64();
        size_of(&format!("{}x{}", side("width")?, side("height")?))
    };
    folders.into_iter().find_map(read)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, file: &str) -> Result<Vec<Posed>, String> {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("c.json"), text).unwrap();
        let file: CameraFile = toml::from_str(&format!("file = \"c.json\"\n{file}")).unwrap();
        file.read(folder.path(), None)
    }

    #[test]
    fn the_cameras_of_nerf_look_along_minus_z() {
        let one = r#"{"w": 640, "h": 480, "fl_x": 500, "cx": 320, "cy": 240, "k1": 0.1, "frames": [
            {"file_path": "a", "transform_matrix": [[1,0,0,2],[0,1,0,3],[0,0,1,4],[0,0,0,1]]},
            {"fl_x": 400, "fl_y": 401, "k1": 0,
             "transform_matrix": [[1,0,0,2],[0,1,0,3],[0,0,1,4],[0,0,0,1]]}]}"#;
        let both = read(one, "").unwrap();
        assert_eq!(both[0].arguments[0], "--pose=1,0,0,2,0,-1,0,3,0,0,-1,4");
        assert_eq!(
            both[0].arguments[1],
            "--k=500,500,319.5,239.5,640,480,0.1,0,0,0,0"
        );
        assert_eq!(both[1].arguments[1], "--k=400,401,319.5,239.5,640,480");
        assert_eq!(read(one, "frames = \"1\"").unwrap(), both[1..]);
        assert!(
            read(one, "frames = \"2\"")
                .unwrap_err()
                .contains("no number 2")
        );
        let angle = r#"{"camera_angle_x": 1.5707963267948966, "frames": [
            {"transform_matrix": [[0,0,1,1],[1,0,0,0],[0,1,0,0],[0,0,0,1]]}]}"#;
        assert!(read(angle, "").unwrap_err().contains("size = "));
        let angle = read(angle, "size = \"200x100\"\nscale = 2.0").unwrap();
        assert!(angle[0].arguments[1].starts_with("--k=100"), "{angle:?}");
        assert!(
            angle[0].arguments[1].ends_with(",99.5,49.5,200,100"),
            "{angle:?}"
        );
        assert_eq!(angle[0].arguments[0], "--pose=0,0,-1,2,1,0,0,0,0,-1,0,0");
    }

    #[test]
    fn the_cameras_of_bop_are_inverted_and_in_millimetres() {
        let text = r#"{"10": {"cam_K": [600,0,320,0,601,240,0,0,1], "depth_scale": 0.1,
              "cam_R_w2c": [0,1,0,-1,0,0,0,0,1], "cam_t_w2c": [1000,2000,3000]},
            "9": {"cam_K": [600,0,320,0,601,240,0,0,1],
              "cam_R_w2c": [1,0,0,0,1,0,0,0,1], "cam_t_w2c": [0,0,0]}}"#;
        let both = read(text, "size = \"640x480\"").unwrap();
        assert_eq!([both[0].number, both[1].number], [9, 10]);
        assert_eq!(both[1].arguments[0], "--pose=0,-1,0,2,1,0,0,-1,0,0,1,-3");
        assert_eq!(both[1].arguments[1], "--k=600,601,320,240,640,480");
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let said = |text: &str| read(text, "size = \"9x9\"").unwrap_err();
        assert!(said("{").contains("c.json: EOF"));
        assert!(said("[]").contains("neither"));
        assert!(said(r#"{"frames": 3}"#).contains("no list"));
        let frame = |f: &str| said(&format!("{{\"fl_x\": 3, \"frames\": [{f}]}}"));
        assert!(frame("{}").contains("frame 0: transform_matrix"));
        assert!(frame(r#"{"transform_matrix": [[1,0],[0,1]]}"#).contains("transform_matrix"));
        let scaled = r#"{"transform_matrix": [[2,0,0,0],[0,2,0,0],[0,0,2,0]]}"#;
        assert!(frame(scaled).contains("no rotation"));
        assert!(frame(r#"{"fl_x": "a"}"#).contains("fl_x is no number"));
        assert!(frame(r#"{"camera_model": "OPENCV_FISHEYE"}"#).contains("pinholes"));
        assert!(said(r#"{"0": {}}"#).contains("picture 0: cam_K"));
        let moved = r#"{"0": {"cam_K": [1,0,0,0,1,0,0,0,1]}}"#;
        assert!(said(moved).contains("cam_R_w2c"));
    }
}
