//! The tables of a scene, one per kind of row.

use super::cameras::{Camera, Cameras};
use super::csg_tables::CsgTables;
use super::lights::Light;
use super::materials::{Materials, Rgb};
use super::meshes::Meshes;
use super::names::Names;
use super::nodes::{Edges, Nodes};
use super::shapes::{Shape, Shapes};
use super::transforms::Transforms;
use crate::geom::kinds::for_each_kind;

macro_rules! tables {
    ($([$kind:ident $field:ident $table:ident $($rest:tt)*])*) => {
        /// All tables of a scene. A table without rows takes no memory and no time.
        #[derive(Clone, Debug, Default)]
        pub struct Tables {
            pub transforms: Transforms,
            pub nodes: Nodes,
            /// The children of all nodes.
            pub edges: Edges,
            /// The roots of the graph, which scene files list as instances.
            pub roots: Edges,
            /// The names of the roots, by row of `roots`.
            pub root_names: Names,

            pub shapes: Shapes,
            $(pub $field: crate::geom::$table,)*
            pub meshes: Meshes,
            pub csg: CsgTables,

            pub materials: Materials,
            pub lights: Vec<Light>,
            pub cameras: Cameras,
            /// The radiance where a ray meets nothing.
            pub background: Rgb,
        }

        impl Tables {
            /// Returns the bytes of each table that has rows, by name.
            pub fn bytes(&self) -> Vec<(&'static str, usize)> {
                let roots = self.roots.bytes() + self.root_names.bytes();
                [
                    ("transforms", self.transforms.bytes()),
                    ("nodes", self.nodes.bytes() + self.edges.bytes()),
                    ("roots", roots),
                    ("shapes", self.shapes.bytes()),
                    $((stringify!($field), self.$field.bytes()),)*
                    ("meshes", self.meshes.bytes()),
                    ("CSG solids", self.csg.bytes()),
                    ("materials", self.materials.bytes()),
                    ("lights", self.lights.len() * size_of::<Light>()),
                    ("cameras", self.cameras.rows.len() * size_of::<Camera>()),
                ]
                .into_iter()
                .filter(|(_, bytes)| *bytes > 0)
                .collect()
            }

            /// Returns the number of rows of the table of a shape's kind.
            pub(super) fn rows_like(&self, shape: Shape) -> usize {
                match shape {
                    $(Shape::$kind(_) => self.$field.len(),)*
                    Shape::Mesh(_) => self.meshes.len(),
                    Shape::Csg(_) => self.csg.len(),
                }
            }
        }
    };
}

for_each_kind!(tables);
