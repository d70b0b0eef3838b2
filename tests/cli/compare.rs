//! `lanecast compare`: figures, bounds, files, and what it refuses.

use crate::run::{folder, lanecast, names, stderr, stdout};
use std::fs;

const SCENE: &str = "format = 1\n[shape.ball]\nsphere = { center = [0, 0, 0], radius = 1 }\n\
                     [[instance]]\nshape = \"ball\"\n";

/// A folder with a.exr and b.exr, which differ in noise, and c.exr without ids.
fn pictures() -> tempfile::TempDir {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), SCENE).unwrap();
    for (name, seed, aov) in [
        ("a.exr", "0", "depth,instance_id"),
        ("b.exr", "1", "depth,instance_id"),
        ("c.exr", "1", "depth"),
        ("a.png", "0", "depth"),
    ] {
        let done = lanecast(
            folder.path(),
            &[
                "render", "s.toml", "--size", "24x18", "--spp", "4", "--seed", seed, "--aov", aov,
                "-o", name,
            ],
        );
        assert!(done.status.success(), "{}", stderr(&done));
    }
    folder
}

#[test]
fn figures_bounds_and_files() {
    let folder = pictures();
    let run = |arguments: &[&str]| lanecast(folder.path(), &[&["compare"], arguments].concat());
    let same = run(&[
        "a.exr",
        "a.exr",
        "--max-wrong",
        "0",
        "--max-rmse",
        "0",
        "--max-flip",
        "0",
    ]);
    assert_eq!(same.status.code(), Some(0), "{}", stderr(&same));
    assert!(
        stdout(&same).contains("0 of 432 pixels wrong"),
        "{}",
        stdout(&same)
    );
    let other = run(&["a.exr", "b.exr", "--json", "-", "--html", "x.html"]);
    assert_eq!(other.status.code(), Some(0));
    let told: serde_json::Value = serde_json::from_str(stdout(&other)).unwrap();
    let wrong = told["wrong"].as_u64().unwrap();
    assert!(wrong > 0 && told["flip"].as_f64().unwrap() > 0.0);
    assert!(told["error"]["rmse"].as_f64().unwrap() > 0.0);
    let ids = told["channels"].as_array().unwrap();
    let ids = ids
        .iter()
        .find(|row| row["name"] == "instance_id.lo")
        .unwrap();
    assert_eq!(ids["differ"], 0);
    let html = fs::read_to_string(folder.path().join("x.html")).unwrap();
    assert_eq!(html.matches("data:image/png;base64,").count(), 4);
    assert!(!html.contains("http"), "the page needs no other file");
    for (bound, value) in [
        ("--max-wrong", (wrong - 1).to_string()),
        ("--max-rmse", "1e-9".into()),
        ("--max-flip", "1e-9".into()),
    ] {
        let beyond = run(&["a.exr", "b.exr", bound, &value]);
        assert_eq!(beyond.status.code(), Some(1), "{bound}");
        assert!(
            stderr(&beyond).contains("a.exr differs from b.exr"),
            "{bound}"
        );
    }
    let within = run(&["a.exr", "b.exr", "--max-wrong", &wrong.to_string()]);
    assert_eq!(within.status.code(), Some(0));
    let tolerant = run(&["a.exr", "b.exr", "--tolerance", "1e9", "--max-wrong", "0"]);
    assert_eq!(tolerant.status.code(), Some(0), "{}", stderr(&tolerant));
}

#[test]
fn what_cannot_be_compared_is_refused_with_the_remedy() {
    let folder = pictures();
    let before = names(folder.path());
    fs::write(folder.path().join("cut.exr"), b"v/1\x01").unwrap();
    for (arguments, code, says) in [
        (&["a.exr", "c.exr"][..], 3, "--channels"),
        (&["a.exr", "a.png"], 3, "sRGB"),
        (&["a.exr", "no.exr"], 3, "no.exr: cannot be read"),
        (
            &["s.toml", "a.exr"],
            3,
            "known are .exr, .hdr, .png and .jpg",
        ),
        (&["cut.exr", "a.exr"], 3, "cut.exr: OpenEXR"),
        (&["a.exr", "a.exr", "--max-wrong", "-1"], 2, "--max-wrong"),
        (&["a.exr", "a.exr", "--tolerance", "nan"], 2, "from 0 on"),
        (&["a.exr", "a.exr", "--html", "a.exr"], 2, "a.exr"),
        (
            &["a.exr", "a.exr", "--channels", "Z", "--max-flip", "1"],
            2,
            "R, G and B are not compared",
        ),
        (&["a.exr"], 2, "<B>"),
    ] {
        let output = lanecast(folder.path(), &[&["compare"], arguments].concat());
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
        assert!(said.contains(says), "{arguments:?}: {said}");
        assert!(!said.contains("panicked"), "{said}");
    }
    fs::remove_file(folder.path().join("cut.exr")).unwrap();
    assert_eq!(names(folder.path()), before);
    let some = lanecast(
        folder.path(),
        &[
            "compare",
            "b.exr",
            "c.exr",
            "--channels",
            "R,G,B,Z",
            "--max-wrong",
            "0",
        ],
    );
    assert_eq!(some.status.code(), Some(0), "{}", stderr(&some));
}

/// Where one picture has a number and the other infinity, no mean can be within a bound.
#[test]
fn what_is_infinite_in_one_picture_alone_exceeds_every_bound() {
    let folder = pictures();
    let smaller = SCENE.replace("radius = 1", "radius = 0.5");
    let camera = "[camera]\neye = [0, 0, 9]\nlook_at = [0, 0, 0]\nfov_y = 30\n";
    for (name, scene) in [("large", SCENE), ("small", &smaller)] {
        let scene = scene.replacen('\n', &format!("\n{camera}"), 1);
        fs::write(folder.path().join(format!("{name}.toml")), scene).unwrap();
        let (from, to) = (format!("{name}.toml"), format!("{name}.exr"));
        let size = ["--size", "24x18", "--spp", "1", "--aov", "depth"];
        let arguments = [&["render", &from, "-o", &to], &size[..]].concat();
        let done = lanecast(folder.path(), &arguments);
        assert!(done.status.success(), "{}", stderr(&done));
    }
    let bound = ["--channels", "Z", "--max-rmse", "1e9"];
    let compared = |a: &str, b: &str| {
        let arguments = [&["compare", a, b], &bound[..]].concat();
        lanecast(folder.path(), &arguments)
    };
    assert_eq!(compared("large.exr", "large.exr").status.code(), Some(0));
    let other = compared("large.exr", "small.exr");
    assert_eq!(other.status.code(), Some(1));
    let said = stderr(&other);
    assert!(
        said.contains("infinite or no number in one picture"),
        "{said}"
    );
}

#[test]
fn every_channel_that_is_named_must_be_there() {
    let folder = pictures();
    let arguments = ["compare", "a.exr", "a.exr", "--channels", "R,depht"];
    let output = lanecast(folder.path(), &arguments);
    assert_ne!(output.status.code(), Some(0));
    let said = stderr(&output);
    assert!(
        said.contains("no channel or layer depht; known are"),
        "{said}"
    );
}

/// A fraction is the same number in 8 bits and in 16.
#[test]
fn codes_of_8_and_of_16_bits_are_compared() {
    let folder = folder();
    let codes = || (0..=255_u8).collect::<Vec<u8>>();
    let narrow = image::GrayImage::from_raw(16, 16, codes()).unwrap();
    let wide: Vec<u16> = codes().iter().map(|code| u16::from(*code) * 257).collect();
    let wide: image::ImageBuffer<image::Luma<u16>, _> =
        image::ImageBuffer::from_raw(16, 16, wide).unwrap();
    narrow.save(folder.path().join("a.png")).unwrap();
    wide.save(folder.path().join("b.png")).unwrap();
    let same = ["compare", "a.png", "b.png", "--max-wrong", "0"];
    let same = lanecast(folder.path(), &same);
    assert!(same.status.success(), "{}{}", stdout(&same), stderr(&same));
}

/// What a decoder would fill with grey is told.
#[test]
fn a_jpeg_that_ends_early_is_refused() {
    let folder = folder();
    let path = folder.path();
    image::RgbImage::from_fn(40, 30, |x, y| image::Rgb([x as u8 * 6, y as u8 * 8, 99]))
        .save(path.join("a.jpg"))
        .unwrap();
    let bytes = fs::read(path.join("a.jpg")).unwrap();
    fs::write(path.join("b.jpg"), &bytes[..bytes.len() * 2 / 3]).unwrap();
    let output = lanecast(path, &["compare", "a.jpg", "b.jpg"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("in the middle of the picture"),
        "{}",
        stderr(&output)
    );
}
