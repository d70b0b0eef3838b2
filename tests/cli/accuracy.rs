//! `render --accuracy`, which chooses options by a measured trade, and `plan --measure`.

use crate::run::{fails, folder, lanecast, stderr, stdout};
use crate::tradeoff::HARD;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Renders the ring with a folder of its own for caches.
fn render(folder: &Path, picture: &str, more: &[&str]) -> Output {
    fs::write(folder.join("a.toml"), HARD).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_lanecast"));
    command
        .current_dir(folder)
        .env("XDG_CACHE_HOME", folder.join("cache"));
    command.args(["render", "a.toml", "--size", "16x9", "-o", picture]);
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
