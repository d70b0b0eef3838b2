//! Renders every damaged, odd and foreign file of the assets with the built command: the
//! result is a picture or one message of one line, within limits of time and memory, and no
//! file is left behind.

use crate::common::assets;
use std::fs::File;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Far more than any of them takes.
const PATIENCE: Duration = Duration::from_secs(10);

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, found);
        } else {
            found.push(path);
        }
    }
}

/// The command, in one gibibyte of address space where a shell can say so.
fn command() -> Command {
    let binary = env!("CARGO_BIN_EXE_lanecast");
    if !cfg!(target_os = "linux") {
        return Command::new(binary);
    }
    let mut command = Command::new("sh");
    command.args(["-c", r#"ulimit -v 1048576 && exec "$0" "$@""#, binary]);
    command
}

/// Exit code (`None` where a signal ended it) and standard error.
fn run(mut command: Command) -> Result<(Option<i32>, String), String> {
    let mut stderr = tempfile::tempfile().unwrap();
    command.stdin(Stdio::null()).stdout(Stdio::null());
    command.stderr(stderr.try_clone().unwrap());
    let start = Instant::now();
    let mut child = command.spawn().unwrap();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            child.wait().unwrap();
            return Err("takes too long".into());
        }
        std::thread::sleep(Duration::from_millis(1));
    };
    Ok((status.code(), read(&mut stderr)))
}

fn read(file: &mut File) -> String {
    file.rewind().unwrap();
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).unwrap();
    String::from_utf8(bytes).expect("messages are UTF-8")
}

/// Whether a picture came of it; otherwise what is wrong with that.
fn check(path: &Path) -> Result<bool, String> {
    let folder = tempfile::tempdir().unwrap();
    let mut command = command();
    command.arg("render").arg(path);
    command.args(["--size", "16x16", "--threads", "1", "--spp", "4", "-o"]);
    command.arg(folder.path().join("picture.png"));
    let (code, said) = run(command)?;
    let errors = said.lines().filter(|l| l.starts_with("error: ")).count();
    let others = said
        .lines()
        .filter(|l| !l.starts_with("error: ") && !l.starts_with("warning: "));
    let left = std::fs::read_dir(folder.path()).unwrap().count();
    let plain = !said.chars().any(|c| c.is_control() && c != '\n');
    let good = match code {
        Some(0) => errors == 0 && left == 1,
        Some(3) => errors == 1 && left == 0,
        _ => false,
    };
    if good && plain && others.count() == 0 {
        return Ok(code == Some(0));
    }
    Err(format!(
        "exit code {code:?}, {left} files left, said: {said:?}"
    ))
}

#[test]
fn every_bad_file_gives_a_picture_or_a_message() {
    let Some(assets) = assets() else { return };
    let mut paths = Vec::new();
    for folder in ["bad", "gltf_odd", "obj/tinyobjloader"] {
        files(&assets.join(folder), &mut paths);
    }
    paths.sort();
    let start = Instant::now();
    // Every second file each: the work is the processes'.
    let half = |first: usize| -> Vec<_> {
        let mine = paths.iter().skip(first).step_by(2);
        mine.map(|path| (path, check(path))).collect()
    };
    let (even, odd) = std::thread::scope(|scope| {
        let even = scope.spawn(|| half(0));
        let odd = half(1);
        (even.join().unwrap(), odd)
    });
    let checked: Vec<_> = even.into_iter().chain(odd).collect();
    let count = |answer: bool| checked.iter().filter(|(_, c)| *c == Ok(answer)).count();
    println!(
        "{} files: {} pictures, {} messages, in {:.1} s",
        checked.len(),
        count(true),
        count(false),
        start.elapsed().as_secs_f64()
    );
    let wrong: Vec<String> = checked
        .iter()
        .filter_map(|(path, c)| Some(format!("{}: {}", path.display(), c.as_ref().err()?)))
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(checked.len() > 500 && count(true) > 20 && count(false) > 200);
}

/// Without it the test above would say nothing about memory.
#[test]
#[cfg(target_os = "linux")]
fn the_limit_of_memory_holds() {
    let status = |script: &str| {
        let mut shell = Command::new("sh");
        shell.args(["-c", script]);
        run(shell).unwrap().0
    };
    assert_eq!(
        status("ulimit -v 1048576 && head -c 1M /dev/zero | tail -c 1M"),
        Some(0)
    );
    assert_ne!(
        status("ulimit -v 1048576 && head -c 1100M /dev/zero | tail -c 1100M"),
        Some(0)
    );
}
