//! The shapes' own numbers, kind by kind.

use super::implicits;
use super::{Entity, SceneError, finite, finite3, require, shape_entity};
use crate::scene::{Shape, Tables};
use glam::DVec3;

pub(super) fn solids(scene: &Tables) -> Result<(), SceneError> {
    for i in 0..scene.shapes.len() {
        let what = || shape_entity(scene, i as u32);
        let positive =
            |field, value: f64| require(value > 0.0, what, field, value, "greater than 0");
        let not_negative =
            |field, value: f64| require(value >= 0.0, what, field, value, "0 or greater");
        let apart = |base: DVec3, top: DVec3| {
            // Halved, as the kernel does: the least numbers have no half.
            if base * 0.5 != top * 0.5 {
                return Ok(());
            }
            Err(SceneError::Degenerate {
                what: what(),
                why: "its base and top are the same point".into(),
            })
        };
        match scene.shapes.rows[i] {
            Shape::HalfSpace(id) => {
                let row = scene.half_spaces.row(id);
                finite3(what, "normal", row.normal)?;
                finite(what, "offset", &[row.offset])?;
                if row.normal == DVec3::ZERO {
                    return Err(SceneError::Degenerate {
                        what: what(),
                        why: "its normal is (0, 0, 0)".into(),
                    });
                }
            }
            Shape::Sphere(id) => {
                let row = scene.spheres.row(id);
                finite3(what, "center", row.center)?;
                finite(what, "radius", &[row.radius])?;
                positive("radius", row.radius)?;
            }
            Shape::Ellipsoid(id) => {
                let row = scene.ellipsoids.row(id);
                finite3(what, "center", row.center)?;
                finite3(what, "radii", row.radii)?;
                positive("radii", row.radii.min_element())?;
            }
            Shape::Cylinder(id) => {
                let row = scene.cylinders.row(id);
                finite3(what, "base", row.base)?;
                finite3(what, "top", row.top)?;
                finite(what, "radius", &[row.radius])?;
                positive("radius", row.radius)?;
                apart(row.base, row.top)?;
            }
            Shape::Cone(id) => {
                let row = scene.cones.row(id);
                finite3(what, "base", row.base)?;
                finite3(what, "top", row.top)?;
                finite(what, "base_radius", &[row.base_radius])?;
                finite(what, "top_radius", &[row.top_radius])?;
                not_negative("base_radius", row.base_radius)?;
                not_negative("top_radius", row.top_radius)?;
                positive("base_radius + top_radius", row.base_radius + row.top_radius)?;
                apart(row.base, row.top)?;
            }
            Shape::Cuboid(id) => {
                let row = scene.cuboids.row(id);
                finite3(what, "min", row.min)?;
                finite3(what, "max", row.max)?;
                if !row.min.cmplt(row.max).all() {
                    return Err(SceneError::Degenerate {
                        what: what(),
                        why: format!(
                            "min {} must be below max {} on every axis",
                            row.min, row.max
                        ),
                    });
                }
            }
            Shape::Quadric(id) => {
                let row = scene.quadrics.row(id);
                finite(what, "coefficients", &row.coefficients)?;
                if row.coefficients[..9].iter().all(|x| *x == 0.0) {
                    return Err(SceneError::Degenerate {
                        what: what(),
                        why: "all its coefficients but the last are 0, and it has no surface"
                            .into(),
                    });
                }
            }
            Shape::Implicit(id) => {
                let (row, solver) = (scene.implicits.row(id), scene.implicits.solver(id));
                implicits::implicit(what, &row, solver)?;
            }
            Shape::LevelSet(id) => implicits::level_set(what, &scene.level_sets.row(id))?,
            Shape::Polyhedron(_) | Shape::Polygon(_) | Shape::Mesh(_) | Shape::Combination(_) => {}
        }
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

pub(super) fn polygons(scene: &Tables) -> Result<(), SceneError> {
    let table = &scene.polygons;
    let counts = normal_counts(&table.normals_of, table.normals.len());
    for i in 0..scene.shapes.len() {
        let Shape::Polygon(id) = scene.shapes.rows[i] else {
            continue;
        };
        let what = || shape_entity(scene, i as u32);
        let points = scene.polygons.points(id);
        if points.len() < 3 {
            return Err(SceneError::Empty {
                what: what(),
                part: "area (fewer than 3 points)",
            });
        }
        for p in points {
            finite3(what, "points", *p)?;
        }
        normal_count(what, counts[id.index()], points.len())?;
        for n in scene.polygons.normals(id).into_iter().flatten() {
            finite3(what, "normals", *n)?;
        }
        let degenerate = |why| SceneError::Degenerate { what: what(), why };
        crate::geom::polygon_plane(points).map_err(degenerate)?;
    }
    Ok(())
}

pub(super) fn polyhedra(scene: &Tables) -> Result<(), SceneError> {
    for i in 0..scene.shapes.len() {
        let Shape::Polyhedron(id) = scene.shapes.rows[i] else {
            continue;
        };
        let what = || shape_entity(scene, i as u32);
        let (planes, points) = (scene.polyhedra.planes(id), scene.polyhedra.points(id));
        if planes.len() < 4 || points.len() < 4 {
            return Err(SceneError::Empty {
                what: what(),
                part: "volume (fewer than 4 faces or corners)",
            });
        }
        for plane in planes {
            finite3(what, "planes", plane.normal)?;
            finite(what, "planes", &[plane.offset])?;
            if plane.normal == DVec3::ZERO {
                return Err(SceneError::Degenerate {
                    what: what(),
                    why: "one of its planes has the normal (0, 0, 0)".into(),
                });
            }
        }
        for p in points {
            finite3(what, "points", *p)?;
        }
    }
    Ok(())
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
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::EntityKind;
    use super::*;

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
