//! Merged meshes: all triangles of a mesh file as one mesh in world space.
//!
//! A native scene's `mesh = "file"` is imported this way, with the file's materials. Cameras
//! and lights of the mesh file are not imported.

use crate::math::Affine;
use crate::scene::{
    Instances, MaterialId, MeshData, MeshId, Scene, SceneBuilder, Shape, Slot, TextureRef,
    TexturedMaterial,
};
use crate::shared::images::ImageStore;
use crate::shared::mesh_cleanup::unit;
use crate::shared::mesh_file::MeshFile;
use crate::{ImportReport, LoadError, LoadOptions, gltf, obj, ply, stl, threemf};
use glam::{DMat3, DVec3};
use std::collections::HashMap;
use std::path::Path;

/// Limit on the vertices and triangles that merging may add to those the file stores, since
/// instances are copied; about half a gigabyte.
const MOST_REPEATED: u64 = 1 << 24;

/// Extensions of the files that a mesh can be read from, as messages list them.
pub const MESH_FORMATS: &str = ".obj .ply .stl .3mf .gltf .glb";

/// Whether a file name has one of the extensions [`MESH_FORMATS`].
pub fn names_mesh(path: &Path) -> bool {
    let extension = crate::extension(path);
    !extension.is_empty()
        && MESH_FORMATS
            .split(['.', ' '])
            .any(|known| known == extension)
}

/// Reads a mesh as [`import_with_materials`] does, without materials.
pub fn import_mesh(
    path: &Path,
    options: &LoadOptions,
    report: &mut ImportReport,
) -> Result<MeshData, LoadError> {
    let mut unused = SceneBuilder::default();
    let images = &mut ImageStore::default();
    let mesh = import_with_materials(path, options, images, &mut unused, report)?;
    Ok(MeshData {
        parts: Vec::new(),
        ..mesh
    })
}

/// Reads a `.gltf`, `.glb`, `.3mf`, `.obj`, `.ply` or `.stl` file and merges all its triangles,
/// transformed to world space in f64, into one mesh, whose materials are added to `scene`.
///
/// The triangles of mirrored instances are reversed, so that the outside stays outside.
/// Fails as the format's importer does, for unknown extensions, and if instancing
/// multiplies the triangles beyond a fixed limit or u32.
pub fn import_with_materials(
    path: &Path,
    options: &LoadOptions,
    images: &mut ImageStore,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<MeshData, LoadError> {
    // A mesh has triangles only.
    let options = &LoadOptions {
        point_radius: None,
        ..options.clone()
    };
    match &*crate::extension(path) {
        graph @ ("gltf" | "glb" | "3mf") => {
            let mut own = SceneBuilder::default();
            match graph {
                "3mf" => threemf::import(path, options, images, &mut own, report)?,
                _ => gltf::import(path, options, images, &mut own, report)?,
            }
            let own = own
                .finish()
                .map_err(|source| LoadError::of_scene(path, source))?;
            let of_normals =
                |row: &TexturedMaterial| row.has(Slot::Normal) || row.has(Slot::ClearcoatNormal);
            let count = own.textures.iter().filter(of_normals).count();
            report.add_many("normal map of a merged mesh", count);
            Ok(bake(path, &own)?.add_materials(scene))
        }
        "obj" => obj::read(path, options, images, report).map(|file| file.add_materials(scene)),
        "ply" => ply::read(path, options, false, report).map(|file| file.add_materials(scene)),
        "stl" => stl::read(path, options, report),
        _ => Err(LoadError::Unsupported {
            path: path.into(),
            what: "a mesh of this format".into(),
            remedy: Some(format!("known are {MESH_FORMATS}")),
        }),
    }
}

/// Concatenates the triangles of all instances, in their order. Normals are kept only if
/// every mesh has them.
fn bake(path: &Path, scene: &Scene) -> Result<MeshFile, LoadError> {
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
    let mut file = MeshFile::default();
    let mut row_of: HashMap<MaterialId, usize> = HashMap::new();
    // Mesh files have no other shapes, and no mesh without triangles, so there are no more
    // rows than triangles.
    for row in all.iter(scene) {
        let Shape::Mesh(id) = scene.shapes.row(row.shape) else {
            continue;
        };
        let mesh = scene.meshes.row(id);
        let mut of = |material: Option<MaterialId>| {
            let id = row.material.or(material)?;
            Some(*row_of.entry(id).or_insert_with(|| {
                let name = scene
                    .materials
                    .names
                    .get(id.0)
                    .unwrap_or_default()
                    .to_string();
                file.materials
                    .push((name, scene.materials.rows[id.index()]));
                file.materials.len() - 1
            }))
        };
        let parts: Vec<_> = mesh.parts.iter().map(|(at, m)| (*at, of(*m))).collect();
        let before = (parts.first().is_none_or(|part| part.0 > 0)).then(|| (0, of(None)));
        let start = file.mesh.triangles.len() as u32;
        for (at, material) in before.into_iter().chain(parts) {
            file.parts.push((start + at, material));
        }
        let baked = &mut file.mesh;
        add_attributes(scene, id, baked);
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
    // Runs of one material are one part.
    file.parts.dedup_by_key(|(_, material)| *material);
    if file.materials.is_empty() {
        file.parts.clear();
    }
    let vertices = file.mesh.positions.len();
    for set in &mut file.mesh.uvs {
        set.resize(vertices, [0.0; 2]);
    }
    if !file.mesh.colors.is_empty() {
        file.mesh.colors.resize(vertices, [u16::MAX; 4]);
    }
    if !scene.textures.is_empty() {
        file.images = scene.textures.images.clone();
        for row in scene.textures.iter() {
            // Without the tangents of its meshes a normal map is left out.
            let is_kept = |(slot, _): &&(Slot, TextureRef)| {
                !matches!(slot, Slot::Normal | Slot::ClearcoatNormal)
            };
            let refs = row.refs.iter().filter(is_kept).copied().collect();
            let made = row_of.get(&row.material);
            file.textures
                .extend(made.map(|made| (*made, *row.texturing, refs)));
        }
    }
    Ok(file)
}

/// Appends the texture coordinates and colours of a mesh, whose vertices are to follow.
fn add_attributes(scene: &Scene, mesh: MeshId, baked: &mut MeshData) {
    let all = &scene.meshes.attributes;
    let Some(row) = all.of(mesh).map(|row| &all.rows[row as usize]) else {
        return;
    };
    let before = baked.positions.len();
    for set in 0..usize::from(row.sets) {
        if baked.uvs.len() <= set {
            baked.uvs.push(Vec::new());
        }
        let first = row.uvs + set * row.vertices;
        baked.uvs[set].resize(before, [0.0; 2]);
        baked.uvs[set].extend_from_slice(&all.uvs[first..first + row.vertices]);
    }
    if let Some(first) = row.colors {
        baked.colors.resize(before, [u16::MAX; 4]);
        baked
            .colors
            .extend_from_slice(&all.colors[first..first + row.vertices]);
    }
}

/// Whether a map has a negative determinant.
fn is_mirrored(m: &Affine) -> bool {
    let size = m.norm();
    let columns = m.linear().map(|c| DVec3::from_array(c) / size);
    DMat3::from_cols(columns[0], columns[1], columns[2]).determinant() < 0.0
}
