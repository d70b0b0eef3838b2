//! Implicit surfaces of the file to tapes and formulas: expressions, and kinds that have
//! one.

use super::expression::{self, Fault, Parameters, Surface, constant};
use super::lower::exactly_one;
use super::lower_shape::one;
use super::schema::Shape;
use super::schema_polynomial::{self as schema, Coefficients, Parameter};
use super::source_spans::At;
use super::tree::Source;
use crate::LoadError;
use crate::geom::formula::Formula;
use crate::geom::implicit::torus;
use crate::geom::tape::{Builder, MAX_DEGREE};
use crate::geom::{Clip, Cuboid, Sphere, Tape};
use crate::roots::Solver;
use crate::scene::{Operand, Operator, SceneBuilder, ShapeId};
use crate::shared::rational::Rational;
use glam::DVec3;

type Result<T> = std::result::Result<T, LoadError>;

pub(super) const KINDS: [&str; 5] = ["torus", "superquadric", "cubic", "quartic", "implicit"];

/// What only polynomial surfaces have, and a few others, on a row of another kind.
pub(super) fn refuse_extras(source: &Source, kind: &str, row: &Shape) -> Result<()> {
    const ONLY: &str = "torus, superquadric, cubic, quartic or implicit can";
    let is_polynomial = KINDS.contains(&kind);
    if let Some(open) = &row.open
        && !is_polynomial
        && !matches!(kind, "cylinder" | "cone" | "mesh")
    {
        let message = format!(
            "{} cannot be open; only a cylinder, cone, mesh, {ONLY}",
            one(kind)
        );
        return Err(source.error(open.at, message));
    }
    if let Some(clip) = &row.clip
        && !is_polynomial
    {
        let message = format!(
            "{} cannot have a clip; only a {ONLY}. Of other solids make an intersection",
            one(kind)
        );
        return Err(source.error(clip.at, message));
    }
    if let Some(solver) = &row.solver
        && !is_polynomial
    {
        let message = format!("{} cannot have a solver; only a {ONLY}", one(kind));
        return Err(source.error(solver.at, message));
    }
    if let Some(parameters) = &row.parameters
        && kind != "implicit"
    {
        let message = format!("{} cannot have parameters; only an implicit can", one(kind));
        return Err(source.error(parameters.at, message));
    }
    Ok(())
}

/// A row of one of these kinds. A clipped solid is an intersection.
pub(super) fn polynomial(
    source: &Source,
    name: &str,
    row: &Shape,
    scene: &mut SceneBuilder,
) -> Result<ShapeId> {
    let tape = if let Some(torus) = &row.torus {
        positive(source, "major", &torus.major)?;
        positive(source, "minor", &torus.minor)?;
        torus::tape_of(torus.major.value, torus.minor.value)
    } else if let Some(superquadric) = &row.superquadric {
        of_superquadric(source, superquadric)?
    } else if let Some(cubic) = &row.cubic {
        of_coefficients(source, cubic, 3, 20)?
    } else if let Some(quartic) = &row.quartic {
        of_coefficients(source, quartic, 4, 35)?
    } else {
        match of_expression(source, row)? {
            Surface::Polynomial(tape) => tape,
            Surface::Formula(formula) => return level_set(source, name, row, formula, scene),
        }
    };
    let solver = row
        .solver
        .as_ref()
        .map(|solver| solver_of(source, solver, &tape));
    let solver = solver.transpose()?;
    let clip = row.clip.as_ref().map(|row| clip(source, row)).transpose()?;
    let open = row.open.as_ref().is_some_and(|open| open.value);
    let is_solid = clip.is_some() && !open;
    let (own, within) = if is_solid { ("", None) } else { (name, clip) };
    let shape = scene.implicit(own, tape, open, within);
    if let Some(solver) = solver {
        scene.set_solver(shape, solver);
    }
    Ok(match clip {
        Some(clip) if is_solid => clipped(name, shape, clip, scene),
        _ => shape,
    })
}

fn solver_of(source: &Source, solver: &At<Solver>, tape: &Tape) -> Result<Solver> {
    let (at, solver, degree) = (solver.at, solver.value, tape.degree());
    match solver.most() {
        Some(most) if degree as usize > most => {
            let message = format!(
                "this has degree {degree}, and the solver '{}' has formulas to degree {most}; \
                 choose auto or another",
                solver.name()
            );
            Err(source.error(at, message))
        }
        _ => Ok(solver),
    }
}

/// The same of what is no polynomial.
fn level_set(
    source: &Source,
    name: &str,
    row: &Shape,
    formula: Formula,
    scene: &mut SceneBuilder,
) -> Result<ShapeId> {
    if let Some(solver) = &row.solver {
        let message = "this implicit is no polynomial, and its zeros are found by intervals; \
                       leave out the solver";
        return Err(source.error(solver.at, message));
    }
    let clip = row.clip.as_ref().map(|row| clip(source, row)).transpose()?;
    let open = row.open.as_ref().is_some_and(|open| open.value);
    match clip {
        Some(clip) if !open => {
            let solid = scene.level_set("", formula, false, Some(clip));
            Ok(clipped(name, solid, clip, scene))
        }
        clip => Ok(scene.level_set(name, formula, open, clip)),
    }
}

fn clipped(name: &str, solid: ShapeId, clip: Clip, scene: &mut SceneBuilder) -> ShapeId {
    let within = match clip {
        Clip::Sphere(sphere) => scene.sphere("", sphere),
        Clip::Cuboid(cuboid) => scene.cuboid("", cuboid),
    };
    let operands = [solid, within].map(Operand::shape);
    scene.csg(name, Operator::Intersection, &operands)
}

fn clip(source: &Source, row: &At<schema::Clip>) -> Result<Clip> {
    let v = DVec3::from_array;
    let At { at, value } = row;
    let given = [
        ("sphere", value.sphere.is_some()),
        ("box", value.cuboid.is_some()),
    ];
    exactly_one(source, *at, "the clip", &given)?;
    let clip = match (&value.sphere, &value.cuboid) {
        (Some(s), _) if s.radius > 0.0 => Clip::Sphere(Sphere {
            center: v(s.center),
            radius: s.radius,
        }),
        (_, Some(s)) if v(s.min).cmplt(v(s.max)).all() => Clip::Cuboid(Cuboid {
            min: v(s.min),
            max: v(s.max),
        }),
        (Some(s), _) => {
            let message = format!(
                "the clip's radius = {}; it must be greater than 0",
                s.radius
            );
            return Err(source.error(*at, message));
        }
        _ => {
            let message = "the clip's min must be below its max on every axis";
            return Err(source.error(*at, message));
        }
    };
    Ok(clip)
}

fn positive(source: &Source, field: &str, number: &At<f64>) -> Result<()> {
    if number.value > 0.0 {
        return Ok(());
    }
    let message = format!("{field} = {}; it must be greater than 0", number.value);
    Err(source.error(number.at, message))
}

fn of_expression(source: &Source, row: &Shape) -> Result<Surface> {
    let mut parameters = Parameters::new();
    let given = row.parameters.iter().flat_map(|rows| &rows.value.0);
    for (name, parameter) in given {
        expression::check_name(&name.value).map_err(|message| source.error(name.at, message))?;
        let text = match &parameter.value {
            // As it is written: 0.1 is a tenth.
            Parameter::Number(number) => format!("{number:e}"),
            Parameter::Expression(text) => text.clone(),
        };
        let value = constant(&text).map_err(|fault| placed(source, parameter.at, &text, fault))?;
        parameters.insert(name.value.clone(), value);
    }
    // Of another kind there would be none, and that is no expression.
    let text = row.implicit.as_ref().map_or("", |text| &text.value);
    let at = row.implicit.as_ref().map_or(0, |text| text.at);
    expression::surface(text, &parameters).map_err(|fault| placed(source, at, text, fault))
}

fn placed(source: &Source, at: usize, text: &str, fault: Fault) -> LoadError {
    source.error(source.within(at, text, fault.at), fault.message)
}

/// x^p / a^p + y^q / b^q + z^r / c^r − 1; the three factors are rounded once.
fn of_superquadric(source: &Source, row: &schema::Superquadric) -> Result<Tape> {
    let (radii, exponents) = (&row.radii, &row.exponents);
    let mut b = Builder::default();
    let mut sum = b.constant(0.0);
    for axis in 0..3 {
        let (radius, exponent) = (radii.value[axis], exponents.value[axis]);
        if !(radius > 0.0) {
            let message = format!("radii = {radius}; each must be greater than 0");
            return Err(source.error(radii.at, message));
        }
        if !(2.0..=f64::from(MAX_DEGREE)).contains(&exponent) || exponent % 2.0 != 0.0 {
            let message = format!(
                "exponents = {exponent}; each must be an even whole number from 2 to {MAX_DEGREE}"
            );
            return Err(source.error(exponents.at, message));
        }
        let exponent = exponent as u32;
        let power = Rational::from_f64(radius).to_the(exponent);
        let factor = power.and_then(|power| Rational::whole(1).over(&power)?.rounded());
        let factor = factor.map_err(|_| {
            let message = format!(
                "radii = {radius:?}; its power is no number, so use {}",
                match radius > 1.0 {
                    true => "a smaller one and a scale",
                    false => "a greater one and a scale",
                }
            );
            source.error(radii.at, message)
        })?;
        let coordinate = b.coordinate(axis as u8);
        let power = b.power(coordinate, exponent);
        let factor = b.constant(factor);
        let term = b.product(factor, power);
        sum = b.sum(sum, term);
    }
    let one = b.constant(1.0);
    let last = b.difference(sum, one);
    Ok(b.finish(last))
}

/// Horner's rule in x, whose coefficients are polynomials in y and z, and so on.
fn of_coefficients(source: &Source, row: &Coefficients, degree: u32, count: usize) -> Result<Tape> {
    let At { at, value } = &row.coefficients;
    if value.len() != count {
        let message = format!("expected {count} values, found {}", value.len());
        return Err(source.error(*at, message));
    }
    let mut b = Builder::default();
    let [x, y, z] = [0, 1, 2].map(|axis| b.coordinate(axis));
    let mut rest = value.iter();
    let mut in_x = b.constant(0.0);
    // The next power of x leaves one degree more to y and z, that of y one more to z.
    for of_y in 0..=degree {
        let mut in_y = b.constant(0.0);
        for of_z in 0..=of_y {
            let mut in_z = b.constant(0.0);
            for coefficient in rest.by_ref().take(of_z as usize + 1) {
                let coefficient = b.constant(*coefficient);
                in_z = b.product(in_z, z);
                in_z = b.sum(in_z, coefficient);
            }
            in_y = b.product(in_y, y);
            in_y = b.sum(in_y, in_z);
        }
        in_x = b.product(in_x, x);
        in_x = b.sum(in_x, in_y);
    }
    Ok(b.finish(in_x))
}
