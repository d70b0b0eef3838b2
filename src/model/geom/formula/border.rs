//! Finds faces at which a function changes its sign without being zero: its domain ends there, or
//! it jumps.
//!
//! The gradient of f does not give the normal of such a face. The responsible step does: the first
//! that has a value on one side only (a root whose operand goes below zero) or that passes
//! infinity (a quotient whose divisor passes zero, a tangent). Its operand is constant on the
//! face, so the operand's gradient is the face's normal (V10, docs/numerics/level-sets.md).

use super::{Binary, Dual, Formula, Sloped, Step, Unary, Values, value_and_gradient};

/// A crossing of such a face on a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Border {
    pub t: f64,
    /// The outward normal, of any length.
    pub normal: [f64; 3],
}

/// The number of roundings of coordinates and t within which the crossing is sought (V10,
/// docs/numerics/level-sets.md).
const BESIDE: f64 = 8.0;

/// Finds the face that a line crosses near t, a number rounded to `unit`. `None` if f is zero
/// there, if no step is responsible, or if the line does not cross it once.
pub fn border(
    formula: &Formula,
    (org, dir): ([f64; 3], [f64; 3]),
    t: f64,
    unit: f64,
) -> Option<Border> {
    let size = |v: [f64; 3]| v.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let near = BESIDE * unit * (t.abs() + size(org) / size(dir));
    let at = |t: f64| std::array::from_fn(|k| org[k] + dir[k] * t);
    let along = |slopes: [f64; 3]| -> f64 { slopes.iter().zip(dir).map(|(s, d)| s * d).sum() };
    let (mut from, mut to) = (t - near, t + near);
    let ends = [from, to].map(|t| value_and_gradient(formula, at(t)));
    let [begins, enters] = ends.map(|(value, _)| value < 0.0);
    if begins == enters {
        return None;
    }
    // Says whether f has the slope that a zero in between would give it.
    let goes = |slopes| match enters {
        true => along(slopes) < 0.0,
        false => along(slopes) > 0.0,
    };
    if ends
        .iter()
        .all(|(value, slopes)| value.is_finite() && goes(*slopes))
    {
        return None;
    }
    loop {
        let middle = from + (to - from) * 0.5;
        if !(from < middle && middle < to) {
            break;
        }
        let is_inside = value_and_gradient(formula, at(middle)).0 < 0.0;
        *(if is_inside == begins {
            &mut from
        } else {
            &mut to
        }) = middle;
    }
    let [before, after] = [from, to].map(|t| all(formula, at(t)));
    let last = [&before, &after].map(|kept| kept.last().copied());
    let is_zero =
        |end: Option<Sloped>| end.is_some_and(|end| end.value.is_finite() && goes(end.slopes));
    if last
        .iter()
        .all(|end| end.is_some_and(|end| end.value.is_finite()))
        && last.into_iter().any(is_zero)
    {
        return None;
    }
    let to_blame = |(i, step): (usize, &Step)| {
        let [a, b] = [before[i].value, after[i].value];
        match *step {
            Step::Unary(Unary::Tan, of) if a * b < -1.0 => Some(of),
            Step::Unary(_, of) if a.is_nan() != b.is_nan() => Some(of),
            Step::Binary(Binary::Quotient, _, of) => {
                let [a, b] = [&before, &after].map(|kept| kept[of as usize].value);
                (a * b <= 0.0 && a != b).then_some(of)
            }
            _ => None,
        }
    };
    let faces = formula.steps().iter().enumerate().filter_map(to_blame);
    let normals = faces.flat_map(|of| [&before, &after].map(|kept| kept[of as usize].slopes));
    let mut known = normals.filter(|slopes| {
        let rate = along(*slopes);
        rate.is_finite() && rate != 0.0
    });
    let normal = known.next()?;
    let outward = (along(normal) < 0.0) == enters;
    Some(Border {
        t: from,
        normal: normal.map(|x| if outward { x } else { -x }),
    })
}

/// Returns every step's value and gradient.
fn all(formula: &Formula, p: [f64; 3]) -> Values<Sloped> {
    let at = std::array::from_fn(|axis| Dual::variable(p[axis], axis));
    let mut kept = formula.values();
    formula.evaluate(&at, &mut kept);
    kept
}
