//! Runs `verify` on every scene at hand, in hours; a run that was ended goes on where it
//! was.
//!
//! ```text
//! LANECAST_CAMPAIGN=1 cargo test --release --test cli -- every_scene --ignored --nocapture
//! ```
//!
//! The scenes are those of the repository, and the meshes and SPD scenes of the test
//! assets (LANECAST_ASSETS). Each is verified as it is with a million aimed rays, and
//! moved and scaled with a tenth of them and a smaller picture. CSG scenes have a tenth of
//! these rays and polynomial surfaces a hundredth, because their reference is slower by as
//! much.
//!
//! Each pair of a scene and a setting is a line of JSON in the file that
//! LANECAST_CAMPAIGN_FILE names, by default target/campaign.jsonl. Pairs whose line says
//! that they succeeded are not run again.

use crate::common::{assets, campaign, in_repository};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Offsets and scales; the first is the scene as it is.
const OFFSETS: [&str; 3] = ["0,0,0", "1e4,-1e4,1e4", "1e6,-1e6,1e6"];
const SCALES: [&str; 3] = ["1", "1e-6", "1e6"];

fn scenes() -> Vec<PathBuf> {
    let mut folders = vec![in_repository("scenes")];
    if let Some(assets) = assets() {
        folders.extend(["meshes", "spd"].map(|name| assets.join(name)));
    }
    let kinds = ["toml", "json", "glb", "nff"];
    let mut found: Vec<PathBuf> = folders
        .iter()
        .flat_map(|folder| fs::read_dir(folder).expect("the folder can be read"))
        .map(|entry| entry.expect("so can its entries").path())
        .filter(|path| {
            path.extension()
                .is_some_and(|e| kinds.iter().any(|k| e == *k))
        })
        // Ten thousand million instances, which the reference does not lay out.
        .filter(|path| !path.ends_with("scenes/many.toml"))
        // JSON among the assets is about scenes, and none.
        .filter(|path| {
            path.starts_with(in_repository("")) || path.extension().is_some_and(|e| e != "json")
        })
        .collect();
    found.sort();
    found
}

/// One line of the results.
fn run(scene: &Path, key: &str, [offset, scale]: [&str; 2], rays: u64) -> Value {
    let as_it_is = [offset, scale] == [OFFSETS[0], SCALES[0]];
    let size = if as_it_is { "160x90" } else { "64x36" };
    let file = tempfile::NamedTempFile::new().expect("a file for the results");
    let output = Command::new(env!("CARGO_BIN_EXE_lanecast"))
        .arg("verify")
        .arg(scene)
        .args(["--offset", offset, "--scale", scale])
        .args(["--adversarial", &rays.to_string()])
        .args(["--size", size, "--seed", "1", "--json"])
        .arg(file.path())
        .output()
        .expect("it runs");
    let says = String::from_utf8_lossy(&output.stderr);
    let error = says.lines().find(|line| line.starts_with("error: "));
    let report = fs::read_to_string(file.path()).unwrap_or_default();
    let report: Value = serde_json::from_str(&report).unwrap_or(Value::Null);
    // Of what is wrong, the first rays with all their numbers.
    let table = String::from_utf8_lossy(&output.stdout);
    let listed: Vec<&str> = table
        .split("\n\n")
        .filter(|part| part.starts_with("guarded, ") || part.starts_with("exact, "))
        .filter(|part| part.contains("  ray  ") && !part.contains("independent"))
        .collect();
    json!({
        "key": key, "exit": output.status.code(), "error": error,
        "modes": report["modes"], "wrong": listed,
    })
}

/// Prints what all lines say together, by mode. How many runs failed, or have a wrong
/// answer where none may be.
fn sum_up(lines: &[Value]) -> usize {
    let mut failed = 0;
    let mut sums: BTreeMap<&str, BTreeMap<String, u64>> = BTreeMap::new();
    for line in lines {
        if line["exit"] != 0 {
            println!("{}: exit {}, {}", line["key"], line["exit"], line["error"]);
            failed += 1;
        }
        let Some(modes) = line["modes"].as_array() else {
            continue;
        };
        for mode in modes {
            let name = mode["precision"].as_str().unwrap_or("?");
            let sum = sums.entry(name).or_default();
            let mut add = |what: String, count: &Value| {
                *sum.entry(what).or_default() += count.as_u64().unwrap_or(0);
            };
            let differing = "lanes_vs_scalar_bit_mismatches";
            add(format!("0 {differing}"), &mode[differing]);
            for part in ["replay", "adversarial"] {
                for count in ["rays", "wrong_hit", "wrong_id", "wrong_shadow"] {
                    add(format!("1 {part} {count}"), &mode[part][count]);
                }
            }
            let kinds = [&mode["wrong_kinds"], &mode["adversarial"]["wrong_kinds"]];
            for (kind, count) in kinds.iter().filter_map(|k| k.as_object()).flatten() {
                add(format!("2 {kind}"), count);
            }
            let wrong = |part: &str| -> u64 {
                let counts = ["wrong_hit", "wrong_id", "wrong_shadow"];
                let count = counts.iter().filter_map(|c| mode[part][c].as_u64());
                count.sum()
            };
            let both = [wrong("replay"), wrong("adversarial")];
            if name != "fast" && both != [0, 0] {
                println!("{} {name}: {both:?} wrong replayed and aimed", line["key"]);
                failed += 1;
            }
        }
    }
    println!("{} runs", lines.len());
    for (mode, sum) in sums {
        println!("{mode}");
        for (what, count) in sum {
            println!("  {count:>12} {}", &what[2..]);
        }
    }
    failed
}

#[test]
#[ignore = "takes hours; resumable"]
fn verify_every_scene() {
    let file = std::env::var_os("LANECAST_CAMPAIGN_FILE")
        .map_or_else(|| in_repository("target/campaign.jsonl"), PathBuf::from);
    let rays = campaign(1_000_000) as u64;
    let text = fs::read_to_string(&file).unwrap_or_default();
    // A last line that was cut short is done again, and what failed.
    let mut lines: Vec<Value> = text
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok())
        .filter(|line: &Value| line["exit"] == 0)
        .collect();
    let done: BTreeSet<String> = lines
        .iter()
        .filter_map(|line| line["key"].as_str().map(String::from))
        .collect();
    let mut out = OpenOptions::new()
        .create(true)
        .append(true)
        .open(&file)
        .expect("the file of results can be written");
    if !text.is_empty() && !text.ends_with('\n') {
        writeln!(out).expect("the disk has room");
    }
    let settings = OFFSETS.iter().flat_map(|o| SCALES.map(|s| (*o, s)));
    let mut settings: Vec<_> = settings.collect();
    // The short ones first.
    settings.rotate_left(1);
    for (offset, scale) in settings {
        let as_it_is = (offset, scale) == (OFFSETS[0], SCALES[0]);
        let rays = if as_it_is { rays } else { rays.div_ceil(10) };
        for scene in scenes() {
            let name = scene.file_name().unwrap_or_default().to_string_lossy();
            let rays = rays.div_ceil(match &*name {
                name if name.starts_with("surface_") => 100,
                name if name.starts_with("csg_") => 10,
                _ => 1,
            });
            let key = format!("{name} offset {offset} scale {scale} rays {rays}");
            if done.contains(&key) {
                continue;
            }
            let line = run(&scene, &key, [offset, scale], rays);
            println!("{key}: exit {} {}", line["exit"], line["error"]);
            writeln!(out, "{line}").expect("the disk has room");
            lines.push(line);
        }
    }
    assert_eq!(sum_up(&lines), 0, "runs that failed, or with wrong answers");
}
