//! Facets beside those of OpenSCAD, and meshes that a file imports.

use super::{CUBE, FN0, load_beside, near, volume, volume_as, volume_of};
use lanecast::internals::io::Curves;
use std::f64::consts::PI;

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

/// Volumes of the meshes that OpenSCAD 2021.01 writes of the same text.
#[test]
fn turns_and_offsets_have_openscads_own_volumes() {
    let at = |x: f64| format!("multmatrix([[1, 0, 0, {x}], [0, 1, 0, 0]])");
    let frame = "difference() { square([12, 12], center = true); square([3, 9], center = true); }";
    let sweep = "linear_extrude(height = 2)";
    for (text, expected) in [
        // A turn by a part: of either sign, on either side of the axis, and of parts of a step.
        (
            format!(
                "rotate_extrude(angle = 90, $fn = 16) {} square([1, 1]);",
                at(3.0)
            ),
            5.3575726,
        ),
        (
            format!(
                "rotate_extrude(angle = -90, $fn = 16) {} square([1, 1]);",
                at(3.0)
            ),
            5.3575726,
        ),
        (
            format!(
                "rotate_extrude(angle = 90, $fn = 16) {} square([1, 1]);",
                at(-4.0)
            ),
            5.3575726,
        ),
        (
            format!(
                "rotate_extrude(angle = 90, $fn = 7) {} square([1, 1]);",
                at(3.0)
            ),
            3.5,
        ),
        (
            format!(
                "rotate_extrude(angle = 100, $fn = 13) {} circle($fn = 9, r = 1);",
                at(3.0)
            ),
            14.305284,
        ),
        // A whole turn begins at −x: what is cut off at x = 3.2 is less than at −x.
        (
            format!(
                "intersection() {{ rotate_extrude($fn = 5) {} square([1, 1]); \
                 multmatrix([[1, 0, 0, 2.5], [0, 1, 0, -9]]) cube([9, 18, 9]); }}",
                at(3.0)
            ),
            3.6372454,
        ),
        // Corners of an offset: round, sharp, cut, and inward.
        (
            format!("{sweep} offset(r = 1, {FN0}) square([4, 4]);"),
            68.0,
        ),
        (
            format!("{sweep} offset(r = 1, $fn = 7) square([4, 4]);"),
            69.621277,
        ),
        (
            format!("{sweep} offset(r = 5, $fn = 100) square([4, 4]);"),
            348.97618,
        ),
        (
            format!("{sweep} offset(r = 2, $fn = 8) polygon([[0, 0], [10, 0], [3, 8]]);"),
            219.00886,
        ),
        (
            format!("{sweep} offset(r = -1, $fn = 64) {frame}"),
            100.17688,
        ),
        (format!("{sweep} offset(r = -1, {FN0}) {frame}"), 101.0),
        (
            format!("{sweep} offset(delta = 1, chamfer = true) square([4, 4]);"),
            70.627435,
        ),
        (
            format!("{sweep} offset(delta = 1) polygon([[0, 0], [20, 0], [0, 1]]);"),
            186.20253,
        ),
    ] {
        near(volume_as(&text, Curves::Facets), expected, &text);
    }
}

/// A tetrahedron of volume 36 as a part of a solid.
#[test]
fn a_mesh_that_is_imported_is_an_operand() {
    let corners = [[0, 0, 0], [6, 0, 0], [0, 6, 0], [0, 0, 6]];
    let facets = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|facet| {
        let vertices = facet.map(|row: usize| {
            let [x, y, z] = corners[row];
            format!("vertex {x} {y} {z}\n")
        });
        format!(
            "facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n",
            vertices.concat()
        )
    });
    let stl = format!("solid\n{}endsolid\n", facets.concat());
    let import =
        "import(file = \"a b.stl\", layer = \"\", origin = [0, 0], scale = 1, convexity = 1);";
    for (text, expected) in [
        (import.to_string(), 36.0),
        (
            format!("difference() {{ {import} cube([1, 1, 1]); }}"),
            35.0,
        ),
        (
            format!("multmatrix([[2, 0, 0, 1], [0, 1, 0, 0], [0, 0, -1, 0]]) {import}"),
            72.0,
        ),
        (format!("hull() {{ {import} {CUBE} }}"), 36.0),
    ] {
        let files: [(&str, &[u8]); 1] = [("a b.stl", stl.as_bytes())];
        let loaded = load_beside(&text, &files, Curves::Exact).unwrap();
        near(volume_of(&loaded.scene, &text), expected, &text);
    }
}
