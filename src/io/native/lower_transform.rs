//! Transforms of the file: steps are multiplied out, and repeated.

use super::lower::{Result, exactly_one, not_zero};
use super::rotate;
use super::schema;
use super::source_spans::At;
use super::tree::Source;
use crate::math::Affine;

/// The product of the steps, the first applied first.
pub(super) fn transform(source: &Source, steps: &[At<schema::Step>]) -> Result<Affine> {
    steps.iter().try_fold(Affine::IDENTITY, |before, row| {
        Ok(step(source, row, 1.0)?.then_after(&before))
    })
}

/// Returns the map of a step; of a translation or rotation, of one that goes `times` as far.
fn step(source: &Source, row: &At<schema::Step>, times: f64) -> Result<Affine> {
    let step = &row.value;
    let given = [
        ("translate", step.translate.is_some()),
        ("rotate_x", step.rotate_x.is_some()),
        ("rotate_y", step.rotate_y.is_some()),
        ("rotate_z", step.rotate_z.is_some()),
        ("rotate", step.rotate.is_some()),
        ("scale", step.scale.is_some()),
        ("matrix", step.matrix.is_some()),
    ];
    exactly_one(source, row.at, "a transform step", &given)?;
    if let Some(turn) = &step.rotate {
        let axis = not_zero(source, "axis", &turn.axis)?;
        return Ok(rotate::about(axis, turn.degrees * times));
    }
    let turns = [step.rotate_x, step.rotate_y, step.rotate_z];
    let turn = turns
        .into_iter()
        .enumerate()
        .find_map(|(k, d)| Some((k, d?)));
    let maps = [
        step.translate
            .map(|by| rotate::translation(by.map(|x| x * times))),
        step.scale.map(|s| rotate::scaling(s.0)),
        step.matrix.map(rotate::from_rows),
        turn.map(|(k, degrees)| rotate::about_axis(k, degrees * times)),
    ];
    Ok(maps
        .into_iter()
        .flatten()
        .next()
        .unwrap_or(Affine::IDENTITY))
}

/// Returns the powers of a transform of steps, from 0 to `count` - 1.
///
/// Where it is a single translation or rotation, power k goes k times as far, as if that were
/// written: a full turn closes. Otherwise power k is power ⌊k/2⌋ after power ⌈k/2⌉, in f64, so that
/// no power has the roundings of more than log₂ k products.
pub(super) fn powers(
    source: &Source,
    steps: &[At<schema::Step>],
    count: usize,
) -> Result<Vec<Affine>> {
    let one = transform(source, steps)?;
    let mut powers: Vec<Affine> = Vec::with_capacity(count);
    let single = steps
        .first()
        .filter(|row| steps.len() == 1 && row.value.scale.is_none() && row.value.matrix.is_none());
    for k in 0..count {
        let power = match (k, single) {
            (0, _) => Affine::IDENTITY,
            (1, _) => one,
            (_, Some(row)) => step(source, row, k as f64)?,
            _ => powers[k / 2].then_after(&powers[k.div_ceil(2)]),
        };
        powers.push(power);
    }
    Ok(powers)
}
