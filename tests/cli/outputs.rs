//! Output files appear whole or not at all, also after errors, signals and closed pipes.

use crate::run::{fails, folder, lanecast, names, small, stderr, stdout};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

#[test]
fn outputs_that_cannot_be_written() {
    fails(&small(&["-o", "none/x.png"]), 4, "create it first");
    fails(&small(&["--stats", "none/s.json"]), 4, "create it first");
    fails(&small(&["--json", "none/s.json"]), 4, "create it first");
    fails(&small(&["-o", "/"]), 2, "known are");
    fails(&small(&["-o", "x.png/"]), 4, "ends in '/'");
    fails(&small(&["--json", "x/"]), 4, "ends in '/'");
    let folder = folder();
    fs::create_dir(folder.path().join("x.png")).unwrap();
    let output = lanecast(folder.path(), &small(&["-o", "x.png", "--stats", "s"]));
    assert_eq!(output.status.code(), Some(4));
    assert_eq!(names(folder.path()), ["x.png"]);
    // Nobody may create a file there; what is said is about the file that was asked for.
    if cfg!(target_os = "linux") {
        let output = lanecast(folder.path(), &small(&["-o", "/proc/x.png"]));
        assert_eq!(output.status.code(), Some(4));
        assert!(stderr(&output).contains("/proc/x.png: cannot be written: "));
        assert!(!stderr(&output).contains(".tmp"), "{}", stderr(&output));
    }
    if Path::new("/dev/full").exists() {
        fails(
            &small(&["-o", "x.png", "--stats", "/dev/full"]),
            4,
            "/dev/full",
        );
    }
}

/// Beyond the limit of the shell: an error of writing, and nothing left.
#[cfg(target_os = "linux")]
#[test]
fn a_file_beyond_the_limit_of_size() {
    let folder = folder();
    let output = Command::new("sh")
        .current_dir(folder.path())
        .args(["-c", r#"ulimit -f 1 && exec "$0" "$@""#])
        .arg(env!("CARGO_BIN_EXE_lanecast"))
        .args(["render", "--size", "200x100", "-o", "x.exr"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(4), "{output:?}");
    assert!(stderr(&output).contains("x.exr: cannot be written"));
    assert!(names(folder.path()).is_empty());
}

#[cfg(unix)]
#[test]
fn a_link_to_nothing_is_followed() {
    let folder = folder();
    std::os::unix::fs::symlink("y.png", folder.path().join("x.png")).unwrap();
    let output = lanecast(folder.path(), &small(&["-o", "x.png"]));
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(names(folder.path()), ["x.png", "y.png"]);
    let about = fs::symlink_metadata(folder.path().join("x.png")).unwrap();
    assert!(about.is_symlink());
}

/// The next run that writes there removes them.
#[cfg(target_os = "linux")]
#[test]
fn what_a_killed_run_leaves_is_swept() {
    let folder = folder();
    let arguments = ["render", "--frames", "2000", "--size", "8x8", "-o", "x.png"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_lanecast"))
        .current_dir(folder.path())
        .args(arguments)
        .spawn()
        .unwrap();
    wait_for("a frame", || {
        let frame = |name: &String| {
            let about = fs::metadata(folder.path().join(name));
            about.is_ok_and(|about| about.len() > 0)
        };
        names(folder.path()).iter().any(frame)
    });
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(!names(folder.path()).is_empty());
    let output = lanecast(folder.path(), &small(&["-o", "x.png"]));
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(names(folder.path()), ["x.png"]);
}

#[cfg(unix)]
#[test]
fn a_folder_without_write_permission() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let locked = folder.path().join("locked");
    fs::create_dir(&locked).unwrap();
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(locked.join("probe"), "").is_ok() {
        println!("skipped: this user may write anywhere");
        return;
    }
    let output = lanecast(folder.path(), &small(&["-o", "locked/x.png"]));
    assert_eq!(output.status.code(), Some(4));
    assert!(stderr(&output).contains("locked/x.png: cannot be written"));
    assert!(names(&locked).is_empty());
}

#[test]
fn an_output_replaces_an_older_one() {
    let folder = folder();
    let path = folder.path().join("x.exr");
    fs::write(&path, "old").unwrap();
    let output = lanecast(folder.path(), &small(&["-o", "x.exr"]));
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(
        fs::read(&path)
            .unwrap()
            .starts_with(&[0x76, 0x2f, 0x31, 0x01])
    );
    assert_eq!(names(folder.path()), ["x.exr"]);
}

/// Nor the files that the scene names.
#[test]
fn what_a_scene_names_is_not_overwritten() {
    let folder = folder();
    let mesh = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    fs::write(folder.path().join("m.ply"), mesh).unwrap();
    let scene = "format = 1\n[shape.a]\nmesh = \"m.ply\"\n[[instance]]\nshape = \"a\"\n";
    fs::write(folder.path().join("s.toml"), scene).unwrap();
    for arguments in [
        ["plan", "s.toml", "--json", "./m.ply"],
        ["render", "s.toml", "--stats", "m.ply"],
        ["measure", "s.toml", "--json", "m.ply"],
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_lanecast"))
            .current_dir(folder.path())
            .args(arguments)
            .output()
            .unwrap();
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(
            said.contains("'m.ply', which an output would replace"),
            "{said}"
        );
        assert_eq!(names(folder.path()), ["m.ply", "s.toml"]);
        assert_eq!(
            fs::read_to_string(folder.path().join("m.ply")).unwrap(),
            mesh
        );
    }
}

#[cfg(unix)]
#[test]
fn a_reader_that_leaves_is_no_error() {
    use std::os::fd::OwnedFd;
    for arguments in [small(&["--json", "-"]), vec!["--help"], vec!["--version"]] {
        let folder = folder();
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = Command::new(env!("CARGO_BIN_EXE_lanecast"))
            .current_dir(folder.path())
            .args(&arguments)
            .stdout(OwnedFd::from(writer))
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert!(stderr(&output).is_empty(), "{}", stderr(&output));
    }
}

/// All outputs or none: where standard output is full, no file stays.
#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output() {
    let full = || fs::File::create("/dev/full").unwrap();
    for arguments in [
        small(&["-o", "x.png"]),
        small(&["-o", "x.png", "--json", "-"]),
        small(&["-o", "x.png", "--json", "j", "--stats", "-"]),
        vec!["--help"],
        vec!["render", "--help"],
        vec!["--version"],
    ] {
        let folder = folder();
        fs::write(folder.path().join("x.png"), "older").unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_lanecast"))
            .current_dir(folder.path())
            .args(&arguments)
            .stdout(full())
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(4), "{arguments:?}");
        let said = stderr(&output);
        assert!(
            said.contains("standard output: cannot be written"),
            "{said}"
        );
        assert_eq!(names(folder.path()), ["x.png"]);
        assert_eq!(fs::read(folder.path().join("x.png")).unwrap(), b"older");
    }
}

/// A pipe without a reader: one signal ends the wait.
#[cfg(target_os = "linux")]
#[test]
fn interrupted_where_nobody_reads() {
    let folder = folder();
    let made = Command::new("mkfifo")
        .arg(folder.path().join("pipe"))
        .status();
    if !made.is_ok_and(|status| status.success()) {
        println!("skipped: no mkfifo");
        return;
    }
    let arguments = small(&["-o", "x.png", "--json", "pipe"]);
    // The picture is complete, and the pipe next.
    let drawn = || {
        let is_drawn = |name: &String| {
            let about = fs::metadata(folder.path().join(name));
            name.ends_with(".tmp") && about.is_ok_and(|about| about.len() > 0)
        };
        wait_for("a picture", || names(folder.path()).iter().any(is_drawn));
        std::thread::sleep(std::time::Duration::from_millis(500));
    };
    let says = "interrupted while nobody read the results; no file was written";
    interrupt("-TERM", &arguments, folder.path(), drawn, says);
    assert_eq!(names(folder.path()), ["pipe"]);
}

#[cfg(unix)]
const NOTHING: &str = "interrupted; nothing was written";

/// A signal, once the work has begun: it ends, says so, and leaves nothing.
#[cfg(unix)]
fn interrupt(signal: &str, arguments: &[&str], folder: &Path, begun: impl Fn(), says: &str) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_lanecast"))
        .current_dir(folder)
        .args(arguments)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait_for_handler(child.id());
    begun();
    let sent = Command::new("kill")
        .args([signal, &child.id().to_string()])
        .status()
        .unwrap();
    assert!(sent.success());
    let start = std::time::Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed().as_secs() > 60 {
            child.kill().unwrap();
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(stderr(&output).contains(says), "{}", stderr(&output));
}

#[cfg(unix)]
#[test]
fn interrupted_leaves_nothing() {
    for signal in ["-INT", "-TERM"] {
        let folder = folder();
        fs::write(folder.path().join("x.png"), "older").unwrap();
        // Hours of work.
        let arguments = ["render", "--size", "4096x4096", "--spp", "65536"];
        let outputs = ["-o", "x.png", "--stats", "s.json"];
        let arguments = [&arguments[..], &outputs].concat();
        interrupt(signal, &arguments, folder.path(), || (), NOTHING);
        assert_eq!(names(folder.path()), ["x.png"]);
        assert_eq!(fs::read(folder.path().join("x.png")).unwrap(), b"older");
    }
}

#[cfg(unix)]
#[test]
fn interrupted_within_a_ray() {
    // 10^12 balls in nearly one place, of which every ray has to meet all.
    let mut scene = "format = 1\n[camera]\neye = [0, 0, 5]\nlook_at = [0, 0, 0]\nfov_y = 40\n\
        [shape.ball]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
        [node.n0]\nchildren = [{ shape = \"ball\" }]\n"
        .to_string();
    for level in 1..=12 {
        let child = |k: i32| {
            let (node, x) = (level - 1, f64::from(k) * 1e-9);
            format!("{{ node = \"n{node}\", transform = [{{ translate = [{x}, 0, 0] }}] }},")
        };
        let children: String = (0..10).map(child).collect();
        scene += &format!("[node.n{level}]\nchildren = [{children}]\n");
    }
    scene += "[[instance]]\nnode = \"n12\"\n";
    let folder = folder();
    fs::write(folder.path().join("deep.toml"), scene).unwrap();
    let arguments = ["render", "deep.toml", "--size", "8x8", "-o", "x.png"];
    interrupt("-TERM", &arguments, folder.path(), || (), NOTHING);
    assert_eq!(names(folder.path()), ["deep.toml"]);
}

/// Commands whose work cannot be cancelled end at once.
#[cfg(unix)]
#[test]
fn interrupted_commands_that_only_read() {
    let folder = folder();
    let mut balls =
        "format = 1\n[shape.a]\nsphere = { center = [0, 0, 0], radius = 1 }\n".to_string();
    for x in 0..300_000 {
        balls +=
            &format!("[[instance]]\nshape = \"a\"\ntransform = [{{ translate = [{x}, 0, 0] }}]\n");
    }
    fs::write(folder.path().join("s.toml"), balls).unwrap();
    for arguments in [
        vec!["plan", "s.toml", "--json", "x"],
        vec![
            "probe", "s.toml", "--org", "0,0,0", "--dir", "1,0,0", "--json", "x",
        ],
        vec!["export", "s.toml", "--pov", "x"],
    ] {
        interrupt("-INT", &arguments, folder.path(), || (), NOTHING);
        assert_eq!(names(folder.path()), ["s.toml"]);
    }
}

/// Until the process listens for signals: its thread for them tells, by its name.
#[cfg(unix)]
fn wait_for_handler(process: u32) {
    let listens = || {
        let threads = fs::read_dir(format!("/proc/{process}/task")).ok()?;
        let mut names =
            threads.filter_map(|t| fs::read_to_string(t.ok()?.path().join("comm")).ok());
        names.find(|name| name.trim() == "ctrl-c")
    };
    wait_for("the handler of signals", || listens().is_some());
}

#[cfg(unix)]
fn wait_for(what: &str, is_there: impl Fn() -> bool) {
    for _ in 0..1000 {
        if is_there() {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    panic!("no {what}");
}

/// What the colours of an inspection mean is said once, beside the picture.
#[test]
fn inspections_have_a_legend() {
    for (integrator, says) in [
        ("normals", "normals: n as 0.5 + 0.5 n; min, median, max: x "),
        ("uv", "of others texture coordinates; min, median, max: u "),
        ("edges", "edges: lines where things end or turn"),
        (
            "ids",
            "a lightness for each primitive; min, median, max: instance ",
        ),
        (
            "heat",
            "heat: nodes + tests + 16 escalations of the camera ray",
        ),
        ("heat:tests", "heat: tests of the camera ray"),
    ] {
        let folder = folder();
        let output = lanecast(folder.path(), &small(&["--integrator", integrator]));
        let said = stderr(&output);
        assert!(output.status.success(), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
        assert!(
            said.contains(says) && said.contains("of 15 pixels"),
            "{said}"
        );
        assert_eq!(names(folder.path()), ["lanecast.png"]);
        for option in [["--spp", "2"], ["--max-bounces", "1"], ["--noise", "0.1"]] {
            let arguments = small(&[&["--integrator", integrator][..], &option].concat());
            fails(&arguments, 2, &format!("leave out {}", option[0]));
        }
    }
}

/// What stands behind things is the colour that was named, whatever the tone curve makes of light.
#[test]
fn a_named_background_is_that_colour_in_the_file() {
    let folder = folder();
    let scene = "format = 1\n[camera]\neye = [0, 0, 9]\nlook_at = [0, 0, 0]\nfov_y = 40\n\
                 [shape.ball]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
                 [[instance]]\nshape = \"ball\"\n";
    fs::write(folder.path().join("s.toml"), scene).unwrap();
    for (exposure, name, code) in [
        ("0", "white", [255; 3]),
        ("-1", "white", [255; 3]),
        ("2", "0.5,0.2,0", [188, 124, 0]),
    ] {
        let mut arguments = vec!["render", "s.toml", "--size", "8x8", "-o", "s.png"];
        arguments.extend(["--integrator", "path", "--spp", "1", "--background", name]);
        arguments.extend(["--exposure", exposure, "--dither", "off"]);
        let output = lanecast(folder.path(), &arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        let picture = image::open(folder.path().join("s.png")).unwrap();
        assert_eq!(picture.color(), image::ColorType::Rgb8);
        assert_eq!(picture.to_rgb8().get_pixel(0, 0).0, code, "{name}");
        assert_ne!(picture.to_rgb8().get_pixel(4, 4).0, code, "{name}");
    }
}

/// Sampling until it is quiet says whether it is, and how many samples that took.
#[test]
fn adaptive_sampling_says_what_it_reached() {
    let said = |noise: &'static str, most: &'static str| {
        let folder = folder();
        let options = [
            "--integrator",
            "path",
            "--noise",
            noise,
            "--max-spp",
            most,
            "--json",
            "s.json",
        ];
        let output = lanecast(folder.path(), &small(&options));
        assert!(output.status.success(), "{}", stderr(&output));
        let stats = fs::read_to_string(folder.path().join("s.json")).unwrap();
        assert!(stats.contains("\"mean_spp\": "), "{stats}");
        (stdout(&output).to_owned(), stderr(&output).to_owned())
    };
    let (quiet, note) = said("1", "16");
    assert!(
        quiet.contains(" spp in the mean, noise below 1,"),
        "{quiet}"
    );
    assert_eq!(note, "");
    let (loud, note) = said("0.0001", "5");
    assert!(
        loud.contains(" 4.0 spp in the mean, noise above 0.0001 in 100.0 % of the picture"),
        "{loud}"
    );
    assert!(note.contains("--max-spp 5 is 4"), "{note}");
}

/// At the bottom of a slot that is a pixel wide all is left to paths; above it nothing is near.
#[test]
fn where_walls_are_nearer_than_a_pixel_a_cache_has_no_records() {
    let folder = folder();
    let records = |half: &str| {
        let block = |name: &str, min: String, max: String| {
            format!(
                "[shape.{name}]\nbox = {{ min = {min}, max = {max} }}\n\
                 [[instance]]\nshape = \"{name}\"\n"
            )
        };
        let scene = [
            "format = 1\n[camera]\neye = [0, 5, 0]\nlook_at = [0, 0, 0]\nup = [0, 0, -1]\n\
             orthographic = 4.0\n[[light]]\nenvironment = { color = [1, 1, 1] }\n"
                .to_owned(),
            block("floor", "[-9, -0.5, -3]".into(), "[9, 0, 3]".into()),
            block("left", "[-9, 0, -3]".into(), format!("[-{half}, 1, 3]")),
            block("right", format!("[{half}, 0, -3]"), "[9, 1, 3]".into()),
        ];
        fs::write(folder.path().join("s.toml"), scene.concat()).unwrap();
        let mut arguments = vec!["render", "s.toml", "--size", "1x48", "--spp", "1"];
        arguments.extend(["--filter", "box", "--cache", "irradiance", "-o", "s.png"]);
        let output = lanecast(folder.path(), &arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        let said = stdout(&output);
        let words: Vec<&str> = said.split_whitespace().collect();
        let at = words.iter().position(|w| *w == "records").unwrap();
        words[at - 1].parse::<u32>().unwrap()
    };
    assert_eq!(records("0.05"), 0);
    assert!(records("2.0") > 0);
}
