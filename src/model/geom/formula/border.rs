//! Where a function changes its sign without being zero: its values end there, or jump.
//!
//! The gradient says nothing of that face. It is a face of the step that is to blame: of
//! the first that has a value on one side alone (the root of what goes below zero), or
//! that passes infinity (a quotient whose divisor passes zero, a tangent); and it lies
//! where the operand of that has one value, so that its gradient is the face's normal.

use super::{Binary, Dual, Formula, Sloped, Step, Unary, value_and_gradient};

/// On a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Border {
    pub t: f64,
    /// Outward, of any length.
    pub normal: [f64; 3],
}

/// Within so many roundings of the coordinates on the way the crossing is looked for.
const BESIDE: f64 = 8.0;

/// Of a line that crosses the border of f < 0 at t, a number rounded to `unit`. `None`: f is
/// zero there, or no step is to blame, or the line does not cross it once.
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
    // f goes where a zero between takes it.
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

/// Every step's value and gradient.
fn all(formula: &Formula, p: [f64; 3]) -> Vec<Sloped> {
    let at = std::array::from_fn(|axis| Dual::variable(p[axis], axis));
    let mut kept = Vec::new();
    formula.evaluate(&at, &mut kept);
    kept
}
