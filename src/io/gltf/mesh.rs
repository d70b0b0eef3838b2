//! Meshes: the triangles of a mesh's primitives one after the other, in file order.
//!
//! Primitives with the same accessors of vertices share them. Normals are kept only if every
//! primitive with triangles has them. Primitives of invisible materials are left out. A
//! position that is not finite is an error only if a triangle uses it.

use super::File;
use super::accessor::{Accept, colors, indices, pairs, quadruples, triples};
use super::material::{Imported, Materials};
use super::morph;
use super::skin::Pose;
use super::variant::material_in;
use crate::scene::MeshData;
use crate::shared::mesh_cleanup::{compact, repair_normals};
use crate::shared::tangents::{generated, given};
use crate::{ImportReport, LoadError};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use std::collections::HashMap;

/// The range of the mesh's vertices that one set of accessors gave.
#[derive(Clone, Copy)]
struct Vertices {
    first: u32,
    count: u32,
    normals: bool,
}

/// In what state a mesh is read.
pub(super) struct State<'a> {
    /// The pose of its skin.
    pub pose: Option<&'a Pose>,
    /// How much of each morph target is added; missing ones are 0.
    pub weights: Vec<f64>,
    /// Whether only vertices are wanted, for the mesh is read already.
    pub is_key: bool,
}

/// Reads a mesh, which may have no triangles, in a state; `label` names it in messages.
pub(super) fn read(
    file: &File,
    source: &gltf::json::Mesh,
    label: &str,
    materials: &Materials,
    state: &State,
    report: &mut ImportReport,
) -> Result<MeshData, LoadError> {
    let mut mesh = MeshData::default();
    let mut read: HashMap<Vec<Option<usize>>, Vertices> = HashMap::new();
    let (mut smooth, mut flat) = (false, false);
    for (i, primitive) in source.primitives.iter().enumerate() {
        let place = format!("{label}, primitive {i}");
        let Checked::Valid(mode) = primitive.mode else {
            return Err(file.invalid(&place, "its mode must be 0 to 6"));
        };
        match mode {
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan => {}
            Mode::Points => {
                left_out(file, "point primitive (see --point-radius)", report);
                continue;
            }
            Mode::Lines | Mode::LineLoop | Mode::LineStrip => {
                left_out(file, "line primitive (see --point-radius)", report);
                continue;
            }
        }
        let attribute = |s| primitive.attributes.get(&Checked::Valid(s)).copied();
        let Some(positions) = attribute(Semantic::Positions) else {
            report.add("primitive without positions");
            continue;
        };
        let varied = file
            .variant
            .and_then(|variant| material_in(primitive, variant));
        let number = varied.or(primitive.material.map(|id| id.value()));
        let material = match number {
            None => materials.unnamed,
            Some(id) => *materials.rows.get(id).ok_or_else(|| {
                let all = materials.rows.len();
                file.invalid(
                    &place,
                    &format!("refers to material {id}, but there are {all}"),
                )
            })?,
        };
        if number.is_some() && material.id.is_none() {
            report.add("primitive of an invisible material");
            continue;
        }
        let sets = u32::from(material.sets);
        let color = attribute(Semantic::Colors(0)).filter(|_| material.vertex_color);
        let mut key = vec![
            Some(positions),
            attribute(Semantic::Normals),
            attribute(Semantic::Joints(0)),
            attribute(Semantic::Weights(0)),
            color,
        ];
        key.extend(morph::columns(primitive));
        key.extend((0..sets).map(|set| attribute(Semantic::TexCoords(set))));
        let key: Vec<_> = key.iter().map(|id| id.map(|id| id.value())).collect();
        let vertices = match read.get(&key) {
            Some(vertices) => *vertices,
            None => {
                let vertices =
                    read_vertices(file, (primitive, &material), &mut mesh, state, &place)?;
                read.insert(key, vertices);
                vertices
            }
        };
        let first = mesh.triangles.len();
        corners(file, primitive, mode, vertices, &mut mesh, &place, report)?;
        if mesh.triangles.len() == first {
            continue;
        }
        let used = mesh.triangles[first..].iter().flatten();
        if let Some(v) = used.copied().find(|v| !is_finite(&mesh, *v)) {
            let (row, at) = (v - vertices.first, mesh.positions[v as usize]);
            let message = format!("vertex {row} is not finite: {at:?}");
            return Err(file.invalid(&format!("{place}, POSITION"), &message));
        }
        if material.tangent_set.is_some() && !state.is_key {
            let moved = state.pose.is_some() || state.weights.iter().any(|w| *w != 0.0);
            let of = (primitive, &material, moved);
            add_tangents(file, of, (&mut mesh, first, vertices), &place)?;
        }
        if mesh.parts.last().and_then(|(_, m)| *m) != material.id {
            mesh.parts.push((first as u32, material.id));
        }
        smooth |= vertices.normals;
        flat |= !vertices.normals;
    }
    if flat {
        if smooth {
            report.add("normals of a mesh where only some primitives have them");
        }
        mesh.normals.clear();
    }
    // Vertices of primitives that lack what others have.
    let vertices = mesh.positions.len();
    for set in &mut mesh.uvs {
        set.resize(vertices, [0.0; 2]);
    }
    if !mesh.colors.is_empty() {
        mesh.colors.resize(vertices, [u16::MAX; 4]);
    }
    if !mesh.tangents.is_empty() {
        mesh.tangents.resize(3 * mesh.triangles.len(), [0; 4]);
    }
    let all = 0..vertices as u32;
    let lost = all.filter(|v| !is_finite(&mesh, *v)).count();
    report.repair("unused vertex that is not finite", lost);
    compact(&mut mesh);
    report.add_many("unusable normal", repair_normals(&mut mesh));
    Ok(mesh)
}

/// Counts a primitive of points or lines, unless these are drawn, by `points`.
fn left_out(file: &File, what: &str, report: &mut ImportReport) {
    report.add_many(what, usize::from(!file.wants_points));
}

fn is_finite(mesh: &MeshData, vertex: u32) -> bool {
    mesh.positions[vertex as usize]
        .iter()
        .all(|x| x.is_finite())
}

/// Appends the tangents of the triangles from `first` on, which normal maps and stretched
/// highlights need.
fn add_tangents(
    file: &File,
    (primitive, material, moved): (&Primitive, &Imported, bool),
    (mesh, first, vertices): (&mut MeshData, usize, Vertices),
    place: &str,
) -> Result<(), LoadError> {
    let attribute = |s| primitive.attributes.get(&Checked::Valid(s)).copied();
    let set = material.tangent_set.unwrap_or_default();
    let found = attribute(Semantic::Tangents).filter(|_| vertices.normals && !moved);
    let tangents = match found {
        Some(id) => {
            let at = format!("{place}, TANGENT");
            let rows = quadruples(file, id, &Accept::Normal, &at)?;
            if rows.len() != vertices.count as usize {
                let (rows, count) = (rows.len(), vertices.count);
                return Err(file.invalid(&at, &format!("{rows} tangents for {count} positions")));
            }
            given(mesh, first, &rows, vertices.first)
        }
        None => {
            file.spend(3 * (mesh.triangles.len() - first) as u64, place)?;
            generated(mesh, first, vertices.normals, set)
        }
    };
    mesh.tangents.resize(3 * first, [0; 4]);
    mesh.tangents.extend(tangents);
    Ok(())
}

/// Appends the sets of texture coordinates and the colours that a material needs; zeros and
/// white where there are none.
fn read_attributes(
    file: &File,
    (primitive, material): (&Primitive, &Imported),
    mesh: &mut MeshData,
    (first, count): (usize, usize),
    place: &str,
) -> Result<(), LoadError> {
    let attribute = |s| primitive.attributes.get(&Checked::Valid(s)).copied();
    let wrong_count = |place: &str, rows: usize| {
        file.invalid(place, &format!("{rows} elements for {count} positions"))
    };
    while mesh.uvs.len() < usize::from(material.sets) {
        mesh.uvs.push(Vec::new());
    }
    for set in 0..material.sets {
        let Some(id) = attribute(Semantic::TexCoords(u32::from(set))) else {
            continue;
        };
        let at = format!("{place}, TEXCOORD_{set}");
        let rows = pairs(file, id, &Accept::Coordinate, &at)?;
        if rows.len() != count {
            return Err(wrong_count(&at, rows.len()));
        }
        let column = &mut mesh.uvs[usize::from(set)];
        column.resize(first, [0.0; 2]);
        let finite = |x: f64| if x.is_finite() { x as f32 } else { 0.0 };
        column.extend(rows.iter().map(|uv| uv.map(finite)));
    }
    if material.vertex_color
        && let Some(id) = attribute(Semantic::Colors(0))
    {
        let at = format!("{place}, COLOR_0");
        let rows = colors(file, id, &at)?;
        if rows.len() != count {
            return Err(wrong_count(&at, rows.len()));
        }
        mesh.colors.resize(first, [u16::MAX; 4]);
        // NaN becomes 0.
        let code = |x: f64| (x * 65_535.0 + 0.5) as u16;
        mesh.colors.extend(rows.iter().map(|color| color.map(code)));
    }
    Ok(())
}

/// Appends the vertices of a primitive, with zeros if it has no normals.
fn read_vertices(
    file: &File,
    (primitive, material): (&Primitive, &Imported),
    mesh: &mut MeshData,
    state: &State,
    place: &str,
) -> Result<Vertices, LoadError> {
    let attribute = |s| primitive.attributes.get(&Checked::Valid(s)).copied();
    let place_of = |what| format!("{place}, {what}");

    let at = place_of("POSITION");
    let positions = match attribute(Semantic::Positions) {
        Some(id) => triples(file, id, &file.vertex_types(Accept::Position), &at)?,
        None => Vec::new(),
    };
    let first = mesh.positions.len();
    let all = first + positions.len();
    if all > u32::MAX as usize {
        return Err(file.invalid(&at, "the mesh has more vertices than u32 can count"));
    }
    let count = positions.len();
    mesh.positions.extend(positions);
    let normals = attribute(Semantic::Normals);
    match normals {
        Some(id) => {
            let at = place_of("NORMAL");
            let normals = triples(file, id, &file.vertex_types(Accept::Normal), &at)?;
            if normals.len() != count {
                let message = format!("{} normals for {count} positions", normals.len());
                return Err(file.invalid(&at, &message));
            }
            mesh.normals
                .extend(normals.iter().map(|n| n.map(|x| x as f32)));
        }
        None => mesh.normals.resize(all, [0.0; 3]),
    }
    read_attributes(file, (primitive, material), mesh, (first, count), place)?;
    if state.weights.iter().any(|w| *w != 0.0) {
        let vertices = (&mut mesh.positions[first..], &mut mesh.normals[first..]);
        morph::apply(file, primitive, &state.weights, vertices, place)?;
    }
    if let Some(pose) = state.pose {
        let vertices = (&mut mesh.positions[first..], &mut mesh.normals[first..]);
        pose.apply(file, primitive, vertices, place)?;
    }
    Ok(Vertices {
        first: first as u32,
        count: count as u32,
        normals: normals.is_some(),
    })
}

/// Appends the triangles of a primitive, by the rules of its mode.
fn corners(
    file: &File,
    primitive: &Primitive,
    mode: Mode,
    vertices: Vertices,
    mesh: &mut MeshData,
    place: &str,
    report: &mut ImportReport,
) -> Result<(), LoadError> {
    let place = &format!("{place}, indices");
    let list = match primitive.indices {
        Some(id) => {
            let list = indices(file, id, place)?;
            if let Some(i) = list.iter().position(|v| *v >= vertices.count) {
                let message = format!(
                    "index {i} is vertex {}, but there are only {}",
                    list[i], vertices.count
                );
                return Err(file.invalid(place, &message));
            }
            list
        }
        None => {
            file.spend(u64::from(vertices.count), place)?;
            (0..vertices.count).collect()
        }
    };
    let triangles = &mut mesh.triangles;
    let mut push = |corners: [u32; 3]| triangles.push(corners.map(|v| vertices.first + v));
    match mode {
        Mode::TriangleStrip => {
            // Every second triangle is reversed, so that all have the same winding.
            for (i, w) in list.windows(3).enumerate() {
                push(if i % 2 == 0 {
                    [w[0], w[1], w[2]]
                } else {
                    [w[0], w[2], w[1]]
                });
            }
        }
        Mode::TriangleFan => {
            for w in list.get(1..).unwrap_or_default().windows(2) {
                push([w[0], w[1], list[0]]);
            }
        }
        _ => {
            let whole = list.chunks_exact(3);
            if !whole.remainder().is_empty() {
                report.add("incomplete triangle");
            }
            whole.for_each(|w| push([w[0], w[1], w[2]]));
        }
    }
    if mesh.triangles.len() > u32::MAX as usize {
        return Err(file.invalid(place, "the mesh has more triangles than u32 can count"));
    }
    Ok(())
}
