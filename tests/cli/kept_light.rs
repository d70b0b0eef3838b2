//! Records of indirect light that are kept: from frame to frame, and in files.

use crate::run::{folder, lanecast, names, stderr};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A ball on a floor below a lamp, so that each gets light from the other.
const SCENE: &str = "format = 1
[camera]
eye = [0, 2, 5]
look_at = [0, 0.5, 0]
fov_y = 40
[[light]]
directional = { direction = [-1, -2, -1], irradiance = [3, 3, 3] }
[material.white]
base_color = [0.8, 0.8, 0.8]
roughness = 1.0
specular = 0.0
[shape.floor]
box = { min = [-3, -0.1, -3], max = [3, 0, 3] }
[shape.ball]
sphere = { center = [0, 0.7, 0], radius = 0.7 }
[[instance]]
shape = 'floor'
material = 'white'
[[instance]]
shape = 'ball'
material = 'white'
";

const CAMERA_MOTION: &str = "fov_y = 40\nmotion = [{ at = 1.0, eye = [0.5, 2, 5] }]";
const BALL_MOTION: &str = "motion = [{ at = 1.0, transform = [{ translate = [0.1, 0, 0] }] }]\n";

fn scene() -> tempfile::TempDir {
    let folder = folder();
    let path = folder.path();
    let moving_camera = SCENE.replace("fov_y = 40", CAMERA_MOTION);
    fs::write(path.join("s.toml"), SCENE).unwrap();
    fs::write(path.join("camera.toml"), &moving_camera).unwrap();
    fs::write(path.join("ball.toml"), format!("{SCENE}{BALL_MOTION}")).unwrap();
    folder
}

/// Renders with a coarse cache; returns whether it did, and what was said.
fn rendered(folder: &Path, arguments: &str) -> (Option<i32>, String) {
    let first = "render --size 32x24 --spp 2 --cache irradiance --cache-error 1";
    let all: Vec<&str> = first
        .split_whitespace()
        .chain(arguments.split_whitespace())
        .collect();
    let done = lanecast(folder, &all);
    let said = stderr(&done).to_owned();
    assert!(!said.contains("panicked"), "{arguments}: {said}");
    (done.status.code(), said)
}

fn succeeds(folder: &Path, arguments: &str) -> String {
    let (code, said) = rendered(folder, arguments);
    assert_eq!(code, Some(0), "{arguments}: {said}");
    said
}

fn refused(folder: &Path, arguments: &str, code: i32, says: &str) {
    let before = names(folder);
    let (found, said) = rendered(folder, arguments);
    assert_eq!(found, Some(code), "{arguments}: {said}");
    assert!(said.contains(says), "{arguments}: {said}");
    assert_eq!(said.matches("error: ").count(), 1, "{arguments}: {said}");
    assert_eq!(names(folder), before, "{arguments}");
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap()
}

/// The numbers of records from a file, kept and added, of a table of statistics.
fn counts(of: &Value) -> [u64; 3] {
    ["from_file", "kept", "added"].map(|name| of["cache"][name].as_u64().unwrap())
}

fn stats(folder: &Path, name: &str) -> Value {
    serde_json::from_slice(&bytes(folder, name)).unwrap()
}

#[test]
fn a_picture_from_a_file_of_records_is_that_which_wrote_it() {
    let folder = scene();
    let path = folder.path();
    succeeds(path, "s.toml -o plain.exr");
    succeeds(path, "s.toml --cache-file c -o first.exr --stats 1.json");
    let file = bytes(path, "c");
    let said = stats(path, "1.json");
    let [read, kept, made] = counts(&said);
    assert_eq!([read, kept], [0, 0]);
    assert!(made > 10 && said["cache"]["seconds"].as_f64().unwrap() > 0.0);
    for more in ["--threads 1", "--threads 2", "--lanes 1", "--accel kd"] {
        succeeds(
            path,
            &format!("s.toml --cache-file c -o again.exr --stats 2.json {more}"),
        );
        assert_eq!(counts(&stats(path, "2.json")), [made, 0, 0], "{more}");
        assert!(
            bytes(path, "again.exr") == bytes(path, "first.exr"),
            "{more}"
        );
        assert!(bytes(path, "c") == file, "{more}");
    }
    assert!(bytes(path, "plain.exr") == bytes(path, "first.exr"));
    // Another view adds what it lacks, and less than by itself.
    succeeds(path, "s.toml --orbit 10,20 -o o.exr --stats 3.json");
    let alone = counts(&stats(path, "3.json"))[2];
    succeeds(
        path,
        "s.toml --orbit 10,20 --cache-file c -o o.exr --stats 4.json",
    );
    let [read, kept, added] = counts(&stats(path, "4.json"));
    assert!(
        read > 0 && kept == 0 && added < alone,
        "{read} {added} of {alone}"
    );
    succeeds(
        path,
        "s.toml --orbit 10,20 --cache-file c -o p.exr --stats 5.json",
    );
    assert_eq!(counts(&stats(path, "5.json")), [read + added, 0, 0]);
    assert!(bytes(path, "o.exr") == bytes(path, "p.exr"));
}

/// Rule S117: from three times as near pixels are narrower than those that records were made for.
#[test]
fn records_of_wider_pixels_stay_for_views_that_have_them() {
    let folder = scene();
    let path = folder.path();
    let view = |eye: &str, name: &str| {
        let place = format!("--eye={eye} --look-at=0,0.5,0 --fov-y 40");
        let line = format!("s.toml {place} --cache-file c -o {name}.exr --stats s.json");
        succeeds(path, &line);
        counts(&stats(path, "s.json"))
    };
    let far = view("0,5,15", "far")[2];
    let [read, _, near] = view("0,2,5", "near");
    assert!(far > 10 && near > 10);
    assert_eq!(read, 0);
    // The far view has the records of both, the near one those that it had.
    assert_eq!(view("0,5,15", "farther"), [far + near, 0, 0]);
    assert_eq!(view("0,2,5", "again"), [near, 0, 0]);
    assert!(bytes(path, "near.exr") == bytes(path, "again.exr"));
}

#[test]
fn a_file_of_records_of_something_else_is_refused() {
    let folder = scene();
    let path = folder.path();
    succeeds(path, "s.toml --cache-file c -o x.exr");
    let good = bytes(path, "c");
    let again = |more: &str| format!("s.toml --cache-file c -o y.exr {more}");
    refused(
        path,
        "ball.toml --cache-file c -o y.exr",
        3,
        "another scene",
    );
    refused(
        path,
        &again("--max-bounces 3"),
        3,
        "--max-bounces 16, not 3",
    );
    refused(path, &again("--seed 1"), 3, "--seed 0, not 1");
    refused(path, &again("--precision fast"), 3, "--precision");
    let other = "--cache-error 0.5";
    let all = "render s.toml --size 32x24 --cache irradiance --cache-file c -o y.exr";
    let all: Vec<&str> = all.split(' ').chain(other.split(' ')).collect();
    let done = lanecast(path, &all);
    assert_eq!(done.status.code(), Some(3));
    assert!(stderr(&done).contains("--cache-error 1, not 0.5"));
    // A camera is no part of the scene's light, nor are pictures' sizes.
    succeeds(path, "camera.toml --cache-file c -o y.exr --filter box");
    fs::write(path.join("c"), &good[..good.len() - 1]).unwrap();
    refused(path, &again(""), 3, "c: records of --cache-file: it has");
    fs::write(path.join("c"), "records").unwrap();
    refused(path, &again(""), 3, "remove the file, or name another");
    refused(
        path,
        "s.toml --cache-file s.toml -o y.exr",
        2,
        "is the input",
    );
    refused(path, "s.toml --cache-file y.exr -o y.exr", 2, "two outputs");
    refused(path, "s.toml --cache-file no/c -o y.exr", 4, "no/c");
    refused(path, "s.toml --cache-file - -o y.exr", 2, "name a file");
    refused(path, "s.toml --cache-keep on -o y.exr", 2, "--frames");
}

/// A scene without light is lit by a studio around its camera.
#[test]
fn records_of_a_studio_are_of_one_view() {
    let folder = scene();
    let path = folder.path();
    let dark = "directional = { direction = [-1, -2, -1], irradiance = [3, 3, 3] }";
    let dark = SCENE.replace(dark, "").replace("[[light]]", "");
    fs::write(path.join("dark.toml"), &dark).unwrap();
    let motion = dark.replace("fov_y = 40", CAMERA_MOTION);
    fs::write(path.join("turned.toml"), motion).unwrap();
    succeeds(path, "dark.toml --cache-file c -o x.exr");
    succeeds(path, "dark.toml --cache-file c -o y.exr");
    assert!(bytes(path, "x.exr") == bytes(path, "y.exr"));
    let other = "dark.toml --orbit 30,20 --cache-file c -o z.exr";
    refused(path, other, 3, "are of other light");
    // Frames each have their own studio, and no records of the others.
    succeeds(path, "turned.toml --frames 2 -o k.exr --stats k.json");
    succeeds(path, "turned.toml --frames 2 -o a.exr --cache-keep off");
    assert_eq!(counts(&stats(path, "k.json")["frames"][1])[1], 0);
    assert!(bytes(path, "k_0001.exr") == bytes(path, "a_0001.exr"));
    for option in ["--cache-file c", "--cache-keep on"] {
        let line = format!("turned.toml --frames 2 {option} -o y.exr");
        refused(path, &line, 2, "turns with the camera");
    }
}

#[test]
fn a_frame_at_rest_makes_only_the_records_that_the_frames_before_lack() {
    let folder = scene();
    let path = folder.path();
    let said = succeeds(path, "camera.toml --frames 3 -o k.exr --stats k.json");
    assert!(said.contains("note: records of --cache are kept"), "{said}");
    let off = "camera.toml --frames 3 -o a.exr --cache-keep off --stats a.json";
    let said = succeeds(path, off);
    assert!(!said.contains("note:"), "{said}");
    let [kept, alone] = ["k.json", "a.json"].map(|name| stats(path, name));
    let of = |stats: &Value, frame: usize| counts(&stats["frames"][frame]);
    assert_eq!(of(&kept, 0), of(&alone, 0));
    for frame in [1, 2] {
        let ([_, before, added], [_, none, whole]) = (of(&kept, frame), of(&alone, frame));
        assert!(before > 10 && none == 0, "{before} {none}");
        assert!(2 * added < whole, "{added} of {whole}");
    }
    assert!(bytes(path, "k_0000.exr") == bytes(path, "a_0000.exr"));
    succeeds(path, "camera.toml --frames 3 -o b.exr --threads 1");
    succeeds(
        path,
        "camera.toml --frames 3 -o c.exr --threads 2 --lanes 4",
    );
    for frame in 0..3 {
        let of = |name: &str| bytes(path, &format!("{name}_000{frame}.exr"));
        assert!(of("k") == of("b") && of("k") == of("c"), "{frame}");
    }
    // A frame alone is that of the sequence without keeping, and with a file none needs the others.
    succeeds(
        path,
        "camera.toml --frames 0..3 --fps 2 -o f.exr --cache-file c",
    );
    for name in ["g", "h"] {
        let range = if name == "g" { "0..3" } else { "2..3" };
        let line = format!("camera.toml --frames {range} --fps 2 -o {name}.exr --cache-file c");
        succeeds(path, &line);
    }
    assert!(bytes(path, "g_0002.exr") == bytes(path, "h_0002.exr"));
}

#[test]
fn a_scene_that_moves_keeps_no_records() {
    let folder = scene();
    let path = folder.path();
    let said = succeeds(path, "ball.toml --frames 2 -o k.exr --stats k.json");
    assert!(!said.contains("note:"), "{said}");
    let frames = &stats(path, "k.json")["frames"];
    assert_eq!(counts(&frames[1])[..2], [0, 0]);
    succeeds(path, "ball.toml --frames 2 -o a.exr --cache-keep off");
    assert!(bytes(path, "k_0001.exr") == bytes(path, "a_0001.exr"));
    let file = "ball.toml --frames 2 --cache-file c -o y.exr";
    refused(path, file, 2, "more moves than the camera");
    let keep = "ball.toml --frames 2 --cache-keep on -o y.exr";
    refused(path, keep, 2, "more moves than the camera");
}
