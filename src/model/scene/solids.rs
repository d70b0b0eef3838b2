//! Tables of primitives that are a few numbers each: one column per field, one row per primitive.

use super::ids::{ConeId, CuboidId, CylinderId, EllipsoidId, HalfSpaceId, QuadricId, SphereId};
use crate::geom::cone::Upright;
use crate::geom::{Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Quadric, Sphere};
use glam::DVec3;

macro_rules! table {
    ($(#[$doc:meta])* $table:ident of $row:ident by $id:ident { $($field:ident: $ty:ty),* $(,)? }
        $(with $derived:ident: $of:ty = $make:expr)?) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Default)]
        pub struct $table {
            $(pub $field: Vec<$ty>,)*
            $($derived: Vec<$of>,)?
        }

        impl $table {
            pub fn push(&mut self, row: $row) -> $id {
                let id = $id(self.len() as u32);
                $(self.$derived.push($make(&row));)?
                $(self.$field.push(row.$field);)*
                id
            }

            #[inline(always)]
            pub fn row(&self, id: $id) -> $row {
                $row { $($field: self.$field[id.index()],)* }
            }

            pub fn rows(&self) -> impl Iterator<Item = ($id, $row)> + '_ {
                (0..self.len() as u32).map(|i| ($id(i), self.row($id(i))))
            }

            pub fn len(&self) -> usize {
                let columns = [$(self.$field.len()),*];
                columns[0]
            }

            pub fn is_empty(&self) -> bool {
                self.len() == 0
            }

            pub fn bytes(&self) -> usize {
                self.len() * (0 $(+ size_of::<$ty>())* $(+ size_of::<$of>())?)
            }
        }
    };
}

table!(HalfSpaces of HalfSpace by HalfSpaceId { normal: DVec3, offset: f64 });
table!(Spheres of Sphere by SphereId { center: DVec3, radius: f64 });
table!(Ellipsoids of Ellipsoid by EllipsoidId { center: DVec3, radii: DVec3 });
table!(Cylinders of Cylinder by CylinderId {
    base: DVec3,
    top: DVec3,
    radius: f64,
    open: bool,
} with uprights: Upright = |row: &Cylinder| row.as_cone().upright());
table!(Cones of Cone by ConeId {
    base: DVec3,
    top: DVec3,
    base_radius: f64,
    top_radius: f64,
    open: bool,
} with uprights: Upright = Cone::upright);
table!(Quadrics of Quadric by QuadricId { coefficients: [f64; 10] });
table!(Cuboids of Cuboid by CuboidId { min: DVec3, max: DVec3 });

impl Cylinders {
    /// As kernels take it.
    #[inline(always)]
    pub fn upright(&self, id: CylinderId) -> &Upright {
        &self.uprights[id.index()]
    }
}

impl Cones {
    /// As kernels take it.
    #[inline(always)]
    pub fn upright(&self, id: ConeId) -> &Upright {
        &self.uprights[id.index()]
    }
}
