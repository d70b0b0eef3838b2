//! `import`: the mesh of an STL file as an operand, or the outline of a drawing.
//!
//! OpenSCAD leaves `scale`, `origin` and `layer` to outlines, so of meshes they mean nothing here either.

use super::budget;
use super::facets;
use super::nodes::{Made, Outcome, Reader, brief, remedy};
use super::solids::Leaf;
use super::syntax::Value;
use crate::{LoadError, LoadOptions};
use glam::DVec3;
use std::path::Path;

impl Reader<'_> {
    /// Reads what the file has that a node names.
    pub(super) fn import(&mut self, row: usize) -> Outcome<Made> {
        let of = self.arguments(row, &["file"]);
        let Some(Value::Text(file)) = of.get("file").filter(|f| **f != Value::Text("".into()))
        else {
            return Err("import() names no file".into());
        };
        let extension = Path::new(file).extension().unwrap_or_default();
        let extension = extension.to_string_lossy().to_lowercase();
        if !["stl", "dxf", "svg"].contains(&&*extension) {
            let kind = brief(&extension);
            return Err(remedy(&format!(
                "import() of a file .{kind} is not drawn, only of .stl, .dxf and .svg"
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
        if extension != "stl" {
            return self.drawing(row, &path);
        }
        let mesh = crate::stl::read(&path, &LoadOptions::default(), self.report);
        let mesh = mesh.map_err(|why| why.to_string())?;
        budget::fits(mesh.positions.len() + mesh.triangles.len())?;
        let positions: Vec<DVec3> = mesh.positions.into_iter().map(DVec3::from_array).collect();
        let mut triangles = mesh.triangles;
        let positions = facets::only_named(positions, &mut triangles);
        let mesh = (!triangles.is_empty()).then_some(Leaf::Mesh {
            positions,
            triangles,
        });
        Ok(self.leaf(self.lines[row], mesh))
    }
}
