//! Sequences of pictures: what they share with single ones, and what is refused or warned of.

use crate::run::{BALL, fails, folder, lanecast, names, small, stderr};
use std::fs;
use std::path::Path;

/// Renders a small sequence of a ball, and returns what is said.
fn succeeds(folder: &Path, more: &[&str]) -> String {
    fs::write(folder.join("ball.toml"), BALL).unwrap();
    let first = ["render", "ball.toml", "--size", "16x16"];
    let done = lanecast(folder, &[&first, more].concat());
    assert!(done.status.success(), "{}", stderr(&done));
    stderr(&done).into()
}

#[test]
fn each_frame_counts_the_work_of_its_rays() {
    let folder = folder();
    let path = folder.path();
    for accel in ["bvh", "kd", "item-buffer"] {
        let heat = ["--integrator", "heat", "--accel", accel];
        succeeds(path, &[&heat[..], &["-o", "one.png"]].concat());
        succeeds(
            path,
            &[&heat[..], &["-o", "h.png", "--frames", "2"]].concat(),
        );
        let bytes = |name: &str| fs::read(path.join(name)).unwrap();
        assert!(bytes("one.png") == bytes("h_0000.png"), "{accel}");
        assert!(bytes("one.png") == bytes("h_0001.png"), "{accel}");
    }
}

/// Rule S94: pictures without light are of the middle of the shutter, whoever asks for it.
#[test]
fn pictures_without_light_are_of_the_middle_of_the_shutter() {
    let folder = folder();
    let path = folder.path();
    let moving = "motion = [{ at = 1.0, transform = [{ translate = [1, 0, 0] }] }]\n";
    fs::write(path.join("s.toml"), format!("{BALL}{moving}")).unwrap();
    let render = |more: &[&str]| {
        let first = [
            "render",
            "s.toml",
            "--size",
            "32x32",
            "--integrator",
            "normals",
        ];
        let done = lanecast(path, &[&first, more].concat());
        assert!(done.status.success(), "{}", stderr(&done));
    };
    render(&["-o", "still.png", "--frames", "5"]);
    render(&["-o", "one.png", "--shutter", "0..1"]);
    render(&["-o", "two.png", "--shutter", "0..1", "--frames", "3"]);
    let bytes = |name: &str| fs::read(path.join(name)).unwrap();
    assert!(bytes("one.png") == bytes("still_0002.png"));
    assert!(bytes("two_0000.png") == bytes("still_0001.png"));
    assert!(bytes("two_0001.png") == bytes("still_0003.png"));
}

#[test]
fn a_scene_in_which_nothing_moves_is_told_once() {
    let folder = folder();
    let said = succeeds(folder.path(), &["-o", "x.png", "--frames", "0..3"]);
    assert!(said.contains("nothing in this scene moves"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    let frames = ["ball.toml", "x_0000.png", "x_0001.png", "x_0002.png"];
    assert_eq!(names(folder.path()), frames);
}

#[test]
fn pictures_need_the_name_of_a_file() {
    fails(&small(&["-o", "-", "--frames", "2"]), 2, "such as -o x.png");
    fails(&small(&["-o", "-"]), 2, "such as -o x.png");
    fails(
        &small(&["-o", "x", "--frames", "2"]),
        2,
        "x: its name has no ending",
    );
}

#[test]
fn options_that_change_nothing_are_told() {
    fails(
        &small(&["--cryptomatte-levels", "3"]),
        2,
        "leave it out, or ask for one",
    );
    let folder = folder();
    let path = folder.path();
    let solid = "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
                 vertex 0 1 0\nendloop\nendfacet\nendsolid x\n";
    fs::write(path.join("s.stl"), solid).unwrap();
    fs::write(
        path.join("s.csg"),
        "cube(size = [1, 1, 1], center = false);",
    )
    .unwrap();
    let said = |scene: &str, more: &[&str]| {
        let first = [
            "render", scene, "--size", "8x8", "--spp", "1", "-o", "x.png",
        ];
        let done = lanecast(path, &[&first, more].concat());
        assert!(done.status.success(), "{}", stderr(&done));
        stderr(&done).to_owned()
    };
    let points = ["--point-radius", "0.1"];
    let curves = ["--scad-curves", "facets"];
    assert!(said("s.stl", &points).contains("--point-radius is of points and lines"));
    assert!(said("s.stl", &curves).contains("--scad-curves is of curves"));
    assert!(said("s.csg", &points).contains("changes nothing here"));
    assert!(!said("s.csg", &curves).contains("changes nothing here"));
    assert_eq!(said("s.stl", &[]), "");
    let mattes = [
        "--integrator=path",
        "--aov=crypto_object",
        "--cryptomatte-levels=3",
    ];
    assert_eq!(said("s.stl", &mattes), "");
}

#[test]
fn a_sequence_says_what_noise_is_left() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("ball.toml"), BALL).unwrap();
    let said = |noise: &str, most: &str| {
        let line = format!(
            "render ball.toml --size 16x16 --frames 2 --integrator path --noise {noise} --max-spp {most} \
             -o f.png --stats s.json"
        );
        let done = lanecast(path, &line.split_whitespace().collect::<Vec<_>>());
        assert!(done.status.success(), "{}", stderr(&done));
        let stats = fs::read_to_string(path.join("s.json")).unwrap();
        assert_eq!(stats.matches("\"noisy\"").count(), 2, "{stats}");
        crate::run::stdout(&done).to_owned() + stderr(&done)
    };
    let left = said("0.0001", "16");
    assert!(left.contains("noise above 0.0001 in up to"), "{left}");
    assert!(left.contains("of a picture (frame "), "{left}");
    let none = said("0.9", "64");
    assert!(none.contains("noise below 0.9"), "{none}");
}
