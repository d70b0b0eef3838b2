//! What a k-d tree's builder aims at.

/// When a cell becomes a leaf. Whatever the rule, a cell also does where no
/// candidate plane is left, at [`KdTree::MAX_DEPTH`](super::KdTree::MAX_DEPTH)
/// levels, and where duplicates use up the memory that a tree may take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KdStop {
    /// At the greatest depth only.
    Depth,
    /// With few enough entries.
    Count,
    /// Whichever of the two comes first.
    Both,
    /// Where splitting is not expected to pay: after some splits that improve
    /// the cost too little (Havran 2000, section 4.5), of which those that did
    /// not pay after all are taken back. Or at the greatest depth.
    #[default]
    Cost,
}

/// Which part of a triangle stands for it in a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KdClip {
    /// Its box, where the cell cuts it.
    Box,
    /// The part of its box near its plane.
    #[default]
    Plane,
    /// The triangle itself: "perfect splits".
    Triangle,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KdQuality {
    pub stop: KdStop,
    /// The greatest depth; 8 + 1.3·log₂ n where it is not given (Wald and
    /// Havran 2006, section 3).
    pub depth: Option<u32>,
    /// What [`KdStop::Count`] calls few.
    pub leaf: u32,
    pub clip: KdClip,
    /// Cost of a step at a plane, in primitive tests.
    pub node_cost: f32,
    /// Factor on the cost of a split that cuts off empty space.
    pub empty_factor: f32,
}

/// Measured on dragon_202k: packets are fastest where a step counts as two tests,
/// though it takes less time, since fewer planes keep them together
/// (docs/KDTREE.md).
impl Default for KdQuality {
    fn default() -> KdQuality {
        KdQuality {
            stop: KdStop::default(),
            depth: None,
            leaf: 2,
            clip: KdClip::default(),
            node_cost: 2.0,
            empty_factor: 0.8,
        }
    }
}

impl KdStop {
    pub const ALL: [KdStop; 4] = [KdStop::Depth, KdStop::Count, KdStop::Both, KdStop::Cost];

    pub fn name(self) -> &'static str {
        match self {
            KdStop::Depth => "depth",
            KdStop::Count => "count",
            KdStop::Both => "both",
            KdStop::Cost => "cost",
        }
    }
}

impl KdClip {
    pub const ALL: [KdClip; 3] = [KdClip::Box, KdClip::Plane, KdClip::Triangle];

    pub fn name(self) -> &'static str {
        match self {
            KdClip::Box => "box",
            KdClip::Plane => "plane",
            KdClip::Triangle => "triangle",
        }
    }
}
