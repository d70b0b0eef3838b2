//! What the user may ask for, by the names of the command line.

use super::Accel;

/// Asked for, or left to the plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Choices {
    pub precision: Precision,
    pub lanes: LaneCount,
    /// `None`: the plan chooses.
    pub accel: Option<Accel>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// f32 lanes.
    Fast,
    /// f32 lanes; decisions that rounding may change are made exactly.
    #[default]
    Guarded,
    /// f64 lanes, the same way.
    Exact,
}

impl Precision {
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
    /// The plan chooses for the machine and the precision.
    #[default]
    Auto,
    One,
    Four,
    Eight,
    Sixteen,
}

impl LaneCount {
    pub fn name(self) -> &'static str {
        match self {
            LaneCount::Auto => "auto",
            LaneCount::One => "1",
            LaneCount::Four => "4",
            LaneCount::Eight => "8",
            LaneCount::Sixteen => "16",
        }
    }

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
