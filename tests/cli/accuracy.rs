//! `render --accuracy`, which chooses options by a measured trade, and `plan --measure`.

use crate::run::{fails, folder, lanecast, stderr, stdout};
use crate::tradeoff::HARD;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Renders the ring with a folder of its own for caches.
fn render(folder: &Path, picture: &str, more: &[&str]) -> Output {
    render_at(folder, picture, &[&["--size", "16x9"], more].concat())
}

fn render_at(folder: &Path, picture: &str, more: &[&str]) -> Output {
    fs::write(folder.join("a.toml"), HARD).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_lanecast"));
    command
        .current_dir(folder)
        .env("XDG_CACHE_HOME", folder.join("cache"));
    command.args(["render", "a.toml", "-o", picture]);
    command.args(more).output().unwrap()
}

#[test]
fn the_options_of_a_trade_are_measured_once_and_used() {
    let folder = folder();
    let bounds = ["--accuracy", "within:flip=0.5,wrong-pixels=0"];
    let said = |output: &Output| {
        assert!(output.status.success(), "{}", stderr(output));
        let line = stderr(output).lines().find(|l| l.starts_with("accuracy: "));
        line.expect("the choice is said").to_owned()
    };
    let first = said(&render(folder.path(), "first.png", &bounds));
    assert!(first.contains("as measured for this scene"), "{first}");
    let second = said(&render(folder.path(), "second.png", &bounds));
    assert!(second.contains("as measured before"), "{second}");
    let options = second["accuracy: ".len()..].split(", as").next().unwrap();
    let options: Vec<&str> = match options.starts_with("--") {
        true => options.split(' ').collect(),
        false => Vec::new(),
    };
    let by_hand = render(folder.path(), "third.png", &options);
    assert!(by_hand.status.success(), "{}", stderr(&by_hand));
    let bytes = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert_eq!(bytes("first.png"), bytes("second.png"));
    assert_eq!(bytes("second.png"), bytes("third.png"));
    let impossible = render(folder.path(), "none.png", &["--accuracy", "within:rmse=0"]);
    assert_eq!(impossible.status.code(), Some(1), "{}", stderr(&impossible));
    assert!(!folder.path().join("none.png").exists());
}

/// Says whether the class of a picture was measured for it.
fn measured(output: &Output) -> bool {
    assert!(output.status.success(), "{}", stderr(output));
    stderr(output).contains("as measured for this scene")
}

#[test]
fn one_class_serves_all_views_and_keeps_the_bound_there() {
    let folder = folder();
    let bound = ["--accuracy", "within:rmse=0.006"];
    let render = |folder: &Path, picture: &str, more: &[&str]| {
        render_at(folder, picture, &[&["--size", "32x18"], more].concat())
    };
    assert!(measured(&render(folder.path(), "a.png", &bound)));
    for view in [
        &["--orbit", "100,60"][..],
        &["--orbit", "-20,-35,50"],
        &["--view", "iso"],
    ] {
        let near = render(folder.path(), "near.exr", &[view, &bound].concat());
        assert!(!measured(&near), "{view:?}");
        let options = [view, &["--spp", "256", "--seed", "7"]].concat();
        let true_one = render(folder.path(), "true.exr", &options);
        assert!(true_one.status.success(), "{}", stderr(&true_one));
        let compared = lanecast(
            folder.path(),
            &["compare", "near.exr", "true.exr", "--json", "-"],
        );
        let report: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
        let rmse = report["error"]["rmse"].as_f64().unwrap();
        assert!(rmse > 0.0 && rmse <= 0.006, "{view:?}: {rmse}");
    }
    // Another light, and pictures with more of their pixels on edges, are other classes.
    let other = ["--integrator", "path"];
    fails(
        &[&["render", "a.toml"], &bound[..], &other].concat(),
        2,
        "cannot be used with",
    );
    let smaller = ["--accuracy", "within:rmse=1", "--size", "8x6"];
    assert!(measured(&render_at(folder.path(), "b.png", &smaller)));
}

#[test]
fn bounds_replace_the_options_that_they_choose() {
    fails(&["render", "--accuracy", "within:rmse=0.1"], 2, "name one");
    fails(&["render", "--accuracy", "rmse=0.1"], 2, "within:");
    fails(
        &["render", "--accuracy", "within:speed=1"],
        2,
        "wrong-pixels",
    );
    let both = [
        "render",
        "a.toml",
        "--accuracy",
        "within:rmse=1",
        "--spp",
        "4",
    ];
    fails(&both, 2, "cannot be used with");
}

#[test]
fn prices_are_of_what_the_scene_lacks() {
    let folder = folder();
    fs::write(folder.path().join("a.toml"), HARD).unwrap();
    let arguments = [
        "plan",
        "a.toml",
        "--measure",
        "--size",
        "32x18",
        "--json",
        "-",
    ];
    let output = lanecast(folder.path(), &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    let report: serde_json::Value = serde_json::from_str(stdout(&output)).unwrap();
    let prices = report["prices"]["of"].as_array().unwrap();
    let names: Vec<&str> = prices.iter().map(|p| p["what"].as_str().unwrap()).collect();
    for lacking in [
        "meshes",
        "CSG solids",
        "transforms",
        "transmission",
        "textures",
    ] {
        assert!(names.contains(&lacking), "{names:?}");
    }
    assert!(!names.contains(&"polynomial surfaces"), "{names:?}");
    for price in prices {
        assert!(price["ratio"].as_f64().unwrap() > 0.0, "{price}");
        assert!(price["bytes"].as_i64().unwrap() > 0, "{price}");
    }
}
