//! OpenSCAD's files from outside: what `measure` calls their parts, and a command `openscad` that
//! fails, warns, says nothing or does not end. A script plays it, so that none need be installed.

use super::run::{folder, lanecast, names, stderr, stdout};

#[test]
fn measure_names_ghosts_by_their_modifier() {
    let folder = folder();
    let text = "%cube(size = [9, 9, 9]);\ncube(size = [2, 2, 2]);\n\
                difference() { cube(size = [1, 1, 1]); #sphere(r = 1); }\n";
    std::fs::write(folder.path().join("a.csg"), text).unwrap();
    let output = lanecast(folder.path(), &["measure", "a.csg", "--json", "-"]);
    let report: serde_json::Value = serde_json::from_str(stdout(&output)).unwrap();
    let rows = report["solids"].as_array().unwrap();
    let rows: Vec<(&str, f64)> = rows
        .iter()
        .map(|row| {
            (
                row["name"].as_str().unwrap(),
                row["volume"].as_f64().unwrap(),
            )
        })
        .collect();
    assert_eq!(rows.len(), 3, "{rows:?}");
    assert_eq!(rows[0].0, "union");
    assert!((rows[0].1 - 8.0).abs() < 1e-6, "{rows:?}");
    assert_eq!(rows[1], ("% line 1", 729.0));
    assert_eq!(rows[2].0, "# line 3");
}

#[cfg(unix)]
mod program {
    use super::*;
    use std::os::unix::fs::PermissionsExt;
    use std::path::Path;
    use std::process::{Command, Output, Stdio};
    use std::time::{Duration, Instant};
    use tempfile::TempDir;

    /// The command with a program, in a folder whose `openscad` runs a script; `$2` is the file that
    /// it should write.
    fn command(folder: &Path, script: &str) -> Command {
        let openscad = folder.join("openscad");
        std::fs::write(&openscad, format!("#!/bin/sh\n{script}\n")).unwrap();
        std::fs::set_permissions(&openscad, PermissionsExt::from_mode(0o755)).unwrap();
        std::fs::write(folder.join("part.scad"), "cube(1);").unwrap();
        let temporary = folder.join("temporary");
        std::fs::create_dir_all(&temporary).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_lanecast"));
        command
            .current_dir(folder)
            .arg("measure")
            .env("PATH", format!("{}:/usr/bin:/bin", folder.display()))
            .env("TMPDIR", temporary)
            .stdin(Stdio::null());
        command
    }

    fn run(script: &str) -> Output {
        let folder = folder();
        let output = command(folder.path(), script)
            .arg("part.scad")
            .output()
            .unwrap();
        assert!(names(&folder.path().join("temporary")).is_empty());
        output
    }

    fn fails(script: &str, says: &str) {
        let output = run(script);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(3), "{script}: {said}");
        assert!(said.starts_with("error: part.scad: "), "{said}");
        assert!(said.contains(says), "{script}: {said}");
    }

    #[test]
    fn what_openscad_says_counts() {
        let writes = "echo 'cube(size = [2, 2, 2]);' >\"$2\"";
        let output = run(writes);
        assert!(output.status.success() && stderr(&output).is_empty());
        assert!(stdout(&output).contains("8.0000000"));
        // It ends well after an assertion that fails, and has written half of it.
        let asserts = format!("{writes}; echo \"ERROR: Assertion 'false' failed\" >&2");
        fails(&asserts, "openscad failed: ERROR: Assertion 'false' failed");
        let warns = format!(
            "{writes}; echo 'ECHO: WARNING: no' >&2; echo 'WARNING: first' >&2; \
             echo 'WARNING: second' >&2"
        );
        let output = run(&warns);
        let said = stderr(&output);
        assert!(output.status.success());
        assert_eq!(said.lines().count(), 1, "{said}");
        assert!(
            said.contains("2 × ") && said.contains("first: WARNING: first"),
            "{said}"
        );
        fails("echo 'no screen' >&2; exit 1", "openscad failed: no screen");
        fails("exit 1", "openscad failed: it says no more");
        fails("exit 0", "openscad has written no .csg");
    }

    /// Gives a `.csg` with texts to the command.
    fn with_texts(nodes: &str, script: &str) -> (Output, TempDir) {
        let folder = folder();
        let mut command = command(folder.path(), script);
        std::fs::write(folder.path().join("part.csg"), nodes).unwrap();
        let output = command.args(["part.csg", "--json", "-"]).output().unwrap();
        (output, folder)
    }

    #[test]
    fn texts_have_the_outlines_that_openscad_makes() {
        // A frame, and a dot beside it.
        let script = "cat \"$3\" >>programs; echo '<svg><path d=\"M 0,0 L 4,0 L 4,-3 L 0,-3 z \
                      M 1,-1 L 2,-1 L 2,-2 L 1,-2 z M 5,0 L 6,0 L 6,-1 z\"/></svg>' >\"$2\"";
        let text = r#"text(text = "o\".", size = 5, font = "", halign = "left", $fn = 0);"#;
        let part = format!("linear_extrude(height = 2) {{ {text} }}");
        let moved = "multmatrix([[1, 0, 0, 9]])";
        let both = format!("{part}\n{moved} {part}\n");
        let (output, folder) = with_texts(&both, script);
        let said = stderr(&output);
        assert!(output.status.success(), "{said}");
        assert!(said.contains("text(), with 17 chords to a curve"), "{said}");
        let report: serde_json::Value = serde_json::from_str(stdout(&output)).unwrap();
        let rows = report["solids"].as_array().unwrap();
        // The frame and the dot, 2 thick, and all of it twice.
        assert_eq!(rows.len(), 4);
        let volume: f64 = rows.iter().map(|row| row["volume"].as_f64().unwrap()).sum();
        assert!((volume - 46.0).abs() < 1e-3, "{volume}");
        // Once for both; nothing of the text becomes the program's.
        let programs = std::fs::read_to_string(folder.path().join("programs")).unwrap();
        let expected = r#"text(text = "o\".", size = 5, font = "", halign = "left", $fn = 128);"#;
        assert_eq!(programs, expected);
    }

    #[test]
    fn texts_that_openscad_does_not_make_are_named() {
        let text = "group() {\n text(text = \"a\");\n}";
        for (script, says) in [
            (
                "echo 'ERROR: no font' >&2; exit 1",
                "openscad failed at this text(): ERROR: no font",
            ),
            (
                "exit 0",
                "openscad has written no outline of this text(): No such file",
            ),
            ("echo '<svg/>' >\"$2\"", "its SVG has no path"),
            ("head -c 2000000 /dev/zero >\"$2\"", "too many corners"),
        ] {
            let (output, ..) = with_texts(text, script);
            let said = stderr(&output);
            assert_eq!(output.status.code(), Some(3), "{script}: {said}");
            assert!(
                said.starts_with("error: part.csg:2:2: ") && said.contains(says),
                "{said}"
            );
        }
        // Spaces only.
        let script = "echo 'Current top level object is not a 2D object.' >&2; exit 1";
        let (output, ..) = with_texts(&format!("{text} cube(2);"), script);
        assert!(output.status.success() && stdout(&output).contains("\"volume\": 8.0"));
        let folder = folder();
        let mut command = command(folder.path(), "");
        std::fs::write(folder.path().join("part.csg"), text).unwrap();
        let output = command
            .env("PATH", "/nowhere")
            .arg("part.csg")
            .output()
            .unwrap();
        assert!(stderr(&output).contains("text() of an outline is drawn by the command openscad"));
    }

    #[test]
    fn what_is_unusable_is_named() {
        let folder = folder();
        let at = folder.path();
        let command = |name, value| {
            let mut command = command(at, "");
            command.env(name, value).arg("part.scad").output().unwrap()
        };
        let output = command("TMPDIR", "/nowhere");
        let said = stderr(&output);
        assert!(
            said.contains("/nowhere") && said.contains("set TMPDIR"),
            "{said}"
        );
        let output = command("PATH", "/nowhere");
        assert!(stderr(&output).contains("without the command openscad on the path"));
        let mut unusable = super::program::command(at, "");
        std::fs::write(at.join("openscad"), [0; 9]).unwrap();
        let said = unusable.arg("part.scad").output().unwrap();
        assert!(
            stderr(&said).contains("the command openscad cannot be run"),
            "{said:?}"
        );
    }

    /// A signal ends both programs, and leaves no file.
    #[test]
    fn openscad_does_not_outlive_the_command() {
        let folder = folder();
        let at = folder.path();
        let script = format!(
            "echo $$ >'{0}/new'; mv '{0}/new' '{0}/id'; exec sleep 1000",
            at.display()
        );
        let mut command = command(at, &script);
        command.arg("part.scad").stderr(Stdio::piped());
        let child = command.spawn().unwrap();
        let start = Instant::now();
        let id = loop {
            if let Ok(id) = std::fs::read_to_string(at.join("id")) {
                break id;
            }
            assert!(start.elapsed() < Duration::from_secs(60));
            std::thread::sleep(Duration::from_millis(10));
        };
        let is_there = || {
            let mut kill = Command::new("kill");
            kill.args(["-0", id.trim()]).stderr(Stdio::null());
            kill.status().unwrap().success()
        };
        assert!(is_there());
        let sent = Command::new("kill")
            .args(["-INT", &child.id().to_string()])
            .status();
        assert!(sent.unwrap().success());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130));
        assert!(stderr(&output).contains("interrupted"));
        assert!(!is_there());
        assert!(names(&at.join("temporary")).is_empty());
    }
}
