//! Texts that nobody wrote, and small ones that ask for much: all end soon, in little room.

use super::{CUBE, load_as};
use crate::common::property;
use lanecast::internals::io::Curves;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use std::cell::Cell;
use std::time::{Duration, Instant};

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
    "text(text = \"\\\"\", size = 0);",
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

/// A file's facets have a bound together, not one by one; and so have the crossings of outlines.
#[test]
fn facets_and_crossings_have_a_bound() {
    let refused = |text: &str, says: &str| {
        let start = Instant::now();
        let error = load_as(text, Curves::Facets).map(|_| ()).unwrap_err();
        assert!(error.contains(says), "{error}");
        assert!(start.elapsed() < Duration::from_secs(20));
    };
    let ball = "sphere($fn = 1000, r = 1);";
    refused(&ball.repeat(5), "more than 4194304 triangles and corners");
    refused(
        &"rotate_extrude($fn = 4000) multmatrix([[1, 0, 0, 3]]) circle($fn = 500, r = 1);"
            .repeat(2),
        "more than 4194304 triangles and corners",
    );
    // Every edge of the star crosses every other one.
    let star: Vec<String> = (0..401)
        .map(|i| f64::from(i) * 400.0 / 401.0 * std::f64::consts::PI)
        .map(|a| format!("[{:.6}, {:.6}]", a.cos(), a.sin()))
        .collect();
    refused(
        &format!("polygon(points = [{}]);", star.join(", ")),
        "part.csg:1:1: this polygon cannot be drawn: the edges of this outline cross more than",
    );
}
