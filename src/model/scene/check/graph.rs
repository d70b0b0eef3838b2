//! Checks of references: ids are in range, nodes have no cycles, and transforms are
//! regular, alone and along every path.

use super::entities::{operand_entity, shape_entity, shortened};
use crate::scene::Motions;
use crate::scene::error::{Entity, EntityKind, SceneError};
use crate::scene::graph_order::children_first;
use crate::scene::ids::{ShapeId, TransformId};
use crate::scene::nodes::Target;
use crate::scene::{Edges, Tables};

/// Checks that all ids are in the range of their tables.
pub(super) fn ranges(scene: &Tables) -> Result<(), SceneError> {
    edge_ranges(scene, &scene.roots, |i| root_entity(scene, i))?;
    let parents = parents(scene);
    edge_ranges(scene, &scene.edges, |i| child_entity(scene, &parents, i))?;
    for (i, shape) in scene.shapes.rows.iter().enumerate() {
        let (kind, id, count) = (
            shape.kind_name(),
            shape.row_number(),
            scene.rows_like(*shape),
        );
        dangling(|| shape_entity(scene, i as u32), kind, id, count)?;
    }
    for (i, operand) in scene.csg.operands.iter().enumerate() {
        let what = || operand_entity(scene, i);
        let transform = operand.transform.0;
        dangling(what, "shape", operand.shape.0, scene.shapes.len())?;
        dangling(what, "transform", transform, scene.transforms.len())?;
        if let Some(m) = operand.material {
            dangling(what, "material", m.0, scene.materials.len())?;
        }
    }
    for (row, material) in scene.csg.material.iter().enumerate() {
        if let Some(m) = material {
            let label = format!("CSG solid {row}");
            let what = || Entity::new(EntityKind::Shape, row as u32, label);
            dangling(what, "material", m.0, scene.materials.len())?;
        }
    }
    for (mesh, parts) in scene.meshes.parts_of.iter().enumerate() {
        for (_, material) in &scene.meshes.parts[parts.start as usize..parts.end as usize] {
            if let Some(m) = material {
                dangling(
                    || Entity::new(EntityKind::Mesh, mesh as u32, format!("mesh {mesh}")),
                    "material",
                    m.0,
                    scene.materials.len(),
                )?;
            }
        }
    }
    Ok(())
}

/// Checks the ids of edges.
fn edge_ranges(
    scene: &Tables,
    edges: &Edges,
    what: impl Fn(u32) -> Entity,
) -> Result<(), SceneError> {
    for i in 0..edges.len() {
        let edge = edges.row(i);
        let what = || what(i as u32);
        match edge.target {
            Target::Shape(id) => dangling(what, "shape", id.0, scene.shapes.len())?,
            Target::Node(id) => dangling(what, "node", id.0, scene.nodes.len())?,
        }
        dangling(what, "transform", edge.transform.0, scene.transforms.len())?;
        if let Some(m) = edge.material {
            dangling(what, "material", m.0, scene.materials.len())?;
        }
    }
    Ok(())
}

/// Returns the entity of a root, which scene files call an instance.
fn root_entity(scene: &Tables, row: u32) -> Entity {
    let label = format!("instance {}", scene.root_names.label(row));
    Entity::new(EntityKind::Instance, row, label)
}

/// Returns the entity of a child edge; `parents` are the nodes of all edges.
fn child_entity(scene: &Tables, parents: &[u32], row: u32) -> Entity {
    let label = match parents[row as usize] {
        u32::MAX => format!("edge {row}"),
        node => format!("a child of node {}", scene.nodes.names.label(node)),
    };
    Entity::new(EntityKind::Edge, row, label)
}

/// Returns an error unless `id` is below `count`.
fn dangling(
    what: impl FnOnce() -> Entity,
    kind: &'static str,
    id: u32,
    count: usize,
) -> Result<(), SceneError> {
    if (id as usize) < count {
        return Ok(());
    }
    Err(SceneError::DanglingId {
        what: what(),
        kind,
        id,
        count,
    })
}

/// Returns the node that each edge belongs to.
fn parents(scene: &Tables) -> Vec<u32> {
    let mut parent = vec![u32::MAX; scene.edges.len()];
    for (node, children) in scene.nodes.children.iter().enumerate() {
        parent[children.start as usize..children.end as usize].fill(node as u32);
    }
    parent
}

/// Checks that no node contains itself.
pub(super) fn cycles(scene: &Tables) -> Result<(), SceneError> {
    children_first(scene).map(|_| ()).map_err(|path| {
        let label = |n: &u32| scene.nodes.names.label(*n);
        SceneError::Cycle {
            what: Entity::new(EntityKind::Node, path[0], label(&path[0])),
            path: shortened(&path, label),
        }
    })
}

/// Checks that transforms and motions in use are finite and regular.
pub(super) fn transforms(scene: &Tables) -> Result<(), SceneError> {
    let parents = parents(scene);
    let of_edges = |edges: &Edges, what: &dyn Fn(u32) -> Entity| {
        for i in 0..edges.len() {
            let t = edges.transform[i].index();
            if !scene.transforms.local[t].is_finite() {
                return Err(SceneError::NotFinite {
                    what: what(i as u32),
                    field: "transform",
                    value: "NaN or infinity in its matrix".into(),
                });
            }
            if scene.transforms.inverse[t].is_none() {
                return Err(SceneError::SingularTransform {
                    what: what(i as u32),
                });
            }
            let motions = &scene.transforms.motions;
            if let Some(row) = motions.row_of(edges.transform[i]) {
                motion(motions, row, &|| what(i as u32))?;
            }
        }
        Ok(())
    };
    of_edges(&scene.roots, &|i| root_entity(scene, i))?;
    of_edges(&scene.edges, &|i| child_entity(scene, &parents, i))?;
    for (i, operand) in scene.csg.operands.iter().enumerate() {
        let row = operand.transform.index();
        let what = || operand_entity(scene, i);
        if !scene.transforms.local[row].is_finite() {
            return Err(SceneError::NotFinite {
                what: what(),
                field: "transform",
                value: "NaN or infinity in its matrix".into(),
            });
        }
        if scene.transforms.inverse[row].is_none() {
            return Err(SceneError::SingularTransform { what: what() });
        }
    }
    Ok(())
}

/// Checks the keys of a motion, and that it is regular between them.
fn motion(motions: &Motions, row: usize, what: &dyn Fn() -> Entity) -> Result<(), SceneError> {
    let keys = motions.keys(row);
    let mut last = 0.0;
    // The first key is the transform itself, which is already checked.
    for key in &keys[1..] {
        if !(key.at > last && key.at <= 1.0) {
            return Err(SceneError::OutOfRange {
                what: what(),
                field: "at of a motion's key",
                value: key.at.to_string(),
                must: "above 0 and the key before, and at most 1",
            });
        }
        last = key.at;
        if !key.local.is_finite() {
            return Err(SceneError::NotFinite {
                what: what(),
                field: "transform of a motion's key",
                value: "NaN or infinity in its matrix".into(),
            });
        }
        if key.local.inverse().is_none() {
            let time = key.at;
            return Err(SceneError::SingularMotion { what: what(), time });
        }
    }
    match motions.singular_time(row) {
        Some(time) if motions.is_rigid(row) => {
            Err(SceneError::MirroredMotion { what: what(), time })
        }
        Some(time) => Err(SceneError::SingularMotion { what: what(), time }),
        None => Ok(()),
    }
}

/// Checks what only the time of a moving scene decides.
pub(in crate::scene) fn at_time(scene: &Tables, time: f64) -> Result<(), SceneError> {
    let motions = &scene.transforms.motions;
    let inverse = |row: &TransformId| scene.transforms.inverse[row.index()];
    let regular = motions.of.iter().all(|row| inverse(row).is_some());
    // This check names the singular transform.
    let checked = if regular {
        instances(scene)
    } else {
        transforms(scene)
    };
    checked.map_err(|error| match error {
        SceneError::SingularTransform { what } => SceneError::SingularMotion { what, time },
        SceneError::SingularPath { what } => SceneError::SingularPathAt { what, time },
        error => error,
    })
}

/// Checks the products along paths: each matrix is regular by itself, but the product may
/// overflow or lose an axis.
pub(super) fn instances(scene: &Tables) -> Result<(), SceneError> {
    let all = crate::scene::Instances::of(scene)?;
    if all.is_empty() {
        return Err(SceneError::NothingToSee);
    }
    let singular = |shape: ShapeId| SceneError::SingularPath {
        what: shape_entity(scene, shape.0),
    };
    // The bounds show regularity for nearly all scenes; for the others every path is
    // computed.
    let Err(shape) = crate::scene::paths::stay_regular(scene) else {
        return Ok(());
    };
    if all.check_enumerable().is_err() {
        return Err(singular(shape));
    }
    let flat = |m: &crate::math::Affine| !m.is_finite() || m.norm() == 0.0;
    match all
        .iter(scene)
        .find(|row| flat(&row.object_from_world) || flat(&row.world_from_object))
    {
        Some(row) => Err(singular(row.shape)),
        None => Ok(()),
    }
}
