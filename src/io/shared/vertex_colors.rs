//! Colours of vertices, as files of one mesh have them: in sRGB.

use super::mesh_file::MeshFile;
use super::points::Code;
use super::srgb::linear_from_srgb;
use crate::scene::{Material, Texturing};

/// A colour in sRGB with alpha, each from 0 to 1.
pub type Srgb = [f32; 4];

/// The colour of a vertex that has none, where others have one.
pub const WHITE: Srgb = [1.0; 4];

/// Adds a white material that colours of vertices vary, and returns its index.
pub fn varied_by_vertices(file: &mut MeshFile) -> usize {
    let row = file.materials.len();
    let white = Material {
        base_color: [1.0; 3],
        ..Material::default()
    };
    file.materials.push((String::new(), white));
    let texturing = Texturing {
        vertex_color: true,
        ..Texturing::default()
    };
    file.textures.push((row, texturing, Vec::new()));
    row
}

/// Returns the code of a point's colour.
pub fn code_of([r, g, b, _]: &Srgb) -> Code {
    // NaN becomes 0.
    [r, g, b].map(|c| (f64::from(*c).clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
}

/// Returns a colour as meshes keep it: linear, in units of 1/65535.
pub fn linear_codes([r, g, b, alpha]: &Srgb) -> [u16; 4] {
    let [r, g, b] = [r, g, b].map(|c| linear_from_srgb(f64::from(*c)));
    [r, g, b, f64::from(*alpha)].map(|x| (x * 65_535.0 + 0.5) as u16)
}
