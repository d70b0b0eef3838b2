//! A tree over the instances of a scene, for lines that need every instance they may cross.
//!
//! Its boxes are those of the top-level structure ([`TlasEntry`]), with the pads of slabs in
//! f64. It serves spans; rays are traced through the wide BVH.

use super::Index;
use super::baselines::bvh4::Bvh4;
use super::baselines::bvh4_build::{Bvh4Quality, build};
use super::bounds::corner_bounds;
use super::slabs::Slabs;
use super::tlas_entry::entries;
use crate::math::{Aabb32, Vec3};
use crate::scene::{Instances, MeshId, Scene};
use glam::DVec3;

#[derive(Clone, Debug)]
pub struct InstanceCrossings {
    tree: Bvh4,
    /// Ids of the instances with a box, in the order of the tree's leaves.
    order: Vec<u64>,
    /// Ids of the others, which every line may cross.
    unbounded: Vec<u64>,
    /// The point that boxes count from, in world space.
    center: DVec3,
}

impl InstanceCrossings {
    /// Builds the tree over all instances, which must be few enough to enumerate.
    pub fn build(scene: &Scene, instances: &Instances) -> InstanceCrossings {
        let all = entries(scene, instances, |mesh| {
            let mesh = scene.meshes.row(MeshId(mesh as u32));
            let boxes = (0..mesh.triangles.len()).map(|i| corner_bounds(&mesh.corners(i)));
            Some(boxes.fold(Aabb32::EMPTY, |all, one| all.union(&one)))
        });
        let boxes: Vec<Aabb32> = all.bounded.iter().map(|entry| entry.bounds).collect();
        let quality = Bvh4Quality {
            max_leaf: 2,
            ..Bvh4Quality::default()
        };
        let (tree, order) = build(&boxes, &quality);
        InstanceCrossings {
            tree,
            order: order
                .iter()
                .map(|i| all.bounded[*i as usize].instance)
                .collect(),
            unbounded: all.unbounded.iter().map(|entry| entry.instance).collect(),
            center: all.center,
        }
    }

    pub fn bytes(&self) -> usize {
        self.tree.bytes() + (self.order.len() + self.unbounded.len()) * size_of::<u64>()
    }

    /// Calls `visit` with every instance that a line in world space may cross, and with
    /// others, in no order.
    pub fn along(&self, org: DVec3, dir: DVec3, mut visit: impl FnMut(u64)) {
        self.unbounded.iter().for_each(|id| visit(*id));
        if self.order.is_empty() {
            return;
        }
        let [org, dir] = [org - self.center, dir].map(|v| Vec3::<f64>::splat(v.to_array()));
        let slabs = Slabs::new(org, dir, &self.tree.bounds());
        let part = (f64::NEG_INFINITY, f64::INFINITY);
        self.tree.leaves_along(&slabs, part, |first, count| {
            let ids = &self.order[first..first + count];
            ids.iter().for_each(|id| visit(*id));
        });
    }
}
