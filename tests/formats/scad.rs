//! OpenSCAD's `.csg`: what each node means, what is refused and with which message, and texts
//! that nobody wrote.

use crate::common::property;
use lanecast::internals::io::{Curves, LoadOptions, Loaded, SrgbEncoder, load};
use lanecast::internals::math::Affine;
use lanecast::internals::measure::volumes::{Goal, Placed};
use lanecast::internals::render::Progress;
use lanecast::internals::scene::{Instances, Scene, Shape};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use std::cell::Cell;
use std::f64::consts::PI;
use std::time::{Duration, Instant};

fn load_as(text: &str, scad_curves: Curves) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part.csg");
    std::fs::write(&path, text).unwrap();
    let options = LoadOptions {
        scad_curves,
        ..LoadOptions::default()
    };
    load(&path, &options).map_err(|error| {
        let message = error.to_string();
        message.replace(&format!("{}/", folder.path().display()), "")
    })
}

fn loaded(text: &str) -> Loaded {
    load_as(text, Curves::Exact).unwrap_or_else(|e| panic!("{text}: {e}"))
}

fn scene(text: &str) -> Scene {
    loaded(text).scene
}

/// The volume of all that is placed, to some 1e-6 of it.
fn volume(text: &str) -> f64 {
    volume_as(text, Curves::Exact)
}

fn volume_as(text: &str, curves: Curves) -> f64 {
    let scene = match load_as(text, curves) {
        Ok(loaded) => loaded.scene,
        Err(error) if error.contains("the scene is empty") => return 0.0,
        Err(error) => panic!("{text}: {error}"),
    };
    let instances = Instances::of(&scene).unwrap();
    let goal = Goal {
        relative: 1e-5,
        ..Goal::default()
    };
    let mut sum = 0.0;
    for instance in instances.iter(&scene) {
        let maps = (&instance.world_from_object, &instance.object_from_world);
        let placed = Placed::new(&scene, instance.shape, maps.0, maps.1);
        let placed = placed.unwrap_or_else(|_| panic!("{text}: no volume"));
        let found = placed.measure(&goal, &Progress::default()).unwrap();
        sum += found.volume(&Affine::IDENTITY, 1.0).unwrap().volume;
    }
    sum
}

fn near(found: f64, expected: f64, text: &str) {
    let off = (found - expected).abs();
    assert!(
        off <= 1e-4 * expected.abs(),
        "{text}: {found}, not {expected}"
    );
}

const CUBE: &str = "cube(size = [1, 2, 3], center = false);";
const FN0: &str = "$fn = 0, $fa = 12, $fs = 2";

#[test]
fn every_node_has_its_volume() {
    let hexagon = 1.5 * 3.0_f64.sqrt();
    for (text, expected) in [
        (CUBE.into(), 6.0),
        ("cube(2);".into(), 8.0),
        (format!("sphere({FN0}, r = 2);"), 32.0 / 3.0 * PI),
        ("sphere($fn = 0, d = 2);".into(), 4.0 / 3.0 * PI),
        (format!("cylinder({FN0}, h = 3, r1 = 2, r2 = 2, center = true);"), 12.0 * PI),
        (format!("cylinder({FN0}, h = 3, r1 = 2, r2 = 0, center = false);"), 4.0 * PI),
        (format!("cylinder({FN0}, h = 3, r1 = 2, r2 = 1, center = false);"), 7.0 * PI),
        // A few sides are meant.
        ("cylinder($fn = 6, h = 2, r1 = 1, r2 = 1);".into(), 2.0 * hexagon),
        ("cylinder($fn = 13, h = 1, r1 = 1, r2 = 1);".into(), PI),
        // An octahedron, and a cube with a dent: faces are clockwise from outside.
        (
            "polyhedron(points = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], \
             [0, 0, -1]], faces = [[0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0], [1, 5, 0], \
             [2, 5, 1], [3, 5, 2], [0, 5, 3]], convexity = 1);"
                .into(),
            4.0 / 3.0,
        ),
        (
            "polyhedron(points = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [0, 0, 2], \
             [2, 0, 2], [2, 2, 2], [0, 2, 2], [1, 1, 1]], faces = [[0, 1, 2, 3], [4, 8, 5], \
             [5, 8, 6], [6, 8, 7], [7, 8, 4], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], \
             [3, 7, 4, 0]], convexity = 2);"
                .into(),
            8.0 - 4.0 / 3.0,
        ),
        ("linear_extrude(height = 3) square(size = [2, 4], center = true);".into(), 24.0),
        (format!("linear_extrude(height = 3) circle({FN0}, r = 2);"), 12.0 * PI),
        (
            "linear_extrude(height = 2, center = true) polygon(points = [[0, 0], [4, 0], [4, 4], \
             [0, 4], [1, 1], [2, 1], [2, 2], [1, 2]], paths = [[0, 1, 2, 3], [4, 5, 6, 7]]);"
                .into(),
            30.0,
        ),
        // Edges that cross: two triangles.
        (
            "linear_extrude(height = 1) polygon(points = [[0, 0], [2, 2], [2, 0], [0, 2]], \
             paths = undef);"
                .into(),
            2.0,
        ),
        (
            format!(
                "linear_extrude(height = 2) difference() {{ circle({FN0}, r = 2); multmatrix([[1, \
                 0, 0, 0.5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) circle({FN0}, r = 1); }}"
            ),
            6.0 * PI,
        ),
        ("linear_extrude(height = 3, scale = [0, 0]) square(size = [2, 2], center = true);".into(), 4.0),
        (
            "linear_extrude(height = 3, scale = 0.5) polygon(points = [[0, 0], [2, 0], [2, 2], \
             [1, 1], [0, 2]]);"
                .into(),
            3.0 * 3.0 * (1.0 + 0.5 + 0.25) / 3.0,
        ),
        (format!("linear_extrude(height = 3, scale = 0.5) circle({FN0}, r = 2);"), 7.0 * PI),
        // An annulus, a torus, half of it, and a ball whose half is cut off.
        (
            format!(
                "rotate_extrude(angle = 360, {FN0}) multmatrix([[1, 0, 0, 2], [0, 1, 0, 0]]) \
                 square(size = [1, 3], center = false);"
            ),
            15.0 * PI,
        ),
        (
            format!(
                "rotate_extrude(angle = 360, {FN0}) multmatrix([[1, 0, 0, 3], [0, 1, 0, 1]]) \
                 circle({FN0}, r = 1);"
            ),
            6.0 * PI * PI,
        ),
        (
            format!(
                "rotate_extrude(angle = -90, {FN0}) multmatrix([[1, 0, 0, 3], [0, 1, 0, 1]]) \
                 circle({FN0}, r = 1);"
            ),
            1.5 * PI * PI,
        ),
        (
            format!(
                "rotate_extrude(angle = 270, {FN0}) multmatrix([[1, 0, 0, -3], [0, 1, 0, 1]]) \
                 circle({FN0}, r = 1);"
            ),
            4.5 * PI * PI,
        ),
        (
            format!(
                "rotate_extrude({FN0}) difference() {{ circle({FN0}, r = 2); \
                 multmatrix([[1, 0, 0, -9], [0, 1, 0, -9]]) square(size = [9, 18]); }}"
            ),
            32.0 / 3.0 * PI,
        ),
        (
            format!("rotate_extrude({FN0}) polygon(points = [[0, 0], [2, 0], [1, 1], [2, 2], [0, 2]]);"),
            // Two cut cones of 7π/3.
            14.0 / 3.0 * PI,
        ),
        ("rotate_extrude($fn = 4) multmatrix([[1, 0, 0, 0]]) square([1, 1]);".into(), 2.0),
        // Hulls: a brick, a capsule, a rounded cube, a rounded plate.
        (
            "hull() { cube(1); multmatrix([[1, 0, 0, 2], [0, 1, 0, 0], [0, 0, 1, 0]]) cube(1); }".into(),
            3.0,
        ),
        (
            format!(
                "hull() {{ sphere({FN0}, r = 1); multmatrix([[1, 0, 0, 3], [0, 1, 0, 1], \
                 [0, 0, 1, 0]]) sphere({FN0}, r = 1); }}"
            ),
            (4.0 / 3.0 + 10.0_f64.sqrt()) * PI,
        ),
        (
            format!(
                "hull() {{ {} }}",
                [[0, 0], [4, 0], [0, 3], [4, 3]].map(|[x, y]| format!(
                    "multmatrix([[1, 0, 0, {x}], [0, 1, 0, {y}], [0, 0, 1, 0]]) {{ sphere({FN0}, r = 1); }}"
                )).concat()
            ),
            24.0 + 7.0 * PI + 4.0 / 3.0 * PI,
        ),
        (
            format!(
                "hull() {{ {} }}",
                [[0, 0], [4, 0], [0, 3], [4, 3]].map(|[x, y]| format!(
                    "multmatrix([[1, 0, 0, {x}], [0, 1, 0, {y}], [0, 0, 1, 1]]) {{ \
                     cylinder({FN0}, h = 2, r1 = 1, r2 = 1); }}"
                )).concat()
            ),
            2.0 * (12.0 + 14.0 + PI),
        ),
        (
            format!(
                "linear_extrude(height = 1) hull() {{ circle({FN0}, r = 1); \
                 multmatrix([[1, 0, 0, 3], [0, 1, 0, 0]]) circle({FN0}, r = 1); }}"
            ),
            6.0 + PI,
        ),
        // Offsets: round, sharp and inward.
        ("linear_extrude(height = 1) offset(r = 1, $fn = 0) square([3, 2]);".into(), 6.0 + 10.0 + PI),
        ("linear_extrude(height = 1) offset(delta = 1, chamfer = false) square([3, 2]);".into(), 20.0),
        ("linear_extrude(height = 1) offset(r = -0.5, $fn = 0) square([3, 2]);".into(), 2.0),
        (format!("linear_extrude(height = 1) offset(r = 1) circle({FN0}, r = 2);"), 9.0 * PI),
        // What OpenSCAD's view shows of outlines.
        ("square([3, 2]);".into(), 6.0),
    ] {
        let text: String = text;
        near(volume(&text), expected, &text);
    }
}

#[test]
fn operators_and_maps_have_their_volumes() {
    let at =
        |x: f64| format!("multmatrix([[1, 0, 0, {x}], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])");
    let half = at(0.5);
    for (text, expected) in [
        (format!("{CUBE} {half} {{ {CUBE} }}"), 9.0),
        (format!("union() {{ {CUBE} {half} {CUBE} }}"), 9.0),
        (format!("group() {{ {CUBE} {} {CUBE} }}", at(5.0)), 12.0),
        (format!("difference() {{ {CUBE} {half} {CUBE} }}"), 3.0),
        (format!("intersection() {{ {CUBE} {half} {CUBE} }}"), 3.0),
        (format!("render() {{ {CUBE} }}"), 6.0),
        // Nothing in it, or not there.
        ("group();".into(), 0.0),
        ("union() { group() { } }".into(), 0.0),
        (format!("difference() {{ group(); {CUBE} }}"), 0.0),
        (format!("difference() {{ {CUBE} group(); }}"), 6.0),
        (format!("intersection() {{ {CUBE} group(); }}"), 0.0),
        (
            "cube(size = [0, 1, 1]); sphere(r = -1); cylinder(h = 0); cylinder(r1 = 0, r2 = 0);"
                .into(),
            0.0,
        ),
        (
            "cube(size = [1, nan, 1]); cube(size = [inf, 1, 1]); sphere(r = inf);".into(),
            0.0,
        ),
        // Modifiers: % is no part of it, * is not there, # is, and ! is all.
        // The ghost is measured as well, under the name %.
        (
            format!("intersection() {{ %cube(size = [9, 9, 9]); {CUBE} }}"),
            6.0 + 729.0,
        ),
        (format!("{CUBE} *cube(size = [9, 9, 9]);"), 6.0),
        (format!("union() {{ {CUBE} #{CUBE} }}"), 6.0),
        (
            format!("group() {{ {CUBE} !cube(size = [2, 2, 2]); }}"),
            8.0,
        ),
        // Scaled by 0, mirrored, sheared, scaled differently.
        (
            format!("multmatrix([[0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]) {CUBE}"),
            0.0,
        ),
        (
            format!("multmatrix([[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]) {CUBE}"),
            6.0,
        ),
        (
            format!("multmatrix([[1, 0.5, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]) {CUBE}"),
            6.0,
        ),
        (
            format!("multmatrix([[2, 0, 0, 0], [0, 3, 0, 0], [0, 0, 1, 0]]) sphere({FN0}, r = 1);"),
            8.0 * PI,
        ),
        (
            format!(
                "multmatrix([[0, 0, 2, 0], [0, 3, 0, 0], [-3, 0, 0, 0]]) \
                 cylinder({FN0}, h = 1, r1 = 1, r2 = 0);"
            ),
            6.0 * PI,
        ),
        // A flat thing among solids is left out.
        (format!("union() {{ {CUBE} square([100, 100]); }}"), 6.0),
    ] {
        near(volume(&text), expected, &text);
    }
}

#[test]
fn facets_are_those_of_openscad() {
    let of = |text: &str| volume_as(text, Curves::Facets);
    // Of a cylinder of radius 5: min(360 / 12, 5 · 2π / 2) = 15.7 sides, and so 16.
    let sides = 16.0_f64;
    let area = sides / 2.0 * 25.0 * (2.0 * PI / sides).sin();
    let text = format!("cylinder({FN0}, h = 2, r1 = 5, r2 = 5);");
    near(of(&text), 2.0 * area, &text);
    let text = format!("linear_extrude(height = 2) circle({FN0}, r = 5);");
    near(of(&text), 2.0 * area, &text);
    let text = "cylinder($fn = 64, h = 2, r1 = 5, r2 = 5);";
    near(of(text), 50.0 * 32.0 * (PI / 32.0).sin(), text);
    // Rings of a ball lie between the poles, at 1/10 and 3/10 of half a turn and so on.
    let text = "sphere($fn = 10, r = 1);";
    let ring = |i: f64| (PI * (i + 0.5) / 5.0).sin_cos();
    let cut = |i: f64| {
        let ([a, y], [b, z]) = (<[f64; 2]>::from(ring(i)), <[f64; 2]>::from(ring(i + 1.0)));
        (y - z) / 3.0 * (a * a + a * b + b * b)
    };
    let expected = (0..4).map(|i| cut(f64::from(i))).sum::<f64>() * 5.0 * (PI / 5.0).sin();
    near(of(text), expected, text);
    near(volume(text), expected, text);
    let text = "rotate_extrude($fn = 64) multmatrix([[1, 0, 0, 2], [0, 1, 0, 0]]) square([1, 1]);";
    near(of(text), 5.0 * 32.0 * (PI / 32.0).sin(), text);
}

#[test]
fn what_is_made_is_exact_and_small() {
    let kinds = |text: &str| -> Vec<&'static str> {
        let scene = scene(text);
        let rows = scene.shapes.rows.iter();
        rows.map(|shape| shape.kind_name()).collect()
    };
    assert_eq!(kinds(CUBE), ["box"]);
    // A quarter of a turn, and any turn of what is round, leave no frame.
    let turned = "multmatrix([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3]])";
    let scene = scene(&format!("{turned} {CUBE}"));
    let cuboid = &scene.cuboids;
    assert_eq!(cuboid.len(), 1);
    assert_eq!(scene.transforms.len(), 1, "only the identity");
    let text = format!(
        "multmatrix([[0.866025, -0.5, 0, 1], [0.5, 0.866025, 0, 0], [0, 0, 1, 0]]) \
         cylinder({FN0}, h = 1, r1 = 2, r2 = 1);"
    );
    assert_eq!(kinds(&text), ["cone"]);
    assert_eq!(
        kinds(&format!("linear_extrude(height = 1) circle({FN0}, r = 1);")),
        ["cylinder"]
    );
    let torus = format!("rotate_extrude({FN0}) multmatrix([[1, 0, 0, 2]]) circle({FN0}, r = 1);");
    assert_eq!(kinds(&torus), ["implicit"]);
}

#[test]
fn z_is_up() {
    let loaded =
        loaded("multmatrix([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 10]]) cube(size = [1, 2, 3]);");
    let scene = &loaded.scene;
    let Shape::Cuboid(id) = scene.shapes.rows[0] else {
        panic!()
    };
    let row = scene.cuboids.row(id);
    assert_eq!(row.min.to_array(), [0.0, 10.0, -2.0]);
    assert_eq!(row.max.to_array(), [1.0, 13.0, 0.0]);
}

#[test]
fn colors_are_those_of_openscads_view() {
    let colors = |text: &str| -> Vec<([u8; 3], f32)> {
        let scene = scene(text);
        let encoder = SrgbEncoder::new();
        let rows = scene.materials.rows.iter();
        rows.map(|m| (m.base_color.map(|c| encoder.encode(c)), m.layers.opacity))
            .collect()
    };
    let (yellow, green) = ([249, 215, 44], [157, 203, 81]);
    assert_eq!(colors(CUBE), [(yellow, 1.0)]);
    // What is cut off, unless it is one piece or has a colour.
    let other = "multmatrix([[1, 0, 0, 0.5]])";
    let cut = colors(&format!("difference() {{ {CUBE} {other} {CUBE} }}"));
    assert!(cut.contains(&(green, 1.0)) && cut.contains(&(yellow, 1.0)) && cut.len() == 2);
    let plain = format!("render() difference() {{ {CUBE} {other} {CUBE} }}");
    assert_eq!(colors(&plain), [(yellow, 1.0)]);
    // The outermost colour counts.
    let nested = format!("color([1, 0, 0, 0.25]) {{ color([0, 1, 0, 1]) {{ {CUBE} }} }}");
    assert_eq!(colors(&nested), [([255, 0, 0], 0.25)]);
    assert_eq!(
        colors(&format!("color([-1, -1, -1, 1]) {CUBE}")),
        [(yellow, 1.0)]
    );
    // Modifiers.
    assert_eq!(colors(&format!("%{CUBE}")), [([180, 180, 180], 0.5)]);
    let marked = colors(&format!("#{CUBE}"));
    assert_eq!(marked.len(), 1);
    assert_eq!(marked[0].1, 1.0);
    assert!(marked[0].0[0] > 240 && marked[0].0[1] < 180);
    let cut = colors(&format!("difference() {{ {CUBE} #{other} {CUBE} }}"));
    assert!(cut.contains(&([255, 81, 81], 0.5)), "{cut:?}");
}

#[test]
fn what_is_not_drawn_is_named_with_its_place_and_a_remedy() {
    for (text, says) in [
        (
            "group() {\n\ttext(text = \"a\");\n}",
            "part.csg:2:2: text() is not drawn; let OpenSCAD make a mesh",
        ),
        (
            "import(file = \"a.stl\");",
            "part.csg:1:1: import() is not drawn",
        ),
        (
            "minkowski() { cube(1); sphere(1); }",
            "minkowski() is not drawn",
        ),
        (
            "linear_extrude(height = 1, twist = 90) square(1);",
            "linear_extrude() with a twist",
        ),
        (
            "linear_extrude(height = 1, scale = [1, 2]) square(1);",
            "scales x and y differently",
        ),
        ("frobnicate();", "frobnicate() is no node that is known"),
        (
            "hull() { sphere(r = 1); sphere(r = 2); }",
            "balls of several sizes",
        ),
        (
            "hull() { difference() { cube(2); cube(1); } cube(1); }",
            "hull() of a difference",
        ),
        (
            "rotate_extrude() square([2, 2], center = true);",
            "on both sides of the axis",
        ),
        ("color(\"red\") cube(1);", "the colour 'red' is a name"),
        (
            "polyhedron(points = [[0, 0, 0]], faces = [[0, 1, 2]]);",
            "face 0 (from 0) names a point",
        ),
        (
            "polyhedron(points = [[0, 0]], faces = []);",
            "point 0 (from 0) is no list of 3",
        ),
        ("x = 3;", "'x' is OpenSCAD's language"),
        (
            "cube(size = [1, 2, 3])",
            "is not closed at the end of the file",
        ),
        ("", "the scene is empty"),
    ] {
        let error = load_as(text, Curves::Exact).map(|_| ()).unwrap_err();
        assert!(error.contains(says), "{text}: {error}");
        assert!(!error.contains('\n'));
        assert!(text.is_empty() || error.starts_with("part.csg:"), "{error}");
    }
    // In the background it is only left out.
    let warning = loaded(&format!("%text(text = \"a\"); {CUBE}"))
        .warning
        .unwrap();
    assert!(warning.contains("1 × % of text()"), "{warning}");
}

/// The shape that the first instance places.
fn root_shape(scene: &Scene) -> Shape {
    let instances = Instances::of(scene).unwrap();
    let first = instances.iter(scene).next().unwrap();
    scene.shapes.row(first.shape)
}

/// Coincident faces whose numbers have six digits leave no skin.
#[test]
fn faces_that_six_digits_part_are_one() {
    let text = "difference() { cube(size = [33.3333, 100, 100]); \
                multmatrix([[1, 0, 0, 16.6667], [0, 1, 0, 10], [0, 0, 1, 10]]) \
                cube(size = [16.6666, 50, 50]); }";
    let scene = scene(text);
    let Shape::Csg(id) = root_shape(&scene) else {
        panic!()
    };
    assert!(scene.csg.tolerance[id.index()] >= 1e-4);
    near(volume(text), 33.3333 * 1e4 - 16.6666 * 2500.0, text);
}

const WORDS: [&str; 34] = [
    "group()",
    "union()",
    "difference()",
    "intersection()",
    "{",
    "}",
    ";",
    "%",
    "#",
    "!",
    "*",
    "cube(size = [1, 2, 3], center = true);",
    "sphere($fn = 7, r = 2);",
    "sphere(r = 1);",
    "cylinder($fn = 0, h = 1, r1 = 2, r2 = 0);",
    "square([1, 2]);",
    "circle(r = 1);",
    "multmatrix([[1, 0, 0, 3], [0, 1, 0, -1], [0, 0, 1, 1], [0, 0, 0, 1]])",
    "multmatrix([[0.5, -0.866025, 0, 0], [0.866025, 0.5, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])",
    "color([1, 0, 0, 0.5])",
    "linear_extrude(height = 2, scale = 0.5)",
    "linear_extrude(height = 1)",
    "rotate_extrude(angle = 90, $fn = 0)",
    "rotate_extrude($fn = 5)",
    "hull()",
    "offset(r = 0.5)",
    "offset(delta = -0.2)",
    "render()",
    "polygon(points = [[0, 0], [2, 0], [1, 2], [3, 1]]);",
    "polyhedron(points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], faces = [[0, 1, 2], [0, 3, 1]]);",
    "1e308",
    "nan",
    "$fn = 1e9",
    "text(text = \"\\\"\");",
];

/// Texts of nodes in any order, and with bytes changed: none makes the importer panic, and all
/// end soon.
#[test]
fn any_text_loads_or_is_refused() {
    let words = proptest::collection::vec(0..WORDS.len(), 0..40);
    let changes = proptest::collection::vec((any::<u16>(), any::<u8>()), 0..4);
    let mut runner = TestRunner::new(property(3000));
    let drawn = Cell::new(0);
    let outcome = runner.run(&(words, changes), |(words, changes)| {
        let mut text: Vec<u8> = words
            .iter()
            .map(|w| WORDS[*w])
            .collect::<Vec<_>>()
            .join(" ")
            .into();
        for (at, byte) in changes {
            if !text.is_empty() {
                let at = usize::from(at) % text.len();
                text[at] = byte;
            }
        }
        let text = String::from_utf8_lossy(&text).into_owned();
        for curves in [Curves::Exact, Curves::Facets] {
            let start = Instant::now();
            let result = load_as(&text, curves);
            prop_assert!(start.elapsed() < Duration::from_secs(5), "{text}");
            if let Err(error) = result {
                prop_assert!(
                    error.starts_with("part.csg") && error.len() < 500,
                    "{error}"
                );
                prop_assert!(!error.contains('\n'), "{error}");
            }
        }
        Ok(())
    });
    outcome.unwrap();
    // Trees that are whole.
    let tree = prop_oneof![
        Just("cube(1);".to_string()),
        Just("sphere(1);".to_string()),
        Just("circle(1);".to_string())
    ]
    .prop_recursive(5, 40, 4, |inner| {
        let nodes = [
            "union()",
            "difference()",
            "intersection()",
            "hull()",
            "linear_extrude(height = 1)",
            "rotate_extrude()",
            "offset(r = 0.1)",
            "#group()",
            "%group()",
            "multmatrix([[1, 0, 0, 0.3], [0, 1, 0, 0.2], [0, 0, -1, 1]])",
            "color([1, 1, 0, 1])",
        ];
        (0..nodes.len(), proptest::collection::vec(inner, 0..4))
            .prop_map(move |(node, parts)| format!("{} {{ {} }}", nodes[node], parts.concat()))
    });
    // A runner counts its cases over all that it is asked for.
    TestRunner::new(property(3000))
        .run(&tree, |text| {
            match load_as(&text, Curves::Exact) {
                Ok(_) => drawn.set(drawn.get() + 1),
                Err(error) => prop_assert!(error.starts_with("part.csg"), "{error}"),
            }
            Ok(())
        })
        .unwrap();
    assert!(drawn.get() > 0);
}

#[test]
fn what_small_numbers_ask_for_is_bounded() {
    let deep = "union(){".repeat(50_000) + CUBE + &"}".repeat(50_000);
    let many = "sphere($fn = 1e9, r = 1);".to_string();
    let wide = format!("rotate_extrude($fn = 1e9) {}", "square([1, 1]);");
    for text in [deep, many, wide] {
        let start = Instant::now();
        let _ = load_as(&text, Curves::Facets);
        let _ = load_as(&text, Curves::Exact);
        assert!(start.elapsed() < Duration::from_secs(20));
    }
}
