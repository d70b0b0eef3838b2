//! The scene: structure-of-arrays tables joined by typed ids.
//!
//! [`SceneBuilder`] fills [`Tables`]. [`SceneBuilder::finish`] checks them once and returns
//! a [`Scene`], whose tables can only be read. After that the pipeline cannot fail. Derived
//! data (bounds, instances, trees, plan) are values of their own and never in the tables.

mod builder;
mod builtin;
mod calibration;
mod camera_motion;
mod cameras;
mod check;
mod conditioning;
mod csg_bounds;
mod csg_solid;
mod csg_tables;
mod defaults;
mod deformation;
mod error;
mod framing;
mod global_transform;
mod graph_order;
mod hatching;
mod hull;
mod ids;
mod instances;
mod light_groups;
mod light_motion;
mod lights;
mod materials;
mod meshes;
mod motion;
mod names;
mod nodes;
mod paths;
mod patterns;
mod primitives;
mod rigid;
mod section;
mod section_mesh;
mod shapes;
mod shared;
mod shining;
mod shutter;
mod studio;
mod tables;
mod texels;
mod textures;
mod timeline;
mod transforms;
mod vertex_attributes;
mod watertight;

pub use crate::csg::Operator;
pub use crate::geom::face::{Face, FaceKey};
pub use builder::{RowCounts, SceneBuilder, Surroundings};
pub use builtin::builtin;
pub use calibration::Calibration;
pub use camera_motion::{CameraKey, CameraMotions};
pub use cameras::{Camera, Cameras, FisheyeMapping, Lens, Projection, UnknownCamera};
pub use conditioning::Conditioning;
pub use csg_bounds::operand_bounds;
pub use csg_solid::operands_first;
pub use csg_solid::{CsgOperand, CsgSolid, Frame, MAX_OPERANDS, MAX_SURFACES};
pub use csg_tables::{CsgTables, Operand};
pub use defaults::default_lights;
pub use deformation::Deformations;
pub use error::{Entity, EntityKind, SceneError};
pub use framing::{FRAMED_TIMES, Outlook, StandardView, default_camera, framed_bounds};
pub use graph_order::{children_first, used_nodes};
pub use hatching::Hatch;
pub use hull::coarse_corners;
pub use ids::*;
pub use instances::{
    Instance, InstanceTable, Instances, MAX_DEPTH, MAX_INSTANCES, MAX_LAID_OUT, Placement,
};
pub use light_groups::{LightGroups, Lit};
pub use light_motion::LightMotions;
pub use lights::{Environment, Falloff, Light};
pub use materials::{Layers, Material, Materials, Model, Rgb};
pub use meshes::far_center;
pub use meshes::{Mesh, MeshData, Meshes};
pub use motion::{Interpolation, Key, Motions};
pub use names::Names;
pub use nodes::{Edge, Edges, Nodes, Target};
pub use patterns::{MOST_OCTAVES, Pattern, mixed};
pub use primitives::{faces_of, shape_bounds, shape_center};
pub use section::Uncut;
pub use shapes::{Shape, Shapes};
pub use shared::Shared;
pub use shutter::{Shutter, ShutterShape};
pub use studio::studio;
pub use tables::{Seconds, Tables};
pub use texels::{Levels, linear_from_srgb};
pub use textures::{
    Alpha, Image, Slot, Texels, TextureRef, TexturedMaterial, Textures, Texturing, Wrap,
};
pub use timeline::{Pace, Timeline};
pub use transforms::Transforms;
pub use vertex_attributes::{MeshAttributes, VertexAttributes};
pub use watertight::{Leaks, check_closed};

use crate::geom::kinds::for_each_kind;
use crate::roots::Solver;
use std::ops::Deref;
use std::sync::Arc;

macro_rules! primitive_tables {
    ($([$kind:ident $field:ident $table:ident $($rest:tt)*])*) => {
        $(pub use crate::geom::$table;)*
    };
}

for_each_kind!(primitive_tables);

/// Checked tables. A scene reads like [`Tables`] and cannot be changed. Clones share the
/// tables.
#[derive(Clone, Debug)]
pub struct Scene {
    tables: Arc<Tables>,
}

impl Scene {
    /// Returns the scene at a time of its motion, from 0 to 1. The transforms that move, their
    /// inverses, the meshes that deform, and the lights and cameras that move are computed again; the other tables stay, and of
    /// those that a clone shares, the small ones are copied. Returns an error where paths become
    /// singular at that time, which single motions never do, or where a camera looks nowhere.
    pub fn at(mut self, time: f64) -> Result<Scene, SceneError> {
        if !self.transforms.motions.is_empty() {
            Arc::make_mut(&mut self.tables).transforms.set_time(time);
            check::at_time(&self.tables, time)?;
        }
        if !self.deformations.is_empty() {
            let Tables {
                deformations,
                meshes,
                ..
            } = Arc::make_mut(&mut self.tables);
            deformations.set_time(meshes, time);
        }
        if !self.light_motions.is_empty() {
            let Tables {
                light_motions,
                lights,
                ..
            } = Arc::make_mut(&mut self.tables);
            light_motions.set_time(lights, time);
            check::lights_at_time(&self.tables)?;
        }
        if !self.cameras.motions.is_empty() {
            Arc::make_mut(&mut self.tables).cameras.set_time(time);
            check::cameras_at_time(&self.tables, time)?;
        }
        Ok(self)
    }

    /// Returns the scene with one solver for all polynomial surfaces, which finds their
    /// roots in `fast`. Returns an error if the solver cannot take one of the surfaces.
    pub fn solved_by(mut self, solver: Solver) -> Result<Scene, SceneError> {
        Arc::make_mut(&mut self.tables)
            .implicits
            .solver
            .fill(solver);
        check::solvers(&self.tables)?;
        Ok(self)
    }

    /// Says whether any transform, mesh, light or camera moves.
    pub fn moves(&self) -> bool {
        !self.transforms.motions.is_empty()
            || !self.deformations.is_empty()
            || !self.light_motions.is_empty()
            || !self.cameras.motions.is_empty()
    }

    /// Returns the scene and its camera of row `camera`. Default view and lights replace
    /// absent ones; `aspect` is the picture's width over its height.
    pub fn completed(
        self,
        camera: Option<usize>,
        instances: &Instances,
        aspect: f64,
    ) -> (Scene, Camera) {
        self.completed_in(Lighting::default(), camera, instances, aspect)
    }

    /// Completes a scene as [`Scene::completed`] does, in this lighting if it brings no light.
    pub fn completed_in(
        mut self,
        lighting: Lighting,
        camera: Option<usize>,
        instances: &Instances,
        aspect: f64,
    ) -> (Scene, Camera) {
        let camera = match camera {
            Some(row) => self.cameras.rows[row],
            None => {
                let camera = default_camera(&self, instances, aspect);
                Arc::make_mut(&mut self.tables).cameras.rows.push(camera);
                camera
            }
        };
        if lighting == Lighting::Headlight && self.lights.is_empty() {
            Arc::make_mut(&mut self.tables).lights = default_lights(&camera);
        }
        (self, camera)
    }
}

impl Scene {
    /// Puts a scene that brings no light into the studio of a camera.
    pub fn in_studio(mut self, camera: &Camera) -> Scene {
        if self.is_dark() {
            Arc::make_mut(&mut self.tables).environment = Some(studio(camera));
        }
        self
    }
}

/// What lights a scene that brings no light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lighting {
    /// Two directional lights from about the camera ([`default_lights`]).
    #[default]
    Headlight,
    /// A soft studio ([`studio`]), which integrators that find light with an extent put
    /// around the scene themselves.
    Studio,
}

impl Deref for Scene {
    type Target = Tables;

    fn deref(&self) -> &Tables {
        &self.tables
    }
}
