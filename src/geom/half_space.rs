use glam::DVec3;

/// The solid n·x ≤ offset; unbounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Outward, any length > 0.
    pub normal: DVec3,
    pub offset: f64,
}
