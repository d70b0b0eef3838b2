//! Scenes of several files, and points, as the command shows them.

use super::run::{folder, lanecast, stderr, stdout};
use crate::common::in_repository;
use std::fs;

#[test]
fn a_camera_of_a_placed_file_is_chosen_by_its_name() {
    let folder = folder();
    let scene = in_repository("scenes/placed.toml");
    let scene = scene.to_str().unwrap();
    let render = |camera: &str| {
        let arguments = [
            "render", scene, "-o", "p.png", "--size", "32x20", "--camera", camera,
        ];
        lanecast(folder.path(), &arguments)
    };
    let output = render("lamp/close");
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(stderr(&output), "");
    let output = render("lamp/clos");
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("'lamp/close'"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn scenes_of_missing_files_and_wrong_copies_end_with_one_message() {
    let folder = folder();
    let path = folder.path();
    fs::write(
        path.join("b.toml"),
        "format = 1\n[[instance]]\nscene = 'a.toml'\n",
    )
    .unwrap();
    for (text, says) in [
        (
            "scene = 'gone.glb'",
            "a.toml:3:9: the scene file 'gone.glb' cannot be read",
        ),
        (
            "scene = 'b.toml'",
            "b.toml:3:9: the scene file 'a.toml' would contain itself",
        ),
        ("scene = '../x.glb'", "which lies outside its folder"),
        (
            "scene = 'b.toml'\nrepeat = { count = 0, transform = [] }",
            "b.toml:3:9: the scene file 'a.toml' would contain itself",
        ),
    ] {
        fs::write(
            path.join("a.toml"),
            format!("format = 1\n[[instance]]\n{text}\n"),
        )
        .unwrap();
        for command in ["render", "plan", "probe"] {
            let mut arguments = vec![command, "a.toml"];
            if command == "probe" {
                arguments.extend(["--org", "0,0,1", "--dir", "0,0,-1"]);
            }
            let output = lanecast(path, &arguments);
            assert_eq!(output.status.code(), Some(3), "{command} {text}");
            let said = stderr(&output);
            assert!(said.starts_with("error: ") && said.contains(says), "{said}");
            assert_eq!(said.lines().count(), 1, "{said}");
        }
    }
}

#[test]
fn a_million_copies_are_read_at_once() {
    let folder = folder();
    let text = "format = 1\n[shape.b]\nsphere = { center = [0, 0, 0], radius = 0.4 }\n\
                [node.n]\nchildren = [{ shape = 'b', repeat = { count = 1000, \
                transform = [{ translate = [1, 0, 0] }] } }]\n\
                [[instance]]\nnode = 'n'\nrepeat = { count = 1000, \
                transform = [{ translate = [0, 1, 0] }] }\n";
    fs::write(folder.path().join("a.toml"), text).unwrap();
    let output = lanecast(folder.path(), &["plan", "a.toml"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(
        stdout(&output).starts_with("1000000 instances"),
        "{}",
        stdout(&output)
    );
}

#[test]
fn points_are_drawn_where_a_radius_is_given() {
    let folder = folder();
    fs::write(folder.path().join("p.obj"), "v 0 0 0\nv 1 1 0\nl 1 2\n").unwrap();
    let render = |more: &[&str]| {
        let mut arguments = vec![
            "render", "p.obj", "-o", "p.png", "--size", "32x20", "--spp", "1",
        ];
        arguments.extend(more);
        lanecast(folder.path(), &arguments)
    };
    let output = render(&[]);
    assert_eq!(output.status.code(), Some(3));
    assert!(
        stderr(&output).contains("see --point-radius"),
        "{}",
        stderr(&output)
    );
    let output = render(&["--point-radius", "0.1"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(stderr(&output), "");
    for wrong in ["0", "-1", "inf", "x"] {
        let radius = format!("--point-radius={wrong}");
        assert_eq!(render(&[&radius]).status.code(), Some(2), "{wrong}");
    }
}
