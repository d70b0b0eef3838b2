//! Typed row numbers. One macro, so that a sphere's id cannot index cylinders.

macro_rules! typed_ids {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub u32);

        impl $name {
            /// The row as an index into the table's columns.
            #[inline(always)]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}

typed_ids! {
    /// A row of [`Transforms`](super::Transforms); 0 is the identity.
    TransformId,
    /// A row of [`Nodes`](super::Nodes).
    NodeId,
    /// A row of [`Shapes`](super::Shapes): any geometry that can be placed.
    ShapeId,
    HalfSpaceId,
    SphereId,
    EllipsoidId,
    CylinderId,
    ConeId,
    CuboidId,
    PolyhedronId,
    PolygonId,
    QuadricId,
    /// A row of [`Implicits`](super::Implicits).
    ImplicitId,
    /// A row of [`LevelSets`](super::LevelSets).
    LevelSetId,
    /// A row of [`Combinations`](super::Combinations).
    CombinationId,
    MeshId,
    MaterialId,
    LightId,
    CameraId,
}

impl TransformId {
    pub const IDENTITY: TransformId = TransformId(0);
}
