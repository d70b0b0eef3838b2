//! Writer of binary PLY files.

use super::view_transform::srgb_from_linear;
use glam::DVec3;

/// A mesh: vertices about a centre, what they have, and triangles counter-clockwise seen from
/// outside.
#[derive(Default)]
pub struct PlyMesh<'m> {
    pub positions: &'m [[f32; 3]],
    pub normals: Option<&'m [[f32; 3]]>,
    /// Texture coordinates, from the image's top.
    pub uvs: Option<&'m [[f32; 2]]>,
    /// Linear colours and alpha in units of 1/65535.
    pub colors: Option<&'m [[u16; 4]]>,
    pub triangles: &'m [[u32; 3]],
    pub center: DVec3,
}

/// Encodes a mesh, little endian: vertices as f32, or as f64 if the centre is not 0. Colours are sRGB
/// as f32, from which their codes can be told, and texture coordinates count from the image's bottom,
/// as f64 where f32 would round them more.
pub fn encode(mesh: &PlyMesh) -> Vec<u8> {
    let is_far = mesh.center != DVec3::ZERO;
    let is_fine = mesh
        .uvs
        .is_some_and(|uvs| !uvs.iter().all(|uv| turns_in_f32(uv[1])));
    let real = |is_double: bool| if is_double { "double" } else { "float" };
    let list = |names: &[&str], kind: &str| {
        let lines = names.iter().map(|name| format!("property {kind} {name}\n"));
        lines.collect::<String>()
    };
    let mut properties = list(&["x", "y", "z"], real(is_far));
    if mesh.normals.is_some() {
        properties += &list(&["nx", "ny", "nz"], "float");
    }
    if mesh.uvs.is_some() {
        properties += &list(&["s", "t"], real(is_fine));
    }
    if mesh.colors.is_some() {
        properties += &list(&["red", "green", "blue", "alpha"], "float");
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
        if let Some([u, v]) = mesh.uvs.map(|uvs| uvs[i].map(f64::from)) {
            for x in [u, turned(v)] {
                match is_fine {
                    true => bytes.extend(x.to_le_bytes()),
                    false => bytes.extend((x as f32).to_le_bytes()),
                }
            }
        }
        if let Some(codes) = mesh.colors.map(|colors| colors[i]) {
            let [r, g, b, alpha] = codes.map(|code| f64::from(code) / f64::from(u16::MAX));
            let [r, g, b] = [r, g, b].map(srgb_from_linear);
            for x in [r, g, b, alpha] {
                bytes.extend((x as f32).to_le_bytes());
            }
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

/// Returns a coordinate from an image's top as one from its bottom, or back. What is nearer to 0 than 2⁻²⁹ is
/// rounded.
pub fn turned(v: f64) -> f64 {
    1.0 - v
}

/// Says whether a coordinate that is turned as f32, and back, is the same.
fn turns_in_f32(v: f32) -> bool {
    let there = turned(f64::from(v)) as f32;
    turned(f64::from(there)) as f32 == v
}
