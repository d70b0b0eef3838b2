//! Cost of acceleration structures: build time, memory, and expected cost of a ray.

use super::clock::best_and_median;
use lanecast_engine::accel::{Figures, World};
use serde::Serialize;

/// One acceleration structure, with the field names of `bench --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StructureRow {
    /// One of our structures, or a baseline's name with its setting.
    pub name: String,
    pub triangles: u64,
    /// Median over the builds.
    pub build_seconds: f64,
    pub build_seconds_best: f64,
    /// Million triangles built per second, by the median; 0 without triangles.
    pub build_mtris_per_s: f64,
    pub builds: usize,
    /// Bytes of all trees and their leaves, including the copies of triangles in them.
    pub tree_bytes: usize,
    pub bytes_per_triangle: f64,
    /// Peak memory of the build, where it is known.
    pub build_peak_bytes: Option<u64>,
    /// Expected cost of a random ray that hits the root's box (surface area heuristic),
    /// in the structure's own unit: of the top-level tree, then of the largest mesh's
    /// tree.
    pub sah: Option<[f64; 2]>,
    /// Figures of the same two trees, for one of our structures.
    pub figures: Option<[Figures; 2]>,
    /// A baseline's version, in its own encoding.
    pub version: Option<u32>,
}

impl StructureRow {
    pub fn new(name: String, triangles: u64, tree_bytes: usize, seconds: &[f64]) -> StructureRow {
        let (best, median) = best_and_median(seconds);
        let per = |amount: f64, unit: f64| if unit > 0.0 { amount / unit } else { 0.0 };
        StructureRow {
            name,
            triangles,
            build_seconds: median,
            build_seconds_best: best,
            build_mtris_per_s: per(triangles as f64 * 1e-6, median),
            builds: seconds.len(),
            tree_bytes,
            bytes_per_triangle: per(tree_bytes as f64, triangles as f64),
            build_peak_bytes: None,
            sah: None,
            figures: None,
            version: None,
        }
    }

    /// Returns the row of one of our structures.
    pub fn of_world(world: &World, name: &str, triangles: u64, seconds: &[f64]) -> StructureRow {
        let mut row = StructureRow::new(name.into(), triangles, tree_bytes(world), seconds);
        let meshes = world.accelerator.blas_figures();
        let largest = meshes.iter().max_by_key(|mesh| mesh.references);
        let figures = [
            world.accelerator.tlas_figures(),
            largest.copied().unwrap_or_default(),
        ];
        row.sah = Some(figures.map(|f| f.sah));
        row.figures = Some(figures);
        row
    }
}

/// Returns the bytes of all trees and leaves of a world, without the table of
/// instances.
pub fn tree_bytes(world: &World) -> usize {
    let bytes = world.bytes();
    let trees = bytes.iter().filter(|(name, _)| *name != "instances");
    trees.map(|(_, bytes)| bytes).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_follow_from_the_median() {
        let row = StructureRow::new("x".into(), 3_000_000, 600, &[4.0, 1.0, 2.0]);
        assert_eq!((row.build_seconds, row.build_seconds_best), (2.0, 1.0));
        assert_eq!(row.build_mtris_per_s, 1.5);
        assert_eq!(row.bytes_per_triangle, 2e-4);
        let none = StructureRow::new("x".into(), 0, 600, &[]);
        assert_eq!(
            (none.build_mtris_per_s, none.bytes_per_triangle),
            (0.0, 0.0)
        );
    }
}
