//! Motion vectors against reprojection by formulas.

use crate::run::{folder, lanecast, stderr};
use lanecast::internals::io::{Channel, read_channels};
use std::collections::BTreeMap;
use std::fs;

const WIDTH: usize = 48;
const HEIGHT: usize = 36;

type Numbers = BTreeMap<String, Vec<f32>>;

/// Renders a scene with motion vectors, and reads the channels of `x.exr`, or of a frame of a
/// sequence.
fn rendered(scene: &str, more: &[&str], name: &str) -> Numbers {
    let folder = folder();
    fs::write(folder.path().join("s.toml"), scene).unwrap();
    for (name, lift) in [("a", 0.0), ("b", 1.0)] {
        let mesh = format!("v -9 -9 0\nv 9 -9 0\nv 0 {} 0\nf 1 2 3\n", 9.0 + lift);
        fs::write(folder.path().join(format!("{name}.obj")), mesh).unwrap();
    }
    let size = format!("{WIDTH}x{HEIGHT}");
    let first = ["render", "s.toml", "--size", &size, "-o", "x.exr"];
    let done = lanecast(folder.path(), &[&first, more].concat());
    assert!(done.status.success(), "{}", stderr(&done));
    let picture = read_channels(&folder.path().join(name)).unwrap();
    let channels = picture.channels.into_iter();
    let numbers = channels.filter_map(|(name, channel)| match channel {
        Channel::Numbers(numbers) => Some((name, numbers)),
        Channel::Ids(_) => None,
    });
    numbers.collect()
}

fn vectors(scene: &str) -> Numbers {
    let all = "motion,vector,position";
    rendered(scene, &["--integrator", "direct", "--aov", all], "x.exr")
}

/// A scene of one instance before a camera at (0, 0, 5) whose picture is 4 units high at the
/// origin.
fn scene(camera: &str, shape: &str, instance: &str) -> String {
    format!(
        r#"format = 1
[camera]
eye = [0, 0, 5]
look_at = [0, 0, 0]
fov_y = {}
{camera}
[[light]]
point = {{ position = [0, 0, 5], intensity = [50, 50, 50] }}
[shape.it]
{shape}
[[instance]]
shape = "it"
{instance}
"#,
        2.0 * 0.4_f64.atan().to_degrees()
    )
}

/// Checks the way forward of each pixel against a formula, which is given the pixel's place from the
/// picture's middle, x to the right and y up, in units of the plane z = 0.
fn check(all: &Numbers, forward: impl Fn([f64; 2]) -> [f64; 2]) {
    let scale = HEIGHT as f64 / 4.0;
    for pixel in 0..WIDTH * HEIGHT {
        let (x, y) = (pixel % WIDTH, pixel / WIDTH);
        let at = [
            (x as f64 + 0.5 - WIDTH as f64 / 2.0) / scale,
            (HEIGHT as f64 / 2.0 - y as f64 - 0.5) / scale,
        ];
        let expected = forward(at).map(|c| c * scale);
        for (name, expected) in ["forward.u", "forward.v"].iter().zip(expected) {
            let found = f64::from(all[*name][pixel]);
            let off = (found - expected).abs();
            assert!(off < 2e-5, "{name} {x} {y}: {found} {expected}");
        }
        // At time 0 nothing has moved yet.
        let back = ["backward.u", "backward.v"].map(|name| all[name][pixel]);
        assert!(back.iter().all(|c| c.abs() < 2e-5), "{back:?}");
        // Blender has both ways reversed: before less now, now less after.
        let of_blender = ["Vector.X", "Vector.Y", "Vector.Z", "Vector.W"].map(|n| all[n][pixel]);
        let [u, v] = ["forward.u", "forward.v"].map(|name| all[name][pixel]);
        assert_eq!(of_blender, [back[0], back[1], -u, -v]);
    }
}

const WALL: &str = "half_space = { normal = [0, 0, 1], offset = 0 }";

#[test]
fn what_is_shifted_moves_by_that() {
    let motion = "motion = [{ at = 1.0, transform = [{ translate = [0.25, -0.5, 0] }] }]";
    check(&vectors(&scene("", WALL, motion)), |_| [0.25, -0.5]);
    // Towards the camera: seen from 4 away what lay at (x, y) is at 5/4 of that.
    let motion = "motion = [{ at = 1.0, transform = [{ translate = [0, 0, 1] }] }]";
    check(&vectors(&scene("", WALL, motion)), |at| {
        at.map(|c| 0.25 * c)
    });
}

#[test]
fn what_turns_moves_in_circles() {
    let motion =
        "interpolation = \"rigid\"\nmotion = [{ at = 1.0, transform = [{ rotate_z = 90.0 }] }]";
    check(&vectors(&scene("", WALL, motion)), |[x, y]| [-y - x, x - y]);
}

#[test]
fn a_moving_camera_moves_all_the_other_way() {
    let camera = "motion = [{ at = 1.0, eye = [0.5, 0, 5], look_at = [0.5, 0, 0] }]";
    check(&vectors(&scene(camera, WALL, "")), |_| [-0.5, 0.0]);
}

#[test]
fn what_is_infinitely_far_turns_with_the_camera() {
    // The eye stays, and the view turns by 0.3 to the right.
    let (sin, cos) = 0.3_f64.sin_cos();
    let camera = format!(
        "motion = [{{ at = 1.0, look_at = [{}, 0, {}] }}]",
        5.0 * sin,
        5.0 - 5.0 * cos
    );
    let shape = "sphere = { center = [0, 0, 50], radius = 1 }";
    check(&vectors(&scene(&camera, shape, "")), |[x, y]| {
        // The direction (x, y, −5) in the turned camera's axes.
        let (across, ahead) = (x * cos - 5.0 * sin, x * sin + 5.0 * cos);
        [5.0 * across / ahead - x, 5.0 * y / ahead - y]
    });
}

#[test]
fn vertices_that_deform_take_along_what_lies_between() {
    let shape = "mesh = \"a.obj\"\nopen = true\nmotion = [{ at = 1.0, mesh = \"b.obj\" }]";
    let all = vectors(&scene("", shape, ""));
    // The third corner goes from (0, 9) to (0, 10), and counts in proportion to the height.
    check(&all, |[_, y]| [0.0, (y + 9.0) / 18.0]);
}

#[test]
fn frames_look_a_frame_back_and_on() {
    let motion = "motion = [{ at = 1.0, transform = [{ translate = [1.0, 0, 0] }] }]";
    let more = ["--frames", "5", "--aov", "motion", "--integrator", "direct"];
    let scale = HEIGHT as f32 / 4.0;
    for (name, forward, backward) in [
        ("x_0000.exr", 0.25, 0.0),
        ("x_0002.exr", 0.25, -0.25),
        ("x_0004.exr", 0.0, -0.25),
    ] {
        let all = rendered(&scene("", WALL, motion), &more, name);
        for (channel, expected) in [("forward.u", forward), ("backward.u", backward)] {
            let off = all[channel].iter().map(|u| (u - expected * scale).abs());
            assert!(off.fold(0.0, f32::max) < 2e-5, "{name} {channel}");
        }
        assert!(!all.contains_key("distance"));
    }
}

#[test]
fn with_an_open_shutter_vectors_are_of_its_middle() {
    let motion = "motion = [{ at = 1.0, transform = [{ translate = [1.0, 0, 0] }] }]";
    let more = ["--shutter", "0..0.5", "--spp", "4", "--aov", "motion"];
    let all = rendered(&scene("", WALL, motion), &more, "x.exr");
    let scale = HEIGHT as f32 / 4.0;
    for (channel, expected) in [("forward.u", 0.75), ("backward.u", -0.25)] {
        let off = all[channel].iter().map(|u| (u - expected * scale).abs());
        assert!(off.fold(0.0, f32::max) < 2e-5, "{channel}");
    }
}
