//! Commands that write files tell them by `--json`.

use crate::run::{folder, lanecast, stderr};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A triangle, which every format has.
const SCENE: &str = "format = 1\n[camera]\neye = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov_y = 30\n\
                     [shape]\nt = { mesh = \"t.obj\" }\n[[instance]]\nshape = 't'\n";

fn told(folder: &Path, arguments: &str) -> Value {
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let output = lanecast(folder, &[&arguments[..], &["--json", "-"]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn files_are_told() {
    let folder = folder();
    let folder = folder.path();
    fs::create_dir(folder.join("in")).unwrap();
    for name in ["", "in/"] {
        fs::write(
            folder.join(format!("{name}t.obj")),
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        )
        .unwrap();
    }
    fs::write(folder.join("a.toml"), SCENE).unwrap();
    for arguments in [
        "convert a.toml b.toml",
        "export a.toml --pov b.pov",
        "export a.toml --mitsuba b.xml",
        "export a.toml --msh b.msh",
    ] {
        let report = told(folder, arguments);
        assert_eq!(report["scene"], "a.toml");
        let files = report["files"].as_array().unwrap();
        assert!(!files.is_empty(), "{arguments}");
        for file in files {
            let path = folder.join(file["path"].as_str().unwrap());
            assert_eq!(
                file["bytes"],
                fs::metadata(&path).unwrap().len(),
                "{arguments}"
            );
        }
    }
    for part in ["0..2", "2..4"] {
        let sums =
            format!("render a.toml --size 8x6 --integrator path --samples {part} -o {part}.sums");
        told(folder, &sums);
    }
    let report = told(folder, "merge 0..2.sums 2..4.sums -o c.png");
    assert_eq!(
        (&report["samples"], &report["parts"]),
        (&4.into(), &2.into())
    );
    assert_eq!(
        (&report["width"], &report["files"][0]),
        (&8.into(), &"c.png".into())
    );
    let report = told(folder, "thumbs in --out out --size 8x8 --spp 1");
    let row = &report["scenes"][0];
    assert!(row["failure"].is_null());
    assert!(
        folder
            .join("out")
            .join(row["picture"].as_str().unwrap())
            .is_file(),
        "{row}"
    );
    let output = lanecast(
        folder,
        &["export", "a.toml", "--pov", "-", "--json", "x.json"],
    );
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("name a file for --pov"),
        "{}",
        stderr(&output)
    );
}
