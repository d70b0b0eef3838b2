//! The shapes' own numbers, kind by kind.

use super::entities::shape_entity;
use super::numbers::{finite, finite3, require};
use crate::scene::error::{Entity, SceneError};
use crate::scene::{MeshId, Shape, Tables};

pub(super) fn primitives(scene: &Tables) -> Result<(), SceneError> {
    for (i, shape) in (0..).zip(&scene.shapes.rows) {
        let what = |flaw| SceneError::from_flaw(shape_entity(scene, i), flaw);
        scene.flaw(*shape).map_err(what)?;
    }
    Ok(())
}

/// How many normals each row brought: its range ends where the next one's
/// begins.
fn normal_counts(first: &[Option<u32>], total: usize) -> Vec<Option<usize>> {
    let mut end = total;
    let mut counts = vec![None; first.len()];
    for (count, first) in counts.iter_mut().zip(first).rev() {
        if let Some(first) = first {
            *count = Some(end - *first as usize);
            end = *first as usize;
        }
    }
    counts
}

fn normal_count(
    what: impl FnOnce() -> Entity,
    normals: Option<usize>,
    vertices: usize,
) -> Result<(), SceneError> {
    match normals {
        Some(normals) if normals != vertices => Err(SceneError::NormalCount {
            what: what(),
            normals,
            vertices,
        }),
        _ => Ok(()),
    }
}

/// Of one mesh: what the trees' leaves can address.
const MAX_TRIANGLES: usize = 1 << 27;

fn few_enough(what: impl FnOnce() -> Entity, count: usize) -> Result<(), SceneError> {
    if count <= MAX_TRIANGLES {
        return Ok(());
    }
    Err(SceneError::TooManyTriangles {
        what: what(),
        count,
        limit: MAX_TRIANGLES,
    })
}

pub(super) fn meshes(scene: &Tables) -> Result<(), SceneError> {
    let table = &scene.meshes;
    let counts = normal_counts(&table.normals_of, table.normals.len());
    for i in 0..scene.shapes.len() {
        let Shape::Mesh(id) = scene.shapes.rows[i] else {
            continue;
        };
        let what = || shape_entity(scene, i as u32);
        // Before the row is read: it slices the normals.
        normal_count(
            what,
            counts[id.index()],
            table.vertices_of[id.index()].len(),
        )?;
        let mesh = table.row(id);
        if mesh.triangles.is_empty() {
            return Err(SceneError::Empty {
                what: what(),
                part: "triangles",
            });
        }
        few_enough(what, mesh.triangles.len())?;
        let mut numbers = mesh.positions.iter().flatten();
        // Vertices are kept as f32, about their middle; a number that is none stays so.
        if numbers.any(|x| x.is_infinite()) || mesh.center.abs().max_element() == f64::INFINITY {
            return Err(SceneError::Degenerate {
                what: what(),
                why: "it is larger than f32 can tell: its vertices must be within 3e38 of their \
                      middle; scale it down"
                    .into(),
            });
        }
        finite3(what, "vertices", mesh.center)?;
        for p in mesh.positions {
            finite(what, "vertices", &p.map(f64::from))?;
        }
        if let Some(normals) = mesh.normals {
            for n in normals {
                finite(what, "normals", &n.map(f64::from))?;
            }
        }
        let count = mesh.positions.len();
        for (triangle, corners) in mesh.triangles.iter().enumerate() {
            if let Some(vertex) = corners.iter().find(|v| **v as usize >= count) {
                return Err(SceneError::VertexOutOfRange {
                    what: what(),
                    triangle,
                    vertex: *vertex,
                    count,
                });
            }
        }
    }
    deformations(scene)
}

/// Checks the keys of meshes that deform.
fn deformations(scene: &Tables) -> Result<(), SceneError> {
    let table = &scene.deformations;
    let shape_of = |mesh: MeshId| {
        let rows = scene.shapes.rows.iter();
        let row = rows
            .into_iter()
            .position(|shape| *shape == Shape::Mesh(mesh));
        shape_entity(scene, row.unwrap_or_default() as u32)
    };
    if let Some((mesh, time)) = table.unlike {
        let what = shape_of(mesh);
        return Err(SceneError::OtherMesh { what, time });
    }
    for (row, mesh) in table.of.iter().enumerate() {
        let what = || shape_of(*mesh);
        for pair in table.times(row).windows(2) {
            let must = "above 0 and the key before, and at most 1";
            let ok = pair[1] > pair[0] && pair[1] <= 1.0;
            require(ok, what, "at of a mesh's key", pair[1], must)?;
        }
    }
    match (table.numbers().all(f32::is_finite), table.of.first()) {
        (false, Some(mesh)) => Err(SceneError::NotFinite {
            what: shape_of(*mesh),
            field: "a vertex or normal of a mesh's key",
            value: "NaN or infinity".into(),
        }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::error::EntityKind;

    /// By its count alone: such a mesh would take gigabytes.
    #[test]
    fn a_mesh_of_too_many_triangles() {
        let what = || Entity::new(EntityKind::Shape, 0, "mesh 'm'".into());
        assert_eq!(few_enough(what, MAX_TRIANGLES), Ok(()));
        let error = few_enough(what, MAX_TRIANGLES + 1).unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("mesh 'm' has 134217729 triangles")
        );
    }
}
