//! `lanecast roots`.

use crate::run::{fails, folder, lanecast, names, stderr, stdout};
use serde_json::Value;
use std::fs;

fn json(arguments: &[&str]) -> Value {
    let folder = folder();
    let output = lanecast(
        folder.path(),
        &[&["roots", "--json", "-"], arguments].concat(),
    );
    assert!(output.status.success(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn roots_of_the_lectures_cubic() {
    let cubic = "--coeffs=-1,0,3,1";
    for (interval, count) in [
        ("0,1", 1),
        ("0,inf", 1),
        ("-inf,inf", 3),
        ("-1,0", 1),
        ("-3,-2", 1),
    ] {
        let report = json(&[cubic, "--interval", interval]);
        assert_eq!(
            report["roots"].as_array().unwrap().len(),
            count,
            "{interval}"
        );
    }
    let report = json(&[cubic]);
    assert_eq!(report["solver"], "auto");
    assert_eq!(report["degree"], 3);
    assert_eq!(report["complete"], true);
    let root = &report["roots"][2];
    assert_eq!(root["t"], "0.53208888623795607040".parse::<f64>().unwrap());
    assert_eq!(root["multiplicity"], 1);
    assert!(root["error"].as_f64().unwrap() < 1.2e-16);
    // All solvers beside it, or the one that is asked for.
    assert_eq!(report["solvers"].as_array().unwrap().len(), 7);
    assert!(report["solvers"][0]["nanoseconds"].as_f64().unwrap() > 0.0);
    let report = json(&[cubic, "--solver=sturm"]);
    assert_eq!(report["solvers"].as_array().unwrap().len(), 1);
    assert_eq!(report["solver"], "sturm");
    // What cannot be told apart is said.
    let report = json(&["--coeffs=1,-2,1", "--solver=bernstein"]);
    assert_eq!(report["roots"].as_array().unwrap().len(), 0);
    assert_eq!(report["clusters"][0]["parity"], "even");

    let folder = folder();
    let output = lanecast(folder.path(), &["roots", cubic, "--interval=0,1"]);
    let said = stdout(&output);
    assert!(
        said.contains("1 distinct real root in (0, 1], by auto"),
        "{said}"
    );
    assert!(said.contains("t 0.532088886237956"), "{said}");
    let output = lanecast(folder.path(), &["roots", cubic, "--json", "a.json"]);
    assert!(output.status.success());
    assert_eq!(names(folder.path()), ["a.json"]);
}

#[test]
fn roots_of_a_file() {
    let folder = folder();
    let list = r#"{"polynomials": [
        {"name": "double", "coeffs_f64": ["1.0", "-2.0", "1.0"],
         "real_roots_f64": [{"x": "1.0000000", "mult": 2, "forward_bound": "2e-08"}]},
        {"name": "plain", "coeffs_f64": [-2, 0, 1, 0, 0, 0]}]}"#;
    fs::write(folder.path().join("list.json"), list).unwrap();
    let output = lanecast(
        folder.path(),
        &["roots", "--file", "list.json", "--json", "-"],
    );
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let rows = report["polynomials"].as_array().unwrap();
    assert_eq!(rows[0]["name"], "double");
    assert_eq!(rows[0]["roots"][0]["multiplicity"], 2);
    assert_eq!(rows[1]["degree"], 2);
    assert_eq!(rows[1]["roots"][1]["t"], std::f64::consts::SQRT_2);
    assert_eq!(report["solvers"][0]["solver"], "auto");
    assert_eq!(report["solvers"][0]["found"], 1);
    assert_eq!(report["degrees"][0]["degree"], 2);
    assert_eq!(report["degrees"][0]["solvers"][0]["polynomials"], 2);
    let plot = ["roots", "--file", "list.json", "--plot", "p.html"];
    assert!(lanecast(folder.path(), &plot).status.success());
    let page = fs::read_to_string(folder.path().join("p.html")).unwrap();
    assert!(page.contains("Speed and accuracy") && page.contains("bracketed"));
    let output = lanecast(folder.path(), &["roots", "--file", "list.json"]);
    let said = stdout(&output);
    assert!(
        said.contains("double (degree 2): 1 distinct real root\n  1 (×2)"),
        "{said}"
    );

    // Known roots that are none.
    let wrong = list.replace("1.0000000", "2");
    fs::write(folder.path().join("list.json"), wrong).unwrap();
    let output = lanecast(folder.path(), &["roots", "--file", "list.json"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("1 lost, 1 others"));

    let known = |root: &str| {
        format!(
            "{{\"polynomials\": [{{\"name\": \"a\", \"coeffs_f64\": [1, 1], \
             \"real_roots_f64\": [{{{root}}}]}}]}}"
        )
    };
    let [infinite, none, negative] = [
        known("\"x\": \"inf\", \"mult\": 1"),
        known("\"x\": -1, \"mult\": 0"),
        known("\"x\": -1, \"mult\": 1, \"forward_bound\": -1"),
    ];
    for (text, says) in [
        (infinite.as_str(), "polynomial 'a': a root is inf"),
        (&none, "polynomial 'a': the root -1 has mult = 0"),
        (&negative, "forward_bound = -1"),
        (
            "{\"polynomials\": [{\"name\": \"a\", \"coeffs_f64\": [\"1e-400\"]}]}",
            "'1e-400' is not 0, but too small",
        ),
        ("{", "bad.json:1:"),
        ("{\"polynomials\": 1}", "coeffs_f64"),
        (
            "{\"polynomials\": [{\"name\": \"a\", \"coeffs_f64\": [\"x\"]}]}",
            "polynomial 'a': 'x' is no number",
        ),
        (
            "{\"polynomials\": [{\"name\": \"a\", \"coeffs_f64\": [1, null]}]}",
            "polynomial 'a': 'null' is no number",
        ),
        ("{\"polynomials\": []}", "polynomials: the list is empty"),
        (
            "{\"polynomials\": [{\"name\": \"a\", \"coeffs_f64\": [0, 0]}]}",
            "every number is a root",
        ),
    ] {
        let folder = crate::run::folder();
        fs::write(folder.path().join("bad.json"), text).unwrap();
        let output = lanecast(folder.path(), &["roots", "--file", "bad.json"]);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(3), "{said}");
        assert!(said.starts_with("error: ") && said.contains(says), "{said}");
    }
}

#[test]
fn wrong_usage_of_roots() {
    let long = format!("--coeffs={}1", "0,".repeat(129));
    for (arguments, says) in [
        (["roots"].as_slice(), "--coeffs=c0,c1"),
        (&["roots", "--coeffs=0,0"], "every number is a root"),
        (&["roots", "--coeffs=1,x"], "constant one first"),
        (&["roots", "--coeffs=1,inf"], "constant one first"),
        (&["roots", &long], "at most 128"),
        (&["roots", "--coeffs=1,2", "--interval=1,0"], "LOW,HIGH"),
        (
            &["roots", "--coeffs=1,2", "--solver=laguerre"],
            "known are auto",
        ),
        (
            &["roots", "--coeffs=1,2,3,4,5,6", "--solver=closed"],
            "at most 4",
        ),
        (
            &["roots", "--coeffs=1,2", "--file=a.json"],
            "cannot be used with",
        ),
        (
            &["roots", "--coeffs=1,2", "--plot=a.html"],
            "cannot be used with",
        ),
    ] {
        fails(arguments, 2, says);
    }
    fails(&["roots", "--file=none.json"], 3, "none.json");
}
