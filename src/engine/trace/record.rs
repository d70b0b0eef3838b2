//! What was asked and what was answered: one row per traced ray.
//!
//! `verify` replays these rows in the reference tracer. They hold the very
//! numbers that the fast path used.

/// Why a ray was traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayKind {
    Primary,
    /// Towards the light of this number.
    Shadow {
        light: u32,
    },
    Reflection,
    Refraction,
}

/// A ray, and what the fast path said about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracedRay {
    pub kind: RayKind,
    /// Pixel row-major index, sample number, and bounce (0 = camera ray).
    pub pixel: u32,
    pub sample: u32,
    pub depth: u32,
    /// World space.
    pub org: [f64; 3],
    /// World space, not unit; t counts in its length.
    pub dir: [f32; 3],
    /// Hits count where 0 < t < t_max.
    pub t_max: f32,
    pub outcome: Outcome,
}

/// The answer of a closest-hit or any-hit query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    Miss,
    Hit {
        t: f64,
        /// Id of one of [`Instances`](crate::scene::Instances).
        instance: u64,
        /// Triangle of a mesh, in source order; surface of a CSG solid, by number, and
        /// [`TURNED`](super::TURNED); 0 for other shapes.
        primitive: u32,
        /// Geometric normal, world space, unit, on the outer side.
        normal: [f64; 3],
    },
    /// Any-hit queries only.
    Clear,
    Blocked,
}
