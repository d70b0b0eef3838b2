//! Writer of binary PLY files, as Mitsuba reads them.

/// A mesh: vertices, their normals or none, and triangles counter-clockwise seen from outside.
pub(super) struct PlyMesh<'m> {
    pub positions: &'m [[f32; 3]],
    pub normals: Option<&'m [[f32; 3]]>,
    pub triangles: &'m [[u32; 3]],
}

/// Encodes a mesh, little endian.
pub(super) fn encode(mesh: &PlyMesh) -> Vec<u8> {
    let vertex = match mesh.normals {
        Some(_) => "x y z nx ny nz",
        None => "x y z",
    };
    let properties: String = vertex
        .split(' ')
        .map(|name| format!("property float {name}\n"))
        .collect();
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{properties}element face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        mesh.positions.len(),
        mesh.triangles.len()
    )
    .into_bytes();
    for (i, position) in mesh.positions.iter().enumerate() {
        let normal = mesh.normals.map(|normals| normals[i]);
        for x in position.iter().chain(normal.iter().flatten()) {
            bytes.extend(x.to_le_bytes());
        }
    }
    for triangle in mesh.triangles {
        bytes.push(3);
        for row in triangle {
            bytes.extend(row.to_le_bytes());
        }
    }
    bytes
}
