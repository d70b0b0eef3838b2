//! Meshes that deform: positions of the same vertices at several times, from 0 to 1.
//!
//! Key vertices are f32 about the mesh's own centre, as its vertices at time 0 are
//! (docs/SPEC.md, S8). At a key the vertices are the key's. Between two keys each coordinate is
//! `a·(1 − s) + b·s` in f64, rounded once to f32. Vertex normals go straight likewise; where a
//! mean vanishes, the normal is that of the key before. Triangles never change.

use super::ids::MeshId;
use super::meshes::{MeshData, Meshes};
use glam::DVec3;
use std::ops::Range;

/// The keys of all meshes that deform.
#[derive(Clone, Debug, Default)]
pub struct Deformations {
    /// The meshes that deform, rising.
    pub of: Vec<MeshId>,
    /// Per row: its range of the columns of keys, with the first key at time 0.
    pub ranges: Vec<Range<u32>>,
    /// Per key: its time.
    pub at: Vec<f64>,
    /// Per key: the first row of its vertices.
    first: Vec<u32>,
    /// Per key: the first row of its normals, if the mesh has them.
    first_normal: Vec<u32>,
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    /// A key that is none of its mesh, which the scene's check refuses.
    pub(super) unlike: Option<(MeshId, f64)>,
}

impl Deformations {
    /// Adds a mesh that is in the table already, as it is at time 0, with its later keys.
    pub(super) fn push(&mut self, meshes: &Meshes, of: MeshId, keys: &[(f64, MeshData)]) {
        let first = self.at.len() as u32;
        let mesh = meshes.row(of);
        self.key(0.0, mesh.positions, mesh.normals.unwrap_or_default());
        for (at, data) in keys {
            let is_alike = data.positions.len() == mesh.positions.len()
                && data.normals.len() == mesh.normals.map_or(0, <[_]>::len)
                && data.triangles == mesh.triangles;
            if !is_alike {
                self.unlike = self.unlike.or(Some((of, *at)));
                continue;
            }
            let about = |p: &[f64; 3]| (DVec3::from_array(*p) - mesh.center).to_array();
            let positions: Vec<[f32; 3]> = data.positions.iter().map(about).map(narrow).collect();
            self.key(*at, &positions, &data.normals);
        }
        self.of.push(of);
        self.ranges.push(first..self.at.len() as u32);
    }

    fn key(&mut self, at: f64, positions: &[[f32; 3]], normals: &[[f32; 3]]) {
        self.at.push(at);
        self.first.push(self.positions.len() as u32);
        self.first_normal.push(self.normals.len() as u32);
        self.positions.extend_from_slice(positions);
        self.normals.extend_from_slice(normals);
    }

    pub fn is_empty(&self) -> bool {
        self.of.is_empty()
    }

    /// Says whether a mesh deforms.
    pub fn has(&self, mesh: MeshId) -> bool {
        self.of.binary_search(&mesh).is_ok()
    }

    /// Returns the times of a row's keys.
    pub(super) fn times(&self, row: usize) -> &[f64] {
        let range = &self.ranges[row];
        &self.at[range.start as usize..range.end as usize]
    }

    /// Lists the coordinates of all vertices and normals of all keys.
    pub(super) fn numbers(&self) -> impl Iterator<Item = f32> {
        self.positions
            .iter()
            .chain(&self.normals)
            .flatten()
            .copied()
    }

    /// Sets the meshes that deform to a time.
    pub(super) fn set_time(&self, meshes: &mut Meshes, time: f64) {
        for (of, range) in self.of.iter().zip(&self.ranges) {
            let keys = range.start as usize..range.end as usize;
            let after = self.at[keys.clone()].partition_point(|at| *at <= time);
            let a = keys.start + after.saturating_sub(1);
            let b = (a + 1).min(keys.end - 1);
            let s = match after {
                0 => 0.0,
                _ if a == b => 0.0,
                _ => (time - self.at[a]) / (self.at[b] - self.at[a]),
            };
            let (positions, normals) = meshes.vertices_mut(*of);
            let [from, to] = [a, b].map(|key| &self.positions[self.first[key] as usize..]);
            for ((vertex, a), b) in positions.iter_mut().zip(from).zip(to) {
                *vertex = between(a, b, s);
            }
            let [from, to] = [a, b].map(|key| &self.normals[self.first_normal[key] as usize..]);
            for ((normal, a), b) in normals.iter_mut().zip(from).zip(to) {
                let mean = between(a, b, s);
                *normal = if mean == [0.0; 3] { *a } else { mean };
            }
        }
    }

    pub fn bytes(&self) -> usize {
        (self.positions.len() + self.normals.len()) * 12
            + self.at.len() * 16
            + self.of.len() * (size_of::<MeshId>() + size_of::<Range<u32>>())
    }
}

fn narrow(v: [f64; 3]) -> [f32; 3] {
    v.map(|x| x as f32)
}

fn between(a: &[f32; 3], b: &[f32; 3], s: f64) -> [f32; 3] {
    if s == 0.0 {
        return *a;
    }
    narrow(std::array::from_fn(|k| {
        f64::from(a[k]) * (1.0 - s) + f64::from(b[k]) * s
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_go_straight_and_are_met_at_keys() {
        let data = |x: f64| MeshData {
            positions: vec![[x, 0.1, 0.0], [1.0, x, 0.0], [0.0, 1.0, 3.0 * x]],
            normals: vec![[0.0, 0.0, if x > 2.0 { -1.0 } else { 1.0 }]; 3],
            triangles: vec![[0, 1, 2]],
            ..MeshData::default()
        };
        let mut meshes = Meshes::default();
        let still = meshes.push(&data(7.0));
        let of = meshes.push(&data(0.1));
        let mut all = Deformations::default();
        all.push(&meshes, of, &[(0.5, data(0.3)), (1.0, data(2.3))]);
        assert!(all.has(of) && !all.has(still));
        for (time, x) in [(-1.0, 0.1), (0.0, 0.1), (0.5, 0.3), (1.0, 2.3), (4.0, 2.3)] {
            all.set_time(&mut meshes, time);
            let expected: Vec<[f32; 3]> = data(x).positions.into_iter().map(narrow).collect();
            assert_eq!(meshes.row(of).positions, expected, "{time}");
            assert_eq!(meshes.row(of).normals.unwrap(), data(x).normals, "{time}");
        }
        all.set_time(&mut meshes, 0.75);
        let mean = (0.5 * (f64::from(0.3_f32) + f64::from(2.3_f32))) as f32;
        assert_eq!(meshes.row(of).positions[0][0], mean);
        // The normals' mean vanishes.
        assert_eq!(meshes.row(of).normals.unwrap()[0], [0.0, 0.0, 1.0]);
        assert_eq!(meshes.row(still).positions[0][0], 7.0);
    }
}
