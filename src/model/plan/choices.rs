//! What a user may ask for, with the names that the command line uses.

use super::Accel;

/// A user's choices; what is not asked for is left to the plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Choices {
    pub precision: Precision,
    pub lanes: LaneCount,
    /// The structure; `None` lets the plan choose.
    pub accel: Option<Accel>,
}

/// What an answer is certain of (docs/SPEC.md, S55 to S57).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// f32 lanes without error bounds.
    Fast,
    /// f32 lanes with error bounds; undecided lanes are decided exactly.
    #[default]
    Guarded,
    /// The decisions of `Guarded`, with each t refined to the nearest f64.
    Exact,
}

impl Precision {
    /// The name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Precision::Fast => "fast",
            Precision::Guarded => "guarded",
            Precision::Exact => "exact",
        }
    }
}

/// Rays per packet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LaneCount {
    /// The plan chooses for the machine.
    #[default]
    Auto,
    One,
    Four,
    Eight,
    Sixteen,
}

impl LaneCount {
    /// The name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            LaneCount::Auto => "auto",
            LaneCount::One => "1",
            LaneCount::Four => "4",
            LaneCount::Eight => "8",
            LaneCount::Sixteen => "16",
        }
    }

    /// Returns the number of rays, or `None` for `Auto`.
    pub fn count(self) -> Option<usize> {
        match self {
            LaneCount::Auto => None,
            LaneCount::One => Some(1),
            LaneCount::Four => Some(4),
            LaneCount::Eight => Some(8),
            LaneCount::Sixteen => Some(16),
        }
    }
}
