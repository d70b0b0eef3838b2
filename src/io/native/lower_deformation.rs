//! Meshes of the file that deform: one mesh file for each key.

use super::lower_shape::MeshFiles;
use super::schema::MeshKey;
use super::source_spans::At;
use super::tree::{Source, quoted};
use crate::scene::{MeshData, SceneBuilder, ShapeId};
use crate::{ImportReport, LoadError};

/// Adds a mesh that is that of `file` at time 0.
pub(super) fn mesh(
    source: &Source,
    name: &str,
    (file, motion, open): (&At<String>, &At<Vec<At<MeshKey>>>, bool),
    files: &mut MeshFiles,
    scene: &mut SceneBuilder,
    report: &mut ImportReport,
) -> Result<ShapeId, LoadError> {
    if motion.value.is_empty() {
        let message = "motion has no keys; give one, such as { at = 1.0, mesh = \"bent.obj\" }, \
                       or leave it out";
        return Err(source.error(motion.at, message));
    }
    let mut data = files.read(source, file, scene, report)?;
    data.open |= open;
    let mut keys: Vec<(f64, MeshData)> = Vec::with_capacity(motion.value.len());
    for row in &motion.value {
        let MeshKey { at, mesh } = &row.value;
        let (time, last) = (at.value, keys.last().map_or(0.0, |key| key.0));
        if !(time > last && time <= 1.0) {
            let message = format!(
                "at = {time}; it must be above that of the key before, {last}, and at most 1"
            );
            return Err(source.error(at.at, message));
        }
        let key = files.read(source, mesh, scene, report)?;
        let counts = |data: &MeshData| [data.positions.len(), data.normals.len()];
        let both = || key.triangles.iter().zip(&data.triangles);
        if counts(&key) == counts(&data)
            && key.triangles.len() == data.triangles.len()
            && let Some(first) = both().position(|(a, b)| a != b)
        {
            let message = format!(
                "triangle {first} of the mesh file {} has the corners {:?}, and that of {} {:?}; a mesh \
                 deforms between files of the same triangles, in the same order",
                quoted(&mesh.value),
                key.triangles[first],
                quoted(&file.value),
                data.triangles[first]
            );
            return Err(source.error(mesh.at, message));
        }
        if counts(&key) != counts(&data) || key.triangles != data.triangles {
            let [vertices, normals] = counts(&key);
            let [of, with] = counts(&data);
            let message = format!(
                "the mesh file {} has {vertices} vertices, {normals} normals and {} triangles, and \
                 {} has {of}, {with} and {}; a mesh deforms between files of the same triangles, \
                 in the same order",
                quoted(&mesh.value),
                key.triangles.len(),
                quoted(&file.value),
                data.triangles.len()
            );
            return Err(source.error(mesh.at, message));
        }
        keys.push((time, key));
    }
    Ok(scene.deforming_mesh(name, &data, &keys))
}
