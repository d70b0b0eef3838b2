//! The command line itself: help, usage errors, missing and broken inputs, the summary, and
//! the message on a processor without the instructions.

use crate::run::{SMALL, fails, folder, lanecast, names, small, stderr, stdout};
use std::fs;
use std::process::Command;

#[test]
fn version_and_help() {
    let folder = folder();
    let version = lanecast(folder.path(), &["--version"]);
    assert!(version.status.success());
    assert_eq!(
        stdout(&version),
        concat!("lanecast ", env!("CARGO_PKG_VERSION"), "\n")
    );
    let help = lanecast(folder.path(), &["--help"]);
    assert!(help.status.success());
    for word in [
        "render", "verify", "bench", "plan", "extremes", "roots", "probe", "measure", "convert",
        "export", "130",
    ] {
        assert!(stdout(&help).contains(word), "{word}");
    }
    let help = lanecast(folder.path(), &["render", "--help"]);
    assert!(help.status.success());
    for option in [
        "--size",
        "--spp",
        "--grid",
        "--stats",
        "--aov",
        "--allow-outside",
        "--precision",
        "--lanes",
        "--accel",
        "--threads",
        "--seed",
        "--json",
        "--max-bounces",
        "--camera",
        "--view-transform",
        "--exposure",
        "--dither",
        "--bits",
        "--background",
        "-o",
    ] {
        assert!(stdout(&help).contains(option), "{option}");
    }
    for (command, options) in [
        (
            "verify",
            [
                "--allow-wrong",
                "--sample",
                "--adversarial",
                "--seed",
                "--scale",
                "--offset",
            ]
            .as_slice(),
        ),
        (
            "bench",
            &["--export", "--mesh", "--rays", "--kinds", "--reps"],
        ),
        (
            "extremes",
            &["--rays", "--only", "--seed", "--json", "--plot"],
        ),
    ] {
        let help = lanecast(folder.path(), &[command, "--help"]);
        assert!(options.iter().all(|o| stdout(&help).contains(o)));
    }
}

#[test]
fn no_command_is_wrong_usage() {
    let folder = folder();
    let output = lanecast(folder.path(), &[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("Usage: lanecast"));
}

#[test]
fn wrong_arguments() {
    for (arguments, says) in [
        (vec!["draw"], "unrecognized subcommand 'draw'"),
        (small(&["--sise", "1x1"]), "--size"),
        (
            vec!["render", "--size", "0x4"],
            "each side must be 1 to 65535",
        ),
        (vec!["render", "--size", "65535x65535"], "at most 268435456"),
        (vec!["render", "--size", "big"], "WIDTHxHEIGHT"),
        // Values, not options that do not exist.
        (
            vec!["render", "--size", "-5x3"],
            "invalid value '-5x3' for '--size <WxH>'",
        ),
        (
            small(&["--threads", "-1"]),
            "invalid value '-1' for '--threads <N>'",
        ),
        (small(&["--spp", "0"]), "1..=65536"),
        (small(&["--spp", "65537"]), "1..=65536"),
        (small(&["--threads", "0"]), "1..=1024"),
        (small(&["--threads", "1025"]), "1..=1024"),
        (small(&["--max-bounces", "256"]), "0..=255"),
        (small(&["--seed", "x"]), "--seed"),
        (
            small(&["-o", "x.exr", "--view-transform", "agx"]),
            "--view-transform is for PNG and JPEG files",
        ),
        (small(&["--view-transform", "filmic"]), "--view-transform"),
        (small(&["--exposure", "nan"]), "number of stops"),
        (small(&["--background", "mauve"]), "R,G,B"),
        (
            small(&["--integrator", "direct", "--noise", "0.1"]),
            "--noise is for pictures of paths",
        ),
        (
            small(&["--integrator", "direct", "--cache", "irradiance"]),
            "--cache is for --integrator path",
        ),
        (
            small(&["--cache", "irradiance", "--max-bounces", "1"]),
            "--max-bounces 2 or more",
        ),
        (
            small(&["--cache", "photons"]),
            "known are irradiance, unbiased",
        ),
        (
            small(&["--cache", "irradiance", "--cache-error", "0"]),
            "from 0.02 to 1",
        ),
        (
            small(&["--integrator", "direct", "--filter", "box"]),
            "--filter is for pictures of paths",
        ),
        (
            small(&["--aov", "depth,smell"]),
            "no output 'smell'; known are",
        ),
        (small(&["--grid", "sides"]), "known are centers, corners"),
        (small(&["--lanes", "2"]), "known are auto, 1, 4, 8, 16"),
        (
            small(&["--precision", "good"]),
            "known are fast, guarded, exact",
        ),
        (
            small(&["--accel", "octree"]),
            "known are auto, bvh, kd, grid, heap, heap-spheres, linear, item-buffer",
        ),
        (
            small(&["--kd-stop", "sometimes"]),
            "known are depth, count, both, cost",
        ),
        (
            small(&["--kd-clip", "corner"]),
            "known are box, plane, triangle",
        ),
        (small(&["--kd-depth", "65"]), "0..=64"),
        // What would be without effect.
        (small(&["--kd-stop", "cost"]), "with --accel kd"),
        (
            small(&["--accel", "bvh", "--kd-leaf", "1"]),
            "with --accel kd",
        ),
        (
            small(&["--accel", "kd", "--kd-leaf", "1"]),
            "--kd-leaf is for --kd-stop count and both",
        ),
        (
            vec!["bench", "x.toml", "--accels", "bvh,grid", "--kd-depth", "3"],
            "with --accel kd",
        ),
        (
            small(&["--accel", "grid", "--build", "high"]),
            "--build applies to the trees of bvh",
        ),
        (
            vec!["plan", "--accel", "linear", "--build", "high"],
            "--build applies to the trees of bvh",
        ),
        (
            vec!["verify", "x.toml", "--accel", "kd", "--build", "high"],
            "--build applies to the trees of bvh",
        ),
        (
            vec!["bench", "x.toml", "--accels", "kd,heap", "--build", "both"],
            "--build applies to the trees of bvh",
        ),
        (small(&["--tiles", "1/4"]), "unexpected argument"),
        (small(&["--tile", "1/4"]), "at most 1x1 tiles"),
        (
            small(&["--grid", "corners", "--spp", "4"]),
            "leave out --spp 4",
        ),
        (
            vec!["render", "--grid", "corners", "--size", "1x9"],
            "at least 2x2",
        ),
        (
            small(&["-o", "x.bmp"]),
            "known are .png, .jpg, .hdr and .exr",
        ),
        (small(&["-o", "x"]), "known are .png, .jpg, .hdr and .exr"),
        (
            small(&["--stats", "-", "--json", "-"]),
            "--stats and --json",
        ),
        (small(&["-o", "x.png", "--json", "x.png"]), "two outputs"),
        (
            small(&["-o", "x.png", "--aov", "depth", "--json", "x.aov.exr"]),
            "two outputs",
        ),
        (vec!["verify"], "<SCENE>"),
        (vec!["render", ""], "a value is required for '[SCENE]'"),
        (vec!["verify", ""], "a value is required for '<SCENE>'"),
        (vec!["plan", ""], "a value is required for '[SCENE]'"),
        (
            vec!["bench", "x.toml", "--accels", "bvh,kd,bvh"],
            "'bvh' is named twice",
        ),
        (vec!["verify", "x.toml", "--sample", "0"], "--sample"),
        (vec!["verify", "x.toml", "--seed", "1"], "--adversarial"),
        (vec!["verify", "x.toml", "--spp", "2"], "--light"),
        (
            vec!["verify", "x.toml", "--scale", "-1"],
            "a finite number above 0",
        ),
        (
            vec!["verify", "x.toml", "--offset", "-1,2"],
            "three finite numbers",
        ),
        (vec!["probe", "x.toml", "--org", "0,0,0"], "--dir <X,Y,Z>"),
        (
            vec!["probe", "x.toml", "--org", "0,0", "--dir", "-1,0,0"],
            "three finite numbers",
        ),
        (
            vec!["probe", "x.toml", "--org", "0,0,0", "--dir", "0,-0,0"],
            "points nowhere",
        ),
        (vec!["export", "x.toml"], "--pov <FILE>"),
        (vec!["convert", "x.toml"], "<OUT>"),
        (vec!["convert", "x.toml", "x.pov"], ".toml or .json"),
        (
            vec!["render", "--variant", "x"],
            "--variant is of a file, and no scene is named",
        ),
        (
            vec!["plan", "--animation", "x"],
            "--animation is of a file, and no scene is named",
        ),
        (
            vec!["render", "--point-radius", "1"],
            "--point-radius is of a file, and no scene is named",
        ),
        (
            vec!["render", "--z-up"],
            "--z-up is of a file, and no scene is named",
        ),
        (
            vec!["render", "--integrator", "ao", "--max-bounces", "2"],
            "--max-bounces is of light, which --integrator ao does not follow",
        ),
        (
            vec!["render", "--integrator", "normals", "--sampler", "sobol"],
            "leave out --sampler",
        ),
        (vec!["bench"], "required"),
        (vec!["bench", "--mesh", "a.msh"], "required"),
        (
            vec!["bench", "x.toml", "--mesh", "a.msh", "--rays", "a.rays"],
            "cannot be used with",
        ),
        (
            vec!["bench", "x.toml", "--kinds", "gamma"],
            "no ray kind 'gamma'",
        ),
        (
            vec!["extremes", "--only", "small,huge"],
            "no sweep 'huge'; known are small, large",
        ),
        (vec!["extremes", "--rays", "0"], "--rays"),
        (vec!["extremes", "x.toml"], "unexpected argument"),
    ] {
        fails(&arguments, 2, says);
    }
}

#[test]
fn options_that_a_command_does_not_use() {
    for (command, options) in [
        ("verify", &["--aov", "--tile"][..]),
        (
            "bench",
            &["--spp", "--aov", "--seed", "--tile", "--max-bounces"],
        ),
        (
            "plan",
            &["--spp", "--aov", "--seed", "--tile", "--max-bounces"],
        ),
    ] {
        let help = lanecast(folder().path(), &[command, "--help"]);
        for option in options {
            let says = format!("unexpected argument '{option}' found");
            fails(&[command, "x.toml", option, "1"], 2, &says);
            assert!(!stdout(&help).contains(option), "{command} {option}");
        }
    }
    let used = ["verify", "x.toml", "--max-bounces", "1"];
    fails(&used, 3, "x.toml");
}

/// Ids of pictures can be told from the file.
#[test]
fn ids_have_names() {
    let folder = folder();
    let scene = "format = 1\n[material.red]\n[shape.ball]\n\
                 sphere = { center = [0, 0, 0], radius = 1 }\n\
                 [node.pair]\nchildren = [{ shape = \"ball\" }, { shape = \"ball\", material = \"red\" }]\n\
                 [[instance]]\nshape = \"ball\"\n[[instance]]\nnode = \"pair\"\n";
    fs::write(folder.path().join("s.toml"), scene).unwrap();
    let plan = lanecast(folder.path(), &["plan", "s.toml", "--json", "-"]);
    let render = ["render", "s.toml", "--size", "4x4", "--stats", "-"];
    let render = lanecast(folder.path(), &render);
    for output in [plan, render] {
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let all = json["instance_names"].as_array().unwrap();
        assert_eq!(all.len(), 3);
        assert_eq!(all[0]["path"], serde_json::json!([0]));
        let last = serde_json::json!({
            "id": 2, "path": [1, 1], "nodes": ["pair"], "shape": "ball", "kind": "sphere",
            "material": "red"
        });
        assert_eq!(all[2], last);
    }
    // Too many to list.
    let mut many = scene.to_string();
    for _ in 0..10_000 {
        many += "[[instance]]\nshape = \"ball\"\n";
    }
    fs::write(folder.path().join("s.toml"), many).unwrap();
    let plan = lanecast(folder.path(), &["plan", "s.toml", "--json", "-"]);
    let json: serde_json::Value = serde_json::from_slice(&plan.stdout).unwrap();
    assert!(
        json["instance_names"]
            .as_str()
            .unwrap()
            .contains("the number of instances before it")
    );
}

/// Names in a file may hold what a terminal obeys.
#[test]
fn control_characters_never_reach_the_terminal() {
    let ball = |radius: u32| {
        format!(
            "format = 1\n[shape.\"x\\u001b[2J\\u0007\\nerror: fake\"]\n\
             sphere = {{ center = [0, 0, 0], radius = {radius} }}\n\
             [shape.\"y\\u001b\\nz\"]\nunion = [\"x\\u001b[2J\\u0007\\nerror: fake\"]\n\
             [[instance]]\nshape = \"y\\u001b\\nz\"\n"
        )
    };
    let gltf = "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":36,\
                \"uri\":\"../\\u001b[2J\\u0007\\nerror: fake\"}],\"nodes\":[{}]}";
    for (name, text, code) in [
        ("bad.toml", ball(0), 3),
        ("good.toml", ball(1), 0),
        ("s.gltf", gltf.to_string(), 3),
    ] {
        let folder = folder();
        fs::write(folder.path().join(name), text).unwrap();
        for arguments in [
            vec!["plan", name],
            vec!["probe", name, "--org", "0,0,5", "--dir", "0,0,-1"],
        ] {
            let output = lanecast(folder.path(), &arguments);
            assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
            let said = format!("{}{}", stdout(&output), stderr(&output));
            let raw = |c: char| c.is_control() && c != '\n';
            assert!(!said.contains(raw), "{said:?}");
            assert!(!said.contains("\nerror: fake"), "{said}");
            assert!(
                !said.contains("y\nz") && !said.contains("\\u{1b}\nz"),
                "{said}"
            );
        }
    }
}

#[test]
fn missing_inputs() {
    for arguments in [
        ["render", "none.toml"].as_slice(),
        &["verify", "none.toml"],
        &["plan", "none.toml"],
        &["probe", "none.toml", "--org", "0,0,0", "--dir", "0,0,1"],
        &["export", "none.toml", "--pov", "x.pov"],
        &["convert", "none.toml", "x.json"],
        &["bench", "none.toml"],
        &["render", "none.tiff"],
    ] {
        fails(arguments, 3, arguments[1]);
    }
    fails(&["render", "."], 3, "it is a folder");
    fails(
        &["render", "none"],
        3,
        "no ending that tells a scene format",
    );
    let sets = ["bench", "--mesh", "a.msh", "--rays", "a.primary.rays"];
    fails(&sets, 3, "a.msh: cannot be read");
}

#[test]
fn broken_meshes_say_what_and_where() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
               property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
               end_header\n0 0 0\n";
    for (name, text, says) in [
        // The line once.
        ("a.ply", ply, "error: a.ply:10:1: the file ends too early"),
        (
            "a.obj",
            "v 0 0 0\nv 1 0 0\nf 1 2\n",
            "places a shape; not imported: 1 × face of fewer than 3 corners\n",
        ),
    ] {
        let folder = folder();
        fs::write(folder.path().join(name), text).unwrap();
        let output = lanecast(folder.path(), &["render", name]);
        assert_eq!(output.status.code(), Some(3));
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
        assert_eq!(names(folder.path()), [name]);
    }
}

#[test]
fn a_broken_ray_set() {
    let folder = folder();
    fs::write(folder.path().join("a.msh"), "MSH1").unwrap();
    let sets = ["bench", "--mesh", "a.msh", "--rays", "a.primary.rays"];
    let output = lanecast(folder.path(), &sets);
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).contains("does not begin like a .msh file"));
}

#[test]
fn default_output_and_summary() {
    let folder = folder();
    let output = lanecast(folder.path(), &SMALL);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(names(folder.path()), ["lanecast.png"]);
    assert!(stdout(&output).starts_with("lanecast.png: 5x3, "));
    // Not a terminal: no progress.
    assert!(stderr(&output).is_empty());
}

#[test]
fn statistics_and_results() {
    let folder = folder();
    let arguments = [
        "-o",
        "x.png",
        "--aov",
        "depth,instance_id",
        "--stats",
        "s.json",
        "--json",
        "-",
        "--spp",
        "1",
    ];
    let output = lanecast(folder.path(), &small(&arguments));
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(names(folder.path()), ["s.json", "x.aov.exr", "x.png"]);
    let stats: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path().join("s.json")).unwrap()).unwrap();
    // Standard output is the document and nothing else.
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["picture"], stats["picture"]);
    assert_eq!(stats["picture"]["width"], 5);
    assert_eq!(stats["picture"]["height"], 3);
    assert_eq!(stats["rays"]["primary"], 15);
    let stages: Vec<&str> = stats["stages"]
        .as_array()
        .unwrap()
        .iter()
        .map(|stage| stage["name"].as_str().unwrap())
        .collect();
    assert!(stages.ends_with(&["render", "write"]), "{stages:?}");
    for key in ["rays_per_second", "memory", "plan", "scene"] {
        assert!(!stats[key].is_null(), "{key}");
    }
}

/// Under an emulator of a processor without the instructions that this was
/// compiled to: a message, never an illegal instruction.
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
#[test]
fn another_processor() {
    // Nothing to lack: compiled for every x86-64 processor.
    let baseline = !cfg!(target_feature = "avx");
    let avx512 = cfg!(target_feature = "avx512f");
    for (cpu, lacks, refused) in [
        ("qemu64", "avx", !baseline),
        ("Nehalem", "avx", !baseline),
        ("Haswell", "avx512f", avx512),
    ] {
        if !refused {
            println!("skipped: compiled without {lacks}");
            continue;
        }
        let Ok(output) = Command::new("qemu-x86_64")
            .args(["-cpu", cpu, env!("CARGO_BIN_EXE_lanecast"), "--version"])
            .output()
        else {
            println!("skipped: no qemu-x86_64");
            return;
        };
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{cpu}: {said}");
        let line = said.lines().find(|l| l.starts_with("error: ")).unwrap();
        assert!(line.contains("built for another processor"), "{line}");
        assert!(line.contains(&format!(" {lacks}")), "{line}");
        assert!(line.contains("cargo build --release"), "{line}");
    }
}

/// Direct light says what it makes of a light with an area; plan says how light is found.
#[test]
fn lights_with_an_area_are_planned_and_warned_of() {
    let folder = folder();
    let ball = "format = 1\n[shape.ball]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
                [[instance]]\nshape = \"ball\"\n";
    let disc = "[[light]]\ndisc = { center = [0, 3, 0], normal = [0, -1, 0], radius = 1, radiance = [9, 9, 9] }\n";
    let glass = "[material.glass]\ntransmission = 1.0\nclearcoat = 0.5\n";
    fs::write(folder.path().join("s.toml"), format!("{ball}{disc}{glass}")).unwrap();
    fs::write(folder.path().join("dark.toml"), ball).unwrap();
    let render = |more: &[&str]| {
        let arguments = ["render", "s.toml", "--size", "8x8", "--spp", "1"];
        let output = lanecast(folder.path(), &[&arguments, more].concat());
        assert!(output.status.success());
        stderr(&output).to_string()
    };
    let said = render(&["--integrator", "direct"]);
    assert!(
        said.contains("warning: direct light takes 1 × rectangle or disc"),
        "{said}"
    );
    assert!(
        said.contains("warning: direct light does not show clearcoat; --integrator path does"),
        "{said}"
    );
    assert_eq!(said.lines().count(), 2, "{said}");
    assert_eq!(render(&[]), "");
    let plan = |name: &str| {
        let output = lanecast(folder.path(), &["plan", name, "--json", "-"]);
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        json["light"].clone()
    };
    let light = plan("s.toml");
    assert_eq!(light["integrator"], "path");
    assert_eq!(light["emitters"]["disc of light"], 1);
    assert_eq!(light["chosen_by"], "list");
    assert_eq!(light["media"], 1);
    let layers = light["layers"].to_string();
    assert!(
        layers.contains("clearcoat") && layers.contains("transmission"),
        "{layers}"
    );
    assert!(
        !light["left_out"].to_string().contains("no media"),
        "{light}"
    );
    let light = plan("dark.toml");
    assert!(light["why"].as_str().unwrap().contains("studio"), "{light}");
    assert_eq!(light["emitters"], serde_json::json!({}));
    assert!(
        light["left_out"].to_string().contains("no media stack"),
        "{light}"
    );
    let text = lanecast(folder.path(), &["plan", "s.toml"]);
    let text = stdout(&text);
    assert!(
        text.contains("1 × disc of light; one chosen by the weights of all"),
        "{text}"
    );
}
