//! What the formats share: reading and writing files, messages, meshes, constants, pictures.
//!
//! Nothing here belongs to one format, and nothing here knows which format asks, except
//! `merge_meshes`, which reads a mesh from any file that has one, and `picture`, which
//! chooses the picture formats by a name's ending.

pub mod aovs;
pub mod checksum;
pub mod child;
pub mod folder;
pub mod images;
pub mod import_report;
pub mod jpeg_end;
#[cfg(feature = "ktx2")]
mod ktx2;
pub mod lathe;
pub mod leftovers;
pub mod line_column;
pub mod merge_meshes;
pub mod mesh_cleanup;
pub mod mesh_file;
pub mod messages;
pub mod outputs;
pub mod picture;
pub mod points;
pub mod rational;
pub mod srgb;
pub mod tangents;
pub mod texels;
pub mod text;
pub mod triangulate;
pub mod vertex_colors;
pub mod view_transform;
pub mod write_ply;
