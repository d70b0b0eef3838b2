//! Exports a scene's triangles in world space, for other programs.
//!
//! Vertices are rounded to f32 once more if an instance has a transform or its mesh a
//! centre; otherwise they are the scene's own numbers. Shapes other than meshes are
//! left out and counted.

use glam::DVec3;
use lanecast_io::TriangleSet;
use lanecast_model::scene::{Instances, Scene, Shape};

/// Limit of exported triangles: 3 GB, and no tree here holds more.
const MAX_TRIANGLES: u64 = 1 << 27;

/// Returns the triangles of all instances of meshes, in the instances' order, and a
/// warning about other shapes. `option` is what asked for them, for errors.
pub fn triangles(
    scene: &Scene,
    instances: &Instances,
    option: &str,
) -> Result<(TriangleSet, Option<String>), String> {
    instances
        .check_enumerable()
        .map_err(|e| format!("{option}: {e}"))?;
    let mut left_out = 0;
    let (mut vertices, mut triangles) = (0_u64, 0_u64);
    for (shape, count) in scene.shapes.rows.iter().zip(instances.of_shapes(scene)) {
        match shape {
            Shape::Mesh(id) => {
                let mesh = scene.meshes.row(*id);
                vertices += count * mesh.positions.len() as u64;
                triangles += count * mesh.triangles.len() as u64;
            }
            _ => left_out += count,
        }
    }
    if vertices.max(triangles) > MAX_TRIANGLES {
        return Err(format!(
            "{option} would write {triangles} triangles with {vertices} vertices; \
             at most {MAX_TRIANGLES} of each are supported"
        ));
    }
    let mut set = TriangleSet {
        positions: Vec::with_capacity(vertices as usize),
        triangles: Vec::with_capacity(triangles as usize),
    };
    for row in instances.iter(scene) {
        let Shape::Mesh(id) = scene.shapes.row(row.shape) else {
            continue;
        };
        let mesh = scene.meshes.row(id);
        let first = set.positions.len() as u32;
        let identity = !row.is_placed(scene);
        set.positions.extend(mesh.positions.iter().map(|p| {
            if identity {
                return *p;
            }
            let own = DVec3::from_array(p.map(f64::from)) + mesh.center;
            row.world_from_object
                .point(own.to_array())
                .map(|x| x as f32)
        }));
        let indices = mesh.triangles.iter().map(|t| t.map(|i| first + i));
        set.triangles.extend(indices);
    }
    if let Some(i) = set
        .positions
        .iter()
        .position(|p| p.iter().any(|x| !x.is_finite()))
    {
        return Err(format!(
            "{option}: vertex {i} is beyond the range of 32-bit numbers; scale the scene down"
        ));
    }
    let warning = (left_out > 0).then(|| {
        format!(
            "{left_out} instances of shapes other than meshes are left out; .msh has only triangles"
        )
    });
    Ok((set, warning))
}
