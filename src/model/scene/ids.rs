//! Typed row numbers.

use crate::geom::kinds::typed_ids;

pub use crate::geom::kinds::*;

typed_ids! {
    /// A row of [`Transforms`](super::Transforms); 0 is the identity.
    TransformId,
    /// A row of [`Nodes`](super::Nodes).
    NodeId,
    /// A row of [`Shapes`](super::Shapes): any geometry that can be placed.
    ShapeId,
    /// A row of [`CsgTables`](super::CsgTables).
    CsgId,
    MeshId,
    MaterialId,
    LightId,
    CameraId,
    /// A row of the images of [`Textures`](super::Textures).
    ImageId,
    /// A row of the patterns of [`Textures`](super::Textures).
    PatternId,
}

impl TransformId {
    pub const IDENTITY: TransformId = TransformId(0);
}
