//! Transforms: of nodes to their parents, of instances on the GPU, and those that are flat.

use super::accessor::{Accept, quadruples, triples};
use super::{File, container};
use crate::math::Affine;
use crate::scene::MeshData;
use crate::{ImportReport, LoadError};
use container::Placement;
use glam::{DMat3, DQuat, DVec3};
use gltf::json::Index;
use serde_json::Value;

/// What rounding may leave of the zeros in a matrix's last row.
const ROUNDED: f64 = 1e-6;

/// Converts a matrix, given column by column, unless it is not affine. Its last row is
/// 0 0 0 w: all is divided by w, as homogeneous coordinates are.
pub(super) fn affine(m: &[f64; 16]) -> Option<Affine> {
    let w = m[15];
    let is_affine = [m[3], m[7], m[11]].iter().all(|x| x.abs() <= ROUNDED * w);
    if !(w > 0.0 && w.is_finite() && is_affine) {
        return None;
    }
    let column = |i: usize| [m[i] / w, m[i + 1] / w, m[i + 2] / w];
    Some(Affine::new([column(0), column(4), column(8)], column(12)))
}

/// Computes a node's transform to its parent in f64: its matrix, or translation · rotation ·
/// scale. Fails if the matrix is not affine or the rotation is 0.
pub(super) fn local_transform(
    file: &File,
    label: &dyn Fn() -> String,
    p: &Placement,
    report: &mut ImportReport,
) -> Result<Affine, LoadError> {
    if let Some(m) = p.matrix {
        let odd = [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0];
        report.repair("matrix whose last row is not 0 0 0 1", usize::from(odd));
        return affine(&m).ok_or_else(|| {
            let message = "its matrix is not affine: the last row must be 0 0 0 1";
            file.invalid(&label(), message)
        });
    }
    composed(
        p.translation.unwrap_or([0.0; 3]),
        p.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]),
        p.scale.unwrap_or([1.0; 3]),
    )
    .ok_or_else(|| file.invalid(&label(), "its rotation is 0 0 0 0"))
}

/// Computes translation · rotation · scale; `None` if the rotation is 0.
fn composed(translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3]) -> Option<Affine> {
    // Files round quaternions, which should have length 1, to f32. The division by the
    // largest component keeps the squares within range.
    let size = rotation.iter().fold(0.0_f64, |a, c| a.max(c.abs()));
    if size == 0.0 {
        return None;
    }
    let rotation = DQuat::from_array(rotation.map(|c| c / size)).normalize();
    let columns = DMat3::from_quat(rotation).to_cols_array_2d();
    let linear = [0, 1, 2].map(|c| columns[c].map(|x| x * scale[c]));
    Some(Affine::new(linear, translation))
}

/// Reads the transforms of the instances of a node's mesh (EXT_mesh_gpu_instancing), to the
/// node's space; `None` if the node has no such instances.
pub(super) fn instances(
    file: &File,
    node: usize,
    label: &dyn Fn() -> String,
) -> Result<Option<Vec<Affine>>, LoadError> {
    let extensions = file.root.nodes[node].extensions.as_ref();
    let Some(source) = extensions.and_then(|e| e.others.get("EXT_mesh_gpu_instancing")) else {
        return Ok(None);
    };
    let attributes = source.get("attributes").and_then(Value::as_object);
    let place = |name: &str| format!("{}, instances' {name}", label());
    let id = |name: &str| match attributes.and_then(|all| all.get(name)) {
        None => Ok(None),
        Some(id) => match id.as_u64().and_then(|id| u32::try_from(id).ok()) {
            Some(id) => Ok(Some(Index::new(id))),
            None => Err(file.invalid(&place(name), "must be the index of an accessor")),
        },
    };
    let vectors = |name| -> Result<Option<Vec<[f64; 3]>>, LoadError> {
        let id = id(name)?;
        id.map(|id| triples(file, id, &Accept::Float, &place(name)))
            .transpose()
    };
    let (translations, scales) = (vectors("TRANSLATION")?, vectors("SCALE")?);
    let rotations = id("ROTATION")?
        .map(|id| quadruples(file, id, &Accept::Normal, &place("ROTATION")))
        .transpose()?;
    let counts = [
        translations.as_ref().map(Vec::len),
        rotations.as_ref().map(Vec::len),
        scales.as_ref().map(Vec::len),
    ];
    let count = counts.iter().flatten().copied().max();
    // Without any of the three the mesh is where the node is.
    let Some(count) = count else {
        return Ok(None);
    };
    if counts.iter().flatten().any(|n| *n != count) {
        return Err(file.invalid(&place("attributes"), "must have as many rows each"));
    }
    let at = |rows: &Option<Vec<[f64; 3]>>, i: usize, or: f64| {
        rows.as_ref().map_or([or; 3], |rows| rows[i])
    };
    let mut all = Vec::with_capacity(count);
    for i in 0..count {
        let rotation = rotations.as_ref().map_or([0.0, 0.0, 0.0, 1.0], |r| r[i]);
        let map = composed(at(&translations, i, 0.0), rotation, at(&scales, i, 1.0));
        let map = map.filter(Affine::is_finite).ok_or_else(|| {
            let message = format!("row {i} is not finite, or its rotation is 0");
            file.invalid(&place("attributes"), &message)
        })?;
        all.push(map);
    }
    Ok(Some(all))
}

/// The map of areas: normals times the determinant, also of flat maps.
pub(super) fn cofactors(map: &Affine) -> Affine {
    let [a, b, c] = map.linear().map(DVec3::from_array);
    let linear = [b.cross(c), c.cross(a), a.cross(b)].map(|v| v.to_array());
    Affine::new(linear, [0.0; 3])
}

/// What a transform leaves of a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Extent {
    Solid,
    /// A plane figure, since one direction is scaled to 0.
    Flat,
    /// A line or a point.
    Nothing,
}

impl Extent {
    pub fn of(map: &Affine) -> Extent {
        if map.inverse().is_some() {
            return Extent::Solid;
        }
        // The largest entry is divided out, for areas are squares.
        let size = map
            .linear()
            .iter()
            .flatten()
            .fold(0.0_f64, |a, x| a.max(x.abs()));
        if size == 0.0 || !size.is_finite() {
            return Extent::Nothing;
        }
        let scaled = map.linear().map(|column| column.map(|x| x / size));
        let areas = cofactors(&Affine::new(scaled, [0.0; 3]));
        let area = areas
            .linear()
            .iter()
            .flatten()
            .fold(0.0_f64, |a, x| a.max(x.abs()));
        if area > 1e-12 {
            Extent::Flat
        } else {
            Extent::Nothing
        }
    }
}

/// Moves a mesh by a flat map. Its triangles are shaded by their own normals.
pub(super) fn flattened(mesh: &MeshData, map: &Affine) -> MeshData {
    let mut flat = mesh.clone();
    flat.normals.clear();
    for p in &mut flat.positions {
        *p = map.point(*p);
    }
    flat
}
