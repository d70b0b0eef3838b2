//! What shells, manuals and programs that run Lanecast are told.

use crate::run::{BALL, SMALL, fails, folder, lanecast, names, small, stderr, stdout};
use std::fs;
use std::io::Write;
use std::process::{Command, Stdio};

#[test]
fn the_version_is_told_to_programs_too() {
    let folder = folder();
    let output = lanecast(folder.path(), &["version", "--json"]);
    let told: serde_json::Value = serde_json::from_str(stdout(&output)).unwrap();
    assert_eq!(told["version"], env!("CARGO_PKG_VERSION"));
    assert!(told["rustc"].as_str().unwrap().starts_with("rustc 1."));
    let isa = &told["isa"];
    for who in ["build", "machine"] {
        assert!(
            isa[who].as_str().is_some_and(|isa| !isa.is_empty()),
            "{isa}"
        );
    }
    assert_eq!(told["lanes"][0], 1);
    let text = lanecast(folder.path(), &["version"]);
    assert!(stdout(&text).starts_with(concat!("lanecast ", env!("CARGO_PKG_VERSION"))));
    lanecast(folder.path(), &["version", "--json", "told.json"]);
    assert_eq!(names(folder.path()), ["told.json"]);
}

#[test]
fn completions_are_scripts_of_their_shells() {
    let folder = folder();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = lanecast(folder.path(), &["completions", shell]);
        for word in ["tradeoff", "precision"] {
            assert!(stdout(&script).contains(word), "{shell} without {word}");
        }
    }
    let script = lanecast(folder.path(), &["completions", "bash"]);
    let bash = Command::new("bash").arg("-n").stdin(Stdio::piped()).spawn();
    let Ok(mut bash) = bash else {
        println!("skipped: there is no bash");
        return;
    };
    let mut stdin = bash.stdin.take().unwrap();
    stdin.write_all(&script.stdout).unwrap();
    drop(stdin);
    assert!(bash.wait().unwrap().success());
}

#[test]
fn every_command_has_a_page_of_the_manual() {
    let folder = folder();
    let output = lanecast(folder.path(), &["man", "pages/one"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let pages = names(&folder.path().join("pages/one"));
    let help = lanecast(folder.path(), &["--help"]);
    let listed = stdout(&help).split("Commands:\n").nth(1).unwrap();
    let lines = listed.lines().take_while(|line| !line.is_empty());
    let commands: Vec<&str> = lines
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .map(|line| line.split_whitespace().next().unwrap())
        .collect();
    let of_command = commands.iter().map(|name| format!("lanecast-{name}.1"));
    let mut expected: Vec<String> = of_command.chain(["lanecast.1".into()]).collect();
    expected.sort();
    assert_eq!(pages, expected);
    // Other letters are lost where roff is read by a plain terminal's encoding.
    for name in &pages {
        let page = std::fs::read(folder.path().join("pages/one").join(name)).unwrap();
        assert!(page.is_ascii(), "{name}");
    }
    let page = std::fs::read_to_string(folder.path().join("pages/one/lanecast-render.1")).unwrap();
    assert!(
        page.starts_with(".") && page.contains(r"\-\-precision"),
        "{page}"
    );
}

#[test]
fn rare_options_stand_below_headings_and_examples_last() {
    let folder = folder();
    let output = lanecast(folder.path(), &["render", "--help"]);
    let help = stdout(&output);
    let at = |words: &str| {
        help.find(words)
            .unwrap_or_else(|| panic!("{words} in {help}"))
    };
    let order = ["-o <FILE>", "--size", "Structures and lanes:", "Examples:"];
    for pair in order.windows(2) {
        assert!(at(pair[0]) < at(pair[1]), "{pair:?}");
    }
    assert!(at("Structures and lanes:") < at("--kd-depth"));
}

#[test]
fn progress_is_told_to_programs_in_lines_of_json() {
    let folder = folder();
    let told = |more: &[&'static str]| {
        let output = lanecast(folder.path(), &small(more));
        assert!(output.status.success(), "{}", stderr(&output));
        stderr(&output).to_owned()
    };
    let json = told(&["--spp", "4", "--progress", "json"]);
    let last: serde_json::Value = serde_json::from_str(json.lines().last().unwrap()).unwrap();
    assert_eq!(last["event"], "progress");
    assert_eq!(last["done"], last["total"]);
    assert_eq!(last["eta"], 0.0);
    assert!(last["rays"].as_u64().unwrap() >= 60);
    for quiet in ["auto", "none"] {
        assert_eq!(told(&["--spp", "4", "--progress", quiet]), "");
    }
    // bench counts pairs of rays and modes.
    fs::write(folder.path().join("ball.toml"), BALL).unwrap();
    let bench = [
        "bench",
        "ball.toml",
        "--size",
        "16x16",
        "--reps",
        "2",
        "--kinds",
        "primary",
    ];
    let output = lanecast(
        folder.path(),
        &[&bench[..], &["--progress", "json"]].concat(),
    );
    assert!(output.status.success(), "{}", stderr(&output));
    let line = stderr(&output).lines().last().expect("progress is told");
    let last: serde_json::Value = serde_json::from_str(line).unwrap();
    assert!(last["total"].as_u64().unwrap() >= 18, "{last}");
    assert_eq!(last["done"], last["total"]);
    assert!(!stderr(&lanecast(folder.path(), &bench)).contains("progress"));
    let wrong = [SMALL[0], "--progress", "loud"];
    fails(
        &wrong,
        2,
        "expected auto, bar, json, openjd, afanasy or none",
    );
}
