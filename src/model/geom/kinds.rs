//! The table of primitive kinds. A new kind is a folder or file of `geom` and a row here; ids,
//! tables, [`Shape`](crate::scene::Shape), builder functions and every dispatch over kinds are
//! generated from the rows. docs/ADDING_A_SHAPE.md lists the steps.

/// Calls a macro with the tokens given first and one row for each kind: the kind, the field of
/// [`Tables`](crate::scene::Tables), the table, the id, the kind's name in messages, the number
/// that runs of equal kinds are sorted by, and the builder function of kinds whose rows are given
/// whole.
macro_rules! for_each_kind {
    ($then:ident $($first:tt)*) => {
        $then! { $($first)*
            [HalfSpace half_spaces HalfSpaces HalfSpaceId "half-space" 0 half_space]
            [Sphere spheres Spheres SphereId "sphere" 1 sphere]
            [Ellipsoid ellipsoids Ellipsoids EllipsoidId "ellipsoid" 2 ellipsoid]
            [Cylinder cylinders Cylinders CylinderId "cylinder" 3 cylinder]
            [Cone cones Cones ConeId "cone" 4 cone]
            [Cuboid cuboids Cuboids CuboidId "box" 5 cuboid]
            [Polyhedron polyhedra Polyhedra PolyhedronId "polyhedron" 6]
            [Polygon polygons Polygons PolygonId "polygon" 7]
            [Quadric quadrics Quadrics QuadricId "quadric" 10 quadric]
            [Implicit implicits Implicits ImplicitId "implicit" 11]
            [LevelSet level_sets LevelSets LevelSetId "implicit" 12]
            [Prism prisms Prisms PrismId "prism" 13 prism]
        }
    };
}

/// Defines typed row numbers, so that a sphere's id cannot index cylinders.
macro_rules! typed_ids {
    ($($(#[$doc:meta])* $name:ident),* $(,)?) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub u32);

        impl $name {
            /// Returns the row as an index into the table's columns.
            #[inline(always)]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}

macro_rules! ids_of_kinds {
    ($([$kind:ident $field:ident $table:ident $id:ident $($rest:tt)*])*) => {
        typed_ids! { $(#[doc = concat!("A row of [`", stringify!($table), "`](super::", stringify!($table), ").")] $id,)* }
        $(impl super::primitive::Sealed for super::$table {})*
    };
}

for_each_kind!(ids_of_kinds);
pub(crate) use {for_each_kind, typed_ids};
