//! Shapes, which edges place: one row each, with the row of the kind's own table.

use super::ids::*;
use super::names::Names;
use crate::geom::kinds::for_each_kind;

macro_rules! shapes {
    ($([$kind:ident $field:ident $table:ident $id:ident $name:literal $number:literal $($rest:tt)*])*) => {
        /// A shape: its kind, and the row of the kind's table.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Shape {
            $($kind($id),)*
            Mesh(MeshId),
            /// A solid made of solids.
            Csg(CsgId),
        }

        impl Shape {
            /// Returns the name in messages and reports. A level set is called an implicit,
            /// because users write both as equations.
            pub fn kind_name(self) -> &'static str {
                match self {
                    $(Shape::$kind(_) => $name,)*
                    Shape::Mesh(_) => "mesh",
                    Shape::Csg(_) => "CSG solid",
                }
            }

            /// Returns the number of the kind, by which entries are sorted into runs.
            pub fn kind(self) -> u8 {
                match self {
                    $(Shape::$kind(_) => $number,)*
                    Shape::Mesh(_) => 8,
                    Shape::Csg(_) => 9,
                }
            }

            /// Returns the row of the kind's own table.
            pub(super) fn row_number(self) -> u32 {
                match self {
                    $(Shape::$kind(id) => id.0,)*
                    Shape::Mesh(id) => id.0,
                    Shape::Csg(id) => id.0,
                }
            }
        }
    };
}

for_each_kind!(shapes);

/// The table of shapes.
#[derive(Clone, Debug, Default)]
pub struct Shapes {
    pub rows: Vec<Shape>,
    pub names: Names,
}

impl Shapes {
    pub fn push(&mut self, name: &str, shape: Shape) -> ShapeId {
        self.names.set(self.rows.len() as u32, name);
        self.rows.push(shape);
        ShapeId(self.rows.len() as u32 - 1)
    }

    #[inline(always)]
    pub fn row(&self, id: ShapeId) -> Shape {
        self.rows[id.index()]
    }

    pub fn len(&self) -> usize {
        self.rows.len()
    }

    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    pub fn bytes(&self) -> usize {
        self.rows.len() * size_of::<Shape>() + self.names.bytes()
    }
}
