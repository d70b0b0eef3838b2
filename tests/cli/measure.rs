//! `lanecast measure`: volumes, areas and centroids of solids.

use super::solids::{PART, probe, write};
use crate::run::{folder, lanecast, stderr, stdout};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn measure(folder: &Path, more: &[&str]) -> Value {
    write(folder, PART);
    measured(folder, more)
}

fn measured(folder: &Path, more: &[&str]) -> Value {
    let arguments = [&["measure", "a.toml", "--json", "-"], more].concat();
    let output = lanecast(folder, &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A ball of radius 1 under each of the transforms.
fn measured_balls(transforms: &[&str]) -> Value {
    let folder = folder();
    let mut scene: String =
        "format = 1\n[shape]\nball.sphere = { center = [0, 0, 0], radius = 1 }\n".into();
    for transform in transforms {
        scene += &format!("[[instance]]\nshape = 'ball'\ntransform = [{transform}]\n");
    }
    write(folder.path(), &scene);
    measured(folder.path(), &[])
}

/// Within three of its half widths, and these no wider than asked for.
pub fn is_measured(row: &Value, key: &str, value: f64, relative: f64) {
    let found = row[key].as_f64().unwrap();
    let error = row[format!("{key}_error")].as_f64().unwrap();
    assert!((found - value).abs() <= 3.0 * error, "{row}: {key} {value}");
    assert!(error <= relative * value, "{row}");
}

#[test]
fn measure_leaves_out_what_f64_has_no_figures_for() {
    let found = measured_balls(&[
        "{ scale = 1e160 }",
        "{ scale = 1e-130 }",
        "{ scale = 1e90 }",
    ]);
    assert_eq!(found["beyond_left_out"], 2, "{found}");
    let [ball] = found["solids"].as_array().unwrap().as_slice() else {
        panic!("{found}");
    };
    is_measured(ball, "volume", 4e270 / 3.0 * std::f64::consts::PI, 1e-3);
    let centroid = ball["centroid"].as_array().unwrap();
    assert!(centroid.iter().all(|x| x.as_f64().unwrap().abs() < 1e88));
}

#[test]
fn measure_gives_volumes_areas_and_centroids_of_the_roots() {
    use std::f64::consts::PI;
    let folder = folder();
    let found = measure(folder.path(), &[]);
    assert_eq!(found["surfaces_left_out"], 2);
    assert_eq!(found["unbounded_left_out"], 1);
    let [part, ball] = found["solids"].as_array().unwrap().as_slice() else {
        panic!("{found}");
    };
    assert_eq!(
        (&part["name"], &ball["name"]),
        (&"part".into(), &"ball".into())
    );
    // A bore of radius 1/2 through 2 of the block.
    is_measured(part, "volume", 24.0 - PI * 0.5, 1e-3);
    is_measured(part, "area", 56.0 - PI * 0.5 + 2.0 * PI, 1e-3);
    is_measured(ball, "volume", PI / 6.0, 1e-3);
    is_measured(ball, "area", PI, 1e-3);
    let centroid = |row: &Value, k: usize| row["centroid"][k].as_f64().unwrap();
    assert!((centroid(ball, 2) - 12.0).abs() < 1e-2, "{ball}");
    assert!((0..3).all(|k| centroid(part, k).abs() < 1e-2), "{part}");

    let found = measure(
        folder.path(),
        &["--per-shape", "--error", "2e-3", "--seed", "3"],
    );
    let [part, ball] = found["solids"].as_array().unwrap().as_slice() else {
        panic!("{found}");
    };
    is_measured(part, "volume", 24.0 - PI * 0.5, 2e-3);
    is_measured(ball, "area", 4.0 * PI, 2e-3);
}

/// What is measured once counts for all places, the first of which may be far away.
#[test]
fn measure_does_not_mind_where_a_solid_stands_first() {
    let found = measured_balls(&[
        "{ scale = [1, 2, 1] }, { translate = [1e17, 0, 0] }",
        "{ scale = [1, 2, 1] }, { translate = [0.3, 0, 0] }",
    ]);
    for (ball, x) in found["solids"].as_array().unwrap().iter().zip([1e17, 0.3]) {
        is_measured(ball, "volume", 8.0 / 3.0 * std::f64::consts::PI, 1e-3);
        let off = ball["centroid"][0].as_f64().unwrap() - x;
        assert!(off.abs() < 1e-2, "{ball}");
    }
}

#[test]
fn nothing_has_no_centroid() {
    let folder = folder();
    let text = "format = 1
[shape]
none.intersection = ['here', 'there']
here.sphere = { center = [0, 0, 0], radius = 1 }
there.sphere = { center = [9, 0, 0], radius = 1 }
[[instance]]
shape = 'none'
";
    write(folder.path(), text);
    let output = lanecast(folder.path(), &["measure", "a.toml", "--json", "-"]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["solids"][0]["volume"], 0.0);
    assert_eq!(found["solids"][0]["centroid"], Value::Null);
    let output = lanecast(folder.path(), &["measure", "a.toml"]);
    assert!(!stdout(&output).contains("NaN"), "{}", stdout(&output));
}

#[test]
fn measure_refuses_errors_that_cannot_be_reached() {
    let folder = folder();
    write(folder.path(), PART);
    let output = lanecast(folder.path(), &["measure", "a.toml", "--error", "0"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("1e-6 to 0.5"),
        "{}",
        stderr(&output)
    );
}

/// A tetrahedron, and three of its faces.
#[test]
fn closed_meshes_are_solids_and_others_are_not() {
    let folder = folder();
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    let faces = "f 1 3 2\nf 1 2 4\nf 1 4 3\n";
    let tetra = format!("{corners}{faces}f 2 3 4\n");
    fs::write(folder.path().join("tetra.obj"), tetra).unwrap();
    fs::write(folder.path().join("open.obj"), format!("{corners}{faces}")).unwrap();
    let text = "format = 1
[material.red]
[shape]
tetra.mesh = 'tetra.obj'
open.mesh = 'open.obj'
part.difference = [{ shape = 'tetra', material = 'red' }, 'half']
half.half_space = { normal = [0, 0, 1], offset = 0.5 }
[[instance]]
shape = 'tetra'
[[instance]]
shape = 'open'
[[instance]]
shape = 'part'
transform = [{ translate = [5, 0, 0] }]
";
    let found = probe(folder.path(), text, "0.25,0.25,-1", "0,0,1");
    assert_eq!(found["surfaces_left_out"], 1);
    let [span] = found["spans"].as_array().unwrap().as_slice() else {
        panic!("{found}");
    };
    assert_eq!(
        (span["t_enter"].as_f64(), span["t_exit"].as_f64()),
        (Some(1.0), Some(1.5))
    );
    assert_eq!(span["exit"]["shape"], "tetra");
    let normal = &span["exit"]["normal"];
    assert!(
        (normal[2].as_f64().unwrap() - 1.0 / 3.0_f64.sqrt()).abs() < 1e-12,
        "{span}"
    );
    let found = probe(folder.path(), text, "5.125,0.125,9", "0,0,-1");
    let [span] = found["spans"].as_array().unwrap().as_slice() else {
        panic!("{found}");
    };
    assert_eq!(
        (span["t_enter"].as_f64(), span["t_exit"].as_f64()),
        (Some(8.25), Some(8.5))
    );
    assert_eq!(span["enter"]["material"], "red");
    assert_eq!(span["exit"]["shape"], "half");
    assert_eq!(span["exit"]["normal"][2], -1.0);

    let output = lanecast(folder.path(), &["measure", "a.toml", "--json", "-"]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["meshes_left_out"], 1);
    let [tetra, part] = found["solids"].as_array().unwrap().as_slice() else {
        panic!("{found}");
    };
    let root3 = 3.0_f64.sqrt();
    is_measured(tetra, "volume", 1.0 / 6.0, 1e-3);
    is_measured(tetra, "area", 1.5 + root3 / 2.0, 1e-3);
    is_measured(part, "volume", 1.0 / 48.0, 1e-3);
    is_measured(part, "area", (1.5 + root3 / 2.0) / 4.0, 1e-3);
}

/// A box, a cylinder on its side and a mesh: figures with methods, errors, boxes, and the
/// inertia of a density.
#[test]
fn formulas_give_mass_and_inertia() {
    let folder = folder();
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    let tetra = format!("{corners}f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    fs::write(folder.path().join("tetra.obj"), tetra).unwrap();
    let text = "format = 1
[shape]
block.box = { min = [0, 0, 0], max = [2, 3, 4] }
rod.cylinder = { base = [0, -1, 0], top = [0, 1, 0], radius = 0.5 }
tetra.mesh = 'tetra.obj'
[[instance]]
shape = 'block'
transform = [{ rotate_z = 90 }, { translate = [10, 0, 0] }]
[[instance]]
shape = 'rod'
transform = [{ scale = [2, 1, 1] }]
[[instance]]
shape = 'tetra'
";
    write(folder.path(), text);
    let found = measured(folder.path(), &["--density", "2"]);
    assert_eq!(found["density"], 2.0);
    let [block, rod, tetra] = found["solids"].as_array().unwrap().as_slice() else {
        panic!("{found}");
    };
    let near = |value: &Value, wanted: f64| {
        let off = (value.as_f64().unwrap() - wanted).abs();
        assert!(off <= 1e-12 * wanted.abs().max(1.0), "{value} {wanted}");
    };
    near(&block["volume"], 24.0);
    near(&block["mass"]["mass"], 48.0);
    // Turned: 3 along x, 2 along y.
    for (k, wanted) in [(0, 4.0 + 16.0), (1, 9.0 + 16.0), (2, 9.0 + 4.0)] {
        near(&block["mass"]["inertia"][k][k], 48.0 / 12.0 * wanted);
        near(&block["mass"]["inertia"][k][(k + 1) % 3], 0.0);
    }
    for (k, (low, high)) in [(7.0, 10.0), (0.0, 2.0), (0.0, 4.0)]
        .into_iter()
        .enumerate()
    {
        near(&block["bounds"]["min"][k], low);
        near(&block["bounds"]["max"][k], high);
    }
    assert_eq!(block["bounds"]["is_tight"], true);
    let pi = std::f64::consts::PI;
    near(&rod["volume"], pi);
    // An ellipse's girth by Ramanujan's second formula, which is off by 1e-8 here.
    let (a, b) = (1.0, 0.5_f64);
    let h = ((a - b) / (a + b)).powi(2);
    let girth = pi * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
    let area = rod["area"].as_f64().unwrap();
    assert!((area - (2.0 * girth + pi)).abs() < 1e-4, "{rod}");
    assert_eq!(
        (&rod["method"], &rod["area_method"]),
        (&"closed_form".into(), &"closed_form".into())
    );
    near(&tetra["volume"], 1.0 / 6.0);
    near(&tetra["centroid"][1], 0.25);
    // ∫x² − V/16 over it is 1/60 − 1/96 = 1/160; of y and z as well.
    near(&tetra["mass"]["inertia"][0][0], 2.0 * 2.0 / 160.0);
    assert_eq!(tetra["method"], "divergence");
    let output = lanecast(folder.path(), &["measure", "a.toml", "--density", "0"]);
    assert_eq!(output.status.code(), Some(2));
}

/// The table keeps its columns, and its program.
#[test]
fn names_of_any_length_are_printed() {
    let folder = folder();
    let name = "n".repeat(1 << 16);
    let text = format!(
        "format = 1\n[shape.{name}]\nsphere = {{ center = [0, 0, 0], radius = 1 }}\n[[instance]]\nshape = '{name}'\n"
    );
    write(folder.path(), &text);
    let output = lanecast(folder.path(), &["measure", "a.toml"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let text = stdout(&output);
    assert!(
        text.contains("nnn…") && text.len() < 2000,
        "{} bytes",
        text.len()
    );
    let found = measured(folder.path(), &[]);
    assert_eq!(found["solids"][0]["name"], name);
}

/// The limit leaves rough figures, or none that are counted; never a wait.
#[test]
fn a_time_limit_ends_what_takes_long() {
    let folder = folder();
    let text = "format = 1
[shape.foam]
implicit = 'sin(9*x)*cos(9*y) + sin(9*y)*cos(9*z) + sin(9*z)*cos(9*x)'
clip = { sphere = { center = [0, 0, 0], radius = 3 } }
[[instance]]
shape = 'foam'
";
    write(folder.path(), text);
    let start = std::time::Instant::now();
    let found = measured(folder.path(), &["--error", "1e-6", "--time-limit", "1"]);
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
    let rough = found["solids"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|row| row["is_rough"] == true);
    assert_eq!(
        rough.count() as u64 + found["late_left_out"].as_u64().unwrap(),
        1,
        "{found}"
    );
}

/// A bracket of 30 operands, by quadrature.
#[test]
fn csg_is_measured_by_quadrature() {
    let folder = folder();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/csg_bracket.toml");
    let arguments = [
        "measure",
        scene.to_str().unwrap(),
        "--json",
        "-",
        "--error",
        "1e-4",
    ];
    let output = lanecast(folder.path(), &arguments);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let row = &found["solids"][0];
    assert_eq!(
        (&row["method"], &row["is_rough"]),
        (&"quadrature".into(), &false.into()),
        "{row}"
    );
    // As --error 1e-6 gives them, from ten times as many lines.
    is_measured(row, "volume", 4.937_221_04, 1e-4);
    is_measured(row, "area", 33.994_309_6, 1e-4);
}
