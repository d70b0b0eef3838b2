//! `lanecast extremes`: what the command writes, and its exit codes.

use crate::run::{folder, lanecast};
use lanecast::internals::measure::extremes::SWEEPS;
use serde_json::Value;
use std::path::Path;

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let arguments = [&["extremes", "--json", "-"], arguments].concat();
    let output = lanecast(folder, &arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!said.contains("panicked"), "{said}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// (sweep, point, figures).
fn rows(report: &Value) -> impl Iterator<Item = (&Value, &Value, &Value)> {
    let array = |value: &'_ Value| value.as_array().unwrap().len();
    (0..array(&report["sweeps"])).flat_map(move |s| {
        let sweep = &report["sweeps"][s];
        (0..array(&sweep["points"])).flat_map(move |p| {
            let point = &sweep["points"][p];
            let modes = &point["modes"];
            (0..array(modes)).map(move |m| (sweep, point, &modes[m]))
        })
    })
}

#[test]
fn the_command_writes_every_sweep_and_a_page_of_its_own() {
    let folder = folder();
    let arguments = [
        "extremes", "--rays", "16", "--json", "x.json", "--plot", "x.html",
    ];
    let output = lanecast(folder.path(), &arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    let printed = String::from_utf8_lossy(&output.stdout);
    let text = std::fs::read_to_string(folder.path().join("x.json")).unwrap();
    let report: Value = serde_json::from_str(&text).unwrap();
    let page = std::fs::read_to_string(folder.path().join("x.html")).unwrap();

    let mut count = 0;
    for sweep in SWEEPS {
        let values = (sweep.values)();
        for subject in sweep.subjects {
            let row = &report["sweeps"][count];
            count += 1;
            assert_eq!(row["name"], sweep.name);
            assert_eq!(row["subject"], subject.name());
            let points = row["points"].as_array().unwrap();
            let written: Vec<f64> = points
                .iter()
                .map(|p| p["value"].as_f64().unwrap())
                .collect();
            assert_eq!(written, values);
            for point in points {
                let modes = point["modes"].as_array().unwrap().len();
                assert_eq!(modes, if point["refused"].is_null() { 3 } else { 0 });
            }
            let starts = row["starts"].as_array().unwrap();
            assert_eq!(starts.len(), 3);
            let line = format!("{} {} ", sweep.name, subject.name());
            assert!(printed.lines().any(|l| l.starts_with(&line)), "{printed}");
            let heading = format!("<h2>{}: {}</h2>", sweep.name, subject.name());
            assert!(page.contains(&heading), "{heading}");
        }
    }
    assert_eq!(report["sweeps"].as_array().unwrap().len(), count);
    assert_eq!(page.matches("<svg").count(), 2 * count);
    assert!(page.ends_with("</html>\n") && !page.contains("NaN"));
    assert!(!page.contains("<script") && !page.contains("src="));

    let mut broken = false;
    for (_, point, figures) in rows(&report) {
        // What is not a number would be null.
        for (name, value) in figures.as_object().unwrap() {
            let named = name == "precision" || name == "first_wrong";
            assert!(named || value.is_number(), "{name} {value}");
        }
        assert_eq!(figures["rays"], 32);
        let count = |name: &str| figures[name].as_u64().unwrap();
        let wrong = count("wrong_hit") + count("wrong_id") + count("wrong_shadow");
        let promised = point["known_gap"].is_null() && wrong > 0;
        broken |= figures["precision"] != "fast" && (promised || count("not_finite") > 0);
    }
    assert_eq!(output.status.code(), Some(i32::from(broken)), "{said}");
    assert_eq!(said.starts_with("error: "), broken, "{said}");
}

#[test]
fn what_is_promised_ends_well() {
    let folder = folder();
    let arguments = ["extremes", "--rays", "64", "--only", "edges,slivers"];
    let output = lanecast(folder.path(), &arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(said.is_empty(), "{said}");
}

/// All but the times.
#[test]
fn a_seed_gives_the_same_figures_again() {
    let folder = folder();
    let figures = |more: &[&str]| {
        let only = ["--rays", "128", "--only", "chain,edges,tangent"];
        let report = json(folder.path(), &[&only, more].concat());
        let of = |(sweep, _, figures): (&Value, &Value, &Value)| {
            let mut figures = figures.clone();
            figures.as_object_mut().unwrap().remove("ns_per_ray");
            (sweep["name"].clone(), figures)
        };
        rows(&report).map(of).collect::<Vec<_>>()
    };
    let first = figures(&["--threads", "1"]);
    assert_eq!(first, figures(&["--threads", "2"]));
    assert_ne!(first, figures(&["--seed", "7"]));
}

#[test]
fn one_precision_and_one_sweep_are_enough() {
    let folder = folder();
    let narrow = [
        "--rays",
        "8",
        "--only",
        "chain",
        "--precision",
        "guarded",
        "--lanes",
        "1",
    ];
    let report = json(folder.path(), &narrow);
    let sweeps = report["sweeps"].as_array().unwrap();
    assert_eq!(sweeps.len(), 2);
    assert_eq!(report["rays"], 8);
    assert!(rows(&report).all(|(sweep, _, figures)| {
        sweep["name"] == "chain" && figures["precision"] == "guarded"
    }));
}
