//! The volumes that nodes, operators and maps have, by their formulas.

use super::{CUBE, FN0, near, volume};
use std::f64::consts::PI;

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
        // All points are one path if there is none.
        ("linear_extrude(height = 1) polygon(points = [[0, 0], [2, 0], [0, 2]], paths = []);".into(), 2.0),
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
        // What no face names is no part of a hull.
        (
            "hull() polyhedron(points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [9, 9, 9]], \
             faces = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]);"
                .into(),
            1.0 / 6.0,
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
        // One direction far larger than the others.
        (
            "multmatrix([[1e-7, 0, 0, 0], [0, 1e-7, 0, 0], [0, 0, 1, 0]]) cube([1e7, 1e7, 1]);"
                .into(),
            1.0,
        ),
        // A flat thing among solids is left out.
        (format!("union() {{ {CUBE} square([100, 100]); }}"), 6.0),
    ] {
        near(volume(&text), expected, &text);
    }
}
