//! Measurements: how wrong, how fast.

pub mod verify;
