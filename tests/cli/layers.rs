//! Pictures with layers, mattes and metadata, and in all formats.

use crate::run::{folder, lanecast, names, stderr};
use exr::prelude::{AttributeValue, ReadChannels, ReadLayers, read};
use lanecast::internals::io::{Channel, read_channels};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

const SCENE: &str = r#"format = 1
[camera]
eye = [0, 1, 5]
look_at = [0, 0.5, 0]
fov_y = 40
[[light]]
environment = { color = [0.2, 0.2, 0.3] }
name = "sky"
[[light]]
rectangle = { center = [0, 4, 0], edge_u = [2, 0, 0], edge_v = [0, 0, 2], radiance = [5, 5, 5] }
name = "key"
[material.red]
base_color = [0.8, 0.1, 0.1]
[shape.ball]
sphere = { center = [0, 0.5, 0], radius = 0.5 }
[shape.floor]
half_space = { normal = [0, 1, 0], offset = 0 }
[[instance]]
shape = "ball"
material = "red"
[[instance]]
shape = "floor"
"#;

fn scene() -> tempfile::TempDir {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENE).unwrap();
    folder
}

fn render(folder: &Path, more: &[&str]) -> std::process::Output {
    let first = ["render", "s.toml", "--size", "24x18", "--spp", "4"];
    lanecast(folder, &[&first, more].concat())
}

/// The names of a file's channels, and the attributes of its header.
fn header(path: &Path) -> (BTreeSet<String>, Vec<(String, AttributeValue)>) {
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .unwrap();
    let channels = image.layer_data.channel_data.list.iter();
    let channels = channels.map(|channel| channel.name.to_string()).collect();
    let attributes = image.layer_data.attributes;
    let mut others: Vec<(String, AttributeValue)> = attributes
        .other
        .into_iter()
        .map(|(name, value)| (name.to_string(), value))
        .collect();
    others.extend(
        attributes
            .world_to_camera
            .map(|m| ("worldToCamera".into(), AttributeValue::Matrix4x4(m))),
    );
    (channels, others)
}

#[test]
fn all_layers_and_what_the_header_tells_of_them() {
    let folder = scene();
    let done = render(
        folder.path(),
        &["--aov", "all", "-o", "x.exr", "--seed", "7"],
    );
    assert!(done.status.success(), "{}", stderr(&done));
    let (channels, attributes) = header(&folder.path().join("x.exr"));
    for name in [
        "R",
        "Z",
        "distance",
        "position.X",
        "normal.Y",
        "geometric_normal.Z",
        "camera_normal.X",
        "uv.U",
        "albedo.B",
        "instance_id.lo",
        "primitive_id",
        "samples",
        "variance.G",
        "diffuse_direct.R",
        "diffuse_indirect.R",
        "specular_direct.R",
        "specular_indirect.R",
        "emission.R",
        "environment.R",
        "light_sky.R",
        "light_key.G",
        "light_ungrouped.B",
        "CryptoObject00.R",
        "CryptoMaterial02.A",
        "CryptoInstance01.G",
        "denoising_albedo.G",
        "denoising_normal.Z",
    ] {
        assert!(channels.contains(name), "{name}: {channels:?}");
    }
    let of = |name: &str| {
        let found = attributes.iter().find(|(other, _)| other == name);
        found.map(|(_, value)| value.clone())
    };
    assert_eq!(of("seed"), Some(AttributeValue::I32(7)));
    assert_eq!(of("samplesPerPixel"), Some(AttributeValue::I32(4)));
    for name in [
        "softwareVersion",
        "commit",
        "renderTimeSeconds",
        "rays",
        "noise",
        "MSE",
        "worldToCamera",
    ] {
        assert!(of(name).is_some(), "{name}");
    }
    let manifests: Vec<String> = attributes
        .iter()
        .filter_map(|(name, value)| match value {
            AttributeValue::Text(text) if name.ends_with("/manifest") => Some(text.to_string()),
            _ => None,
        })
        .collect();
    for name in ["ball", "floor", "red", "default", "ball.0", "floor.1"] {
        let key = format!("\"{name}\":\"");
        assert!(
            manifests.iter().any(|all| all.contains(&key)),
            "{manifests:?}"
        );
    }
}

#[test]
fn equal_pictures_are_equal_files_unless_times_are_told() {
    let folder = scene();
    let bytes = |more: &[&str], name: &str| {
        let done = render(folder.path(), &[more, &["-o", name]].concat());
        assert!(done.status.success(), "{}", stderr(&done));
        fs::read(folder.path().join(name)).unwrap()
    };
    let fixed = ["--aov", "all", "--metadata", "fixed"];
    let one = bytes(&[&fixed[..], &["--threads", "1"]].concat(), "a.exr");
    let two = bytes(&[&fixed[..], &["--threads", "3"]].concat(), "b.exr");
    assert!(one == two);
    let plain = bytes(&[], "c.exr");
    assert!(plain == bytes(&["--metadata", "none"], "d.exr"));
    assert!(plain.len() < bytes(&["--metadata", "all"], "e.exr").len());
}

#[test]
fn other_formats() {
    let folder = scene();
    let path = folder.path();
    for name in ["x.png", "x.exr", "x.jpg", "x.hdr"] {
        let done = render(path, &["-o", name]);
        assert!(done.status.success(), "{}", stderr(&done));
    }
    let compared = |a: &str, b: &str, flip: &str| {
        let done = lanecast(path, &["compare", a, b, "--max-flip", flip]);
        assert_eq!(done.status.code(), Some(0), "{}", stderr(&done));
    };
    // What JPEG's blocks and HDR's shared exponents lose.
    compared("x.jpg", "x.png", "0.05");
    compared("x.hdr", "x.exr", "0.03");
    let done = render(path, &["-o", "y.jpg", "--aov", "depth"]);
    assert!(done.status.success(), "{}", stderr(&done));
    assert!(names(path).contains(&"y.aov.exr".to_string()));
}

#[test]
fn outputs_that_a_picture_cannot_have_are_refused() {
    let folder = scene();
    let before = names(folder.path());
    for (arguments, says) in [
        (
            &["--integrator", "direct", "--aov", "emission,crypto_object"][..],
            "only paths have emission, crypto_object",
        ),
        (&["--spp", "1", "--aov", "variance"], "no variance"),
        (&["--cryptomatte-levels", "0"], "1..=32"),
        (
            &["--metadata", "all", "-o", "x.png"],
            "--metadata is for OpenEXR",
        ),
        (&["--metadata", "some"], "--metadata"),
        (&["-o", "x.jpg", "--bits", "16"], "8 bits"),
        (&["-o", "x.hdr", "--view-transform", "agx"], "linear"),
        (&["-o", "x.jpg", "--background", "transparent"], "no alpha"),
        (
            &["--samples", "0..4", "--aov", "all", "-o", "x.sums"],
            "--aov",
        ),
        (
            &["--samples", "0..4", "--metadata", "all", "-o", "x.sums"],
            "--metadata",
        ),
    ] {
        let first = ["render", "s.toml", "--size", "8x6"];
        let output = lanecast(folder.path(), &[&first, arguments].concat());
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(says), "{arguments:?}: {said}");
        assert_eq!(names(folder.path()), before);
    }
    // All that a picture without paths can have.
    let direct = ["--integrator", "direct", "--aov", "all", "-o", "x.exr"];
    let done = render(folder.path(), &direct);
    assert!(done.status.success(), "{}", stderr(&done));
    let (channels, _) = header(&folder.path().join("x.exr"));
    assert!(channels.contains("distance") && !channels.contains("emission.R"));
}

/// Readers that are strict refuse files whose texts are Latin-1.
#[test]
fn texts_of_headers_are_utf_8() {
    let folder = folder();
    let path = folder.path();
    let ball = crate::run::BALL.replace("ball", "K\u{fc}gel");
    let ball = ball.replace("[shape.K\u{fc}gel]", "[shape.\"K\u{fc}gel\"]");
    fs::write(path.join("\u{e9}.toml"), ball).unwrap();
    let more = ["--integrator", "path", "--spp", "1", "--size", "8x8"];
    let aov = ["--aov", "crypto_object", "-o", "x.exr"];
    let done = lanecast(
        path,
        &[&["render", "\u{e9}.toml"], &more[..], &aov].concat(),
    );
    assert!(done.status.success(), "{}", stderr(&done));
    let bytes = fs::read(path.join("x.exr")).unwrap();
    for text in ["\u{e9}.toml", "{\"K\u{fc}gel\":"] {
        let has = bytes.windows(text.len()).any(|w| w == text.as_bytes());
        assert!(has, "{text}");
    }
}

#[test]
fn names_of_groups_are_checked() {
    let folder = folder();
    let long = "a".repeat(241);
    for (name, says) in [
        (&long[..], "at most 240 letters"),
        ("a.b", "letters, digits"),
        ("", "letters, digits"),
        ("ungrouped", "name it otherwise"),
    ] {
        let text = SCENE.replace("name = \"key\"", &format!("name = \"{name}\""));
        fs::write(folder.path().join("s.toml"), text).unwrap();
        let done = render(folder.path(), &["-o", "x.exr"]);
        assert_eq!(done.status.code(), Some(3));
        let said = stderr(&done);
        assert!(
            said.contains("s.toml:11:8") && said.contains(says),
            "{said}"
        );
    }
}

/// Each frame tells where its own camera stood.
#[test]
fn frames_of_a_moving_camera_have_matrices_of_their_own() {
    let folder = folder();
    let scene = "format = 1\n[camera]\neye = [0, 0, 6]\nlook_at = [0, 0, 0]\nfov_y = 35\n\
                 motion = [{ at = 1.0, eye = [5, 0, 6] }]\n\
                 [shape.ball]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
                 [[instance]]\nshape = \"ball\"\n";
    fs::write(folder.path().join("s.toml"), scene).unwrap();
    let more = ["--frames", "2", "--metadata", "fixed", "-o", "x.exr"];
    let done = render(folder.path(), &more);
    assert!(done.status.success(), "{}", stderr(&done));
    let matrix = |path: std::path::PathBuf| {
        let (_, attributes) = header(&path);
        let found = attributes
            .into_iter()
            .find(|(name, _)| name == "worldToCamera");
        found.unwrap().1
    };
    let files = fs::read_dir(folder.path())
        .unwrap()
        .map(|e| e.unwrap().path());
    let mut frames: Vec<_> = files
        .filter(|p| p.extension().is_some_and(|e| e == "exr"))
        .collect();
    frames.sort();
    assert_eq!(frames.len(), 2);
    assert_ne!(matrix(frames[0].clone()), matrix(frames[1].clone()));
}

/// The numbers of a file's channels, by name.
fn numbers(path: &Path) -> BTreeMap<String, Vec<f32>> {
    let picture = lanecast::internals::io::read_channels(path).unwrap();
    let channels = picture.channels.into_iter();
    let numbers = channels.filter_map(|(name, channel)| match channel {
        Channel::Numbers(numbers) => Some((name, numbers)),
        Channel::Ids(_) => None,
    });
    numbers.collect()
}

/// A mirror that stands aslant shows a green wall beside the camera, and so does a pane of glass
/// before a wall; a rough mirror shows itself.
#[test]
fn guides_follow_mirrors_and_glass() {
    let folder = folder();
    let of = |material: &str| {
        let text = format!(
            r#"format = 1
[camera]
eye = [0, 0, 4]
look_at = [0, 0, 0]
fov_y = 10
[[light]]
environment = {{ color = [1, 1, 1] }}
[material.own]
{material}
[material.green]
base_color = [0.1, 0.7, 0.2]
[shape.mirror]
polygon = {{ points = [[-1, -1, 1], [-1, 1, 1], [1, 1, -1], [1, -1, -1]] }}
[shape.wall]
polygon = {{ points = [[5, -9, 9], [5, 9, 9], [5, 9, -9], [5, -9, -9]] }}
[shape.back]
polygon = {{ points = [[-9, -9, -5], [-9, 9, -5], [9, 9, -5], [9, -9, -5]] }}
[[instance]]
shape = "mirror"
material = "own"
[[instance]]
shape = "wall"
material = "green"
[[instance]]
shape = "back"
material = "green"
"#
        );
        fs::write(folder.path().join("s.toml"), text).unwrap();
        let aovs = "denoising_albedo,denoising_normal";
        let done = render(folder.path(), &["--aov", aovs, "-o", "x.exr"]);
        assert!(done.status.success(), "{}", stderr(&done));
        let all = numbers(&folder.path().join("x.exr"));
        let middle = 9 * 24 + 12;
        [
            "denoising_albedo.R",
            "denoising_albedo.G",
            "denoising_albedo.B",
            "denoising_normal.X",
            "denoising_normal.Y",
            "denoising_normal.Z",
        ]
        .map(|name| all[name][middle])
    };
    let near = |found: [f32; 6], expected: [f32; 6]| {
        let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f32::max) < 1e-6, "{found:?} {expected:?}");
    };
    let metal = "base_color = [0.9, 0.5, 0.1]\nmetallic = 1.0\nroughness =";
    near(of(&format!("{metal} 0.0")), [0.1, 0.7, 0.2, -1.0, 0.0, 0.0]);
    let half = 0.5_f32.sqrt();
    near(
        of(&format!("{metal} 0.5")),
        [0.9, 0.5, 0.1, half, 0.0, half],
    );
    let pane = "transmission = 1.0\nior = 1.0\nthin = true\nroughness = 0.0";
    near(of(pane), [0.1, 0.7, 0.2, 0.0, 0.0, 1.0]);
}

/// What `--denoise` writes is in `.ci/denoise`, which has the library.
#[test]
fn denoising_tells_what_it_lacks() {
    let folder = scene();
    let before = names(folder.path());
    let done = render(folder.path(), &["--denoise", "-o", "x.exr"]);
    let said = stderr(&done);
    if cfg!(feature = "denoise") {
        assert!(done.status.success() || said.contains("OIDN_DIR"), "{said}");
        return;
    }
    assert_eq!(done.status.code(), Some(2), "{said}");
    assert!(said.contains("--features denoise"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert_eq!(names(folder.path()), before);
}

/// Where nothing is, ids are those of nothing.
#[test]
fn what_meets_nothing_has_the_largest_id() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("s.toml"), crate::run::BALL).unwrap();
    let aov = [
        "--size",
        "9x9",
        "--aov",
        "instance_id,primitive_id",
        "-o",
        "x.exr",
    ];
    let done = lanecast(path, &[&["render", "s.toml"], &aov[..]].concat());
    assert!(done.status.success(), "{}", stderr(&done));
    let channels = read_channels(&path.join("x.exr")).unwrap().channels;
    for name in ["instance_id.lo", "instance_id.hi", "primitive_id"] {
        let Channel::Ids(ids) = &channels[name] else {
            panic!("{name} is of numbers");
        };
        assert_eq!((ids[0], ids[40]), (u32::MAX, 0), "{name}");
    }
}

/// What direct light leaves out of a scene is told, and what an exporter does of a moving one.
#[test]
fn what_is_left_out_is_told() {
    let folder = folder();
    let path = folder.path();
    let scene = "format = 1\n[shape.ball]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
                 [material.lamp]\nemission = [1, 1, 1]\n[[light]]\nenvironment = { color = [0, 1, 0] }\n\
                 [[instance]]\nshape = \"ball\"\nmaterial = \"lamp\"\n\
                 motion = [{ at = 1, transform = [{ translate = [1, 0, 0] }] }]\n";
    fs::write(path.join("s.toml"), scene).unwrap();
    let small = [
        "render",
        "s.toml",
        "--size",
        "8x8",
        "--spp",
        "1",
        "--integrator",
    ];
    let direct = lanecast(path, &[&small[..], &["direct"]].concat());
    let told = "direct light does not show the environment, the light of things that shine";
    assert!(stderr(&direct).contains(told), "{}", stderr(&direct));
    let whole = lanecast(path, &[&small[..], &["path"]].concat());
    assert_eq!(stderr(&whole), "");
    for export in [["--pov", "s.pov"], ["--mitsuba", "s.xml"]] {
        let output = lanecast(path, &[&["export", "s.toml"][..], &export].concat());
        let told = stderr(&output);
        assert!(
            told.contains("what moves is exported as it is at the beginning"),
            "{told}"
        );
    }
    let none = lanecast(path, &["export", "s.toml"]);
    assert_eq!(none.status.code(), Some(2));
    for option in ["--pov", "--mitsuba", "--msh", "--openjd"] {
        assert!(stderr(&none).contains(option), "{}", stderr(&none));
    }
}
