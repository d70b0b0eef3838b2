//! The tables of a scene, one per kind of row.

use super::cameras::{Camera, Cameras};
use super::csg_tables::CsgTables;
use super::deformation::Deformations;
use super::light_groups::LightGroups;
use super::light_motion::LightMotions;
use super::lights::{Environment, Light};
use super::materials::{Materials, Rgb};
use super::meshes::Meshes;
use super::names::Names;
use super::nodes::{Edges, Nodes};
use super::shapes::{Shape, Shapes};
use super::shared::Shared;
use super::textures::Textures;
use super::transforms::Transforms;
use crate::geom::kinds::for_each_kind;

/// A length of time; one second unless a file says otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seconds(pub f64);

impl Default for Seconds {
    fn default() -> Seconds {
        Seconds(1.0)
    }
}

macro_rules! tables {
    ($([$kind:ident $field:ident $table:ident $($rest:tt)*])*) => {
        /// All tables of a scene. A table without rows takes no memory and no time.
        #[derive(Clone, Debug, Default)]
        pub struct Tables {
            pub transforms: Transforms,
            pub nodes: Shared<Nodes>,
            /// The children of all nodes.
            pub edges: Shared<Edges>,
            /// The roots of the graph, which scene files list as instances.
            pub roots: Shared<Edges>,
            /// The names of the roots, by row of `roots`.
            pub root_names: Names,

            pub shapes: Shapes,
            $(pub $field: crate::geom::$table,)*
            pub meshes: Shared<Meshes>,
            /// The keys of the meshes that deform.
            pub deformations: Shared<Deformations>,
            pub csg: CsgTables,

            pub materials: Materials,
            /// Images, and the materials that they vary.
            pub textures: Shared<Textures>,
            pub lights: Vec<Light>,
            /// The keys of the lights that move.
            pub light_motions: Shared<LightMotions>,
            pub light_groups: LightGroups,
            pub cameras: Cameras,
            /// The radiance where a ray meets nothing.
            pub background: Rgb,
            /// The radiance from all directions, in place of the background.
            pub environment: Option<Environment>,
            /// How many seconds the motion takes from time 0 to time 1; above 0.
            pub seconds: Seconds,
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
                    ("deformations", self.deformations.bytes()),
                    ("CSG solids", self.csg.bytes()),
                    ("materials", self.materials.bytes()),
                    ("textures", self.textures.bytes()),
                    ("lights", self.lights.len() * size_of::<Light>() + self.light_motions.bytes()),
                    ("cameras", self.cameras.rows.len() * size_of::<Camera>()),
                    ("environment", self.environment.as_ref().map_or(0, Environment::bytes)),
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
