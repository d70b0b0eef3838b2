//! A mesh as an operand of combinations: which of its triangles a line may meet.
//!
//! Rays come one by one, in f64, and want all triangles and not the nearest; so
//! the tree has small leaves, and boxes of its own beside that of the same mesh
//! where it is seen as a surface.

use super::Index;
use super::bvh::Tree;
use super::sah::{Quality, build};
use super::slabs::Slabs;
use super::world::corner_bounds;
use crate::geom::exact::Line;
use crate::math::{Aabb32, Vec3};
use crate::scene::{MeshId, Tables};
use std::collections::HashMap;
use std::sync::Arc;

#[derive(Clone, Debug)]
pub struct Facets {
    tree: Tree,
    /// Triangles, in the tree's order.
    order: Vec<u32>,
}

/// What several combinations share: a tree for each mesh.
pub type FacetTrees = HashMap<MeshId, Arc<Facets>>;

impl Facets {
    /// Those of a mesh, built once.
    pub fn shared(trees: &mut FacetTrees, tables: &Tables, id: MeshId) -> Arc<Facets> {
        let of = || Arc::new(Facets::of(tables, id));
        trees.entry(id).or_insert_with(of).clone()
    }

    fn of(tables: &Tables, id: MeshId) -> Facets {
        let mesh = tables.meshes.row(id);
        let corners = (0..mesh.triangles.len()).map(|i| mesh.corners(i));
        let boxes: Vec<Aabb32> = corners.map(|c| corner_bounds(&c)).collect();
        let quality = Quality {
            max_leaf: 4,
            ..Quality::default()
        };
        let (tree, order) = build(&boxes, &quality);
        Facets { tree, order }
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
