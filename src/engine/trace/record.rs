//! Records of traced rays with their answers, for `verify` to replay in the reference.
//!
//! They hold the same numbers that were traced.

/// Kind of a ray.
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

/// A traced ray and its answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracedRay {
    pub kind: RayKind,
    /// Row-major index of the pixel.
    pub pixel: u32,
    pub sample: u32,
    /// Number of bounces; 0 for camera rays.
    pub depth: u32,
    /// World space.
    pub org: [f64; 3],
    /// World space, not unit; t is in units of its length.
    pub dir: [f64; 3],
    /// Hits lie in 0 < t < t_max.
    pub t_max: f32,
    pub outcome: Outcome,
}

/// Answer of a closest-hit or any-hit query.
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
    /// Any-hit queries only: not blocked.
    Clear,
    /// Any-hit queries only.
    Blocked,
}
