//! Rows of the report: one for each kind of rays and mode, and the options that choose among
//! them.

use super::{BALL, VIEW, report, reported, rows, write_scene};
use crate::run::{folder, lanecast, names, stderr, stdout};
use serde_json::Value;
use std::fs;

#[test]
fn every_kind_in_every_mode() {
    let folder = folder();
    write_scene(folder.path(), BALL);
    let bench = ["bench", "s.toml", "--size", "75x50", "--reps", "2"];
    let report = reported(folder.path(), &bench[1..]);
    assert_eq!(rows(&report).len(), 54);
    let primary_hits = &rows(&report)[0]["hits"];
    assert!(primary_hits.as_u64().unwrap() > 300, "{primary_hits}");
    let kinds = [
        "primary",
        "ortho",
        "shadow",
        "lightshadow",
        "directional",
        "areashadow",
        "mirror",
        "diffuse",
        "diffuse_any",
    ];
    for (kind, rows) in kinds.iter().zip(rows(&report).chunks(6)) {
        for row in rows {
            assert_eq!(row["kind"], *kind);
            assert_eq!(row["accel"], "bvh");
            assert_eq!(row["threads"], 1);
            assert_eq!(row["checked"], row["rays"]);
            let rate = |key: &str| row[key].as_f64().unwrap();
            assert!(rate("mrays_per_s") > 0.0);
            assert!(rate("mrays_per_s_best") >= rate("mrays_per_s"));
            assert!(row["isa"].is_string());
            let single = row["lanes"] == 1;
            assert_eq!(row["kernel"], if single { "single" } else { "tile" });
            assert_eq!(row["peer"], false);
            let parts = ["missed", "extra", "tied", "elsewhere"];
            let parts = parts.map(|key| row[key].as_u64().unwrap());
            assert_eq!(row["differ"].as_u64().unwrap(), parts.iter().sum::<u64>());
            assert!(row["nodes_per_ray"].is_null() || row["nodes_per_ray"].is_f64());
        }
        // Every primary hit sends one ray of each other kind.
        match *kind {
            "primary" | "ortho" => assert_eq!(rows[0]["rays"], 75 * 50),
            _ => assert_eq!(&rows[0]["rays"], primary_hits),
        }
        // Those that decide exactly agree, at every width.
        for (row, precision) in (2..).zip(["guarded", "guarded", "exact", "exact"]) {
            assert_eq!(rows[row]["precision"], precision);
            assert_eq!(rows[row]["hits"], rows[5]["hits"]);
            assert_eq!(rows[row]["differ"], 0);
        }
    }
    // The same rays, asked for any hit.
    assert_eq!(rows(&report)[46]["hits"], rows(&report)[52]["hits"]);
    assert!(report["build_seconds"].is_f64() && report["tree_bytes"].is_u64());
    // What it takes to measure this again.
    assert_eq!(report["scene"], "s.toml");
    assert!(report["size"][0].is_u64() && report["date"].as_str().unwrap().ends_with('Z'));
    assert_eq!(report["arguments"][0], "bench");
    assert_eq!(report["version"], env!("CARGO_PKG_VERSION"));
    let structure = &report["structures"][0];
    assert_eq!(structure["name"], "bvh");
    assert_eq!(structure["tree_bytes"], report["tree_bytes"]);
    assert!(structure["bytes_per_triangle"].as_f64().unwrap() > 0.0);
    assert!(structure["sah"][1].is_f64());
    assert_eq!(report["comparisons"].as_array().unwrap().len(), 0);

    // Without --json a table, and nothing else is written.
    let output = lanecast(folder.path(), &bench);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(stdout(&output).matches("\ndiffuse_any ").count(), 6);
    assert_eq!(names(folder.path()), ["pyramid.obj", "s.toml"]);
}

#[test]
fn what_is_asked_for_narrows() {
    let folder = folder();
    write_scene(folder.path(), BALL);
    let bench = |more: &[&str]| {
        let bench = ["s.toml", "--size", "20x20", "--reps", "1"];
        reported(folder.path(), &[&bench, more].concat())
    };
    let one = [
        "--precision",
        "fast",
        "--lanes",
        "1",
        "--kinds",
        "diffuse,primary",
    ];
    let report = bench(&one);
    let kinds: Vec<&Value> = rows(&report).iter().map(|row| &row["kind"]).collect();
    assert_eq!(kinds, ["primary", "diffuse"]);
    assert_eq!(rows(&report)[0]["lanes"], 1);
    assert_eq!(rows(&report)[0]["precision"], "fast");
    // Another structure and more threads answer the same.
    let other = bench(&[&one[..], &["--accel", "linear", "--threads", "2"]].concat());
    assert_eq!(rows(&other)[1]["accel"], "linear");
    assert_eq!(rows(&other)[1]["threads"], 2);
    assert_eq!(rows(&other)[1]["hits"], rows(&report)[1]["hits"]);
    assert_eq!(other["clock"], "wall");
    assert_eq!(
        rows(&bench(&["--lanes", "auto", "--kinds", "shadow"])).len(),
        3
    );
    assert_eq!(
        rows(&bench(&["--precision", "exact", "--kinds", "shadow"])).len(),
        2
    );
}

/// The set is the same in any order, and so are the hits.
#[test]
fn orders_change_no_answer() {
    let folder = folder();
    write_scene(folder.path(), "");
    let hits = |order: &str| {
        let bench = ["s.toml", "--size", "45x33", "--reps", "1"];
        let modes = ["--precision", "exact", "--lanes", "auto"];
        let asked = [&bench[..], &modes, &["--order", order]].concat();
        let report = reported(folder.path(), &asked);
        assert_eq!(report["order"][0], order);
        let hits = rows(&report).iter().map(|row| row["hits"].clone());
        hits.collect::<Vec<Value>>()
    };
    let tile = hits("tile");
    assert_eq!(tile.len(), 9);
    for order in ["scanline", "morton", "random"] {
        assert_eq!(hits(order), tile, "{order}");
    }
}

#[test]
fn lists_of_widths_and_orders() {
    let folder = folder();
    write_scene(folder.path(), "");
    let bench = [
        "s.toml",
        "--size",
        "45x33",
        "--reps",
        "1",
        "--kinds",
        "primary,shadow",
    ];
    let lists = [
        "--precision",
        "exact",
        "--lanes",
        "1,auto",
        "--order",
        "tile,random",
    ];
    let report = reported(folder.path(), &[&bench[..], &lists].concat());
    assert_eq!(report["order"], serde_json::json!(["tile", "random"]));
    let kinds = rows(&report)
        .iter()
        .map(|row| row["kind"].as_str().unwrap());
    let kinds: Vec<&str> = kinds.collect();
    let sets = [
        "primary-tile",
        "shadow-tile",
        "primary-random",
        "shadow-random",
    ];
    assert_eq!(kinds, sets.map(|set| [set, set]).concat());
    let hits = |row: usize| &rows(&report)[row]["hits"];
    assert!(
        (1..4)
            .map(&hits)
            .chain([hits(4), hits(5)])
            .all(|h| !h.is_null())
    );
    assert_eq!((hits(0), hits(1)), (hits(4), hits(5)));
}

#[test]
fn a_camera_that_sees_nothing() {
    let folder = folder();
    write_scene(folder.path(), "");
    let away = VIEW.replace("look_at = [1.0, 0.5, 0.0]", "look_at = [1.0, 2.0, 9.0]");
    fs::write(folder.path().join("s.toml"), away).unwrap();
    let bench = [
        "bench", "s.toml", "--size", "9x9", "--reps", "1", "--json", "-",
    ];
    let output = lanecast(folder.path(), &bench);
    assert!(
        stderr(&output).contains("warning: shadow: no rays"),
        "{}",
        stderr(&output)
    );
    let report = report(&output);
    assert_eq!(rows(&report)[0]["hits"], 0);
    // No hits to leave from.
    assert_eq!(rows(&report)[12]["kind"], "shadow");
    assert_eq!(rows(&report)[12]["mrays_per_s"], 0.0);
}

#[test]
fn a_width_that_one_precision_lacks_is_said() {
    let folder = folder();
    write_scene(folder.path(), "");
    for lanes in ["1", "4", "8", "16"] {
        let bench = ["bench", "s.toml", "--size", "9x7", "--reps", "1"];
        let asked = ["--kinds", "primary", "--json", "-", "--lanes", lanes];
        let output = lanecast(folder.path(), &[&bench[..], &asked].concat());
        let said = stderr(&output);
        let measured = match output.status.code() {
            Some(0) => rows(&report(&output)).len(),
            code => {
                assert_eq!(code, Some(2), "{said}");
                continue;
            }
        };
        let left_out = said.matches("is left out: packets of").count();
        assert_eq!(measured + left_out, 3, "{lanes} lanes: {said}");
        if cfg!(feature = "all-lanes") {
            assert_eq!(left_out, 0);
        }
    }
}
