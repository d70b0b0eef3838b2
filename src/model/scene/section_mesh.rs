//! Cuts the triangles of a mesh by half-spaces (Sutherland & Hodgman, "Reentrant polygon clipping",
//! 1974). What vertices have goes straight along a cut edge.

use super::{MeshData, MeshId, Tables};
use crate::geom::HalfSpace;
use glam::DVec3;
use std::collections::HashMap;

/// Returns what is left of a mesh in all of some half-spaces of its own space.
pub fn cut_mesh(tables: &Tables, id: MeshId, kept: &[HalfSpace]) -> MeshData {
    let mut data = data_of(tables, id);
    for plane in kept {
        data = cut(&data, plane);
    }
    data
}

/// Returns a mesh as it was added.
fn data_of(tables: &Tables, id: MeshId) -> MeshData {
    let mesh = tables.meshes.row(id);
    let place = |p: &[f32; 3]| (DVec3::from_array(p.map(f64::from)) + mesh.center).to_array();
    let mut data = MeshData {
        positions: mesh.positions.iter().map(place).collect(),
        normals: mesh.normals.map(<[_]>::to_vec).unwrap_or_default(),
        triangles: mesh.triangles.to_vec(),
        parts: mesh.parts.to_vec(),
        open: mesh.open,
        ..MeshData::default()
    };
    let attributes = &tables.meshes.attributes;
    if let Some(row) = attributes.of(id) {
        let row = attributes.rows[row as usize];
        for set in 0..usize::from(row.sets) {
            let first = row.uvs + set * row.vertices;
            data.uvs
                .push(attributes.uvs[first..first + row.vertices].to_vec());
        }
        if let Some(first) = row.colors {
            data.colors = attributes.colors[first..first + row.vertices].to_vec();
        }
        if let Some(first) = row.tangents {
            let corners = data.triangles.len() * 3;
            data.tangents = attributes.tangents[first..first + corners].to_vec();
        }
    }
    data
}

/// A corner of what is left of a triangle: a vertex, and its tangent.
type Corner = (u32, [i16; 4]);

fn cut(data: &MeshData, plane: &HalfSpace) -> MeshData {
    let height = |p: &[f64; 3]| DVec3::from_array(*p).dot(plane.normal) - plane.offset;
    let heights: Vec<f64> = data.positions.iter().map(height).collect();
    let mut left = MeshData {
        triangles: Vec::new(),
        parts: Vec::new(),
        tangents: Vec::new(),
        ..data.clone()
    };
    // New vertices by the edge that they are on, so that neighbours share them.
    let mut new: HashMap<(u32, u32), u32> = HashMap::new();
    let mut parts = data.parts.iter().peekable();
    for (number, corners) in data.triangles.iter().enumerate() {
        while let Some((_, material)) = parts.next_if(|part| part.0 as usize <= number) {
            left.parts.push((left.triangles.len() as u32, *material));
        }
        let corner = |k: usize| -> Corner {
            let tangent = data.tangents.get(number * 3 + k);
            (corners[k], tangent.copied().unwrap_or_default())
        };
        let mut polygon: Vec<Corner> = Vec::with_capacity(4);
        for k in 0..3 {
            let (from, to) = (corner(k), corner((k + 1) % 3));
            let [a, b] = [from.0, to.0].map(|v| heights[v as usize]);
            if a <= 0.0 {
                polygon.push(from);
            }
            if (a <= 0.0) != (b <= 0.0) && a != 0.0 && b != 0.0 {
                let way = a / (a - b);
                let edge = (from.0.min(to.0), from.0.max(to.0));
                let vertex = *new.entry(edge).or_insert_with(|| {
                    let way = if from.0 == edge.0 { way } else { 1.0 - way };
                    add_between(&mut left, edge, way)
                });
                polygon.push((vertex, between_tangents(from.1, to.1, way)));
            }
        }
        for k in 1..polygon.len().saturating_sub(1) {
            let fan = [polygon[0], polygon[k], polygon[k + 1]];
            left.triangles.push(fan.map(|corner| corner.0));
            if !data.tangents.is_empty() {
                left.tangents.extend(fan.map(|corner| corner.1));
            }
        }
    }
    // Parts that have lost all their triangles leave their place to the next one.
    left.parts.dedup_by(|next, part| {
        next.0 == part.0 && {
            *part = *next;
            true
        }
    });
    let count = left.triangles.len() as u32;
    left.parts.retain(|part| part.0 < count);
    left
}

/// Adds a vertex part of the way along an edge.
fn add_between(data: &mut MeshData, (from, to): (u32, u32), way: f64) -> u32 {
    let [from, to] = [from, to].map(|v| v as usize);
    let mix = |a: f64, b: f64| a + (b - a) * way;
    let single = |a: f32, b: f32| mix(f64::from(a), f64::from(b)) as f32;
    let positions = &mut data.positions;
    let [a, b] = [positions[from], positions[to]];
    positions.push(std::array::from_fn(|k| mix(a[k], b[k])));
    if !data.normals.is_empty() {
        let [a, b] = [data.normals[from], data.normals[to]];
        let normal = std::array::from_fn(|k| single(a[k], b[k]));
        // Normals that face each other have no mean.
        let normal = if normal == [0.0; 3] { a } else { normal };
        data.normals.push(normal);
    }
    for set in &mut data.uvs {
        let [a, b] = [set[from], set[to]];
        set.push(std::array::from_fn(|k| single(a[k], b[k])));
    }
    if !data.colors.is_empty() {
        let [a, b] = [data.colors[from], data.colors[to]];
        let mixed = |k: usize| mix(f64::from(a[k]), f64::from(b[k])).round() as u16;
        data.colors.push(std::array::from_fn(mixed));
    }
    data.positions.len() as u32 - 1
}

/// Returns a tangent part of the way, with the first one's side of the bitangent.
fn between_tangents(from: [i16; 4], to: [i16; 4], way: f64) -> [i16; 4] {
    let mix = |k: usize| {
        let (a, b) = (f64::from(from[k]), f64::from(to[k]));
        (a + (b - a) * way).round() as i16
    };
    [mix(0), mix(1), mix(2), from[3]]
}
