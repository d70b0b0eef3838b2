//! What is refused, and with which message.

use super::{CUBE, load_as, loaded};
use lanecast::internals::io::Curves;

#[test]
fn what_is_not_drawn_is_named_with_its_place_and_a_remedy() {
    for (text, says) in [
        (
            "group() {\n\tsurface(file = \"a\");\n}",
            "part.csg:2:2: surface() is not drawn; let OpenSCAD make a mesh",
        ),
        (
            "import(file = \"\");",
            "part.csg:1:1: import() names no file",
        ),
        (
            "import(file = \"a.stl\");",
            "part.csg:1:1: import() of 'a.stl': No such file",
        ),
        (
            "import(file = \"../a.stl\");",
            "import() of '../a.stl', which lies outside the folder; move it there",
        ),
        (
            "import(file = \"a.off\");",
            "import() of a file .off is not drawn, only of .stl, .dxf and .svg; let OpenSCAD",
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
    // Of a long name only the beginning is said.
    let long = "x".repeat(1000);
    for text in [
        format!("{long}();"),
        format!("{long}("),
        format!("{long} = 3;"),
        format!("color(\"{long}\") cube(1);"),
        format!("import(file = \"{long}.stl\");"),
        format!("import(file = \"a.{long}\");"),
        format!("{long}() {{"),
    ] {
        let error = load_as(&text, Curves::Exact).map(|_| ()).unwrap_err();
        assert!(error.len() < 300, "{error}");
    }
    // In the background it is only left out.
    let warning = loaded(&format!("%surface(file = \"a.dat\"); {CUBE}"))
        .warning
        .unwrap();
    assert!(warning.contains("1 × % of surface()"), "{warning}");
}
