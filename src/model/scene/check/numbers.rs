//! Checks of single numbers.

use crate::scene::error::{Entity, SceneError};
use glam::DVec3;

/// Returns an error if one of several numbers is not finite.
pub(super) fn finite(
    what: impl FnOnce() -> Entity,
    field: &'static str,
    values: &[f64],
) -> Result<(), SceneError> {
    match values.iter().find(|v| !v.is_finite()) {
        None => Ok(()),
        Some(v) => Err(SceneError::NotFinite {
            what: what(),
            field,
            value: v.to_string(),
        }),
    }
}

/// Returns an error if a vector is not finite.
pub(super) fn finite3(
    what: impl FnOnce() -> Entity,
    field: &'static str,
    v: DVec3,
) -> Result<(), SceneError> {
    finite(what, field, &v.to_array())
}

/// Returns the number that a number of f32 is written as.
pub(super) fn decimal(x: f32) -> f64 {
    x.to_string().parse().unwrap_or(f64::from(x))
}

/// Returns an error unless `ok`; `must` says what the value must be.
pub(super) fn require(
    ok: bool,
    what: impl FnOnce() -> Entity,
    field: &'static str,
    value: f64,
    must: &'static str,
) -> Result<(), SceneError> {
    if ok {
        return Ok(());
    }
    Err(SceneError::OutOfRange {
        what: what(),
        field,
        value: value.to_string(),
        must,
    })
}
