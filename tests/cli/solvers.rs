//! The option `--solver` and solvers that a scene chooses for a shape, which only `fast` uses.

use super::solids::write;
use crate::run::{folder, lanecast, names, stderr, stdout};
use serde_json::Value;
use std::fs;
use std::path::Path;

const SOLVERS: [&str; 6] = [
    "halving",
    "newton",
    "sturm",
    "closed",
    "bracketed",
    "bernstein",
];

/// A ring, a part of one, and a ring with a bite; each with what stands for MORE.
const RINGS: &str = "format = 1
[camera]
eye = [0, 5, 5]
look_at = [0, 0, 0]
fov_y = 50
[shape]
ring = { torus = { major = 1, minor = 0.4 }, MORE }
spare = { torus = { major = 1, minor = 0.2 }, MORE }
half = { torus = { major = 1, minor = 0.4 }, open = true, clip.sphere = { center = [0, 0, 0.8], radius = 0.9 }, MORE }
bitten.difference = ['ring', { shape = 'ring', transform = [{ translate = [1, 0.1, 0] }] }]
[[instance]]
shape = 'ring'
[[instance]]
shape = 'half'
transform = [{ rotate_y = 30 }, { translate = [-2.5, 0, 0] }]
[[instance]]
shape = 'bitten'
transform = [{ rotate_x = 20 }, { translate = [2.2, 0, 0] }]
";

fn rings(folder: &Path, more: &str) {
    write(folder, &RINGS.replace(", MORE", more));
}

/// The picture, after so many arguments more.
fn rendered(folder: &Path, more: &[&str]) -> Vec<u8> {
    let arguments = ["render", "a.toml", "-o", "a.png", "--size", "64x48"];
    let output = lanecast(folder, &[&arguments, more].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let picture = image::open(folder.join("a.png")).unwrap().into_rgb8();
    fs::remove_file(folder.join("a.png")).unwrap();
    picture.into_raw()
}

fn unlike(a: &[u8], b: &[u8]) -> usize {
    let pixels = a.chunks(3).zip(b.chunks(3));
    pixels.filter(|(a, b)| a != b).count()
}

#[test]
fn every_solver_draws_nearly_the_same() {
    let folder = folder();
    rings(folder.path(), "");
    let fast = |more: &[&str]| rendered(folder.path(), &[&["--precision", "fast"], more].concat());
    let auto = fast(&[]);
    assert_eq!(fast(&["--solver", "auto"]), auto);
    for solver in SOLVERS {
        let own = fast(&["--solver", solver]);
        // Rays that nearly touch.
        let count = unlike(&own, &auto);
        assert!(count < 25, "{solver}: {count} pixels");
        assert_eq!(fast(&["--solver", solver, "--lanes", "1"]), own, "{solver}");
    }
}

#[test]
fn a_solver_of_a_shape_is_that_of_the_command_line() {
    let folder = folder();
    rings(folder.path(), "");
    let guarded = rendered(folder.path(), &[]);
    let newton = rendered(
        folder.path(),
        &["--precision", "fast", "--solver", "newton"],
    );
    rings(folder.path(), ", solver = 'newton'");
    assert_eq!(rendered(folder.path(), &["--precision", "fast"]), newton);
    // The other precisions do not depend on it.
    assert_eq!(rendered(folder.path(), &[]), guarded);
    for solver in SOLVERS {
        rings(folder.path(), &format!(", solver = '{solver}'"));
        let output = lanecast(folder.path(), &["plan", "a.toml"]);
        let says = format!("'half': the solver '{solver}'");
        assert!(stdout(&output).contains(&says), "{}", stdout(&output));
        // Nothing uses it.
        assert!(!stdout(&output).contains("'spare'"), "{}", stdout(&output));
    }
}

/// A double plane, which only some solvers know for one, before a single one.
const PLANES: &str = "format = 1
[camera]
eye = [0, 0, 5]
look_at = [0, 0, 0]
fov_y = 40
[shape]
planes = { implicit = '(z - 1)^2*(z + 1)', open = true, clip.box = { min = [-3, -3, -2], max = [3, 3, 2] } }
[[instance]]
shape = 'planes'
";

#[test]
fn verify_counts_what_a_solver_gets_wrong() {
    let folder = folder();
    write(folder.path(), PLANES);
    for (solver, misses) in [("halving", true), ("bernstein", true), ("sturm", false)] {
        let arguments = ["verify", "a.toml", "--size", "24x18", "--json", "-"];
        let output = lanecast(
            folder.path(),
            &[&arguments[..], &["--solver", solver]].concat(),
        );
        assert!(output.status.success(), "{}", stderr(&output));
        let report: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(report["plan"]["solvers"][0], solver);
        for mode in report["modes"].as_array().unwrap() {
            let kinds = ["wrong_hit", "wrong_id", "wrong_shadow"];
            let wrong = kinds.map(|kind| mode["replay"][kind].as_u64().unwrap());
            let expected = misses && mode["precision"] == "fast";
            let context = format!("{solver} {}: {wrong:?}", mode["precision"]);
            assert_eq!(wrong.iter().sum::<u64>() > 100, expected, "{context}");
        }
    }
}

#[test]
fn solvers_where_they_mean_nothing_are_refused() {
    let ring = "ring = { torus = { major = 1, minor = 0.4 } }";
    let cases = [
        (
            ring,
            "--solver=sturm",
            2,
            "--solver sturm is for --precision fast",
        ),
        (ring, "--solver=laguerre", 2, "halving"),
        (
            "ring = { torus = { major = 1, minor = 0.4 }, solver = 'laguerre' }",
            "--spp=1",
            3,
            "laguerre",
        ),
        (
            "ring = { sphere = { center = [0, 0, 0], radius = 1 }, solver = 'sturm' }",
            "--spp=1",
            3,
            "a sphere cannot have a solver",
        ),
        (
            "ring = { implicit = 'x^2 + y^2 + sin(z)^2 - 1', clip.sphere = { center = [0, 0, 0], radius = 4 }, solver = 'sturm' }",
            "--spp=1",
            3,
            "no polynomial",
        ),
        (
            "ring = { implicit = 'x^6 + y^6 + z^6 - 1', clip.sphere = { center = [0, 0, 0], radius = 1 }, solver = 'closed' }",
            "--spp=1",
            3,
            "a.toml:3",
        ),
    ];
    for (shape, option, code, says) in cases {
        let folder = folder();
        let text = format!("format = 1\n[shape]\n{shape}\n[[instance]]\nshape = 'ring'\n");
        write(folder.path(), &text);
        let arguments = ["render", "a.toml", "-o", "a.png", option];
        let output = lanecast(folder.path(), &arguments);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert!(said.contains(says), "{said}");
        assert_eq!(names(folder.path()), ["a.toml"]);
    }
}

#[test]
fn a_solver_without_a_formula_for_a_shape_names_it() {
    let folder = folder();
    let text = "format = 1\n[shape]\nring.implicit = 'x^6 + y^6 + z^6 - 1'\n[[instance]]\nshape = 'ring'\n";
    write(folder.path(), text);
    let arguments = [
        "render",
        "a.toml",
        "-o",
        "a.png",
        "--precision",
        "fast",
        "--solver",
        "closed",
    ];
    let output = lanecast(folder.path(), &arguments);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("implicit 'ring' has degree 6"), "{said}");
    assert_eq!(names(folder.path()), ["a.toml"]);
}
