//! Tangents of the corners of triangles, in which normal maps are given: those of the file, or
//! MikkTSpace's (Mikkelsen 2008), which the specification asks for where it has none.

use crate::scene::MeshData;
use bevy_mikktspace::{Geometry, Ops, TangentSpace, generate_tangents};
use glam::{DVec3, Vec3};

/// Elementary functions with the same bits everywhere.
struct Libm;

impl Ops for Libm {
    fn sqrt(x: f32) -> f32 {
        libm::sqrtf(x)
    }

    fn acos(x: f32) -> f32 {
        libm::acosf(x)
    }
}

/// The triangles of a primitive.
struct Corners<'a> {
    mesh: &'a MeshData,
    /// The primitive's triangles.
    first: usize,
    smooth: bool,
    set: usize,
    tangents: Vec<[i16; 4]>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.triangles[self.first + face][corner] as usize
    }
}

impl Geometry<Libm> for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles.len() - self.first
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)].map(|x| x as f32)
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        if self.smooth {
            return self.mesh.normals[self.vertex(face, corner)];
        }
        let [a, b, c] =
            [0, 1, 2].map(|k| DVec3::from_array(self.mesh.positions[self.vertex(face, k)]));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        normal.as_vec3().to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        // A primitive may lack the set.
        let uv = self.mesh.uvs[self.set].get(self.vertex(face, corner));
        let [u, v] = uv.copied().unwrap_or_default();
        // v counts downwards in files, but the bitangent of normal maps points up.
        [u, 1.0 - v]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        if let Some(space) = space {
            self.tangents[3 * face + corner] = encoded(space.tangent_encoded());
        }
    }
}

/// Returns MikkTSpace's tangents of the triangles from `first` on, of a set of texture
/// coordinates; `smooth` says whether their normals are those of vertices.
pub fn generated(mesh: &MeshData, first: usize, smooth: bool, set: u8) -> Vec<[i16; 4]> {
    let count = 3 * (mesh.triangles.len() - first);
    let mut corners = Corners {
        mesh,
        first,
        smooth,
        set: usize::from(set),
        tangents: vec![[0; 4]; count],
    };
    // A mesh without a usable triangle has no tangents, and its normal map is not seen.
    let _ = generate_tangents(&mut corners);
    corners.tangents
}

/// Returns the tangents of the file, by corner of the triangles from `first` on; `rows` are
/// those of the vertices from `vertex` on.
pub fn given(mesh: &MeshData, first: usize, rows: &[[f64; 4]], vertex: u32) -> Vec<[i16; 4]> {
    let corners = mesh.triangles[first..].iter().flatten();
    let of = |corner: &u32| encoded(rows[(corner - vertex) as usize].map(|x| x as f32));
    corners.map(of).collect()
}

/// Encodes a tangent and the sign of the bitangent; zeros where it is none.
fn encoded([x, y, z, w]: [f32; 4]) -> [i16; 4] {
    let tangent = Vec3::new(x, y, z);
    let unit = tangent / tangent.length();
    if !unit.is_finite() {
        return [0; 4];
    }
    let [x, y, z] = unit.to_array().map(|x| (x * 32_767.0).round() as i16);
    [x, y, z, if w < 0.0 { -32_767 } else { 32_767 }]
}
