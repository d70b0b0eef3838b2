//! Compares structures, build qualities, a peer, and frames with and without reuse.

use super::{BALL, MOVING, report, reported, rows, write_scene};
use crate::run::{fails, folder, lanecast, stderr};
use serde_json::Value;
use std::fs;

#[test]
fn structures_side_by_side() {
    let folder = folder();
    write_scene(folder.path(), BALL);
    let bench = [
        "s.toml",
        "--size",
        "20x20",
        "--reps",
        "1",
        "--lanes",
        "1",
        "--kinds",
        "primary",
        "--accels",
        "bvh,linear,auto",
        "--builds",
        "3",
        "--plot",
        "p.html",
    ];
    let report = reported(folder.path(), &bench);
    // auto is one of the others.
    let names = |list: &Value, key: &str| -> Vec<String> {
        let rows = list.as_array().unwrap().iter();
        rows.map(|row| row[key].as_str().unwrap().into()).collect()
    };
    assert_eq!(names(&report["structures"], "name"), ["bvh", "linear"]);
    assert_eq!(report["structures"][0]["builds"], 3);
    let accels = names(&report["results"], "accel");
    assert_eq!(accels, ["bvh", "bvh", "bvh", "linear", "linear", "linear"]);
    assert_eq!(rows(&report)[2]["hits"], rows(&report)[5]["hits"]);
    // A linear scan tests rays against the ball and two pyramids, in whose boxes
    // they come.
    let tests = rows(&report)[3]["tests_per_ray"].as_f64().unwrap();
    assert!(tests > 0.1 && tests <= 13.0, "{tests}");

    // The page has a bar for each row, and nothing from elsewhere.
    let page = fs::read_to_string(folder.path().join("p.html")).unwrap();
    assert!(page.starts_with("<!doctype html>") && page.ends_with("</html>\n"));
    for label in [
        ">bvh single fast 1<",
        ">linear single exact 1<",
        ">primary<",
    ] {
        assert!(page.contains(label), "{label}");
    }
    assert!(!page.contains("<script") && !page.contains("src=") && !page.contains("url("));
    assert_eq!(page.matches("<rect").count(), 6 + 2 + 2);
}

/// Trees of both qualities in one run: other trees, the same hits.
#[test]
fn qualities_side_by_side() {
    let folder = folder();
    let bench = [
        "--growth",
        "2e4:2e4",
        "--generate",
        "building",
        "--size",
        "40x40",
        "--reps",
        "1",
        "--lanes",
        "1",
        "--kinds",
        "primary",
        "--precision",
        "exact",
        "--build",
        "both",
        "--accels",
        "bvh,kd",
    ];
    let report = reported(folder.path(), &bench);
    let size = &report["sizes"][0];
    let triangles = size["triangles"].as_u64().unwrap();
    assert!(triangles.abs_diff(20_000) < 1000, "{triangles}");
    let list = |key: &str| size[key].as_array().unwrap();
    let names: Vec<_> = list("structures").iter().map(|row| &row["name"]).collect();
    assert_eq!(names, ["bvh", "bvh-high", "kd"]);
    let cost = |row: usize| list("structures")[row]["sah"][1].as_f64().unwrap();
    assert!(cost(1) < cost(0));
    let accels: Vec<_> = list("results").iter().map(|row| &row["accel"]).collect();
    assert_eq!(accels, ["bvh", "bvh-high", "kd"]);
    let hits: Vec<_> = list("results").iter().map(|row| &row["hits"]).collect();
    assert!(hits[0] == hits[1] && hits[0] == hits[2]);
    fails(
        &["bench", "--growth", "2e4:2e4", "--build", "low"],
        2,
        "known are medium, high, both",
    );
}

/// The stopping rules make different trees with the same hits, and what the
/// tracing took is reported.
#[test]
fn k_d_trees_and_counts() {
    let folder = folder();
    write_scene(folder.path(), BALL);
    let run = |rule: &str| {
        let bench = [
            "s.toml", "--size", "75x50", "--reps", "1", "--kinds", "primary", "--lanes", "1",
        ];
        let kd = [
            "--precision",
            "exact",
            "--accels",
            "kd,linear",
            "--kd-stop",
            rule,
        ];
        reported(folder.path(), &[&bench[..], &kd].concat())
    };
    let nodes = ["depth", "cost"].map(|rule| {
        let report = run(rule);
        let (kd, linear) = (&rows(&report)[0], &rows(&report)[1]);
        assert_eq!((&kd["accel"], &kd["hits"]), (&"kd".into(), &linear["hits"]));
        let number = |row: &Value, key: &str| row[key].as_f64().unwrap();
        // By cost, so few primitives may well be one leaf.
        assert!(rule == "cost" || number(kd, "nodes_per_ray") > 0.0);
        assert_eq!(number(linear, "nodes_per_ray"), 0.0);
        assert!(number(kd, "tests_per_ray") < number(linear, "tests_per_ray"));
        assert_eq!(number(linear, "spared_per_ray"), 0.0);
        let mesh = &report["structures"][0]["figures"][1];
        assert!(number(mesh, "references") >= 6.0);
        mesh["nodes"].as_u64().unwrap()
    });
    assert!(nodes[0] > nodes[1], "{nodes:?}");
}

#[test]
fn growth_is_fitted() {
    let folder = folder();
    let bench = [
        "--growth",
        "1e3:1e4",
        "--size",
        "32x32",
        "--reps",
        "1",
        "--precision",
        "fast",
        "--lanes",
        "auto",
        "--plot",
        "g.html",
    ];
    let report = reported(folder.path(), &bench);
    let sizes = report["sizes"].as_array().unwrap();
    assert_eq!(sizes.len(), 3);
    for pair in sizes.windows(2) {
        let triangles = |i: usize| pair[i]["triangles"].as_u64().unwrap() as f64;
        let factor = triangles(1) / triangles(0);
        assert!((3.0..3.4).contains(&factor), "{factor}");
    }
    assert_eq!(sizes[2]["results"].as_array().unwrap().len(), 4);
    let fits = report["fits"].as_array().unwrap();
    let memory = fits
        .iter()
        .find(|fit| fit["what"] == "memory" && fit["name"] == "bvh");
    let exponent = memory.unwrap()["exponent"].as_f64().unwrap();
    assert!((0.8..1.2).contains(&exponent), "{exponent}");
    let page = fs::read_to_string(folder.path().join("g.html")).unwrap();
    assert_eq!(page.matches("<polyline").count(), fits.len());
}

/// With the feature the peer answers; without it the command says how to get it.
#[test]
fn a_peer_beside_ours() {
    let folder = folder();
    write_scene(folder.path(), "");
    // Sides that are even: no ray goes through the middle, along an edge, where
    // Embree's default tests may miss both triangles.
    let bench = [
        "bench", "s.toml", "--size", "64x48", "--reps", "1", "--lanes", "auto", "--peers",
        "embree", "--json", "-",
    ];
    let output = lanecast(folder.path(), &bench);
    if !cfg!(all(feature = "peer-embree", target_arch = "x86_64")) {
        assert_eq!(output.status.code(), Some(2));
        assert!(
            stderr(&output).contains("--features peer-embree"),
            "{}",
            stderr(&output)
        );
        return;
    }
    let report = report(&output);
    let peers: Vec<&Value> = rows(&report).iter().filter(|r| r["peer"] == true).collect();
    // Three of its ways for each kind, with its usual tests and with robust ones.
    assert_eq!(peers.len(), 54);
    for row in &peers {
        assert_eq!(row["accel"], "embree3");
        let name = row["kernel"].as_str().unwrap();
        let verb = if row["kind"] == "primary" || row["kind"] == "mirror" {
            "embree3 Intersect"
        } else {
            "embree3 "
        };
        assert!(name.starts_with(verb), "{name}");
        let tests = if name.ends_with(" robust") {
            "robust"
        } else {
            "fast"
        };
        assert_eq!(row["precision"], tests);
        assert!(row["mrays_per_s"].as_f64().unwrap() > 0.0);
        // Few rays of so small a picture go through an edge; a peer that read
        // rays or wrote answers wrongly would differ by hundreds.
        assert!(row["differ"].as_u64().unwrap() <= 4, "{row}");
    }
    let ratios = report["comparisons"].as_array().unwrap();
    assert_eq!(ratios.len(), 27);
    for ratio in ratios {
        let row = |key: &str| &rows(&report)[ratio[key].as_u64().unwrap() as usize];
        let fair = if ratio["precision"] == "fast" {
            "fast"
        } else {
            "robust"
        };
        assert_eq!(row("own")["precision"], ratio["precision"]);
        assert_eq!(row("peer")["precision"], fair);
    }
    let built = report["structures"].as_array().unwrap();
    assert!(built.len() >= 5, "ours, and two qualities of two at least");
    assert!(built[1]["build_peak_bytes"].as_u64().unwrap() > 0);

    // Other shapes than triangles are not its business.
    write_scene(folder.path(), BALL);
    let output = lanecast(folder.path(), &bench);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("triangles only"));
}

/// Every bound on fitted trees and every reuse, in both precisions; no answer shows
/// any of it.
#[test]
fn frames_show_nothing_of_what_they_reuse() {
    let folder = folder();
    write_scene(folder.path(), MOVING);
    let bench = ["s.toml", "--frames", "4", "--size", "300x200"];
    let report = reported(folder.path(), &[&bench[..], &["--reps", "1"]].concat());
    let [rows, renewals] = ["results", "renewals"].map(|key| report[key].as_array().unwrap());
    assert_eq!((rows.len(), renewals.len()), (6, 16));
    for row in rows.iter().chain(renewals) {
        assert_eq!(row["mismatches"], 0, "{row}");
    }
    for row in rows {
        assert_eq!((&row["frames"], &row["rays"]), (&3.into(), &60000.into()));
        let bounded = row["temporal_bounds"]["bounded"].as_u64().unwrap();
        assert_eq!(bounded > 0, row["reuse"] != "none", "{row}");
    }
    let refitted = |i: usize| renewals[i]["refitted"].as_u64().unwrap();
    assert_eq!([refitted(0), refitted(6), refitted(7)], [0, 3, 0]);
}
