//! `lanecast bench`: scenes that its tests share, and usage errors.

mod exports;
mod rows;
mod structures;

use crate::run::{fails, folder, lanecast, stderr, stdout};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Output;

/// A pyramid on a square, as .obj; every coordinate is a short binary fraction.
const PYRAMID: &str = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0.25 1.5 0\n\
                       f 1 2 3\nf 1 3 4\nf 1 5 2\nf 2 5 3\nf 3 5 4\nf 4 5 1\n";

const VIEW: &str = r#"
format = 1
[camera]
eye = [1.0, 2.0, 7.0]
look_at = [1.0, 0.5, 0.0]
fov_y = 40.0
[[light]]
point = { position = [-5.0, 2.0, -3.0], intensity = [120.0, 120.0, 120.0] }
[shape.pyramid]
mesh = "pyramid.obj"
[[instance]]
shape = "pyramid"
[[instance]]
shape = "pyramid"
transform = [{ scale = 0.5 }, { translate = [2.5, 0.25, 1.0] }]
"#;

const BALL: &str = r#"
[shape.ball]
sphere = { center = [0.5, 0.5, 2.0], radius = 0.5 }
[[instance]]
shape = "ball"
"#;

/// A pyramid that turns before the others.
const MOVING: &str = r#"
[[instance]]
shape = "pyramid"
transform = [{ scale = 0.4 }, { translate = [0.0, 0.5, 2.0] }]
motion = [{ at = 1.0, transform = [{ scale = 0.4 }, { rotate_y = 50.0 }, { translate = [2.0, 0.5, 2.5] }] }]
"#;

fn write_scene(folder: &Path, more: &str) {
    fs::write(folder.join("pyramid.obj"), PYRAMID).unwrap();
    fs::write(folder.join("s.toml"), format!("{VIEW}{more}")).unwrap();
}

/// What `bench` reports, given these options.
fn reported(folder: &Path, options: &[&str]) -> Value {
    let asked = [&["bench"], options, &["--json", "-"]].concat();
    report(&lanecast(folder, &asked))
}

/// The report on standard output.
fn report(output: &Output) -> Value {
    assert!(output.status.success(), "{}", stderr(output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn rows(report: &Value) -> &[Value] {
    report["results"].as_array().unwrap()
}

#[test]
fn refusals() {
    fails(
        &["bench", "x.toml", "--size", "16384x16384"],
        2,
        "too many rays",
    );
    let kinds = ["--mesh", "a", "--rays", "b", "--kinds", "shadow"];
    fails(&[&["bench"], &kinds[..]].concat(), 2, "cannot be used with");
    fails(&["bench"], 2, "required");
    fails(&["bench", "--growth", "9:8"], 2, "MIN:MAX");
    fails(
        &["bench", "x.toml", "--growth", "1e3:1e4"],
        2,
        "cannot be used with",
    );
    fails(
        &["bench", "x.toml", "--order", "spiral"],
        2,
        "known are scanline",
    );
    fails(&["bench", "x.toml", "--accels", "bvh,oak"], 2, "'oak'");
    fails(&["bench", "x.toml", "--lanes", "1,2"], 2, "known are auto");
    fails(&["bench", "x.toml", "--lanes", "1,1"], 2, "named twice");
    fails(
        &["bench", "x.toml", "--order", "tile,tile"],
        2,
        "named twice",
    );
    fails(
        &["render", "x.toml", "--lanes", "1,8"],
        2,
        "only bench takes several",
    );
    let orders = ["--order", "tile,random", "--frames", "3"];
    fails(
        &[&["bench", "x.toml"], &orders[..]].concat(),
        2,
        "take one --order",
    );
    fails(
        &["bench", "x.toml", "--peers", "oak"],
        2,
        "known are embree",
    );
    let folder = folder();
    write_scene(folder.path(), "");
    for (arguments, code, says) in [
        (
            ["--accel", "linear", "--reps", "10000"],
            2,
            "--accel linear would test",
        ),
        (["--export", "none", "--reps", "1"], 4, "create it first"),
    ] {
        let output = lanecast(
            folder.path(),
            &[&["bench", "s.toml"], &arguments[..]].concat(),
        );
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
        assert!(stdout(&output).is_empty());
    }
    // Rays that are damaged.
    let corners: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut mesh = b"MSH1\x03\0\0\0\x01\0\0\0".to_vec();
    mesh.extend(corners.iter().flat_map(|x| x.to_le_bytes()));
    mesh.extend([0_u32, 1, 2].iter().flat_map(|i| i.to_le_bytes()));
    fs::write(folder.path().join("a.msh"), mesh).unwrap();
    fs::write(folder.path().join("a.primary.rays"), "RAY1\u{9}").unwrap();
    let sets = ["bench", "--mesh", "a.msh", "--rays", "a.primary.rays"];
    let output = lanecast(folder.path(), &sets);
    assert_eq!(output.status.code(), Some(3));
    assert!(
        stderr(&output).contains("a.primary.rays: "),
        "{}",
        stderr(&output)
    );
}

#[test]
fn its_usage_names_both_forms() {
    fails(&["bench"], 2, "lanecast bench [OPTIONS] <SCENE>\n");
    fails(&["bench"], 2, "bench [OPTIONS] --mesh <FILE> --rays <FILE>");
}
