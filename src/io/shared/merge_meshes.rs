//! Merged meshes: all triangles of a mesh file as one mesh in world space.
//!
//! A native scene's `mesh = "file"` is imported this way. Materials, cameras and lights of
//! the mesh file are not imported.

use crate::math::Affine;
use crate::scene::{Instances, MeshData, Scene, SceneBuilder, Shape};
use crate::shared::mesh_cleanup::unit;
use crate::{ImportReport, LoadError, LoadOptions, gltf, obj, ply, stl};
use glam::{DMat3, DVec3};
use std::path::Path;

/// Limit on the vertices and triangles that merging may add to those the file stores, since
/// instances are copied; about half a gigabyte.
const MOST_REPEATED: u64 = 1 << 24;

/// Extensions of the files that a mesh can be read from, as messages list them.
pub const MESH_FORMATS: &str = ".obj .ply .stl .gltf .glb";

/// Whether a file name has one of the extensions [`MESH_FORMATS`].
pub fn names_mesh(path: &Path) -> bool {
    let extension = crate::extension(path);
    !extension.is_empty()
        && MESH_FORMATS
            .split(['.', ' '])
            .any(|known| known == extension)
}

/// Reads a `.gltf`, `.glb`, `.obj`, `.ply` or `.stl` file and merges all its triangles,
/// transformed to world space in f64, into one mesh without material parts.
///
/// The triangles of mirrored instances are reversed, so that the outside stays outside.
/// Fails as the format's importer does, for unknown extensions, and if instancing
/// multiplies the triangles beyond a fixed limit or u32.
pub fn import_mesh(
    path: &Path,
    options: &LoadOptions,
    report: &mut ImportReport,
) -> Result<MeshData, LoadError> {
    match &*crate::extension(path) {
        "gltf" | "glb" => {
            let mut scene = SceneBuilder::default();
            gltf::import(path, options, &mut scene, report)?;
            let scene = scene
                .finish()
                .map_err(|source| LoadError::of_scene(path, source))?;
            bake(path, &scene)
        }
        "obj" => obj::read(path, options, report).map(|o| o.mesh),
        "ply" => ply::read(path, report),
        "stl" => stl::read(path),
        _ => Err(LoadError::Unsupported {
            path: path.into(),
            what: "a mesh of this format".into(),
            remedy: Some(format!("known are {MESH_FORMATS}")),
        }),
    }
}

/// Concatenates the triangles of all instances, in their order. Normals are kept only if
/// every mesh has them.
fn bake(path: &Path, scene: &Scene) -> Result<MeshData, LoadError> {
    let of_scene = |source| LoadError::of_scene(path, source);
    let all = Instances::of(scene).map_err(of_scene)?;
    let (mut vertices, mut triangles) = (0_u64, 0_u64);
    let mut smooth = true;
    for (shape, count) in scene.shapes.rows.iter().zip(all.of_shapes(scene)) {
        if let (Shape::Mesh(id), 1..) = (shape, count) {
            let mesh = scene.meshes.row(*id);
            let times = |n: usize| count.saturating_mul(n as u64);
            vertices = vertices.saturating_add(times(mesh.positions.len()));
            triangles = triangles.saturating_add(times(mesh.triangles.len()));
            smooth &= mesh.normals.is_some();
        }
    }
    let stored = (scene.meshes.positions.len() + scene.meshes.triangles.len()) as u64;
    if vertices.saturating_add(triangles) > stored + MOST_REPEATED
        || vertices.max(triangles) > u64::from(u32::MAX)
    {
        return Err(LoadError::Unsupported {
            path: path.into(),
            what: format!("baking {triangles} instanced triangles into one mesh"),
            remedy: Some("load the file as a scene, where instances share their mesh".into()),
        });
    }
    let mut baked = MeshData::default();
    // Mesh files have no other shapes, and no mesh without triangles, so there are no more
    // rows than triangles.
    for row in all.iter(scene) {
        let Shape::Mesh(id) = scene.shapes.row(row.shape) else {
            continue;
        };
        let mesh = scene.meshes.row(id);
        let first = baked.positions.len() as u32;
        let world = &row.world_from_object;
        baked.positions.extend(mesh.positions.iter().map(|p| {
            let about = DVec3::from_array(p.map(f64::from));
            world.point((about + mesh.center).to_array())
        }));
        if let (true, Some(normals)) = (smooth, mesh.normals) {
            baked.normals.extend(normals.iter().map(|n| {
                let normal = row.object_from_world.transposed_vector(n.map(f64::from));
                let normal = unit(DVec3::from_array(normal)).unwrap_or(DVec3::Z);
                normal.as_vec3().to_array()
            }));
        }
        let mirrored = is_mirrored(world);
        baked.triangles.extend(mesh.triangles.iter().map(|corners| {
            let [a, b, c] = corners.map(|v| first + v);
            if mirrored { [a, c, b] } else { [a, b, c] }
        }));
    }
    Ok(baked)
}

/// Whether a map has a negative determinant.
fn is_mirrored(m: &Affine) -> bool {
    let size = m.norm();
    let columns = m.linear().map(|c| DVec3::from_array(c) / size);
    DMat3::from_cols(columns[0], columns[1], columns[2]).determinant() < 0.0
}
