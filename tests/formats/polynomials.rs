//! Polynomial surfaces of scene files: each tape has the values of the polynomial in the file.

use crate::common::{assets, in_repository};
use glam::DVec3;
use lanecast::internals::geom::tape::{Arithmetic, Step};
use lanecast::internals::geom::{Clip, Cuboid, Sphere, Tape};
use lanecast::internals::io::{LoadOptions, load, pov_text};
use lanecast::internals::scene::{CsgId, Instances, Operator, Scene, ShapeId};

fn scene_of(name: &str, text: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    let loaded = load(&path, &LoadOptions::default());
    loaded.unwrap_or_else(|e| panic!("{e}")).scene
}

/// The shape 'a'.
fn scene(shape: &str) -> Scene {
    let text = format!("format = 1\n[shape.a]\n{shape}\n[[instance]]\nshape = 'a'\n");
    scene_of("a.toml", &text)
}

/// A value, and what it would be if nothing cancelled.
struct Sizes([f64; 3]);

impl Arithmetic for Sizes {
    type Value = [f64; 2];

    fn coordinate(&self, axis: usize) -> [f64; 2] {
        [self.0[axis], self.0[axis].abs()]
    }

    fn constant(&self, value: f64) -> [f64; 2] {
        [value, value.abs()]
    }

    fn sum(&self, a: &[f64; 2], b: &[f64; 2]) -> [f64; 2] {
        [a[0] + b[0], a[1] + b[1]]
    }

    fn difference(&self, a: &[f64; 2], b: &[f64; 2]) -> [f64; 2] {
        [a[0] - b[0], a[1] + b[1]]
    }

    fn product(&self, a: &[f64; 2], b: &[f64; 2]) -> [f64; 2] {
        [a[0] * b[0], a[1] * b[1]]
    }
}

#[track_caller]
fn is_near(tape: &Tape, point: [f64; 3], expected: f64) {
    let [value, size] = tape.evaluate(&Sizes(point));
    let error = (value - expected).abs();
    assert!(error <= 1e-12 * size, "{value} for {expected} of {size}");
}

/// The two points at which kinds are looked at.
const POINTS: [[f64; 3]; 2] = [[0.75, -1.25, 0.5], [-2.125, 0.375, 1.5]];

#[test]
fn known_surfaces_have_their_known_values() {
    let Some(assets) = assets() else { return };
    let text = std::fs::read_to_string(assets.join("surfaces/surfaces.json")).unwrap();
    let file: serde_json::Value = serde_json::from_str(&text).unwrap();
    let surfaces = file["surfaces"].as_array().unwrap();
    assert!(surfaces.len() >= 20);
    for surface in surfaces {
        let formula = surface["formula"].as_str().unwrap();
        let scene = scene(&format!("implicit = '{formula}'"));
        let tape = &scene.implicits.tape[0];
        assert_eq!(
            u64::from(tape.degree()),
            surface["degree"].as_u64().unwrap()
        );
        println!("{}: {} steps", surface["name"], tape.steps().len());
        for check in surface["check_values"].as_array().unwrap() {
            let number = |value: &serde_json::Value| value.as_f64().unwrap();
            let point = [0, 1, 2].map(|k| number(&check["p"][k]));
            let expected = check["f"].as_str().unwrap().parse().unwrap();
            is_near(tape, point, expected);
        }
    }
}

#[test]
fn a_torus_is_that_of_its_own_numbers() {
    // Neither has an exact square.
    let scene = scene("torus = { major = 1.1, minor = 0.3 }");
    let row = (scene.implicits.open[0], scene.implicits.clip[0]);
    assert_eq!(row, (false, None));
    let tape = &scene.implicits.tape[0];
    let constants = tape.steps().iter().filter_map(Step::constant);
    // Two of them squared.
    assert_eq!(constants.collect::<Vec<_>>(), [1.1, 1.1, 0.3, 0.3, 4.0]);
    assert_eq!(tape.degree(), 4);
    for [x, y, z] in POINTS {
        let ring: f64 = x * x + y * y + z * z + 1.1 * 1.1 - 0.3 * 0.3;
        let expected = ring.powi(2) - 4.0 * 1.1 * 1.1 * (x * x + z * z);
        is_near(tape, [x, y, z], expected);
    }
    // About y: the tube's innermost point.
    assert!(tape.evaluate(&Sizes([0.0, 0.0, 0.8]))[0].abs() < 1e-15);
}

#[test]
fn a_superquadric_has_its_radii() {
    let scene = scene("superquadric = { radii = [2, 0.5, 1], exponents = [2, 4, 8] }");
    let tape = &scene.implicits.tape[0];
    assert_eq!(tape.degree(), 8);
    for [x, y, z] in POINTS {
        let expected = (x / 2.0).powi(2) + (y / 0.5).powi(4) + z.powi(8) - 1.0;
        is_near(tape, [x, y, z], expected);
    }
    for corner in [[2.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, -1.0]] {
        assert_eq!(tape.evaluate(&Sizes(corner))[0], 0.0);
    }
}

/// Terms of a degree in POV-Ray's order.
fn powers(degree: i32) -> Vec<[i32; 3]> {
    let down = |from: i32| (0..=from).rev();
    down(degree)
        .flat_map(|i| {
            down(degree - i).flat_map(move |j| down(degree - i - j).map(move |k| [i, j, k]))
        })
        .collect()
}

#[test]
fn coefficients_stand_in_the_order_of_the_document() {
    for (kind, degree, count) in [("cubic", 3, 20), ("quartic", 4, 35)] {
        let powers = powers(degree);
        assert_eq!(powers.len(), count);
        // One at a time, and all at once.
        let value = |at: usize, only: Option<usize>| match only {
            Some(one) if one != at => 0,
            _ => 7 * at as i32 % 11 - 5,
        };
        for only in (0..count - 1).map(Some).chain([None]) {
            let numbers: Vec<_> = (0..count).map(|at| value(at, only)).collect();
            if numbers.iter().all(|number| *number == 0) {
                continue;
            }
            let scene = scene(&format!("{kind} = {{ coefficients = {numbers:?} }}"));
            for [x, y, z] in POINTS {
                let term = |(p, number): (&[i32; 3], &i32)| {
                    f64::from(*number) * x.powi(p[0]) * y.powi(p[1]) * z.powi(p[2])
                };
                let expected = powers.iter().zip(&numbers).map(term).sum();
                is_near(&scene.implicits.tape[0], [x, y, z], expected);
            }
        }
    }
    // What the document lists.
    let name = |p: &[i32; 3]| {
        let mut name = String::new();
        for (axis, power) in ["x", "y", "z"].iter().zip(p) {
            match power {
                0 => {}
                1 => name += axis,
                power => name += &format!("{axis}{}", ['²', '³', '⁴'][*power as usize - 2]),
            }
        }
        if name.is_empty() { "1".into() } else { name }
    };
    let path = in_repository("docs/SCENE_FORMAT.md");
    let document = std::fs::read_to_string(path).unwrap();
    let document = document.split_whitespace().collect::<Vec<_>>().join(" ");
    for degree in [3, 4] {
        let names: Vec<String> = powers(degree).iter().map(name).collect();
        assert!(document.contains(&names.join(", ")), "{names:?}");
    }
}

#[test]
fn parameters_are_constants() {
    let scene = scene(
        "implicit = 'a*x^2 + b*y^2 - k^2*z + tenth*3*z^3'\n\
         parameters = { a = 2, b = 1.5, k = 'sqrt(2)/2', tenth = 0.1 }",
    );
    for [x, y, z] in POINTS {
        let expected = 2.0 * x * x + 1.5 * y * y - 0.5 * z + 0.3 * z.powi(3);
        is_near(&scene.implicits.tape[0], [x, y, z], expected);
    }
    let has = |value: f64| {
        let steps = scene.implicits.tape[0].steps();
        steps.iter().any(|step| step.constant() == Some(value))
    };
    // A tenth as written, times three, is the f64 0.3; the square is a half.
    assert!(has(0.3) && has(0.5) && has(1.5));
    // The same from JSON.
    let json = r#"{ "format": 1, "instance": [{ "shape": "a" }], "shape": { "a": {
        "implicit": "a*x^2 + b*y^2 - k^2*z + tenth*3*z^3",
        "parameters": { "a": 2, "b": 1.5, "k": "sqrt(2)/2", "tenth": 0.1 } } } }"#;
    assert_eq!(
        scene_of("a.json", json).implicits.tape,
        scene.implicits.tape
    );
}

#[test]
fn an_open_surface_keeps_its_clip() {
    let ball = Clip::Sphere(Sphere {
        center: DVec3::new(1.0, 2.0, 3.0),
        radius: 4.0,
    });
    let cuboid = Clip::Cuboid(Cuboid {
        min: DVec3::new(-1.0, -2.0, -3.0),
        max: DVec3::ONE,
    });
    let cubic = format!("cubic.coefficients = [{}]", vec!["1"; 20].join(", "));
    for (kind, clip, expected) in [
        (
            "implicit = 'x*y*z'",
            "clip.sphere = { center = [1, 2, 3], radius = 4 }",
            Some(ball),
        ),
        (
            "torus = { major = 1, minor = 2 }",
            "clip = { box = { min = [-1, -2, -3], max = [1, 1, 1] } }",
            Some(cuboid),
        ),
        (&cubic, "", None),
    ] {
        let scene = scene(&format!("{kind}\n{clip}\nopen = true"));
        assert_eq!(scene.shapes.rows.len(), 1);
        assert_eq!(
            (scene.implicits.open[0], scene.implicits.clip[0]),
            (true, expected)
        );
    }
}

#[test]
fn a_clipped_solid_is_an_intersection() {
    let scene = scene(
        "implicit = 'z - x*y'\nclip.sphere = { center = [0, 1, 0], radius = 2 }\n\
         [shape.b]\ntorus = { major = 1, minor = 0.25 }\nopen = false\n\
         clip.box = { min = [-2, -1, 0], max = [2, 1, 2] }\n\
         [shape.c]\nunion = ['a', 'b']",
    );
    let kinds: Vec<&str> = scene.shapes.rows.iter().map(|s| s.kind_name()).collect();
    let of = |last| ["implicit", last, "CSG solid"];
    let expected = [of("sphere"), of("box")].concat();
    assert_eq!(kinds, [&expected[..], &["CSG solid"]].concat());
    let names: Vec<_> = (0..7).map(|row| scene.shapes.names.get(row)).collect();
    let expected = [None, None, Some("a"), None, None, Some("b"), Some("c")];
    assert_eq!(names, expected);
    for row in [0, 1] {
        let operator = scene.csg.operator[row as usize];
        assert_eq!(operator, Operator::Intersection);
        let operands = scene.csg.operands(CsgId(row)).iter();
        let shapes: Vec<ShapeId> = operands.map(|operand| operand.shape).collect();
        assert_eq!(shapes, [ShapeId(3 * row), ShapeId(3 * row + 1)]);
    }
    assert_eq!(scene.implicits.open, [false, false]);
    assert_eq!(scene.implicits.clip, [None, None]);
}

#[test]
fn povray_gets_every_coefficient() {
    let text = |shape: &str| {
        let scene = scene(shape);
        let instances = Instances::of(&scene).unwrap();
        let (scene, camera) = scene.completed(None, &instances, 1.0);
        pov_text(&scene, &camera).unwrap()
    };
    for (shape, part) in [
        (
            "implicit = '(x - y/2)^2 - 3*z'\nopen = true\n\
             clip.sphere = { center = [0, 1, 0], radius = 2.5 }",
            "#declare Shape_0 = polynomial { 2,\n  xyz(2, 0, 0): 1,\n  xyz(1, 1, 0): -1,\n  \
             xyz(0, 2, 0): 0.25,\n  xyz(0, 0, 1): -3\n  sturm\n  \
             clipped_by { sphere { <0, 1, 0>, 2.5 } }\n  bounded_by { clipped_by }\n} // a\n",
        ),
        (
            "implicit = 'x + 2*y - 3'\nopen = true\nclip.box = { min = [0, 0, 0], max = [1, 2, 3] }",
            "polynomial { 2,\n  xyz(1, 0, 0): 1,\n  xyz(0, 1, 0): 2,\n  xyz(0, 0, 0): -3\n  sturm\n  \
             clipped_by { box { <0, 0, 0>, <1, 2, 3> } }\n",
        ),
        (
            "torus = { major = 2, minor = 1 }\nclip.box = { min = [0, -1, -3], max = [3, 1, 3] }",
            "#declare Shape_0 = polynomial { 4,\n  xyz(4, 0, 0): 1,\n  xyz(2, 2, 0): 2,\n  \
             xyz(2, 0, 2): 2,\n  xyz(2, 0, 0): -10,\n  xyz(0, 4, 0): 1,\n  xyz(0, 2, 2): 2,\n  \
             xyz(0, 2, 0): 6,\n  xyz(0, 0, 4): 1,\n  xyz(0, 0, 2): -10,\n  xyz(0, 0, 0): 9\n  sturm\n",
        ),
        (
            "torus = { major = 2, minor = 1 }\nclip.box = { min = [0, -1, -3], max = [3, 1, 3] }",
            "#declare Shape_2 = intersection {\n  object { Shape_0 }\n  object { Shape_1 }\n} // a\n",
        ),
    ] {
        let text = text(shape);
        assert!(text.contains(part), "{part}\nis not in\n{text}");
    }
}
