//! Outlines that are turned about an axis, in native scenes.

use crate::scad::{NEAR, volume_of};
use lanecast::internals::io::{LoadOptions, load};
use lanecast::internals::scene::Scene;
use std::f64::consts::PI;

/// Loads a scene that places a lathe with these fields. Errors are those of `scene.toml`.
fn loaded(fields: &str) -> Result<Scene, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let text = format!(
        "format = 1\n[shape.a]\nlathe = {{ {fields} }}\n[[instance]]\nshape = \"a\"\n\
         transform = [{{ rotate_x = 20.0 }}]\n"
    );
    std::fs::write(&path, text).unwrap();
    match load(&path, &LoadOptions::default()) {
        Ok(loaded) => Ok(loaded.scene),
        Err(error) => Err(error
            .to_string()
            .replace(&format!("{}/", folder.path().display()), "")),
    }
}

#[test]
fn what_an_outline_sweeps_has_the_volume_of_pappus() {
    for (fields, expected) in [
        // A cylinder, a cone, and a cone whose tip is cut off.
        ("points = [[0, 0], [2, 0], [2, 3], [0, 3]]", 12.0 * PI),
        ("points = [[0, -1], [0, 2], [2, -1]]", 4.0 * PI),
        ("points = [[0, 0], [2, 0], [1, 3], [0, 3]]", 7.0 * PI),
        // A ring, either way round, and with a hole.
        ("points = [[2, 0], [3, 0], [3, 3], [2, 3]]", 15.0 * PI),
        ("points = [[2, 3], [3, 3], [3, 0], [2, 0]]", 15.0 * PI),
        (
            "points = [[2, 0], [5, 0], [5, 3], [2, 3]], \
             holes = [[[3, 1], [4, 1], [4, 2], [3, 2]]]",
            63.0 * PI - 7.0 * PI,
        ),
        // A bead: a rhombus of area 2 whose centroid is at 3.
        ("points = [[2, 0], [3, -1], [4, 0], [3, 1]]", 12.0 * PI),
        // Edges that cross: two triangles of area 1, with centroids at 1 + 1/3 and 1 + 5/3.
        ("points = [[1, 0], [3, 2], [3, 0], [1, 2]]", 8.0 * PI),
    ] {
        let scene = loaded(fields).unwrap_or_else(|e| panic!("{fields}: {e}"));
        let found = volume_of(&scene, fields);
        let off = (found - expected).abs() / expected;
        assert!(off < NEAR, "{fields}: {found}, not {expected}");
    }
}

#[test]
fn outlines_that_sweep_nothing_are_refused() {
    for (fields, message) in [
        (
            "points = [[1, 0], [2, 0]]",
            "an outline of 2 points encloses nothing",
        ),
        (
            "points = [[1, 0], [2, 0], [-1, 3]]",
            "a point of a lathe is [-1, 3]; give [distance from the y axis, y]",
        ),
        (
            "points = [[1, 0], [2, 0], [inf, 1]]",
            "inf is not a finite number",
        ),
        ("points = [[1, 0], [2, 0], [3, 0]]", "sweeps nothing"),
        ("points = [[0, 0], [0, 1], [0, 3]]", "sweeps nothing"),
        (
            "points = [[1, 0], [2, 0], [3, 1]], angle = 90",
            "unknown key 'angle'",
        ),
    ] {
        let error = loaded(fields).expect_err(fields);
        assert!(error.contains(message), "{fields}: {error}");
        assert!(error.starts_with("scene.toml:3:"), "{fields}: {error}");
    }
}
