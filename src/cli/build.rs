//! Tells the program what it is built from and for: as `LANECAST_COMMIT` the commit, that of the
//! environment variable of this name, else what git says, with `-dirty` if sources were changed
//! since, absent without git; as `LANECAST_TARGET` the target, as `LANECAST_RUSTC` the compiler.
//!
//! It runs again when sources change, which builds the crate anew anyway; a commit alone does not.

use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=..");
    println!("cargo:rerun-if-env-changed=LANECAST_COMMIT");
    for (name, value) in [
        ("LANECAST_TARGET", std::env::var("TARGET").ok()),
        ("LANECAST_RUSTC", compiler()),
    ] {
        let value = value.as_deref().map_or("unknown", str::trim);
        println!("cargo:rustc-env={name}={value}");
    }
    if let Some(commit) = std::env::var("LANECAST_COMMIT").ok().or_else(commit) {
        println!("cargo:rustc-env=LANECAST_COMMIT={}", commit.trim());
    }
}

fn commit() -> Option<String> {
    let head = git(&["rev-parse", "--short=12", "HEAD"])?;
    let status = ["--no-optional-locks", "status", "--porcelain"];
    let paths = ["--", ":/src", ":/Cargo.toml", ":/Cargo.lock"];
    let changed = git(&[&status[..], &paths[..]].concat())?;
    let dirty = if changed.is_empty() { "" } else { "-dirty" };
    Some(format!("{}{dirty}", head.trim()))
}

/// Returns the version that the compiler prints.
fn compiler() -> Option<String> {
    printed(Command::new(std::env::var_os("RUSTC")?).arg("--version"))
}

/// Returns what git prints, unless it fails or is not there.
fn git(arguments: &[&str]) -> Option<String> {
    printed(Command::new("git").args(arguments))
}

fn printed(command: &mut Command) -> Option<String> {
    let output = command.output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then_some(text)
}
