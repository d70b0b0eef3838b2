//! What vertices of meshes have beside places and normals: texture coordinates, colours and
//! tangents. Only meshes that have some take a row.

use super::ids::MeshId;
use super::meshes::MeshData;

/// Columns of vertex attributes, and the meshes that have them, in rising order.
#[derive(Clone, Debug, Default)]
pub struct VertexAttributes {
    pub rows: Vec<MeshAttributes>,
    /// Texture coordinates; a set has one for each vertex of its mesh.
    pub uvs: Vec<[f32; 2]>,
    /// Linear colour and alpha, in units of 1/65535.
    pub colors: Vec<[u16; 4]>,
    /// Tangents of the corners of triangles and the sign of the bitangent, in units of 1/32767.
    pub tangents: Vec<[i16; 4]>,
}

/// The attributes of a mesh: first rows of the columns.
#[derive(Clone, Copy, Debug)]
pub struct MeshAttributes {
    pub mesh: MeshId,
    /// The first set, and the number of sets, one behind the other.
    pub uvs: usize,
    pub sets: u8,
    pub vertices: usize,
    pub colors: Option<usize>,
    pub tangents: Option<usize>,
}

impl VertexAttributes {
    /// Adds the attributes of a mesh, if it has any.
    pub(super) fn push(&mut self, mesh: MeshId, data: &MeshData) {
        if data.uvs.is_empty() && data.colors.is_empty() && data.tangents.is_empty() {
            return;
        }
        let row = MeshAttributes {
            mesh,
            uvs: self.uvs.len(),
            sets: data.uvs.len() as u8,
            vertices: data.positions.len(),
            colors: (!data.colors.is_empty()).then_some(self.colors.len()),
            tangents: (!data.tangents.is_empty()).then_some(self.tangents.len()),
        };
        for set in &data.uvs {
            self.uvs.extend_from_slice(set);
        }
        self.colors.extend_from_slice(&data.colors);
        self.tangents.extend_from_slice(&data.tangents);
        self.rows.push(row);
    }

    /// Returns the row of a mesh, if it has attributes.
    pub fn of(&self, mesh: MeshId) -> Option<u32> {
        let found = self.rows.binary_search_by_key(&mesh, |row| row.mesh);
        found.ok().map(|row| row as u32)
    }

    pub(super) fn bytes(&self) -> usize {
        self.uvs.len() * size_of::<[f32; 2]>()
            + self.colors.len() * size_of::<[u16; 4]>()
            + self.tangents.len() * size_of::<[i16; 4]>()
            + self.rows.len() * size_of::<MeshAttributes>()
    }
}
