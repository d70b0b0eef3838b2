//! How much one file may make: a few letters ask for millions of facets.

use super::outlines::{Outlines, Shape};
use super::solids::{Leaf, Part, Solids};

/// The most triangles and corners of a file. Until the scene's trees are built one takes up to
/// 300 bytes, so a file takes about 1 GB at most; a design has fewer by far.
pub(super) const MOST: usize = 1 << 22;

/// Counts what the nodes of a file have made.
#[derive(Debug, Default)]
pub(super) struct Budget {
    used: usize,
    /// How many rows of each table have been counted.
    solids: usize,
    outlines: usize,
}

impl Budget {
    /// Counts what has been made since the last call. Fails once it is too much.
    pub fn count(&mut self, solids: &Solids, outlines: &Outlines) -> Result<(), String> {
        let new = solids.parts.iter().skip(self.solids);
        let of_solids: usize = new.map(of_part).sum();
        let new = outlines.shapes.iter().skip(self.outlines);
        let of_outlines: usize = new.map(of_shape).sum();
        (self.solids, self.outlines) = (solids.parts.len(), outlines.shapes.len());
        self.used += of_solids + of_outlines;
        fits(self.used)
    }

    /// Fails if nothing more may be made.
    pub fn check(&self) -> Result<(), String> {
        fits(self.used)
    }
}

/// Refuses more triangles and corners than a file may have.
pub(super) fn fits(count: usize) -> Result<(), String> {
    match count <= MOST {
        true => Ok(()),
        false => Err(format!(
            "this file's facets and meshes have more than {MOST} triangles and corners; ask for \
             fewer by $fn, or let curves be round: --scad-curves exact"
        )),
    }
}

fn of_part(part: &Part) -> usize {
    match part {
        Part::Leaf(Leaf::Mesh {
            positions,
            triangles,
        }) => positions.len() + triangles.len(),
        Part::Leaf(Leaf::Polyhedron { planes, points }) => planes.len() + points.len(),
        Part::Leaf(Leaf::Prism { rings, .. }) => rings.iter().map(Vec::len).sum(),
        _ => 1,
    }
}

fn of_shape(shape: &Shape) -> usize {
    match shape {
        Shape::Rings(rings) => rings.iter().map(Vec::len).sum(),
        _ => 1,
    }
}
