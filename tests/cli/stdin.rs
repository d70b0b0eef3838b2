//! Scenes on standard input, and formats that names do not tell.

use crate::run::{BALL, fails, folder, names, stderr, stdout};
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn lanecast(folder: &Path, arguments: &[&str], input: &[u8]) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_lanecast"))
        .current_dir(folder)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A command that refuses its arguments does not read.
    let _ = child.stdin.take().unwrap().write_all(input);
    child.wait_with_output().unwrap()
}

const CSG: &str =
    "difference() {\n\tcube(size = [2, 2, 2], center = true);\n\tsphere(r = 1.2);\n}\n";
const STL: &str = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
                   endloop\nendfacet\nendsolid a\n";
const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

#[test]
fn pictures_are_those_of_the_file() {
    let folder = folder();
    for (name, text) in [
        ("a.toml", BALL),
        ("a.csg", CSG),
        ("a.stl", STL),
        ("a.obj", OBJ),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
        let render = |scene: &str, picture: &str, input: &str| {
            let line = [
                "render", scene, "--size", "20x15", "--spp", "2", "-o", picture,
            ];
            let output = lanecast(folder.path(), &line, input.as_bytes());
            assert!(output.status.success(), "{name}: {}", stderr(&output));
            fs::read(folder.path().join(picture)).unwrap()
        };
        let same = render(name, "file.png", "") == render("-", "stdin.png", text);
        assert!(same, "{name}");
    }
}

#[test]
fn every_command_that_loads_a_scene_reads_standard_input() {
    let folder = folder();
    for line in [
        "render - --size 5x3",
        "plan -",
        "probe - --org 0,0,9 --dir 0,0,-1",
        "measure -",
        "verify - --size 8x6",
        "bench - --size 16x16 --reps 1 --kinds primary",
        "tradeoff - --size 16x12 --reps 1 --converged 2 --html page.html",
        "export - --pov -",
        "convert - out.toml",
    ] {
        let arguments: Vec<&str> = line.split(' ').collect();
        let output = lanecast(folder.path(), &arguments, BALL.as_bytes());
        assert!(output.status.success(), "{line}: {}", stderr(&output));
        assert!(!stdout(&output).contains("panicked"));
    }
    let made = names(folder.path());
    assert_eq!(made, ["lanecast.png", "out.toml", "page.html"]);
    // Its commands read standard input, too.
    let page = fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(page.contains("lanecast render - --size 16x12 --precision fast"));
}

#[test]
fn files_that_it_names_are_beside_the_current_folder() {
    let folder = folder();
    fs::write(folder.path().join("part.obj"), OBJ).unwrap();
    let scene = "format = 1\n[shape]\na.mesh = 'part.obj'\n[[instance]]\nshape = 'a'\n";
    let output = lanecast(folder.path(), &["plan", "-"], scene.as_bytes());
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stdout(&output).contains("1 × mesh") || stdout(&output).contains("mesh"));
}

#[test]
fn messages_name_standard_input_and_a_remedy() {
    let folder = folder();
    let said = |line: &str, input: &[u8]| {
        let arguments: Vec<&str> = line.split(' ').collect();
        let output = lanecast(folder.path(), &arguments, input);
        assert_eq!(output.status.code(), Some(3), "{line}: {}", stderr(&output));
        stderr(&output).to_owned()
    };
    let broken = said("plan -", b"format = 1\n[camera]\neye = [1, 2\n");
    assert!(broken.starts_with("error: <stdin>:3:"), "{broken}");
    let unknown = said("render -", b"sphere(3);\n");
    assert!(
        unknown.contains("<stdin>") && unknown.contains("--format"),
        "{unknown}"
    );
    let empty = said("measure -", b"");
    assert!(
        empty.contains("<stdin>") && empty.contains("--format"),
        "{empty}"
    );
    let other = said("plan - --format json", BALL.as_bytes());
    assert!(other.starts_with("error: <stdin>:1:"), "{other}");
    let bytes = said("plan -", &[0xff, 0xfe, 0, 1, 2, 3]);
    assert!(bytes.contains("<stdin>"), "{bytes}");
    let mesh = said("plan - --variant red", OBJ.as_bytes());
    assert!(
        mesh.contains("--variant of a file that is no .gltf"),
        "{mesh}"
    );
}

#[test]
fn what_cannot_read_it_says_so() {
    fails(
        &["view", "-"],
        2,
        match cfg!(feature = "view") {
            true => "name a file",
            false => "--features view",
        },
    );
    fails(
        &["render", "-", "--accuracy", "within:rmse=1"],
        2,
        "name a file",
    );
    fails(
        &["render", "a.toml", "--format", "fbx"],
        2,
        "known are toml",
    );
}

#[test]
fn a_format_counts_more_than_a_name() {
    let folder = folder();
    fs::write(folder.path().join("part.txt"), CSG).unwrap();
    let output = lanecast(
        folder.path(),
        &["measure", "part.txt", "--format", "csg"],
        b"",
    );
    assert!(output.status.success(), "{}", stderr(&output));
    let without = lanecast(folder.path(), &["measure", "part.txt"], b"");
    assert_eq!(without.status.code(), Some(3));
    assert!(stderr(&without).contains("unknown scene format 'txt'"));
}
