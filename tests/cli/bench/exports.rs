//! Exports rays and meshes from `bench`, and reads them back.

use super::{BALL, report, rows, write_scene};
use crate::run::{folder, lanecast, names, stderr, stdout};
use serde_json::Value;
use std::fs;

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
    assert_eq!(stdout(&output).matches("\nrays ").count(), 6);
}

/// `export --msh` writes the same file as `bench --export`, and refuses a scene without triangles.
#[test]
fn export_writes_triangles_alone() {
    let folder = folder();
    write_scene(folder.path(), "");
    fs::create_dir(folder.path().join("out")).unwrap();
    let bench = "bench s.toml --size 8x6 --reps 1 --kinds primary --export out";
    let output = lanecast(folder.path(), &bench.split(' ').collect::<Vec<_>>());
    assert!(output.status.success(), "{}", stderr(&output));
    let output = lanecast(folder.path(), &["export", "s.toml", "--msh", "t.msh"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(
        stdout(&output).starts_with("t.msh: "),
        "{}",
        stdout(&output)
    );
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert_eq!(read("t.msh"), read("out/s.msh"));
    let ball = "format = 1\n[shape]\nb.sphere = { center = [0, 0, 0], radius = 1 }\n\
                [[instance]]\nshape = 'b'\n";
    fs::write(folder.path().join("b.toml"), ball).unwrap();
    for (arguments, says) in [
        (["b.toml", "--msh", "b.msh"], "the scene has no mesh"),
        (["s.toml", "--msh", "s.toml"], "is the input"),
    ] {
        let output = lanecast(folder.path(), &[&["export"][..], &arguments].concat());
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
    }
    assert!(!names(folder.path()).contains(&"b.msh".to_string()));
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
        stderr(&output).contains("warning: ./s.msh: 1 instance"),
        "{}",
        stderr(&output)
    );
    assert_eq!(
        names(folder.path()),
        ["pyramid.obj", "s.msh", "s.shadow.rays", "s.toml"]
    );
}
