//! What drawings are made of: standard views, fitting, sections, and feature lines.

use crate::run::{fails, folder, lanecast, stderr};
use image::RgbImage;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A red block and a blue ball that reaches out of its top, in one solid, with a hole down from
/// the top; nothing has its light.
const PART: &str = "format = 1
[material.red]
base_color = [1, 0, 0]
unlit = true
[material.blue]
base_color = [0, 0, 1]
unlit = true
[material.green]
base_color = [0, 1, 0]
unlit = true
[shape]
block.box = { min = [-2, -1, -1], max = [2, 1, 1] }
ball.sphere = { center = [0, 1, 0], radius = 0.75 }
hole.cylinder = { base = [1.5, 0, 0], top = [1.5, 1, 0], radius = 0.25 }
both.union = [{ shape = 'block', material = 'red' }, { shape = 'ball', material = 'blue' }]
part.difference = ['both', { shape = 'hole', material = 'green' }]
[[instance]]
shape = 'part'
";

const CAMERA: &str = "[camera]
eye = [0, 0, 90]
look_at = [0, 0, 80]
orthographic = 2.16
";

fn render(folder: &Path, scene: &str, more: &[&str]) -> RgbImage {
    fs::write(folder.join("a.toml"), scene).unwrap();
    let arguments = [&["render", "a.toml", "-o", "a.png"], more].concat();
    let output = lanecast(folder, &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    image::open(folder.join("a.png")).unwrap().into_rgb8()
}

/// Names a pixel's colour, which tone curves make a little paler.
fn color_of(picture: &RgbImage, x: u32, y: u32) -> &'static str {
    let bright = picture.get_pixel(x, y).0.map(|c| c >= 200);
    match bright {
        [true, false, false] => "red",
        [false, true, false] => "green",
        [false, false, true] => "blue",
        _ => "other",
    }
}

fn measured(folder: &Path, scene: &str, more: &[&str]) -> Value {
    fs::write(folder.join("a.toml"), scene).unwrap();
    let arguments = [&["measure", "a.toml", "--json", "-"], more].concat();
    let output = lanecast(folder, &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn the_front_view_is_that_of_a_camera_in_front() {
    let folder = folder();
    let block = PART.replace("shape = 'part'", "shape = 'block'");
    let size = ["--size", "84x42", "--integrator", "normals"];
    let by_hand = render(folder.path(), &(block.clone() + CAMERA), &size);
    let front = [&size[..], &["--view", "front"]].concat();
    // The block is twice as wide as high, and the margin around it is 8 %.
    assert!(render(folder.path(), &block, &front) == by_hand);
    // Whatever camera the scene has.
    let askew = CAMERA.replace("[0, 0, 80]", "[3, 3, 80]");
    assert!(render(folder.path(), &(block.clone() + &askew), &front) == by_hand);
    let fit = [&size[..], &["--fit"]].concat();
    let near = CAMERA.replace("2.16", "0.02");
    assert!(render(folder.path(), &(block + &near), &fit) == by_hand);
}

#[test]
fn a_cut_shows_its_operands_and_keeps_the_rest() {
    let folder = folder();
    let section = ["--clip", "0,0,1,0"];
    let front = [
        "--view",
        "front",
        "--size",
        "200x150",
        "--integrator",
        "direct",
    ];
    let shown = render(folder.path(), PART, &[&front[..], &section].concat());
    // The picture is as wide as the block, with 8 % around it, and from -1 to 1.75 high.
    let at = |x: f64, y: f64| {
        let scale = 2.0 * 2.0 * 1.08 / 200.0;
        let place = |c: f64, half: f64| (half + c / scale) as u32;
        color_of(&shown, place(x, 100.0), place(0.375 - y, 75.0))
    };
    assert_eq!(at(-1.5, 0.0), "red");
    assert_eq!(at(0.0, 1.3), "blue");
    // Within the hole its far wall is seen, and beside it the cut.
    assert_eq!(at(1.5, 0.5), "green");
    assert_eq!(at(1.5, -0.5), "red");
    // Without the cut the block is in front of the hole.
    let whole = render(folder.path(), PART, &front);
    assert_eq!(color_of(&whole, 100 + 69, 69), "red");

    let volume = |more: &[&str]| {
        let found = measured(folder.path(), PART, more);
        found["solids"][0]["volume"].as_f64().unwrap()
    };
    // The plane goes through the middle of everything.
    assert!((volume(&section) / volume(&[]) - 0.5).abs() < 2e-3);
    let corner = ["--clip", "0,0,1,0", "--clip=-2,0,0,0", "--clip", "0,1,0,0"];
    let hole = std::f64::consts::PI * 0.25 * 0.25;
    let ball = 2.0 / 3.0 * std::f64::consts::PI * 0.75_f64.powi(3);
    assert!((volume(&corner) / 2.0 - 1.0).abs() < 2e-3);
    assert!((volume(&[]) / (16.0 + ball - hole) - 1.0).abs() < 2e-3);
}

#[test]
fn a_hatched_cut_has_lines_in_its_operands_colours() {
    let folder = folder();
    let front = [
        "--view",
        "front",
        "--size",
        "400x300",
        "--integrator",
        "direct",
    ];
    let hatched = ["--clip", "0,0,1,0", "--hatch", "0.5"];
    let shown = render(folder.path(), PART, &[&front[..], &hatched].concat());
    let plain = render(folder.path(), PART, &[&front[..], &hatched[..2]].concat());
    // The picture is as wide as the block, with 8 % around it, and from -1 to 1.75 high.
    let at = |x: f64, y: f64| {
        let scale = 4.0 * 1.08 / 400.0;
        (
            (200.0 + x / scale) as u32,
            (150.0 - (y - 0.375) / scale) as u32,
        )
    };
    // How much darker places are than without lines: in the middle of lines that go through the
    // origin, and between them.
    let darker = |(x, y): (u32, u32), channel: usize| {
        let [with, without] = [&shown, &plain].map(|p| f64::from(p.get_pixel(x, y).0[channel]));
        with / without
    };
    // From line to line along x is the spacing over cos 45°. Dark lines begin at whole numbers of
    // spacings and are a 16th wide, without their edges.
    let period = 0.5 * 2.0_f64.sqrt();
    let middle = period / 32.0;
    for line in [-2.0, -1.0, 1.0] {
        let x = line * period + middle;
        for y in [-0.9, -0.5, -0.3] {
            let on = darker(at(x - y, y), 0);
            let between = darker(at(x - y + 0.5 * period, y), 0);
            assert!(on < 0.75 && between > 0.99, "{line} {y}: {on} {between}");
        }
    }
    // The other part has lines the other way, and what is behind the cut has none.
    let x = middle;
    let rows = [1.2, 1.3, 1.4].map(|y| (darker(at(x + y - 2.0 * period, y), 2), y));
    assert!(rows.iter().all(|(on, _)| *on < 0.75), "{rows:?}");
    assert!(darker(at(1.5, 0.5), 1) == 1.0);
}

#[test]
fn lines_are_where_things_end_and_turn() {
    let folder = folder();
    let size = ["--size", "200x150", "--integrator", "edges"];
    let iso = render(
        folder.path(),
        PART,
        &[&size[..], &["--view", "iso"]].concat(),
    );
    let dark = iso.pixels().filter(|p| p.0[0] < 128).count();
    assert!((300..3000).contains(&dark), "{dark}");
    // Two blocks that stand side by side in one solid have no line between them.
    let row = "format = 1
[shape]
left.box = { min = [-1, 0, 0], max = [0, 1, 1] }
right.box = { min = [0, 0, 0], max = [1, 1, 1] }
row.union = ['left', 'right']
[[instance]]
shape = 'row'
";
    let front = [&size[..], &["--view", "front"]].concat();
    let shown = render(folder.path(), row, &front);
    assert_eq!(shown.get_pixel(100, 75).0, [255; 3]);
    assert_eq!(shown.get_pixel(50, 75).0, [255; 3]);
    // Half a line's width lies on either side of the outline, 1.5 pixels in all.
    let ink: f64 = (0..30)
        .map(|x| f64::from(255 - shown.get_pixel(x, 75).0[0]) / 255.0)
        .sum();
    assert!(ink > 0.8 && ink < 1.6, "{ink}");
    // Of two instances there is one.
    let apart = row.replace(
        "shape = 'row'",
        "shape = 'left'\n[[instance]]\nshape = 'right'",
    );
    let shown = render(folder.path(), &apart, &front);
    assert!(shown.get_pixel(100, 75).0[0] < 200);
}

#[test]
fn wrong_views_and_cuts_are_refused() {
    for (arguments, code, says) in [
        (&["--view", "diagonal"][..], 2, "front, back, left"),
        (
            &["--view", "top", "--camera", "0"],
            2,
            "cannot be used with",
        ),
        (&["--clip", "1,2,3"], 2, "four numbers"),
        (&["--clip", "0,0,0,1"], 2, "not all 0"),
        (&["--clip", "1,nan,0,1"], 2, "finite"),
        (&["--hatch", "auto"], 2, "--clip"),
        (
            &["--clip", "0,0,1,0", "--hatch", "0"],
            2,
            "above 0, or auto",
        ),
        (&["--clip", "0,0,1,0", "--hatch", "wide"], 2, "or auto"),
    ] {
        fails(&[&["render"], arguments].concat(), code, says);
    }
    let folder = folder();
    let panorama = PART.to_owned()
        + "[camera]\neye = [0, 0, 9]\nlook_at = [0, 0, 0]\npanorama = 'equirectangular'\n";
    fs::write(folder.path().join("a.toml"), panorama).unwrap();
    let output = lanecast(folder.path(), &["render", "a.toml", "--fit"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("panorama"), "{}", stderr(&output));
    let moving = PART.to_owned() + "motion = [{ at = 1, transform = [{ scale = 2 }] }]\n";
    for (scene, plane, says) in [
        (&moving[..], "0,0,1,0", "as they stand"),
        (PART, "0,0,1,-1e9", "leaves nothing"),
    ] {
        fs::write(folder.path().join("a.toml"), scene).unwrap();
        let output = lanecast(folder.path(), &["render", "a.toml", "--clip", plane]);
        assert_eq!(output.status.code(), Some(3));
        assert!(stderr(&output).contains(says), "{}", stderr(&output));
    }
}
