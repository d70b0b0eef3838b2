//! `lanecast bench`: rows, narrowing, export and the way back.

use super::{fails, folder, lanecast, names, stderr, stdout};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Output;

/// A pyramid on a square, as .obj; every coordinate is a short binary fraction.
const PYRAMID: &str = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0.25 1.5 0\n\
                       f 1 2 3\nf 1 3 4\nf 1 5 2\nf 2 5 3\nf 3 5 4\nf 4 5 1\n";

const VIEW: &str = r#"
format = 1
[camera]
eye = [1.0, 2.0, 7.0]
look_at = [1.0, 0.5, 0.0]
fov_y = 40.0
[[light]]
point = { position = [-5.0, 2.0, -3.0], intensity = [120.0, 120.0, 120.0] }
[shape.pyramid]
mesh = "pyramid.obj"
[[instance]]
shape = "pyramid"
[[instance]]
shape = "pyramid"
transform = [{ scale = 0.5 }, { translate = [2.5, 0.25, 1.0] }]
"#;

const BALL: &str = r#"
[shape.ball]
sphere = { center = [0.5, 0.5, 2.0], radius = 0.5 }
[[instance]]
shape = "ball"
"#;

/// A pyramid that turns before the others.
const MOVING: &str = r#"
[[instance]]
shape = "pyramid"
transform = [{ scale = 0.4 }, { translate = [0.0, 0.5, 2.0] }]
motion = [{ at = 1.0, transform = [{ scale = 0.4 }, { rotate_y = 50.0 }, { translate = [2.0, 0.5, 2.5] }] }]
"#;

fn write_scene(folder: &Path, more: &str) {
    fs::write(folder.join("pyramid.obj"), PYRAMID).unwrap();
    fs::write(folder.join("s.toml"), format!("{VIEW}{more}")).unwrap();
}

/// The report on standard output.
fn report(output: &Output) -> Value {
    assert!(output.status.success(), "{}", stderr(output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn rows(report: &Value) -> &[Value] {
    report["results"].as_array().unwrap()
}

/// Every bound on fitted trees and every reuse, in both precisions; no answer shows
/// any of it.
#[test]
fn frames_show_nothing_of_what_they_reuse() {
    let folder = folder();
    write_scene(folder.path(), MOVING);
    let bench = ["bench", "s.toml", "--frames", "4", "--size", "300x200"];
    let report = report(&lanecast(
        folder.path(),
        &[&bench[..], &["--reps", "1", "--json", "-"]].concat(),
    ));
    let [rows, renewals] = ["results", "renewals"].map(|key| report[key].as_array().unwrap());
    assert_eq!((rows.len(), renewals.len()), (6, 16));
    for row in rows.iter().chain(renewals) {
        assert_eq!(row["mismatches"], 0, "{row}");
    }
    for row in rows {
        assert_eq!((&row["frames"], &row["rays"]), (&3.into(), &60000.into()));
        let bounded = row["guesses"]["bounded"].as_u64().unwrap();
        assert_eq!(bounded > 0, row["reuse"] != "none", "{row}");
    }
    let refitted = |i: usize| renewals[i]["refitted"].as_u64().unwrap();
    assert_eq!([refitted(0), refitted(6), refitted(7)], [0, 3, 0]);
}

#[test]
fn every_kind_in_every_mode() {
    let folder = folder();
    write_scene(folder.path(), BALL);
    let bench = ["bench", "s.toml", "--size", "75x50", "--reps", "2"];
    let report = report(&lanecast(
        folder.path(),
        &[&bench[..], &["--json", "-"]].concat(),
    ));
    assert_eq!(rows(&report).len(), 36);
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
    for (kind, rows) in kinds.iter().zip(rows(&report).chunks(4)) {
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
        assert_eq!(rows[2]["precision"], "exact");
        assert_eq!(rows[2]["hits"], rows[3]["hits"]);
        assert_eq!(rows[3]["differ"], 0);
    }
    // The same rays, asked for any hit.
    assert_eq!(rows(&report)[30]["hits"], rows(&report)[34]["hits"]);
    assert!(report["build_seconds"].is_f64() && report["tree_bytes"].is_u64());
    let structure = &report["structures"][0];
    assert_eq!(structure["name"], "bvh");
    assert_eq!(structure["tree_bytes"], report["tree_bytes"]);
    assert!(structure["bytes_per_triangle"].as_f64().unwrap() > 0.0);
    assert!(structure["sah"][1].is_f64());
    assert_eq!(report["comparisons"].as_array().unwrap().len(), 0);

    // Without --json a table, and nothing else is written.
    let output = lanecast(folder.path(), &bench);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(stdout(&output).matches("\ndiffuse_any ").count(), 4);
    assert_eq!(names(folder.path()), ["pyramid.obj", "s.toml"]);
}

#[test]
fn what_is_asked_for_narrows() {
    let folder = folder();
    write_scene(folder.path(), BALL);
    let bench = |more: &[&str]| {
        let bench = ["bench", "s.toml", "--size", "20x20", "--reps", "1"];
        report(&lanecast(
            folder.path(),
            &[&bench[..], more, &["--json", "-"]].concat(),
        ))
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
        2
    );
    assert_eq!(
        rows(&bench(&["--precision", "exact", "--kinds", "shadow"])).len(),
        2
    );
}

#[test]
fn exported_and_read_back() {
    let folder = folder();
    write_scene(folder.path(), "");
    fs::create_dir(folder.path().join("out")).unwrap();
    let modes = ["--reps", "1", "--precision", "exact", "--json", "-"];
    let bench = ["bench", "s.toml", "--size", "61x47", "--export", "out"];
    let output = lanecast(folder.path(), &[&bench[..], &modes].concat());
    assert!(stderr(&output).is_empty(), "{}", stderr(&output));
    let direct = report(&output);
    let kinds = [
        "areashadow",
        "diffuse",
        "diffuse_any",
        "directional",
        "lightshadow",
        "mirror",
        "ortho",
        "primary",
        "shadow",
    ];
    let mut files: Vec<String> = kinds.iter().map(|k| format!("s.{k}.rays")).collect();
    files.insert(6, "s.msh".into());
    assert_eq!(names(&folder.path().join("out")), files);
    for row in rows(&direct) {
        let kind = row["kind"].as_str().unwrap();
        let rays = format!("out/s.{kind}.rays");
        let sets = ["bench", "--mesh", "out/s.msh", "--rays", &rays];
        let back = report(&lanecast(folder.path(), &[&sets[..], &modes].concat()));
        assert_eq!(back["triangles"], 12);
        for key in ["kind", "rays", "hits"] {
            assert_eq!(rows(&back)[0][key], row[key], "{kind}");
        }
        // Nothing lies where so small a scene mirrors to.
        let hits = row["hits"].as_u64().unwrap();
        assert!(hits > 0 || kind == "mirror", "{kind}");
    }
    // Several sets in one run.
    let sets = ["bench", "--mesh", "out/s.msh", "--rays", "out/s.ortho.rays"];
    let more = ["--rays", "out/s.mirror.rays"];
    let sets = [&sets[..], &more, &modes].concat();
    let both = report(&lanecast(folder.path(), &sets));
    let kinds: Vec<&Value> = rows(&both).iter().step_by(2).map(|r| &r["kind"]).collect();
    assert_eq!(kinds, ["ortho", "mirror"]);
    // Any other name asks for the closest hit.
    fs::rename(
        folder.path().join("out/s.shadow.rays"),
        folder.path().join("x.rays"),
    )
    .unwrap();
    let sets = [
        "bench",
        "--mesh",
        "out/s.msh",
        "--rays",
        "x.rays",
        "--reps",
        "1",
    ];
    let output = lanecast(folder.path(), &sets);
    assert_eq!(stdout(&output).matches("\nrays ").count(), 4);
}

/// The set is the same in any order, and so are the hits.
#[test]
fn orders_change_no_answer() {
    let folder = folder();
    write_scene(folder.path(), "");
    let hits = |order: &str| {
        let bench = ["bench", "s.toml", "--size", "45x33", "--reps", "1"];
        let modes = ["--precision", "exact", "--lanes", "auto", "--json", "-"];
        let output = lanecast(
            folder.path(),
            &[&bench[..], &modes, &["--order", order]].concat(),
        );
        let report = report(&output);
        assert_eq!(report["order"], order);
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
fn structures_side_by_side() {
    let folder = folder();
    write_scene(folder.path(), BALL);
    let bench = [
        "bench",
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
        "--json",
        "-",
        "--plot",
        "p.html",
    ];
    let report = report(&lanecast(folder.path(), &bench));
    // auto is one of the others.
    let names = |list: &Value, key: &str| -> Vec<String> {
        let rows = list.as_array().unwrap().iter();
        rows.map(|row| row[key].as_str().unwrap().into()).collect()
    };
    assert_eq!(names(&report["structures"], "name"), ["bvh", "linear"]);
    assert_eq!(report["structures"][0]["builds"], 3);
    let accels = names(&report["results"], "accel");
    assert_eq!(accels, ["bvh", "bvh", "linear", "linear"]);
    assert_eq!(rows(&report)[1]["hits"], rows(&report)[3]["hits"]);
    // A linear scan tests rays against the ball and two pyramids, in whose boxes
    // they come.
    let tests = rows(&report)[2]["tests_per_ray"].as_f64().unwrap();
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
    assert_eq!(page.matches("<rect").count(), 4 + 2 + 2);
}

/// Trees of both qualities in one run: other trees, the same hits.
#[test]
fn qualities_side_by_side() {
    let folder = folder();
    let bench = |more: &[&str]| {
        let all = [
            "bench",
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
            "--json",
            "-",
        ];
        lanecast(folder.path(), &[&all[..], more].concat())
    };
    let report = report(&bench(&["--build", "both", "--accels", "bvh,kd"]));
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
            "bench", "s.toml", "--size", "75x50", "--reps", "1", "--kinds", "primary", "--lanes",
            "1",
        ];
        let kd = [
            "--precision",
            "exact",
            "--accels",
            "kd,linear",
            "--kd-stop",
            rule,
            "--json",
            "-",
        ];
        report(&lanecast(folder.path(), &[&bench[..], &kd].concat()))
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
        "bench",
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
        "--json",
        "-",
        "--plot",
        "g.html",
    ];
    let report = report(&lanecast(folder.path(), &bench));
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
    // Three of its ways for each kind.
    assert_eq!(peers.len(), 27);
    for row in &peers {
        assert_eq!(row["accel"], "embree3");
        let name = row["kernel"].as_str().unwrap();
        let verb = if row["kind"] == "primary" || row["kind"] == "mirror" {
            "embree3 Intersect"
        } else {
            "embree3 "
        };
        assert!(name.starts_with(verb), "{name}");
        assert!(row["mrays_per_s"].as_f64().unwrap() > 0.0);
        // Few rays of so small a picture go through an edge; a peer that read
        // rays or wrote answers wrongly would differ by hundreds.
        assert!(row["differ"].as_u64().unwrap() <= 4, "{row}");
    }
    let ratios = report["comparisons"].as_array().unwrap();
    assert_eq!(ratios.len(), 18);
    let built = report["structures"].as_array().unwrap();
    assert!(built.len() >= 3, "ours, and two qualities at least");
    assert!(built[1]["build_peak_bytes"].as_u64().unwrap() > 0);

    // Other shapes than triangles are not its business.
    write_scene(folder.path(), BALL);
    let output = lanecast(folder.path(), &bench);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("triangles only"));
}

#[test]
fn what_msh_cannot_hold_is_counted() {
    let folder = folder();
    write_scene(folder.path(), BALL);
    let bench = [
        "bench", "s.toml", "--size", "9x9", "--reps", "1", "--kinds", "shadow",
    ];
    let output = lanecast(folder.path(), &[&bench[..], &["--export", "."]].concat());
    assert!(output.status.success());
    assert!(
        stderr(&output).contains("warning: ./s.msh: 1 appearance"),
        "{}",
        stderr(&output)
    );
    assert_eq!(
        names(folder.path()),
        ["pyramid.obj", "s.msh", "s.shadow.rays", "s.toml"]
    );
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
    assert_eq!(rows(&report)[8]["kind"], "shadow");
    assert_eq!(rows(&report)[8]["mrays_per_s"], 0.0);
}

#[test]
fn refusals() {
    fails(
        &["bench", "x.toml", "--size", "16384x16384"],
        2,
        "too many rays",
    );
    let kinds = ["--mesh", "a", "--rays", "b", "--kinds", "shadow"];
    fails(&[&["bench"], &kinds[..]].concat(), 2, "cannot be used with");
    fails(&["bench"], 2, "required");
    fails(&["bench", "--growth", "9:8"], 2, "MIN:MAX");
    fails(
        &["bench", "x.toml", "--growth", "1e3:1e4"],
        2,
        "cannot be used with",
    );
    fails(
        &["bench", "x.toml", "--order", "spiral"],
        2,
        "known are scanline",
    );
    fails(&["bench", "x.toml", "--accels", "bvh,oak"], 2, "'oak'");
    fails(
        &["bench", "x.toml", "--peers", "oak"],
        2,
        "known are embree",
    );
    let folder = folder();
    write_scene(folder.path(), "");
    for (arguments, code, says) in [
        (
            ["--accel", "linear", "--reps", "10000"],
            2,
            "--accel linear would test",
        ),
        (["--export", "none", "--reps", "1"], 4, "create it first"),
    ] {
        let output = lanecast(
            folder.path(),
            &[&["bench", "s.toml"], &arguments[..]].concat(),
        );
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
        assert!(stdout(&output).is_empty());
    }
    // Rays that are damaged.
    let corners: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut mesh = b"MSH1\x03\0\0\0\x01\0\0\0".to_vec();
    mesh.extend(corners.iter().flat_map(|x| x.to_le_bytes()));
    mesh.extend([0_u32, 1, 2].iter().flat_map(|i| i.to_le_bytes()));
    fs::write(folder.path().join("a.msh"), mesh).unwrap();
    fs::write(folder.path().join("a.primary.rays"), "RAY1\u{9}").unwrap();
    let sets = ["bench", "--mesh", "a.msh", "--rays", "a.primary.rays"];
    let output = lanecast(folder.path(), &sets);
    assert_eq!(output.status.code(), Some(3));
    assert!(
        stderr(&output).contains("a.primary.rays: "),
        "{}",
        stderr(&output)
    );
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
        assert_eq!(measured + left_out, 2, "{lanes} lanes: {said}");
        if cfg!(feature = "all-lanes") {
            assert_eq!(left_out, 0);
        }
    }
}

#[test]
fn its_usage_names_both_forms() {
    fails(&["bench"], 2, "lanecast bench [OPTIONS] <SCENE>\n");
    fails(&["bench"], 2, "bench [OPTIONS] --mesh <FILE> --rays <FILE>");
}
