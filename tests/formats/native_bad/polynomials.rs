//! Faults of polynomial surfaces: expressions, parameters, kinds, clips.

use super::*;

/// The case stands on line 3.
fn case(kind: &str) -> String {
    format!("format = 1\n[shape.x]\n{kind}\n[[instance]]\nshape = 'x'\n")
}

#[test]
fn expressions() {
    all(&[
        (
            case("implicit = 'x^2 + y^2 - r^2'"),
            &["scene.toml:3:25: there is no parameter 'r'; define it as parameters = { r = … }"],
        ),
        (
            case("implicit = \"x^2 + radius\"\nparameters = { raduis = 1 }"),
            &["scene.toml:3:19: there is no parameter 'radius'; did you mean 'raduis'?"],
        ),
        (
            case("implicit = \"\"\"\nx^2\n + floor(y)\"\"\""),
            &["scene.toml:5:4: 'floor' is not supported; known are sqrt, abs, exp"],
        ),
        (
            case("implicit = \"\"\"x \\\n    + y \\\r\n  + z z\"\"\""),
            &["scene.toml:5:7: expected an operator or the end, found 'z'; a product"],
        ),
        (
            case("implicit = '''\r\nx +\r\n y)'''"),
            &["scene.toml:5:3: this parenthesis was never opened"],
        ),
        // Behind an escape the place is not known.
        (
            case("implicit = \"x +\\u0020y)\""),
            &["scene.toml:3:16: this parenthesis was never opened"],
        ),
        (
            case("implicit = ''"),
            &["scene.toml:3:13: expected a number, a name or a parenthesis, found the end"],
        ),
        (
            case("implicit = 3"),
            &["scene.toml:3:12: expected text in quotes, found a number"],
        ),
        (
            case("implicit = 'x^13*y^12'"),
            &["scene.toml:3:17: this product has degree 25; at most 24 is supported"],
        ),
        (
            case("implicit = '1 - 1/x'"),
            &[
                "scene.toml:2:8: implicit 'x' is degenerate: it is no polynomial, and no box is found \
               that holds all of its surface; give it a clip",
            ],
        ),
        (
            case("implicit = '2 - sqrt(4)'"),
            &["scene.toml:2:8: implicit 'x' is degenerate: its polynomial is the same number"],
        ),
        (
            case("implicit = '(x + y)^2 - x^2 - 2*x*y - y^2 - 1'"),
            &["implicit 'x' is degenerate: its polynomial is the same number"],
        ),
        (
            case("implicit = '(1e-300*x + y)^24 - (1e300*z - 1)^24'"),
            &["implicit 'x' is degenerate: its constants, multiplied out, are too large"],
        ),
        (
            case("implicit = 'x^4 - 1e308*y*z + z^4 - 1'"),
            &["implicit 'x' is degenerate: its constants, multiplied out, are too large"],
        ),
        (
            case("implicit = '1e-250*x^2 + 1e-250*y'"),
            &[
                "implicit 'x' is degenerate: its constants, multiplied out, are too large or too small",
            ],
        ),
    ]);
    let deep = case(&format!("implicit = '{}x'", "(".repeat(100_000)));
    check(
        "scene.toml",
        deep.as_bytes(),
        &["scene.toml:3:13: the expression is 100001 bytes long; at most 65536"],
    );
    check(
        "scene.json",
        b"{\"format\": 1, \"shape\": {\"x\":\n {\"implicit\": \"x + q\"}}}",
        &["scene.json:2:20: there is no parameter 'q'"],
    );
}

#[test]
fn parameters() {
    let with = |parameters: &str| case(&format!("implicit = 'x'\nparameters = {parameters}"));
    all(&[
        (
            with("{ x = 1 }"),
            &["scene.toml:4:16: 'x' has a meaning of its own; give the parameter another name"],
        ),
        (
            with("{ sqrt = 1 }"),
            &["scene.toml:4:16: 'sqrt' is a function"],
        ),
        (
            with("{ 'a b' = 1 }"),
            &["'a b' cannot stand in an expression"],
        ),
        (
            with("{ a = 'x + 1' }"),
            &["scene.toml:4:21: a parameter is a constant: it cannot have x, y or z"],
        ),
        (
            with("{ a = '1 + b' }"),
            &["scene.toml:4:25: 'b' is no number; a parameter cannot be made of others"],
        ),
        (
            with("{ a = 'sqrt(1 - 2)' }"),
            &["scene.toml:4:21: this is the square root of a negative number"],
        ),
        (
            with("{ a = inf }"),
            &["scene.toml:4:20: inf is not a finite number"],
        ),
        (
            with("{ a = [1] }"),
            &[
                "scene.toml:4:20:",
                "a number or a constant expression in quotes",
            ],
        ),
        (
            with("3"),
            &["scene.toml:4:14: expected a table, found a number"],
        ),
        (
            case("torus = { major = 2, minor = 1 }\nparameters = { a = 1 }"),
            &["scene.toml:4:14: a torus cannot have parameters; only an implicit can"],
        ),
    ]);
}

#[test]
fn kinds() {
    all(&[
        (
            case("torus = { major = 0, minor = 1 }"),
            &["scene.toml:3:19: major = 0; it must be greater than 0"],
        ),
        (
            case("torus = { major = 1, minor = -1 }"),
            &["scene.toml:3:30: minor = -1; it must be greater than 0"],
        ),
        (
            case("torus = { major = 1 }"),
            &["scene.toml:3:9: the key 'minor' is missing"],
        ),
        (
            case("torus = { major = 1e200, minor = 1e200 }\nimplicit = 'x'"),
            &["scene.toml:2:8: shape 'x' has torus and implicit at once"],
        ),
        (
            case("superquadric = { radii = [1, 0, 1], exponents = [2, 2, 2] }"),
            &["scene.toml:3:26: radii = 0; each must be greater than 0"],
        ),
        (
            case("superquadric = { radii = [1, 1, 1], exponents = [2, 3, 2] }"),
            &["scene.toml:3:49: exponents = 3; each must be an even whole number from 2 to 24"],
        ),
        (
            case("superquadric = { radii = [1, 1, 1], exponents = [2, 26, 2] }"),
            &["exponents = 26; each"],
        ),
        (
            case("superquadric = { radii = [1, 1, 1], exponents = [2, 2, 2.5] }"),
            &["exponents = 2.5; each"],
        ),
        (
            case("superquadric = { radii = [1, 1, 1e-20], exponents = [2, 2, 24] }"),
            &["radii = 1e-20; its power is no number, so use a greater one and a scale"],
        ),
        (
            case("cubic = { coefficients = [1, 2, 3] }"),
            &["scene.toml:3:26: expected 20 values, found 3"],
        ),
        (
            case(&format!("quartic = {{ coefficients = {:?} }}", [1; 36])),
            &["scene.toml:3:28: expected 35 values, found 36"],
        ),
        (
            case(&format!("quartic = {{ coefficients = {:?} }}", [0; 35])),
            &["implicit 'x' is degenerate: its polynomial is the same number everywhere"],
        ),
        (
            case("torsu = { major = 1, minor = 1 }"),
            &["unknown key 'torsu'; did you mean 'torus'?"],
        ),
    ]);
}

#[test]
fn clips() {
    for open in ["", "\nopen = true"] {
        let clip = |clip: &str| case(&format!("implicit = 'x'\nclip = {clip}{open}"));
        all(&[
            (
                clip("{}"),
                &["scene.toml:4:8: the clip is empty; give one of sphere, box"],
            ),
            (
                clip(
                    "{ sphere = { center = [0, 0, 0], radius = 1 }, box = { min = [0, 0, 0], max = [1, 1, 1] } }",
                ),
                &["scene.toml:4:8: the clip has sphere and box at once"],
            ),
            (
                clip("{ sphere = { center = [0, 0, 0], radius = 0 } }"),
                &["scene.toml:4:8: the clip's radius = 0; it must be greater than 0"],
            ),
            (
                clip("{ box = { min = [0, 0, 0], max = [1, 0, 1] } }"),
                &["scene.toml:4:8: the clip's min must be below its max on every axis"],
            ),
            (
                clip("{ cone = 1 }"),
                &["scene.toml:4:10: unknown key 'cone'; known are sphere, box"],
            ),
        ]);
    }
    all(&[
        (
            case(
                "sphere = { center = [0, 0, 0], radius = 1 }\nclip = { sphere = { center = [0, 0, 0], radius = 1 } }",
            ),
            &[
                "scene.toml:4:8: a sphere cannot have a clip; only a torus",
                "make an intersection",
            ],
        ),
        (
            case("ellipsoid = { center = [0, 0, 0], radii = [1, 1, 1] }\nopen = true"),
            &["scene.toml:4:8: an ellipsoid cannot be open; only a cylinder, cone, mesh, torus"],
        ),
        (
            case("implicit = 'x'\nmaterial = 'gold'"),
            &["scene.toml:4:12: an implicit cannot have a material of its own"],
        ),
        (
            case("complement = 'y'\n[shape.y]\nimplicit = 'x'\nopen = true"),
            &[
                "scene.toml:2:8: CSG solid 'x' has implicit 'y' as an operand",
                "leave out 'open'",
            ],
        ),
        // The rows of what comes after a clipped solid have their own places.
        (
            case(
                "implicit = 'x'\nclip = { sphere = { center = [0, 0, 0], radius = 1 } }\n[shape.y]\nsphere = { center = [0, 0, 0], radius = 0 }",
            ),
            &["scene.toml:5:8: sphere 'y' has radius = 0"],
        ),
    ]);
}
