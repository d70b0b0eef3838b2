//! Open shutters from the command line.

use crate::run::{fails, folder, lanecast, names, stderr, stdout};
use std::fs;
use std::path::Path;

const SCENE: &str = "format = 1
[camera]
eye = [0, 0, 5]
look_at = [0, 0, 0]
fov_y = 30
motion = [{ at = 1, eye = [1, 0, 5] }]
[[light]]
directional = { direction = [0, -1, -1], irradiance = [3, 3, 3] }
[shape.ball]
sphere = { center = [0, 0, 0], radius = 0.5 }
[[instance]]
shape = \"ball\"
motion = [{ at = 1, transform = [{ translate = [1, 0.5, 0] }] }]
";

fn scene(text: &str) -> tempfile::TempDir {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), text).unwrap();
    folder
}

fn rendered(folder: &Path, to: &str, more: &[&str]) -> Vec<u8> {
    let arguments = ["render", "s.toml", "--size", "24x18", "-o", to];
    let done = lanecast(folder, &[&arguments, more].concat());
    assert!(done.status.success(), "{more:?}: {}", stderr(&done));
    fs::read(folder.join(to)).unwrap_or_default()
}

#[test]
fn a_shutter_blurs_and_can_be_taken_out() {
    let folder = scene(SCENE);
    let path = folder.path();
    let still = rendered(path, "still.exr", &["--spp", "8"]);
    let blurred = rendered(path, "b.exr", &["--spp", "8", "--shutter", "0..1"]);
    assert_ne!(blurred, still);
    // A shutter of the scene is the same, and --shutter 0 takes it out.
    let own = SCENE.replace("fov_y = 30", "fov_y = 30\nshutter = { close = 1 }");
    fs::write(path.join("s.toml"), own).unwrap();
    assert_eq!(rendered(path, "own.exr", &["--spp", "8"]), blurred);
    assert_eq!(
        rendered(path, "out.exr", &["--spp", "8", "--shutter", "0"]),
        still
    );
    let few = ["--spp", "8", "--shutter-slices", "3"];
    assert_ne!(rendered(path, "few.exr", &few), blurred);
    let plan = lanecast(path, &["plan", "s.toml"]);
    assert!(stdout(&plan).contains("256 worlds"), "{}", stdout(&plan));
}

#[test]
fn a_frames_shutter_is_its_part_of_the_sequence() {
    let folder = scene(SCENE);
    let path = folder.path();
    for integrator in ["direct", "path"] {
        let more = ["--integrator", integrator, "--spp", "4", "--aov", "depth"];
        let sequence = ["--frames", "5", "--shutter", "0..0.5"];
        rendered(path, "f.exr", &[&more[..], &sequence].concat());
        let first = fs::read(path.join("f_0000.exr")).unwrap();
        let single = ["--shutter", "0..0.125"];
        assert_eq!(
            rendered(path, "s.exr", &[&more[..], &single].concat()),
            first
        );
        assert_ne!(fs::read(path.join("f_0001.exr")).unwrap(), first);
    }
}

#[test]
fn parts_of_blurred_pictures_add_up() {
    let folder = scene(SCENE);
    let path = folder.path();
    let blur = ["--integrator", "path", "--shutter", "0..1"];
    let whole = rendered(path, "whole.exr", &[&blur[..], &["--spp", "8"]].concat());
    for (samples, to) in [("0..4", "a.sums"), ("4..8", "b.sums")] {
        rendered(path, to, &[&blur[..], &["--samples", samples]].concat());
    }
    let merged = lanecast(path, &["merge", "a.sums", "b.sums", "-o", "m.exr"]);
    assert!(merged.status.success(), "{}", stderr(&merged));
    assert_eq!(fs::read(path.join("m.exr")).unwrap(), whole);
    // Parts of other shutters are of other pictures.
    let other = [
        "--integrator",
        "path",
        "--shutter",
        "0..0.5",
        "--samples",
        "4..8",
    ];
    rendered(path, "c.sums", &other);
    let merged = lanecast(path, &["merge", "a.sums", "c.sums", "-o", "n.exr"]);
    assert!(!merged.status.success());
}

#[test]
fn a_scene_at_rest_keeps_its_bits() {
    let at_rest: String = SCENE
        .lines()
        .filter(|line| !line.starts_with("motion"))
        .fold(String::new(), |text, line| text + line + "\n");
    let folder = scene(&at_rest);
    let path = folder.path();
    let still = rendered(path, "still.exr", &[]);
    let arguments = [
        "render",
        "s.toml",
        "--size",
        "24x18",
        "-o",
        "b.exr",
        "--shutter",
        "0..1",
    ];
    let done = lanecast(path, &arguments);
    assert!(
        stderr(&done).contains("nothing in this scene moves"),
        "{}",
        stderr(&done)
    );
    assert_eq!(fs::read(path.join("b.exr")).unwrap(), still);
    let plan = lanecast(path, &["plan", "s.toml"]);
    assert!(stdout(&plan).contains("one world"), "{}", stdout(&plan));
}

#[test]
fn wrong_shutters_are_refused() {
    for (wrong, says) in [
        ("1..0", "write when it opens"),
        ("1", "write when it opens"),
        ("0..nan", "write when it opens"),
    ] {
        fails(&["render", "--shutter", wrong], 2, says);
    }
    fails(
        &["render", "--shutter-slices", "0"],
        2,
        "0 is not in 1..=65536",
    );
    let folder = scene(SCENE);
    let path = folder.path();
    let before = names(path);
    for (more, says) in [
        (
            &["--shutter-slices", "4"][..],
            "there is no shutter that --shutter-slices",
        ),
        (
            &["--shutter", "0..1", "--grid", "corners"],
            "leave out --shutter",
        ),
        (
            &[
                "--shutter",
                "0..1",
                "--integrator",
                "ids",
                "--shutter-slices=4",
            ],
            "leave out --shutter-slices",
        ),
        (
            &["--shutter", "0..1", "--ground"],
            "with a shutter they move",
        ),
    ] {
        let arguments = ["render", "s.toml", "--size", "8x6", "-o", "x.png"];
        let done = lanecast(path, &[&arguments, more].concat());
        assert_eq!(done.status.code(), Some(2), "{more:?}");
        assert!(stderr(&done).contains(says), "{more:?}: {}", stderr(&done));
    }
    assert_eq!(names(path), before);
}
