//! The parameters of the k-d tree's builder.

/// The rule by which a cell becomes a leaf. By any rule a cell also becomes one if no
/// candidate plane is left, at [`KdTree::MAX_DEPTH`](super::KdTree::MAX_DEPTH) levels, and if
/// duplicates use up the memory that a tree may take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KdStop {
    /// A cell becomes a leaf at the greatest depth only.
    Depth,
    /// A cell becomes a leaf if it has few enough entries.
    Count,
    /// A cell becomes a leaf by whichever of these two comes first.
    Both,
    /// A cell becomes a leaf at the greatest depth, or after some splits that improve the cost
    /// too little (Havran 2000, section 4.5); splits that did not pay in the end are undone.
    #[default]
    Cost,
}

/// The part of a triangle that decides which cells list it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KdClip {
    /// The part of its box in the cell.
    Box,
    /// The part of its box near its plane (docs/numerics/boxes.md, X13).
    #[default]
    Plane,
    /// The triangle itself, for "perfect splits".
    Triangle,
}

/// The parameters of the builder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KdQuality {
    pub stop: KdStop,
    /// The greatest depth; 8 + 1.3·log₂ n if it is not given (Wald and Havran 2006, section
    /// 3).
    pub depth: Option<u32>,
    /// The most entries of a leaf by [`KdStop::Count`].
    pub leaf: u32,
    pub clip: KdClip,
    /// The cost of a step at a plane, in primitive tests.
    pub node_cost: f32,
    /// The factor on the cost of a split that cuts off empty space.
    pub empty_factor: f32,
}

/// Measured on dragon_202k: packets are fastest if a step counts as two tests. It takes less
/// time, but fewer planes keep the packets together (docs/decisions/015-k-d-tree.md).
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
