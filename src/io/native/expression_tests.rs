//! Tests of expressions: their steps, and their values against plain evaluation in f64.

use super::*;
use crate::geom::formula::value_and_gradient;
use crate::geom::tape::{Arithmetic, Step};
use proptest::prelude::*;

struct Plain([f64; 3]);

impl Arithmetic for Plain {
    type Value = f64;

    fn coordinate(&self, axis: usize) -> f64 {
        self.0[axis]
    }

    fn constant(&self, value: f64) -> f64 {
        value
    }

    fn sum(&self, a: &f64, b: &f64) -> f64 {
        a + b
    }

    fn difference(&self, a: &f64, b: &f64) -> f64 {
        a - b
    }

    fn product(&self, a: &f64, b: &f64) -> f64 {
        a * b
    }
}

fn tape(text: &str) -> Tape {
    let parameters = [("a", 3), ("long_name2", 5)];
    let parameters = parameters.map(|(name, value)| (name.into(), Rational::whole(value)));
    polynomial(text, &parameters.into()).unwrap_or_else(|fault| panic!("{text}: {fault:?}"))
}

fn value(text: &str) -> f64 {
    tape(text).evaluate(&Plain([2.0, 3.0, 5.0]))
}

fn constants(text: &str) -> Vec<f64> {
    let tape = tape(text);
    tape.steps().iter().filter_map(Step::constant).collect()
}

#[test]
fn operators_bind_as_in_books() {
    for (text, expected) in [
        ("x", 2.0),
        (" x+y*z ", 17.0),
        ("(x+y)*z", 25.0),
        ("x-y-z", -6.0),
        ("x - (y - z)", 4.0),
        ("-x^2", -4.0),
        ("(-x)^2", 4.0),
        ("--x", 2.0),
        ("+-+x", -2.0),
        ("2*-x", -4.0),
        ("x*-y^2*z", -90.0),
        ("-x*y+z", -1.0),
        ("x^2^3", 256.0),
        ("2^-1^2*x", 1.0),
        ("4^0.5*x + 2^-1", 4.5),
        ("x^0", 1.0),
        ("0^0", 1.0),
        ("2^3^2", 512.0),
        ("x^a", 8.0),
        ("x^(a - 1)", 4.0),
        ("x/2/4", 0.25),
        ("x/2*4", 4.0),
        ("12*x/a", 8.0),
        ("x - -y", 5.0),
        ("1e1*x + .5 + 5.", 25.5),
        ("1E+1*x", 20.0),
        ("long_name2*x", 10.0),
        ("sqrt(16)*x", 8.0),
        ("abs(-3)*abs(3)*x", 18.0),
        ("((((x))))", 2.0),
        ("sqrt(1 + (1 + 1)*4)*x", 6.0),
        ("x*y\n\t- z", 1.0),
    ] {
        assert_eq!(value(text), expected, "{text}");
    }
}

#[test]
fn constants_are_one() {
    for (text, expected) in [
        ("x*(1/2 + sqrt(5)/2)^2", vec![2.618_033_988_749_895]),
        ("18561*x/6550", vec![18561.0 / 6550.0]),
        ("4*x^2*(1/2 + sqrt(5)/2)^2", vec![10.472_135_954_999_58]),
        ("9*y^2*z^3/80", vec![0.1125]),
        ("(2*x)^3*y/8", vec![]),
        ("0.1*x*3", vec![0.3]),
        ("2*pi*x", vec![std::f64::consts::TAU]),
        ("x^2 - 1 + y^2 - 1/2", vec![1.5]),
        ("x + 3 - a", vec![]),
        // Equal factors of a sum become one factor of the whole.
        ("-16*x^2 - 16*y^2", vec![-16.0]),
        ("16*x^2 - 16*y^2", vec![16.0]),
        ("2*x + 3*x", vec![5.0]),
        ("(sqrt(2)^2 - 2)*x + y", vec![]),
        // The negative of f is the step 0 − f.
        ("-x*y", vec![0.0]),
        ("x - x", vec![0.0]),
        ("2*x - (1 + 1)*x", vec![0.0]),
        ("0*x + 7", vec![7.0]),
        ("2*(x + 1)*3", vec![1.0, 6.0]),
    ] {
        assert_eq!(constants(text), expected, "{text}");
    }
}

#[test]
fn what_is_taken_away_is_a_difference() {
    for (text, products, constants) in [
        ("-x^2*z^3 + y", 4, 0),
        ("-x^2 - y^2 + z", 2, 0),
        ("z + -x", 0, 0),
        ("-2*x + y", 1, 1),
        ("-(x - y)*z", 1, 1),
    ] {
        let tape = tape(text);
        let count = |such: fn(&&Step) -> bool| tape.steps().iter().filter(such).count();
        let found = count(|step| matches!(step, Step::Product(..) | Step::Scaled(..)));
        assert_eq!(found, products, "{text}");
        let found = count(|step| step.constant().is_some());
        assert_eq!(found, constants, "{text}");
    }
}

#[test]
fn tapes_stay_factored() {
    assert_eq!(tape("(x+y)^24").steps().len(), 3 + 5);
    assert_eq!(tape("(x+y)^24").degree(), 24);
    // Equal squares share one step.
    let heart = tape("-x^2*z^3 - 9*y^2*z^3/80 + (x^2 + 9*y^2/4 + z^2 - 1)^3");
    assert_eq!((heart.steps().len(), heart.degree()), (19, 6));
}

#[test]
fn faults_have_a_place_and_a_remedy() {
    for (text, at, parts) in [
        (
            "",
            0,
            "expected a number, a name or a parenthesis, found the end",
        ),
        ("x +", 3, "found the end"),
        ("x + * y", 4, "found '*'"),
        ("x**2", 2, "found '*'; a power is written x^2"),
        (
            "x²",
            1,
            "expected an operator or the end, found '²'; a power is written x^2",
        ),
        ("2x", 1, "found 'x'; a product is written with *"),
        ("2(x)", 1, "found '('; a product is written with *"),
        ("x y", 2, "found 'y'; a product is written with *"),
        (
            "x = 1",
            2,
            "found '='; the surface is where the expression is 0",
        ),
        ("x, y", 1, "found ','; only min and max have several values"),
        ("(x", 0, "this parenthesis is never closed"),
        ("((x)", 0, "this parenthesis is never closed"),
        ("sqrt(2", 0, "this parenthesis is never closed"),
        ("x)", 1, "this parenthesis was never opened"),
        ("()", 1, "found ')'"),
        (
            "b*x",
            0,
            "there is no parameter 'b'; define it as parameters = { b = … }",
        ),
        (
            "long_name*x",
            0,
            "there is no parameter 'long_name'; did you mean 'long_name2'?",
        ),
        ("X", 0, "there is no parameter 'X'; did you mean 'x'?"),
        (
            "sqr(2)*x",
            0,
            "there is no function 'sqr'; did you mean 'sqrt'?",
        ),
        (
            "f(2)*x",
            0,
            "there is no function 'f'; known are sqrt, abs, exp, ln, sin",
        ),
        ("sqrt 2", 5, "expected '(' after sqrt, found '2'"),
        (
            "1 + floor(x)",
            4,
            "'floor' is not supported; known are sqrt",
        ),
        (
            "log(x)",
            0,
            "'log' is not supported; the natural logarithm is ln",
        ),
        (
            "pow(x, 2)",
            0,
            "'pow' is not supported; a power is written x^2",
        ),
        ("y*max(x)", 2, "expected two values or more here, found 1"),
        ("sin(x, y)", 0, "expected one value here, found 2"),
        (
            "min(x, (y, z))",
            9,
            "found ','; only min and max have several values",
        ),
        ("min(x, )", 7, "found ')'"),
        ("sin(x) + y^4097", 10, "this exponent is too large"),
        ("asin(2)*x", 0, "this function has no value"),
        ("exp(9999)*x", 0, "too large for a number"),
        ("sqrt(-2)", 0, "square root of a negative number"),
        ("x/(3 - a)", 1, "this divides by 0"),
        (
            "x^y",
            1,
            "an exponent must be a constant, without x, y and z",
        ),
        ("sin(x)/0", 6, "this divides by 0"),
        ("x^10^21", 1, "this exponent is too large"),
        (
            "x^25",
            1,
            "this power has degree 25; at most 24 is supported",
        ),
        ("x + (y^5)^5", 9, "this power has degree 25"),
        ("x^20*y^5", 4, "this product has degree 25"),
        ("x^99999999999", 1, "this exponent is too large"),
        ("2^9999*x", 1, "this exponent is too large"),
        ("10^999*x + y", 9, "too large for a number"),
        ("1e-999*x + y", 9, "too small for a number"),
        ("1e9999*x", 0, "too large for a number"),
        (".", 0, "a point without digits"),
        ("2e*x", 1, "found 'e'"),
        ("x $ y", 2, "found '$'"),
    ] {
        let parameters = [("a", 3), ("long_name2", 5)];
        let parameters = parameters.map(|(name, value)| (name.into(), Rational::whole(value)));
        match surface(text, &parameters.into()) {
            Ok(_) => panic!("{text} was read"),
            Err(fault) => {
                assert!(fault.message.contains(parts), "{text}: {fault:?}");
                assert_eq!(fault.at, at, "{text}: {fault:?}");
            }
        }
    }
}

/// Evaluates a formula at x = 2, y = 3, z = 5, with the parameter a = 3.
#[track_caller]
fn formula_value(text: &str) -> f64 {
    match surface(text, &[("a".into(), Rational::whole(3))].into()) {
        Ok(Surface::Formula(formula)) => value_and_gradient(&formula, [2.0, 3.0, 5.0]).0,
        other => panic!("{text}: {other:?}"),
    }
}

#[test]
fn what_is_no_polynomial_is_a_formula() {
    for (text, expected) in [
        ("sin(x)*cos(y)", libm::sin(2.0) * libm::cos(3.0)),
        ("1/x - y", -2.5),
        ("-exp(-x)", -libm::exp(-2.0)),
        ("sqrt(x^2 + 4*y)", 4.0),
        ("abs(x - z)", 3.0),
        ("min(z, x, y) + max(x, 2*a)", 8.0),
        ("min((x), max(y, z)) - min(1, a)", 1.0),
        ("x^-2", 0.25),
        ("(x + 2)^0.5", 2.0),
        ("z^2.5", libm::exp(2.5 * libm::log(5.0))),
        (
            "ln(x) + tan(y)*atan(z)",
            libm::log(2.0) + libm::tan(3.0) * libm::atan(5.0),
        ),
        ("x/y*z", 2.0 / 3.0 * 5.0),
        ("(x + y)/(z - 1)", 1.25),
    ] {
        let value = formula_value(text);
        assert!(
            (value - expected).abs() <= 1e-14 * expected.abs(),
            "{text}: {value} {expected}"
        );
    }
    // Functions of constants are constants, so these are polynomials, as are quotients by
    // constants.
    for text in [
        "sin(2)*x",
        "10^999*x/10^999",
        "x^2 + y^2/(1 + (a - 3)*z) - 1",
        "sqrt(1 + (a - 3)*z)*x",
        "x/3 + exp(1)",
        "2^0.5*y + min(3, 4)*x",
        "x^(a - 1)",
        "2^-1*x",
    ] {
        assert!(
            matches!(
                surface(text, &[("a".into(), Rational::whole(3))].into()),
                Ok(Surface::Polynomial(_))
            ),
            "{text}"
        );
    }
    assert_eq!(constants("sin(2)*x"), [libm::sin(2.0)]);
    assert_eq!(constants("min(1/3, 0.5)*x"), [1.0 / 3.0]);
}

#[test]
fn nothing_grows_without_end() {
    let refused = |text: &str, part: &str| {
        let fault = polynomial(text, &Parameters::new()).unwrap_err();
        assert!(fault.message.contains(part), "{fault:?}");
    };
    let deep = format!("{}x{}", "(".repeat(30_000), ")".repeat(30_000));
    assert_eq!(value(&deep), 2.0);
    refused(&"(".repeat(100_000), "100000 bytes long");
    refused(&"(".repeat(60_000), "found the end");
    refused(&"-".repeat(60_000), "found the end");
    refused(&format!("x{}", "^1".repeat(30_000) + "^"), "found the end");
    let power = format!("x{}", "^1".repeat(30_000));
    assert_eq!(value(&power), 2.0);
    let many: Vec<String> = (0..5000).map(|i| format!("x*{i}")).collect();
    assert_eq!(tape(&many.join("+")).steps().len(), 2, "one factor");
    let many: Vec<String> = (1..1600).map(|i| format!("(x+{i})*{i}")).collect();
    refused(&many.join("+"), "steps; at most 4096");
    let nested: Vec<String> = (2..100).map(|i| format!("{i}*x+y*(x+{i}*(")).collect();
    let nested = format!("{}x{}", nested.concat(), "))".repeat(98));
    refused(&nested, "degree 25");
    // Each factor and term waits for the next.
    let nested: Vec<String> = (2..100)
        .map(|i| format!("({i}*x+y)+3*(x+{i}*(z+"))
        .collect();
    let nested = format!("{}x{}", nested.concat(), "))".repeat(98));
    refused(&nested, "values at once; at most 64");
    let many: Vec<String> = (1..5000).map(|i| format!("sin({i}*x)")).collect();
    let fault = surface(&many.join("+"), &Parameters::new()).unwrap_err();
    assert!(fault.message.contains("steps; at most 4096"), "{fault:?}");
    // Each addition has operands of thousands of bits.
    let roots: Vec<String> = (2..6000).map(|i| format!("sqrt({i})")).collect();
    let sum = constants(&format!("x*({})", roots.join("+")));
    let plain: f64 = (2..6000).map(|i| f64::from(i).sqrt()).sum();
    assert!((sum[0] - plain).abs() < 1e-9 * plain);
}

#[test]
fn names_of_parameters() {
    for (name, part) in [
        ("x", "has a meaning of its own"),
        ("pi", "has a meaning of its own"),
        ("sqrt", "is a function"),
        ("max", "is a function"),
        ("floor", "is a function"),
        ("", "cannot stand in an expression"),
        ("2a", "cannot stand"),
        ("a b", "cannot stand"),
        ("a-b", "cannot stand"),
    ] {
        assert!(check_name(name).unwrap_err().contains(part), "{name}");
    }
    for name in ["a", "_", "R2", "φ", "max_radius", "xx", "e"] {
        assert_eq!(check_name(name), Ok(()));
    }
}

/// A random expression as a tree.
#[derive(Clone, Debug)]
enum Tree {
    Coordinate(u8),
    Number(i32, u32),
    Negated(Box<Tree>),
    Binary(char, Box<Tree>, Box<Tree>),
    Power(Box<Tree>, u32),
}

impl Tree {
    /// Writes the expression with the fewest parentheses, for a context that binds with the
    /// precedence `around`.
    fn text(&self, around: u32) -> String {
        let (own, text) = match self {
            Tree::Coordinate(axis) => (5, ["x", "y", "z"][usize::from(*axis)].to_string()),
            Tree::Number(n, scale) => (5, format!("{}e-{scale}", n.unsigned_abs())),
            Tree::Negated(a) => (3, format!("-{}", a.text(3))),
            Tree::Power(a, n) => (4, format!("{} ^{n}", a.text(5))),
            Tree::Binary(operator, a, b) => {
                let own = if "+-".contains(*operator) { 1 } else { 2 };
                let (a, b) = (a.text(own), b.text(own + 1));
                (own, format!("{a} {operator}{b}"))
            }
        };
        match own < around {
            true => format!("({text})"),
            false => text,
        }
    }

    /// Evaluates the expression, and the same with all signs positive.
    fn value(&self, point: [f64; 3]) -> [f64; 2] {
        match self {
            Tree::Coordinate(axis) => {
                let value = point[usize::from(*axis)];
                [value, value.abs()]
            }
            Tree::Number(n, scale) => [f64::from(n.unsigned_abs()) / 10_f64.powi(*scale as i32); 2],
            Tree::Negated(a) => {
                let [a, size] = a.value(point);
                [-a, size]
            }
            Tree::Power(a, n) => a.value(point).map(|a| a.powi(*n as i32)),
            Tree::Binary(operator, a, b) => {
                let ([a, r], [b, s]) = (a.value(point), b.value(point));
                match operator {
                    '+' => [a + b, r + s],
                    '-' => [a - b, r + s],
                    '*' => [a * b, r * s],
                    _ => [a / b, r / s],
                }
            }
        }
    }

    fn degree(&self) -> u32 {
        match self {
            Tree::Coordinate(_) => 1,
            Tree::Number(..) => 0,
            Tree::Negated(a) => a.degree(),
            Tree::Power(a, n) => a.degree() * n,
            Tree::Binary('*', a, b) => a.degree() + b.degree(),
            Tree::Binary(_, a, b) => a.degree().max(b.degree()),
        }
    }
}

fn trees() -> impl Strategy<Value = Tree> {
    let leaf = prop_oneof![
        3 => (0_u8..3).prop_map(Tree::Coordinate),
        2 => (1_i32..1000, 0_u32..4).prop_map(|(n, scale)| Tree::Number(n, scale)),
    ];
    leaf.prop_recursive(7, 60, 2, |inner| {
        let boxed = inner.clone().prop_map(Box::new);
        let divisor =
            (1_i32..1000, 0_u32..4).prop_map(|(n, scale)| Box::new(Tree::Number(n, scale)));
        prop_oneof![
            1 => boxed.clone().prop_map(Tree::Negated),
            1 => (boxed.clone(), 0_u32..4).prop_map(|(a, n)| Tree::Power(a, n)),
            1 => (boxed.clone(), divisor).prop_map(|(a, b)| Tree::Binary('/', a, b)),
            5 => (prop_oneof![Just('+'), Just('-'), Just('*')], boxed.clone(), boxed)
                .prop_map(|(operator, a, b)| Tree::Binary(operator, a, b)),
        ]
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn expressions_are_what_they_say(tree in trees(), point in [-3.0_f64..3.0, -3.0..3.0, -3.0..3.0]) {
        let text = tree.text(0);
        match polynomial(&text, &Parameters::new()) {
            Ok(tape) => {
                let [value, size] = tree.value(point);
                let found = tape.evaluate(&Plain(point));
                prop_assert!((found - value).abs() <= 1e-13 * size, "{text}: {found} {value}");
                prop_assert!(tape.degree() <= MAX_DEGREE);
            }
            Err(fault) => prop_assert!(tree.degree() > MAX_DEGREE, "{text}: {fault:?}"),
        }
    }
}
