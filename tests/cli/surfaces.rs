//! `probe` and `measure` on polynomial surfaces.

use super::measure::is_measured;
use super::solids::{probe, write};
use crate::run::{folder, lanecast, stderr, stdout};
use serde_json::Value;
use std::f64::consts::PI;
use std::path::Path;

/// (t_enter, t_exit) of all spans, by a solid's name.
fn spans(found: &Value, solid: &str) -> Vec<[Option<f64>; 2]> {
    let of = |span: &Value| ["t_enter", "t_exit"].map(|key| span[key].as_f64());
    let spans = found["spans"].as_array().unwrap().iter();
    let own = spans.filter(|span| span["solid"] == solid);
    own.map(of).collect()
}

const RING: &str = "format = 1
[shape]
ring.torus = { major = 1, minor = 0.5 }
flat = { implicit = 'x*y - z', open = true }
half = { torus = { major = 1, minor = 0.5 }, open = true, clip.box = { min = [-2, -1, 0], max = [2, 1, 2] } }
bowl.implicit = 'x^4 + z^4 - y - 3'
[[instance]]
shape = 'ring'
[[instance]]
shape = 'flat'
[[instance]]
shape = 'half'
[[instance]]
shape = 'bowl'
";

#[test]
fn probe_finds_every_span_of_a_torus() {
    let folder = folder();
    let ring = |org: &str, dir: &str| {
        let found = probe(folder.path(), RING, org, dir);
        // The two open ones, wherever the line is.
        assert_eq!(found["surfaces_left_out"], 2, "{org} {dir}");
        spans(&found, "ring")
    };
    let both = |a: f64, b: f64| [Some(a), Some(b)];
    // Across in the plane of the ring, and twice as fast along a chord of it.
    let across = ring("-5,0,0", "1,0,0");
    assert_eq!(across, [both(3.5, 4.5), both(5.5, 6.5)]);
    let side = 2.0_f64.sqrt();
    let chord = ring("0.5,0,0", "0,0,2");
    assert_eq!(chord, [both(-side / 2.0, side / 2.0)]);
    let chord = ring("0.25,0,0", "0,0,1");
    let [inner, outer] = [0.5_f64, 1.5].map(|r| (r * r - 0.0625).sqrt());
    assert_eq!(chord, [both(-outer, -inner), both(inner, outer)]);
    // Through the tube, from within it and along the axis.
    assert_eq!(ring("1,0,0", "0,1,0"), [both(-0.5, 0.5)]);
    assert!(ring("0,-3,0", "0,1,0").is_empty());
    // Touched at its outer rim, at its top, and from within the hole.
    assert!(ring("1.5,0,-5", "0,0,1").is_empty());
    assert!(ring("1.5,-5,0", "0,1,0").is_empty());
    assert!(ring("-5,0.5,0", "1,0,0").is_empty());
    assert!(ring("0.5,-5,0", "0,1,0").is_empty());
}

#[test]
fn probe_ends_at_surfaces_without_end() {
    let folder = folder();
    let found = probe(folder.path(), RING, "0,5,0", "0,-1,0");
    assert_eq!(spans(&found, "bowl"), [[None, Some(8.0)]]);
    let end = &found["spans"][0]["exit"];
    assert_eq!(
        (&end["point"][1], &end["normal"][1]),
        (&(-3.0).into(), &(-1.0).into())
    );
    let found = probe(folder.path(), RING, "-5,13,0", "1,0,0");
    assert_eq!(spans(&found, "bowl"), [[Some(3.0), Some(7.0)]]);
    let found = probe(folder.path(), RING, "0,-5,0", "1,0,0");
    assert!(spans(&found, "bowl").is_empty());
}

/// A ring, two that overlap by an operator, and balls as polynomials.
const PARTS: &str = "format = 1
[shape]
ring.torus = { major = 1, minor = 0.4 }
aside.union = [{ shape = 'ring', transform = [{ translate = [0.4, 0, 0] }] }]
less.difference = ['ring', 'aside']
both.intersection = ['ring', 'aside']
spindle.torus = { major = 0.5, minor = 1 }
ball.implicit = '(x - 1)^2 + y^2 + (z + 2)^2 - 9/4'
lens.intersection = ['unit', { shape = 'unit', transform = [{ translate = [1, 0, 0] }] }]
unit.implicit = 'x^2 + y^2 + z^2 - 1'
flat = { implicit = 'x*y - z', open = true }
bowl.implicit = 'x^2 + z^2 - y'
[[instance]]
shape = 'ring'
[[instance]]
shape = 'less'
[[instance]]
shape = 'both'
[[instance]]
shape = 'ball'
[[instance]]
shape = 'spindle'
[[instance]]
shape = 'lens'
[[instance]]
shape = 'flat'
[[instance]]
shape = 'bowl'
[[instance]]
shape = 'ring'
transform = [{ scale = [2, 1, 1] }, { rotate_x = 30 }, { translate = [0, 5, 0] }]
";

fn measured(folder: &Path, text: &str, error: &str) -> Value {
    write(folder, text);
    let arguments = ["measure", "a.toml", "--json", "-", "--error", error];
    let output = lanecast(folder, &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn volumes_and_areas_of_polynomial_solids() {
    let error = 4e-3;
    let found = measured(folder().path(), PARTS, "4e-3");
    assert_eq!(found["surfaces_left_out"], 1);
    assert_eq!(found["unbounded_left_out"], 1);
    let solids = found["solids"].as_array().unwrap().as_slice();
    let [ring, less, both, ball, spindle, lens, long] = solids else {
        panic!("{found}");
    };
    let (major, minor) = (1.0, 0.4);
    let volume = 2.0 * PI * PI * major * minor * minor;
    is_measured(ring, "volume", volume, error);
    is_measured(ring, "area", 4.0 * PI * PI * major * minor, error);
    is_measured(long, "volume", 2.0 * volume, error);
    for (k, at) in [0.0, 5.0, 0.0].into_iter().enumerate() {
        let centroid = long["centroid"][k].as_f64().unwrap();
        assert!((centroid - at).abs() < 3e-2, "{long}");
    }
    // What two have in common and what only the one has, are that one.
    let of = |row: &Value, key: &str| row[key].as_f64().unwrap();
    let sum = of(less, "volume") + of(both, "volume");
    let room = of(less, "volume_error").hypot(of(both, "volume_error"));
    assert!((sum - volume).abs() <= 3.0 * room, "{less} {both} {volume}");
    is_measured(both, "volume", common_volume(minor, minor), error);
    is_measured(ball, "volume", 4.5 * PI, error);
    is_measured(ball, "area", 9.0 * PI, error);
    // Where it is in itself twice, its polynomial is above zero.
    let (inner, outer) = spindle_volumes(0.5, 1.0);
    is_measured(spindle, "volume", outer - inner, error);
    // Two caps of height 1/2.
    is_measured(lens, "volume", 5.0 * PI / 12.0, error);
    is_measured(lens, "area", 2.0 * PI, error);
}

/// The sphere that `plan` names fills what the torus leaves out.
#[test]
fn a_torus_that_passes_through_itself_is_filled_by_a_sphere() {
    for (major, minor) in [(1.0_f64, 2.0_f64), (0.7, 0.8)] {
        let radius = (minor * minor - major * major).sqrt();
        let ring = format!("torus = {{ major = {major}, minor = {minor} }}");
        let folder = folder();
        let alone = format!("format = 1\nshape.a.{ring}\n[[instance]]\nshape = 'a'\n");
        write(folder.path(), &alone);
        let plan = lanecast(folder.path(), &["plan", "a.toml"]);
        assert!(stdout(&plan).contains("minor > major"), "{}", stdout(&plan));
        let text = format!(
            "format = 1\nshape.a.{ring}\n\
             shape.b.sphere = {{ center = [0, 0, 0], radius = {radius} }}\n\
             shape.c.union = ['a', 'b']\n[[instance]]\nshape = 'c'\n"
        );
        let found = measured(folder.path(), &text, "4e-3");
        let (_, outer) = spindle_volumes(major, minor);
        is_measured(&found["solids"][0], "volume", outer, 4e-3);
    }
}

/// Of a ring of radii 1 and `minor` and the same one by `shift` aside, by layers: in
/// each both are annuli, and so is most of what they share; by the midpoint rule.
fn common_volume(minor: f64, shift: f64) -> f64 {
    let layers = 4000;
    let layer = |i: i32| {
        let y = minor * (2.0 * (f64::from(i) + 0.5) / f64::from(layers) - 1.0);
        let half = (minor * minor - y * y).sqrt();
        let [inner, outer] = [1.0 - half, 1.0 + half];
        let [small, both, large] =
            [(inner, inner), (inner, outer), (outer, outer)].map(|(a, b)| lens(a, b, shift));
        large - 2.0 * both + small
    };
    let sum: f64 = (0..layers).map(layer).sum();
    sum * 2.0 * minor / f64::from(layers)
}

/// The area that two discs have in common whose centres are `apart`.
fn lens(a: f64, b: f64, apart: f64) -> f64 {
    if apart >= a + b {
        return 0.0;
    }
    if apart <= (a - b).abs() {
        return PI * a.min(b).powi(2);
    }
    let segment = |a: f64, b: f64| {
        let to_chord = (apart * apart + a * a - b * b) / (2.0 * apart);
        a * a * (to_chord / a).acos() - to_chord * (a * a - to_chord * to_chord).sqrt()
    };
    segment(a, b) + segment(b, a)
}

/// Of a torus that meets itself: what is in it twice, and what is in it at all.
fn spindle_volumes(major: f64, minor: f64) -> (f64, f64) {
    let top = (minor * minor - major * major).sqrt();
    let layers = 100_000;
    let (mut inner, mut outer) = (0.0, 0.0);
    for i in 0..layers {
        let y = minor * (2.0 * (f64::from(i) + 0.5) / f64::from(layers) - 1.0);
        let half = (minor * minor - y * y).sqrt();
        let thick = 2.0 * minor / f64::from(layers);
        outer += PI * (major + half).powi(2) * thick;
        if y.abs() < top {
            inner += PI * (half - major).powi(2) * thick;
        } else {
            outer -= PI * (major - half).powi(2) * thick;
        }
    }
    (inner, outer)
}
