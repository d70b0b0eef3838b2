//! Trees over the triangles of meshes that are operands of CSG solids.
//!
//! Rays come one at a time, in f64, and need all triangles on the line instead of the
//! nearest. So the tree has small leaves and is separate from the BLAS by which the same
//! mesh is traced as a surface.

use super::Index;
use super::baselines::bvh4::Bvh4;
use super::baselines::bvh4_build::{Bvh4Quality, build};
use super::bounds::corner_bounds;
use super::slabs::Slabs;
use crate::geom::exact::Line;
use crate::math::{Aabb32, Vec3};
use crate::scene::{MeshId, Tables};
use std::collections::HashMap;
use std::sync::Arc;

/// The triangle tree of one mesh.
#[derive(Clone, Debug)]
pub struct MeshCrossings {
    tree: Bvh4,
    /// The triangles in the order of the tree's leaves.
    order: Vec<u32>,
}

/// The triangle tree of each mesh, which several CSG solids share.
pub type MeshCrossingTrees = HashMap<MeshId, Arc<MeshCrossings>>;

impl MeshCrossings {
    /// Returns the tree of a mesh, built once.
    pub fn shared(
        trees: &mut MeshCrossingTrees,
        tables: &Tables,
        id: MeshId,
    ) -> Arc<MeshCrossings> {
        let build = || Arc::new(MeshCrossings::build(tables, id));
        trees.entry(id).or_insert_with(build).clone()
    }

    fn build(tables: &Tables, id: MeshId) -> MeshCrossings {
        let mesh = tables.meshes.row(id);
        let corners = (0..mesh.triangles.len()).map(|i| mesh.corners(i));
        let boxes: Vec<Aabb32> = corners.map(|c| corner_bounds(&c)).collect();
        let quality = Bvh4Quality {
            max_leaf: 4,
            ..Bvh4Quality::default()
        };
        let (tree, order) = build(&boxes, &quality);
        MeshCrossings { tree, order }
    }

    pub fn bytes(&self) -> usize {
        self.tree.bytes() + self.order.len() * size_of::<u32>()
    }

    /// Calls `visit` with every triangle that a line may cross beyond `t_min`, and with
    /// others, in no order. The line is about the mesh's centre.
    #[inline]
    pub fn along(&self, line: &Line, t_min: f64, mut visit: impl FnMut(u32)) {
        let [org, dir] = [line.org, line.dir].map(Vec3::<f64>::splat);
        let slabs = Slabs::new(org, dir, &self.tree.bounds());
        let part = (t_min, f64::INFINITY);
        self.tree.leaves_along(&slabs, part, |first, count| {
            let triangles = &self.order[first..first + count];
            triangles.iter().for_each(|triangle| visit(*triangle));
        });
    }
}
