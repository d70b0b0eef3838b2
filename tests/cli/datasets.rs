//! Data sets of `lanecast batch`: masks by closed formulas, cameras of files, options by chance, and
//! what is left of objects that are gone.

use crate::run::{folder, lanecast, names, stderr, stdout};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

/// A ball, a wall before its left half as the camera sees it, and a floor that is no object.
const SCENE: &str = "format = 1\n\
    [[light]]\npoint = { position = [3, 4, 5], intensity = [90, 90, 90] }\n\
    [shape.\"ball.7\"]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
    [shape.wall]\nbox = { min = [-9, -9, 1.5], max = [0, 9, 1.75] }\n\
    [shape.floor]\nhalf_space = { normal = [0, 1, 0], offset = -1 }\n\
    [[instance]]\nshape = \"ball.7\"\n\
    [[instance]]\nshape = \"floor\"\n\
    [[instance]]\nshape = \"wall\"\n";

/// Two cameras, of which one has the ball at the border of its picture.
const CAMERAS: &str = r#"{"w": 40, "h": 30, "fl_x": 50, "fl_y": 52, "cx": 21, "cy": 15, "frames": [
    {"transform_matrix": [[1,0,0,0],[0,1,0,0.25],[0,0,1,5],[0,0,0,1]]},
    {"transform_matrix": [[1,0,0,-1.75],[0,1,0,0.25],[0,0,1,5],[0,0,0,1]]}]}"#;

const JOB: &str = "format = 1\nscene = \"scene.toml\"\ncamera = { file = \"cameras.json\" }\n\
    [dataset]\nwrite = [\"bop\", \"coco\", \"nerf\", \"kubric\"]\n\
    category = [{ id = 2, name = \"ball\", objects = \"ball*\" },\n\
    { id = 9, name = \"wall\", objects = \"wall\" }]\n";

fn job(job: &str) -> tempfile::TempDir {
    let folder = folder();
    fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    fs::write(folder.path().join("cameras.json"), CAMERAS).unwrap();
    fs::write(folder.path().join("job.toml"), job).unwrap();
    folder
}

fn succeeds(folder: &Path, arguments: &[&str]) -> String {
    let done = lanecast(folder, &[&["batch", "job.toml"], arguments].concat());
    assert_eq!(done.status.code(), Some(0), "{}", stderr(&done));
    stdout(&done).into()
}

fn refused(text: &str) -> String {
    let folder = job(text);
    let done = lanecast(folder.path(), &["batch", "job.toml", "--list"]);
    assert_eq!(done.status.code(), Some(3), "{}", stderr(&done));
    stderr(&done).into()
}

fn read(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// Counts the pixels whose rays meet the ball, of columns and rows of a picture of 40 by 30, and how
/// many of these have the wall before them.
fn ball(eye: [f64; 3], columns: std::ops::Range<i32>, rows: std::ops::Range<i32>) -> [u64; 2] {
    let (mut met, mut hidden) = (0, 0);
    for (x, y) in rows.flat_map(|y| columns.clone().map(move |x| (x, y))) {
        let (x, y) = ((f64::from(x) - 20.5) / 50.0, (14.5 - f64::from(y)) / 52.0);
        // The distance of the line from the ball's middle is below 1.
        let dir = [x, y, -1.0];
        let square = |v: [f64; 3]| v.iter().map(|c| c * c).sum::<f64>();
        let along: f64 = eye.iter().zip(dir).map(|(e, d)| e * d).sum();
        if square(eye) - along * along / square(dir) < 1.0 {
            met += 1;
            // The wall's front is 3.25 before the eye, its back 3.5.
            hidden += u64::from(eye[0] + x * 3.25 < 0.0 || eye[0] + x * 3.5 < 0.0);
        }
    }
    [met, hidden]
}

#[test]
fn masks_are_what_closed_formulas_say() {
    let folder = job(JOB);
    let path = folder.path();
    succeeds(path, &["--out", "out"]);
    succeeds(path, &["--out", "out", "--merge"]);
    let chunk = path.join("out/train_pbr/000000");
    let about = read(&chunk.join("scene_gt_info.json"));
    for (number, eye) in [[0.0, 0.25, 5.0], [-1.75, 0.25, 5.0]]
        .into_iter()
        .enumerate()
    {
        let ball_info = &about[number.to_string()][0];
        let [all, _] = ball(eye, -40..80, -30..60);
        let [inside, hidden] = ball(eye, 0..40, 0..30);
        assert_eq!(ball_info["px_count_all"], all, "{number}");
        assert_eq!(ball_info["px_count_visib"], inside - hidden, "{number}");
        assert_eq!(ball_info["px_count_valid"], inside, "{number}");
        assert!(if number == 0 {
            all == inside
        } else {
            all > inside && inside > 0
        });
    }
    let truth = &read(&chunk.join("scene_gt.json"))["0"];
    assert_eq!(truth[0]["cam_t_m2c"], json!([0.0, 250.0, 5000.0]));
    assert_eq!(
        (&truth[0]["obj_id"], &truth[1]["obj_id"]),
        (&json!(2), &json!(9))
    );
    assert_eq!(truth.as_array().unwrap().len(), 2);
    let coco = read(&path.join("out/coco.json"));
    let areas = coco["annotations"].as_array().unwrap().iter();
    let areas: Vec<&Value> = areas.map(|a| &a["area"]).collect();
    assert_eq!(areas[0], &about["0"][0]["px_count_visib"]);
    assert_eq!(
        coco["images"][1]["file_name"],
        "train_pbr/000000/rgb/000001.png"
    );
    assert_eq!(names(&chunk.join("mask")).len(), 4);
    // The cameras are written as they were read.
    let (told, asked) = (
        read(&path.join("out/transforms.json")),
        CAMERAS.replace('\n', ""),
    );
    let asked: Value = serde_json::from_str(&asked).unwrap();
    for (told, frame) in told["frames"].as_array().unwrap().iter().zip(0..) {
        for key in ["fl_x", "fl_y", "cx", "cy", "w", "h"] {
            assert_eq!(told[key].as_f64(), asked[key].as_f64(), "{key}");
        }
        let matrices = [told, &asked["frames"][frame]].map(|f| f["transform_matrix"].clone());
        let numbers = matrices.each_ref().map(|matrix| {
            let rows = matrix.as_array().unwrap().iter();
            let numbers = rows.flat_map(|row| row.as_array().unwrap().iter().map(Value::as_f64));
            numbers.collect::<Vec<_>>()
        });
        assert_eq!(numbers[0], numbers[1]);
    }
    let track = &read(&path.join("out/metadata_000000.json"))["instances"][0];
    assert_eq!(
        (&track["asset_id"], &track["category"]),
        (&json!("ball.7"), &json!(2))
    );
}

#[test]
fn a_picture_of_a_data_set_has_the_bits_of_render() {
    let folder = job(JOB);
    let path = folder.path();
    succeeds(path, &["--out", "out"]);
    for (number, line) in succeeds(path, &["--list", "--json"]).lines().enumerate() {
        let line: Value = serde_json::from_str(line).unwrap();
        let command = line["command"].as_array().unwrap().iter();
        let mut command: Vec<&str> = command.map(|word| word.as_str().unwrap()).collect();
        let place = command.iter().position(|word| *word == "-o").unwrap() + 1;
        command[place] = "alone.png";
        let done = lanecast(path, &command);
        assert!(done.status.success(), "{}", stderr(&done));
        let of_job = format!("out/train_pbr/000000/rgb/{number:06}.png");
        assert!(fs::read(path.join("alone.png")).unwrap() == fs::read(path.join(of_job)).unwrap());
    }
}

#[test]
fn parts_make_one_data_set_and_lost_files_are_made_again() {
    let folder = job(JOB);
    let path = folder.path();
    succeeds(path, &["--out", "all"]);
    succeeds(path, &["--out", "all", "--merge"]);
    succeeds(path, &["--out", "parts", "--shard", "1/2"]);
    let early = lanecast(path, &["batch", "job.toml", "--out", "parts", "--merge"]);
    assert_eq!(early.status.code(), Some(1), "{}", stderr(&early));
    succeeds(path, &["--out", "parts", "--shard", "0/2"]);
    fs::remove_file(path.join("parts/train_pbr/000000/mask/000001_000000.png")).unwrap();
    let again = succeeds(path, &["--out", "parts"]);
    assert!(
        again.contains("1 pictures") && again.contains("1 were there"),
        "{again}"
    );
    succeeds(path, &["--out", "parts", "--merge"]);
    for file in [
        "coco.json",
        "transforms.json",
        "camera.json",
        "metadata_000001.json",
    ] {
        let bytes = ["all", "parts"].map(|out| fs::read(path.join(out).join(file)).unwrap());
        assert!(bytes[0] == bytes[1], "{file}");
    }
    for kind in [
        "rgb",
        "depth",
        "mask",
        "mask_visib",
        "view",
        "objects",
        "categories",
        "coordinates",
    ] {
        let folders =
            ["all", "parts"].map(|out| path.join(out).join("train_pbr/000000").join(kind));
        assert_eq!(names(&folders[0]), names(&folders[1]));
        for name in names(&folders[0]) {
            let bytes = folders
                .each_ref()
                .map(|folder| fs::read(folder.join(&name)).unwrap());
            assert!(bytes[0] == bytes[1], "{kind}/{name}");
        }
    }
    // What is gone from the scene is gone from the data set.
    let without = SCENE.replace("[[instance]]\nshape = \"wall\"\n", "");
    fs::write(path.join("scene.toml"), without).unwrap();
    succeeds(path, &["--out", "parts"]);
    let masks = names(&path.join("parts/train_pbr/000000/mask"));
    assert_eq!(masks, ["000000_000000.png", "000001_000000.png"]);
}

#[test]
fn what_is_drawn_depends_on_seed_and_number_alone() {
    let text = |count: u32, more: &str| {
        format!(
            "format = 1\nscene = \"scene.toml\"\n[random]\ncount = {count}\nseed = 5\n\
             orbit = [[0, 360], [10, 60], 40]\n{more}"
        )
    };
    let listed = |text: &str| -> Vec<Vec<String>> {
        let folder = job(text);
        let lines = succeeds(folder.path(), &["--list", "--json"]);
        let lines = lines.lines().map(|line| {
            let line: Value = serde_json::from_str(line).unwrap();
            let command = line["command"].as_array().unwrap().iter();
            let words = command.map(|word| word.as_str().unwrap().to_owned());
            words.filter(|word| word.starts_with("--orbit")).collect()
        });
        lines.collect()
    };
    let few = listed(&text(3, ""));
    let more = listed(&text(20, "exposure = [-1, 1]\n"));
    assert_eq!(few, more[..3]);
    assert!(more.iter().all(|orbit| orbit.len() == 1));
    let folder = job(&text(2, "[render]\nsize = \"8x8\"\n"));
    succeeds(folder.path(), &["--out", "out"]);
    let made = names(&folder.path().join("out"));
    assert_eq!(made, ["records", "scene_00000.png", "scene_00001.png"]);
}

#[test]
fn wrong_jobs_are_refused_with_the_remedy() {
    let with = |more: &str| refused(&format!("format = 1\nscene = \"scene.toml\"\n{more}"));
    let view = with("view = \"front\"\n[dataset]\nwrite = \"coco\"\n");
    assert!(view.contains("ask for orbit or camera"), "{view}");
    let output = with("output = \"a.png\"\n[dataset]\nwrite = \"bop\"\n");
    assert!(output.contains("leave output out"), "{output}");
    let format = with("[dataset]\nwrite = \"voc\"\n");
    assert!(format.contains("`bop`"), "{format}");
    let twice = with("[render]\nexposure = 1\n[random]\ncount = 1\nexposure = [0, 1]\n");
    assert!(twice.contains("leave it out there"), "{twice}");
    let unknown = with("[random]\ncount = 1\nsun = [0, 1]\n");
    assert!(unknown.contains("sun is no option"), "{unknown}");
    let views = with("view = \"front\"\n[random]\ncount = 1\norbit = [[0, 1], 2]\n");
    assert!(views.contains("leave these out"), "{views}");
    let count = with("[random]\ncount = 0\n");
    assert!(count.contains("count is a number"), "{count}");
    let lost = with("camera = { file = \"lost.json\" }\n");
    assert!(lost.contains("lost.json: cannot be read"), "{lost}");
    let key = with("camera = { fil = \"lost.json\" }\n");
    assert!(key.contains("transforms.json"), "{key}");
}

#[test]
fn what_a_data_set_has_no_numbers_for_fails_alone() {
    let folder = job(
        "format = 1\nscene = \"scene.toml\"\ncamera = { file = \"cameras.json\" }\n\
        [render]\nsize = \"16x12\"\n[dataset]\nwrite = \"bop\"\n",
    );
    let path = folder.path();
    fs::write(
        path.join("cameras.json"),
        CAMERAS.replace("\"cx\"", "\"k1\": 0.1, \"cx\""),
    )
    .unwrap();
    let done = lanecast(path, &["batch", "job.toml", "--out", "out"]);
    assert_eq!(done.status.code(), Some(1), "{}", stderr(&done));
    assert!(stderr(&done).contains("leave bop out"), "{}", stderr(&done));
    // Steps of depth that are too small are counted.
    let folder = job(&JOB.replace("write =", "depth_scale = 0.01\nwrite ="));
    succeeds(folder.path(), &["--out", "out"]);
    let merged = lanecast(
        folder.path(),
        &["batch", "job.toml", "--out", "out", "--merge"],
    );
    assert!(merged.status.success(), "{}", stderr(&merged));
    assert!(
        stderr(&merged).contains("of 2 pictures lie farther"),
        "{}",
        stderr(&merged)
    );
}
