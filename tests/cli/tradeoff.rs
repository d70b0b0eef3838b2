//! `lanecast tradeoff`: points, bounds, the page.

use crate::run::{fails, folder, lanecast, stderr, stdout};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Output;

/// A ball under a lamp: paths, no polynomials, nothing that moves.
const LIT: &str = "format = 1
[camera]
eye = [0, 1, 6]
look_at = [0, 0, 0]
fov_y = 40
[[light]]
rectangle = { center = [0, 3, 0], edge_u = [2, 0, 0], edge_v = [0, 0, 2], radiance = [4, 4, 4] }
[shape]
ball.sphere = { center = [0, 0, 0], radius = 1 }
floor.box = { min = [-4, -2, -4], max = [4, -1, 4] }
[[instance]]
shape = 'ball'
[[instance]]
shape = 'floor'
";

/// A torus by direct light.
pub const HARD: &str = "format = 1
[[light]]
directional = { direction = [-1, -1, -1], irradiance = [3, 3, 3] }
[shape]
ring.torus = { major = 2, minor = 0.5 }
[[instance]]
shape = 'ring'
";

fn tradeoff(folder: &Path, scene: &str, more: &[&str]) -> Output {
    fs::write(folder.join("a.toml"), scene).unwrap();
    let small = [
        "tradeoff",
        "a.toml",
        "--size",
        "32x18",
        "--reps",
        "1",
        "--converged",
        "32",
    ];
    lanecast(folder, &[&small[..], more].concat())
}

fn points(output: &Output) -> Vec<Value> {
    assert!(output.status.success(), "{}", stderr(output));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    report["points"].as_array().unwrap().clone()
}

fn choices(points: &[Value]) -> Vec<&str> {
    let mut all: Vec<&str> = points
        .iter()
        .map(|p| p["choice"].as_str().unwrap())
        .collect();
    all.dedup();
    all
}

#[test]
fn ways_are_those_that_the_scene_has() {
    let folder = folder();
    let lit = points(&tradeoff(folder.path(), LIT, &["--json", "-"]));
    let hard = points(&tradeoff(folder.path(), HARD, &["--json", "-"]));
    assert!(choices(&lit).contains(&"cache") && choices(&lit).contains(&"sampler"));
    assert!(!choices(&lit).contains(&"solver"));
    assert!(choices(&hard).contains(&"solver") && !choices(&hard).contains(&"cache"));
    for points in [&lit, &hard] {
        assert_eq!(points[0]["options"], "");
        assert!(points.iter().any(|p| p["pareto"] == true));
        for point in points {
            assert!(point["seconds"].as_f64().unwrap() > 0.0);
            assert!(point["rmse"].as_f64().unwrap() >= 0.0);
            let [t, normal] = ["t_error", "normal_error"].map(|key| point[key].as_f64().unwrap());
            assert!(t >= 0.0 && normal >= 0.0, "{point}");
            // What is guarded or exact is right.
            let options = point["options"].as_str().unwrap();
            if !options.contains("fast") {
                assert_eq!(point["wrong_pixels"], 0, "{options}");
                // t is that of f32 at most, and normals are f64's.
                assert!(t < 1e-6 && normal < 1e-6, "{point}");
            }
        }
    }
    let t_error = |options: &str| {
        let found = lit.iter().find(|p| p["options"] == options);
        found.unwrap()["t_error"].as_f64().unwrap()
    };
    assert!(t_error("--precision exact") == 0.0 && t_error("") > 1e-9);
    // More samples are nearer to the converged picture.
    let error = |options: &str| {
        let found = lit.iter().find(|p| p["options"] == options);
        found.unwrap()["rmse"].as_f64().unwrap()
    };
    assert!(error("--spp 1") > error("--spp 16") && error("--spp 16") > error("--spp 256"));
}

#[test]
fn options_within_bounds_render_what_was_measured() {
    let folder = folder();
    let output = tradeoff(
        folder.path(),
        LIT,
        &["--within", "wrong-pixels=0,rmse=1000"],
    );
    assert!(output.status.success(), "{}", stderr(&output));
    let options: Vec<&str> = stdout(&output).split_whitespace().collect();
    let render = ["render", "a.toml", "--size", "32x18", "-o", "a.png"];
    let rendered = lanecast(folder.path(), &[&render[..], &options].concat());
    assert!(
        rendered.status.success(),
        "{options:?}: {}",
        stderr(&rendered)
    );
    let never = tradeoff(folder.path(), LIT, &["--within", "rmse=0"]);
    assert_eq!(never.status.code(), Some(1));
    assert!(stdout(&never).is_empty());
    assert!(stderr(&never).contains("keeps these bounds"));
}

#[test]
fn the_page_needs_nothing_else() {
    let folder = folder();
    let output = tradeoff(folder.path(), HARD, &["--html", "a.html"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stdout(&output).contains("(the scene's own way)"));
    let page = fs::read_to_string(folder.path().join("a.html")).unwrap();
    // The name of SVG's language is no address.
    let addresses = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!addresses.contains("http:") && !addresses.contains("https:"));
    assert!(page.contains("lanecast render a.toml --size 32x18 --precision fast"));
    // A picture for each row, and the converged one.
    let rows = page.matches("<tr data-way").count();
    assert_eq!(page.matches("data:image/png;base64,").count(), rows + 1);
}

#[test]
fn wrong_bounds_are_refused() {
    for (bounds, says) in [
        ("speed=3", "expected wrong-pixels"),
        ("rmse=-1", "no number of 0 or more"),
        ("wrong-pixels=0.5", "no whole number"),
        ("rmse", "expected wrong-pixels"),
    ] {
        fails(&["tradeoff", "a.toml", "--within", bounds], 2, says);
    }
    fails(&["tradeoff", "a.toml"], 3, "a.toml");
}
