//! Export of level sets as POV-Ray's isosurfaces.

use super::{PovError, number, vector};
use crate::geom::formula::{Binary, Formula, Step, value_and_gradient};
use crate::geom::{Clip, LevelSet};
use crate::math::Aabb;
use glam::DVec3;

/// Limit on the bytes of a formula, whose shared steps are written out at each use.
const LONGEST: usize = 1 << 16;

/// The number of points along each axis at which the gradient is sampled, and the factor by
/// which the formula may be steeper between them than at the steepest one.
const POINTS: usize = 24;
const STEEPER: f64 = 1.5;

/// Writes an isosurface. POV-Ray's search needs a bound on the gradient, which is estimated
/// from samples. Fails for a solid without end and for a formula that is too long.
pub(super) fn level_set(row: &LevelSet, name: impl FnOnce() -> String) -> Result<String, PovError> {
    if row.is_below_beyond && !row.open {
        return Err(PovError::Endless { name: name() });
    }
    let Some(function) = written(row.formula) else {
        return Err(PovError::LongFormula { name: name() });
    };
    let region = row.region.unwrap_or(Aabb::new(DVec3::ZERO, DVec3::ZERO));
    let container = match row.ends() {
        Some(Clip::Sphere(s)) => format!("sphere {{ {}, {} }}", vector(s.center), number(s.radius)),
        _ => format!("box {{ {}, {} }}", vector(region.min), vector(region.max)),
    };
    let open = if row.open { "  open\n" } else { "" };
    let steepest = number(steepest(row.formula, &region));
    Ok(format!(
        "isosurface {{\n  function {{ {function} }}\n  contained_by {{ {container} }}\n  \
         accuracy 1e-7 max_gradient {steepest}\n  all_intersections\n{open}}}"
    ))
}

/// Estimates the greatest length of the gradient in a region from samples.
fn steepest(formula: &Formula, region: &Aabb) -> f64 {
    let mut most = 0.0;
    for i in 0..POINTS * POINTS * POINTS {
        let place = [i % POINTS, i / POINTS % POINTS, i / (POINTS * POINTS)];
        let part = DVec3::from_array(place.map(|k| k as f64 / (POINTS - 1) as f64));
        let at = region.min + region.extent() * part;
        let (_, slope) = value_and_gradient(formula, at.to_array());
        let slope = DVec3::from_array(slope).length();
        if slope.is_finite() {
            most = f64::max(most, slope);
        }
    }
    // POV-Ray needs a positive bound, so a function that is flat at all samples gets 1.
    if most > 0.0 { most * STEEPER } else { 1.0 }
}

/// Writes a formula as a function of POV-Ray; `None` if it is too long.
fn written(formula: &Formula) -> Option<String> {
    let mut all: Vec<String> = Vec::new();
    for step in formula.steps() {
        let of = |i: u32| &all[i as usize];
        let text = match *step {
            Step::Coordinate(axis) => ["x", "y", "z"][usize::from(axis)].into(),
            Step::Constant(value) => format!("({})", number(value)),
            Step::Power(a, exponent) => format!("pow({}, {exponent})", of(a)),
            Step::Unary(function, a) => format!("{}({})", function.name(), of(a)),
            Step::Binary(operator, a, b) => {
                let (a, b) = (of(a), of(b));
                match operator {
                    Binary::Sum => format!("({a} + {b})"),
                    Binary::Difference => format!("({a} - {b})"),
                    Binary::Product => format!("{a} * {b}"),
                    Binary::Quotient => format!("({a} / ({b}))"),
                    Binary::Min => format!("min({a}, {b})"),
                    Binary::Max => format!("max({a}, {b})"),
                }
            }
        };
        if text.len() > LONGEST {
            return None;
        }
        all.push(text);
    }
    all.pop()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::formula::{Builder, Unary};

    #[test]
    fn formulas_are_written_as_pov_ray_reads_them() {
        let mut b = Builder::default();
        let [x, y] = [0, 1].map(|axis| b.coordinate(axis));
        let sine = b.unary(Unary::Sin, x);
        let product = b.binary(Binary::Product, sine, y);
        let minus = b.constant(-2.5);
        let sum = b.binary(Binary::Sum, product, minus);
        let square = b.power(sum, 2);
        let quotient = b.binary(Binary::Quotient, square, product);
        let text = "(pow((sin(x) * y + (-2.5)), 2) / (sin(x) * y))";
        assert_eq!(written(&b.finish(quotient)).as_deref(), Some(text));
    }
}
