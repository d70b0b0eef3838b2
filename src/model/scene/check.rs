//! The check of a scene's tables. A scene that passes cannot fail later.
//!
//! Every error names the entity and says what to do. Range checks come first, so that later
//! checks may index freely.

mod csg_tables;
mod entities;
mod graph;
mod looks;
mod numbers;
mod shapes;

pub(super) use graph::at_time;
pub(super) use looks::{cameras_at_time, lights_at_time};

use super::Tables;
use super::csg_bounds::csg_bounds_of;
use super::error::SceneError;

/// Checks all tables, and adds the columns that can only be derived from checked tables.
pub(super) fn check(scene: &mut Tables) -> Result<(), SceneError> {
    graph::ranges(scene)?;
    graph::cycles(scene)?;
    graph::transforms(scene)?;
    let order = csg_tables::csg_solids(scene)?;
    check_rows(scene)?;
    csg_tables::meshes(scene)?;
    (scene.csg.bounds, scene.csg.conditioning) = csg_bounds_of(scene, &order);
    graph::instances(scene)
}

/// Checks the rows of solids again after their solvers are changed, because a solver may
/// not take them.
pub(super) fn solvers(scene: &Tables) -> Result<(), SceneError> {
    shapes::primitives(scene)
}

fn check_rows(scene: &Tables) -> Result<(), SceneError> {
    shapes::primitives(scene)?;
    shapes::meshes(scene)?;
    looks::materials(scene)?;
    looks::lights(scene)?;
    looks::cameras(scene)
}
