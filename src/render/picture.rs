//! The finished film: one column per channel, row-major, top row first.

/// Which arbitrary output variables are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AovSet {
    pub depth: bool,
    pub position: bool,
    pub normal: bool,
    pub albedo: bool,
    pub instance_id: bool,
    pub primitive_id: bool,
}

impl AovSet {
    pub fn any(&self) -> bool {
        *self != AovSet::default()
    }
}

/// Channels that were not asked for are `None` and take no memory. AOVs are of
/// the pixel's first sample, never blended.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    /// Linear Rec. 709 radiance.
    pub color: Vec<[f32; 3]>,
    /// Along the camera's view axis, world units; infinity where nothing is.
    pub depth: Option<Vec<f32>>,
    /// World space; NaN-free: (0, 0, 0) where nothing is.
    pub position: Option<Vec<[f32; 3]>>,
    /// Shading normal, world space, unit; (0, 0, 0) where nothing is.
    pub normal: Option<Vec<[f32; 3]>>,
    pub albedo: Option<Vec<[f32; 3]>>,
    /// The appearance's path index; [`Picture::NO_ID`] where nothing is.
    pub instance_id: Option<Vec<u64>>,
    /// Triangle in source order, 0 for other shapes; `u32::MAX` where nothing is.
    pub primitive_id: Option<Vec<u32>>,
}

impl Picture {
    pub const NO_ID: u64 = u64::MAX;
}
