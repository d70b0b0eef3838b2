//! `import`: the mesh of an STL file as an operand.
//!
//! OpenSCAD leaves `scale`, `origin` and `layer` to outlines, so they mean nothing here either.

use super::budget;
use super::facets;
use super::nodes::{Outcome, Reader, brief, remedy};
use super::solids::Leaf;
use super::syntax::Value;
use crate::LoadError;
use glam::DVec3;
use std::path::Path;

impl Reader<'_> {
    /// Reads the mesh that a node names. `None` if it has no triangles.
    pub(super) fn import(&mut self, row: usize) -> Outcome<Option<Leaf>> {
        let of = self.arguments(row, &["file"]);
        let Some(Value::Text(file)) = of.get("file").filter(|f| **f != Value::Text("".into()))
        else {
            return Err("import() names no file".into());
        };
        let extension = Path::new(file).extension().unwrap_or_default();
        let extension = extension.to_string_lossy().to_lowercase();
        if extension != "stl" {
            let kind = brief(&extension);
            return Err(remedy(&format!(
                "import() of a file .{kind} is not drawn, only of .stl"
            )));
        }
        let path = self.folder.resolve(file).map_err(|why| match why {
            LoadError::Read { source, .. } => format!(
                "import() of '{}': {source}; the name is relative to the folder of the .scad \
                 program, so put the .csg there",
                brief(file)
            ),
            LoadError::Outside { .. } => format!(
                "import() of '{}', which lies outside the folder; move it there, or allow it with \
                 --allow-outside",
                brief(file)
            ),
            other => other.to_string(),
        })?;
        let mesh = crate::stl::read(&path, self.report).map_err(|why| why.to_string())?;
        budget::fits(mesh.positions.len() + mesh.triangles.len())?;
        let positions: Vec<DVec3> = mesh.positions.into_iter().map(DVec3::from_array).collect();
        let mut triangles = mesh.triangles;
        let positions = facets::only_named(positions, &mut triangles);
        Ok((!triangles.is_empty()).then_some(Leaf::Mesh {
            positions,
            triangles,
        }))
    }
}
