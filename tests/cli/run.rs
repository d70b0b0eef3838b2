//! Runs the command in a folder, and looks at what it says and leaves.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// The command in `folder`, without standard input.
pub fn lanecast(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lanecast"));
    command.current_dir(folder).args(arguments);
    command.stdin(Stdio::null()).output().unwrap()
}

/// An empty folder that goes with the value.
pub fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// The names of a folder's entries, sorted.
pub fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

pub fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).unwrap()
}

pub fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

/// Asserts that the command ends with this exit code, says this as its only error, and
/// leaves no file.
pub fn fails(arguments: &[&str], code: i32, says: &str) {
    let folder = folder();
    let output = lanecast(folder.path(), arguments);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    assert!(said.contains(says), "{arguments:?}: {said}");
    assert!(said.starts_with("error: "), "{arguments:?}: {said}");
    assert_eq!(said.matches("error: ").count(), 1, "{arguments:?}: {said}");
    assert!(!said.contains("panicked"), "{said}");
    assert!(stdout(&output).is_empty());
    assert!(names(folder.path()).is_empty(), "{arguments:?}");
}

/// A picture of the default scene that takes no time.
pub const SMALL: [&str; 3] = ["render", "--size", "5x3"];

/// `SMALL` with more arguments.
pub fn small(more: &[&'static str]) -> Vec<&'static str> {
    [&SMALL, more].concat()
}

/// A red ball before a camera.
pub const BALL: &str = "format = 1
[camera]
eye = [0, 0, 9]
look_at = [0, 0, 0]
fov_y = 30
[[light]]
directional = { direction = [-1, -1, -1], irradiance = [3, 3, 3] }
[material.red]
base_color = [1, 0, 0]
[shape.ball]
sphere = { center = [0, 0, 0], radius = 1 }
[[instance]]
shape = 'ball'
material = 'red'
";
