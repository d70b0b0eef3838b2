//! The scene: structure-of-arrays tables joined by typed ids.
//!
//! [`SceneBuilder`] fills [`Tables`]; [`SceneBuilder::finish`] checks them once
//! and gives a [`Scene`], whose tables can be read and no longer changed. After
//! that the pipeline cannot fail. Derived data (bounds, appearances, trees,
//! plan) are values of their own, never in here.

mod appearances;
mod blur;
mod builder;
mod builtin;
mod cameras;
mod check;
mod closed;
mod combinations;
mod csg_bounds;
mod csg_solid;
mod defaults;
mod extents;
mod ids;
mod lights;
mod materials;
mod meshes;
mod motion;
mod moved;
mod names;
mod nodes;
mod paths;
mod primitives;
mod shapes;
mod transforms;

pub use crate::csg::Operator;
pub use crate::geom::face::{Face, FaceKey};
pub use appearances::{
    Appearance, AppearanceTable, Appearances, MAX_APPEARANCES, MAX_DEPTH, MAX_LAID_OUT, Place,
};
pub use blur::Blur;
pub use builder::SceneBuilder;
pub use builtin::builtin;
pub use cameras::{Camera, Cameras, Projection};
pub use check::{Entity, EntityKind, SceneError};
pub use check::{children_first, used_nodes};
pub use closed::{Leaks, check_closed};
pub use combinations::{Combinations, Operand};
pub use csg_bounds::operand_bounds;
pub use csg_solid::operands_first;
pub use csg_solid::{CsgOperand, CsgSolid, Frame, MAX_OPERANDS, MAX_SURFACES};
pub use defaults::{default_camera, default_lights};
pub use extents::coarse_corners;
pub use ids::*;
pub use lights::{Falloff, Light};
pub use materials::{Material, Materials, Model, Rgb};
pub use meshes::far_center;
pub use meshes::{Mesh, MeshData, Meshes};
pub use motion::{Key, Motions};
pub use names::Names;
pub use nodes::{Edge, Edges, Nodes, Target};
pub use primitives::{faces_of, shape_bounds};
pub use shapes::{Shape, Shapes};
pub use transforms::Transforms;

use crate::geom::kinds::for_each_kind;
use crate::roots::Solver;
use std::ops::Deref;
use std::sync::Arc;

macro_rules! tables {
    ($([$kind:ident $field:ident $table:ident $($rest:tt)*])*) => {
        $(pub use crate::geom::$table;)*

        /// Every table of a scene. Absent things are empty tables: no memory, no time.
        #[derive(Clone, Debug, Default)]
        pub struct Tables {
            pub transforms: Transforms,
            pub nodes: Nodes,
            /// The children of all nodes.
            pub edges: Edges,
            /// The roots.
            pub instances: Edges,
            /// Names of the roots, by row of `instances`.
            pub instance_names: Names,

            pub shapes: Shapes,
            $(pub $field: $table,)*
            pub meshes: Meshes,
            pub combinations: Combinations,

            pub materials: Materials,
            pub lights: Vec<Light>,
            pub cameras: Cameras,
            /// Radiance where a ray meets nothing.
            pub background: Rgb,
        }

        impl Tables {
            /// Bytes of each table that holds anything, by name.
            pub fn bytes(&self) -> Vec<(&'static str, usize)> {
                let roots = self.instances.bytes() + self.instance_names.bytes();
                [
                    ("transforms", self.transforms.bytes()),
                    ("nodes", self.nodes.bytes() + self.edges.bytes()),
                    ("instances", roots),
                    ("shapes", self.shapes.bytes()),
                    $((stringify!($field), self.$field.bytes()),)*
                    ("meshes", self.meshes.bytes()),
                    ("combinations", self.combinations.bytes()),
                    ("materials", self.materials.bytes()),
                    ("lights", self.lights.len() * size_of::<Light>()),
                    ("cameras", self.cameras.rows.len() * size_of::<Camera>()),
                ]
                .into_iter()
                .filter(|(_, bytes)| *bytes > 0)
                .collect()
            }

            /// The rows of a shape's own table.
            pub(super) fn rows_like(&self, shape: Shape) -> usize {
                match shape {
                    $(Shape::$kind(_) => self.$field.len(),)*
                    Shape::Mesh(_) => self.meshes.len(),
                    Shape::Combination(_) => self.combinations.len(),
                }
            }
        }
    };
}

for_each_kind!(tables);

/// Checked tables. Reads like [`Tables`]; cannot be changed. Clones share them.
#[derive(Clone, Debug)]
pub struct Scene {
    tables: Arc<Tables>,
}

impl Scene {
    /// The same scene at a time of its motion, 0 to 1: the transforms that move
    /// and their inverses are made anew, the rest stays where it is (or is copied, where a
    /// clone shares it). Refused where paths become singular at that time; each motion by
    /// itself does not.
    pub fn at(mut self, time: f64) -> Result<Scene, SceneError> {
        if !self.transforms.motions.is_empty() {
            Arc::make_mut(&mut self.tables).transforms.set_time(time);
            check::at_time(&self.tables, time)?;
        }
        Ok(self)
    }

    /// The same scene with one solver for all polynomial surfaces: what finds where rays
    /// meet them in the precision `fast`. Refused where it cannot take one of them.
    pub fn solved_by(mut self, solver: Solver) -> Result<Scene, SceneError> {
        Arc::make_mut(&mut self.tables)
            .implicits
            .solver
            .fill(solver);
        check::solvers(&self.tables)?;
        Ok(self)
    }

    /// Whether anything moves.
    pub fn moves(&self) -> bool {
        !self.transforms.motions.is_empty()
    }

    /// The scene as seen by camera `row`, with the default view and lights where
    /// it brings none; `aspect` is the picture's width over its height.
    pub fn completed(
        mut self,
        camera: Option<usize>,
        appearances: &Appearances,
        aspect: f64,
    ) -> (Scene, Camera) {
        let camera = match camera {
            Some(row) => self.cameras.rows[row],
            None => {
                let camera = default_camera(&self, appearances, aspect);
                Arc::make_mut(&mut self.tables).cameras.rows.push(camera);
                camera
            }
        };
        if self.lights.is_empty() {
            Arc::make_mut(&mut self.tables).lights = default_lights(&camera);
        }
        (self, camera)
    }
}

impl Deref for Scene {
    type Target = Tables;

    fn deref(&self) -> &Tables {
        &self.tables
    }
}
