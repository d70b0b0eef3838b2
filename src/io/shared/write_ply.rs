//! Writer of binary PLY files.

use glam::DVec3;

/// A mesh: vertices about a centre, their normals or none, and triangles counter-clockwise seen
/// from outside.
pub struct PlyMesh<'m> {
    pub positions: &'m [[f32; 3]],
    pub normals: Option<&'m [[f32; 3]]>,
    pub triangles: &'m [[u32; 3]],
    pub center: DVec3,
}

/// Encodes a mesh, little endian: vertices as f32, or as f64 if the centre is not 0.
pub fn encode(mesh: &PlyMesh) -> Vec<u8> {
    let is_far = mesh.center != DVec3::ZERO;
    let place = if is_far { "double" } else { "float" };
    let mut properties = ["x", "y", "z"]
        .map(|axis| format!("property {place} {axis}\n"))
        .concat();
    if mesh.normals.is_some() {
        properties += &["nx", "ny", "nz"]
            .map(|axis| format!("property float {axis}\n"))
            .concat();
    }
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{properties}element face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        mesh.positions.len(),
        mesh.triangles.len()
    )
    .into_bytes();
    for (i, position) in mesh.positions.iter().enumerate() {
        if is_far {
            let position = DVec3::from_array(position.map(f64::from)) + mesh.center;
            for x in position.to_array() {
                bytes.extend(x.to_le_bytes());
            }
        } else {
            for x in position {
                bytes.extend(x.to_le_bytes());
            }
        }
        for x in mesh.normals.map(|normals| normals[i]).iter().flatten() {
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
