//! `lanecast verify`: its results as JSON, and its exit codes.

use lanecast::internals::measure::verify::Counts;
use serde_json::Value;
use std::process::{Command, Output};

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/primitives.toml");

fn verify(arguments: &[&str]) -> Output {
    let common = ["verify", SCENE, "--size", "32x18", "--threads", "1"];
    Command::new(env!("CARGO_BIN_EXE_lanecast"))
        .args(common)
        .args(arguments)
        .output()
        .expect("it runs")
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).expect("standard output is JSON alone")
}

#[test]
fn the_names_of_the_counts() {
    let json = serde_json::to_value(Counts::default()).unwrap();
    for key in [
        "wrong_hit",
        "wrong_id",
        "wrong_shadow",
        "undecided",
        "max_rel_t_error",
        "max_normal_error_deg",
    ] {
        assert!(json[key].is_number(), "{key}");
    }
}

#[test]
fn every_precision_is_in_one_table_and_in_the_results() {
    let output = verify(&["--json", "-", "--adversarial", "200"]);
    let report = json(&output);
    let modes = report["modes"].as_array().unwrap();
    let names: Vec<_> = modes
        .iter()
        .map(|m| m["precision"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["fast", "guarded", "exact"]);
    // At the top stands the default, with the names of old.
    assert_eq!(report["plan"]["precision"], "guarded");
    for name in [
        "rays",
        "replay",
        "independent",
        "lanes_vs_scalar_bit_mismatches",
    ] {
        assert_eq!(report[name], modes[1][name], "{name}");
    }
    assert_eq!(report["pixels"], 32 * 18);
    assert!(report["times"].as_array().unwrap().len() >= 3 && report["escalated"].is_u64());
    for mode in modes {
        for counts in ["replay", "independent", "adversarial"] {
            for name in ["rays", "wrong_hit", "wrong_id", "wrong_shadow", "undecided"] {
                assert!(mode[counts][name].is_u64(), "{counts} {name}");
            }
        }
        assert_eq!(mode["adversarial"]["rays"], 400);
        assert_eq!(mode["replay"]["wrong_hit"], 0);
        assert!(mode["t_ulps"]["median"].as_f64().unwrap() < 2.0);
        assert!(mode["t_ulps"]["max"].is_number() && mode["wrong_kinds"].is_object());
        assert!(mode["escalated_per_ray"].is_number() && mode["ns_per_ray"].is_number());
    }
}

#[test]
fn one_precision_alone_and_the_same_rays_again() {
    let run = || {
        let seed = [
            "--adversarial",
            "500",
            "--seed",
            "3",
            "--allow-wrong",
            "9999",
        ];
        let output = verify(&[&seed[..], &["--precision", "fast", "--json", "-"]].concat());
        assert!(output.status.success(), "{output:?}");
        let report = json(&output);
        assert_eq!(report["modes"].as_array().unwrap().len(), 1);
        assert_eq!(report["plan"]["precision"], "fast");
        report["modes"][0]["adversarial"]["wrong_id"].clone()
    };
    assert_eq!(run(), run());
    // Fast may be wrong, unless somebody sets a limit.
    let aimed = ["--precision", "fast", "--adversarial", "5000"];
    assert!(verify(&aimed).status.success());
    let limited = verify(&[&aimed[..], &["--allow-wrong", "3"]].concat());
    assert_eq!(limited.status.code(), Some(1));
    let says = String::from_utf8(limited.stderr).unwrap();
    assert!(
        says.contains("error: fast: ") && says.contains("3 are allowed"),
        "{says}"
    );
}

/// The words of the table are explained, and hits at the origin of a ray do not make the
/// errors of all others look large.
#[test]
fn the_table_explains_itself() {
    let output = verify(&["--adversarial", "5000", "--precision", "fast"]);
    let said = String::from_utf8(output.stdout).unwrap();
    for line in [
        "\nreplay: the reference answers the same rays",
        "\nindependent: the reference traces its own rays",
        "hits are not in t ulps",
    ] {
        assert!(said.contains(line), "{said}");
    }
    let report = json(&verify(&["--adversarial", "5000", "--json", "-"]));
    for mode in report["modes"].as_array().unwrap() {
        let aimed = &mode["adversarial"];
        assert!(aimed["t_ulps"]["max"].as_f64().unwrap() < 1e12, "{aimed}");
        assert!(aimed["without_ulps"].is_u64());
    }
    let help = Command::new(env!("CARGO_BIN_EXE_lanecast"))
        .args(["verify", "--help"])
        .output()
        .unwrap();
    let help = String::from_utf8(help.stdout).unwrap();
    assert!(help.contains("replay: ") && help.contains("independent: "));
}

/// The last line counts what the exit code does: rays that both sides trace, and aimed ones.
#[test]
fn the_last_line_is_the_verdict() {
    let output = verify(&["--adversarial", "1000"]);
    let said = String::from_utf8(output.stdout).unwrap();
    let last = said.lines().last().unwrap();
    let (name, modes) = last.split_once(": ").unwrap();
    assert_eq!(name, "wrong answers", "{last}");
    let report = json(&verify(&["--adversarial", "1000", "--json", "-"]));
    let compared = report["modes"].as_array().unwrap();
    let modes: Vec<&str> = modes.split("; ").collect();
    assert_eq!(modes.len(), compared.len(), "{last}");
    for (said, mode) in modes.iter().zip(compared) {
        let rays = |part: &str| mode[part]["rays"].as_u64().unwrap();
        let all = rays("replay") + rays("adversarial");
        let precision = mode["precision"].as_str().unwrap();
        assert!(said.starts_with(precision), "{said}");
        assert!(said.contains(&format!(" of {all}")), "{said}, not {all}");
        assert!(precision == "fast" || said.contains(" 0 of "), "{said}");
    }
}

#[test]
fn scenes_are_verified_where_they_are_moved_to() {
    let moved = [
        "--precision",
        "exact",
        "--json",
        "-",
        "--offset",
        "-1e4,0,1e4",
    ];
    let output = verify(&[&moved[..], &["--scale", "1e3"]].concat());
    assert!(output.status.success(), "{output:?}");
    let far = verify(&["--scale", "1e200", "--offset", "1,2,3"]);
    assert_eq!(far.status.code(), Some(2));
    let says = String::from_utf8(far.stderr).unwrap();
    assert!(
        says.contains("--scale 1e200 --offset 1.0,2.0,3.0") && says.lines().count() == 1,
        "{says}"
    );
}

/// Samples of the path integrator are compared one by one, and what the reference does not
/// know is refused by name.
#[test]
fn samples_of_light_are_compared() {
    let scene = |name: &str| format!("{}/scenes/{name}", env!("CARGO_MANIFEST_DIR"));
    let light = |name: &str, more: &[&str]| {
        let fixed = ["--light", "--spp", "2", "--size", "16x12", "--threads", "1"];
        Command::new(env!("CARGO_BIN_EXE_lanecast"))
            .args(["verify", &scene(name)])
            .args(fixed)
            .args(more)
            .output()
            .expect("it runs")
    };
    let output = light("light_cornell.toml", &["--json", "-"]);
    assert_eq!(output.status.code(), Some(0));
    let found = json(&output);
    let counts = &found["counts"];
    assert_eq!(counts["samples"], 16 * 12 * 2);
    assert_eq!(counts["unexplained"], 0);
    assert!(found["unexplained"].as_array().unwrap().is_empty());
    for key in ["same", "other_hit", "other_shadow", "other_choice", "grown"] {
        assert!(counts[key].is_u64(), "{key}");
    }
    let text = light("light_cornell.toml", &[]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("0 unexplained"), "{text}");
    let output = light("primitives.toml", &["--grid", "corners"]);
    assert_eq!(output.status.code(), Some(2));
}
