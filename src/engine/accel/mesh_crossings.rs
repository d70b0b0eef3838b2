//! A mesh as an operand of CSG solids: which of its triangles a line may meet.
//!
//! Rays come one by one, in f64, and want all triangles and not the nearest; so
//! the tree has small leaves, and boxes of its own beside that of the same mesh
//! where it is seen as a surface.

use super::Index;
use super::baselines::bvh4::Bvh4;
use super::baselines::bvh4_build::{Bvh4Quality, build};
use super::slabs::Slabs;
use super::world::corner_bounds;
use crate::geom::exact::Line;
use crate::math::{Aabb32, Vec3};
use crate::scene::{MeshId, Tables};
use std::collections::HashMap;
use std::sync::Arc;

#[derive(Clone, Debug)]
pub struct MeshCrossings {
    tree: Bvh4,
    /// Triangles, in the tree's order.
    order: Vec<u32>,
}

/// What several CSG solids share: a tree for each mesh.
pub type MeshCrossingTrees = HashMap<MeshId, Arc<MeshCrossings>>;

impl MeshCrossings {
    /// Those of a mesh, built once.
    pub fn shared(
        trees: &mut MeshCrossingTrees,
        tables: &Tables,
        id: MeshId,
    ) -> Arc<MeshCrossings> {
        let of = || Arc::new(MeshCrossings::of(tables, id));
        trees.entry(id).or_insert_with(of).clone()
    }

    fn of(tables: &Tables, id: MeshId) -> MeshCrossings {
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

    /// Calls `visit` with every triangle that a line about the mesh's centre may meet
    /// beyond `t_min`, and with others, in no order.
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
