//! Entries of the top-level structure: one per instance of a shape.
//!
//! A primitive or CSG solid is tested directly; a mesh has a BLAS that all of its instances
//! share. Entries without a world-space box stand in a list of their own, which every ray
//! asks.

use super::bounds::{FAR, MAX_CONDITION, world_bounds};
use super::instance_bvh::InstanceBvhs;
use crate::math::{Aabb, Aabb32};
use crate::scene::{
    Instances, Placement, Scene, Shape, ShapeId, Tables, far_center, shape_bounds, shape_center,
};
use glam::DVec3;

/// One instance, as the leaves of the top-level structure hold it.
#[derive(Clone, Copy, Debug)]
pub struct TlasEntry {
    pub shape: Shape,
    /// The id of the instance in [`Instances`].
    pub instance: u64,
    /// Whether rays must be transformed: object space is not world space.
    pub placed: bool,
    /// The box in world space, about [`World::center`](super::World::center). The t of every
    /// hit lies inside it. Everything if the placement's condition exceeds
    /// [`MAX_CONDITION`].
    pub bounds: Aabb32,
    /// The box in object space; equal to `bounds` if the instance is not placed. Of a mesh,
    /// the box of its BLAS.
    pub own: Aabb32,
    /// The largest coordinate of `own`, or 0 if `own` is unbounded.
    pub size: f64,
    /// The ∞-norm of the linear part of `world_from_object`.
    pub stretch: f64,
}

impl TlasEntry {
    /// Builds the entry of instance `id` of a shape with the object-space box `own`, in a
    /// world whose boxes count from `center`.
    pub fn place(
        scene: &Tables,
        shape: ShapeId,
        own: Aabb32,
        id: u64,
        place: &Placement,
        center: DVec3,
    ) -> TlasEntry {
        let placed = place.is_placed(scene, shape) || center != DVec3::ZERO;
        let (row, shape) = (shape, scene.shapes.row(shape));
        let bounds = if !placed || own == Aabb32::EVERYTHING {
            own
        } else if place.conditioning(scene, row).norm() <= MAX_CONDITION {
            let world = world_bounds(&own.widened(), place, shape_center(scene, shape));
            world.map_or(Aabb32::EVERYTHING, |world| {
                Aabb::new(world.min - center, world.max - center).outward()
            })
        } else {
            Aabb32::EVERYTHING
        };
        TlasEntry {
            shape,
            instance: id,
            placed,
            bounds,
            own,
            size: match own {
                Aabb32::EVERYTHING => 0.0,
                _ => own.widened().max_abs(),
            },
            stretch: place.world_from_object.norm(),
        }
    }

    fn is_unbounded(&self) -> bool {
        self.bounds == Aabb32::EVERYTHING
    }
}

/// All entries of a flat world.
pub(super) struct TlasEntries {
    /// Entries with a box, in the order of the instances.
    pub bounded: Vec<TlasEntry>,
    pub unbounded: Vec<TlasEntry>,
    /// The point that boxes count from; see [`World::center`](super::World::center).
    pub center: DVec3,
}

/// Builds the entries of all instances. `mesh_bounds` returns the box of a mesh's BLAS, if
/// the mesh has one.
pub(super) fn entries(
    scene: &Scene,
    instances: &Instances,
    mesh_bounds: impl Fn(usize) -> Option<Aabb32>,
) -> TlasEntries {
    entries_of(scene, instances, &own_bounds(scene, mesh_bounds))
}

/// Builds the entries of all instances, given the object-space box of each shape.
pub(super) fn entries_of(scene: &Scene, instances: &Instances, own: &[Aabb32]) -> TlasEntries {
    if !instances.are_laid_out() {
        // Boxes count from the same point as in a nested world.
        let center = InstanceBvhs::build(scene, instances, own.to_vec()).center();
        return entries_about(scene, instances, own, center);
    }
    let near = entries_about(scene, instances, own, DVec3::ZERO);
    let around = near
        .bounded
        .iter()
        .fold(Aabb::EMPTY, |all, entry| all.union(&entry.bounds.widened()));
    let center = far_center(&around, FAR);
    if center == DVec3::ZERO {
        return near;
    }
    entries_about(scene, instances, own, center)
}

fn entries_about(
    scene: &Scene,
    instances: &Instances,
    own: &[Aabb32],
    center: DVec3,
) -> TlasEntries {
    let [mut bounded, mut unbounded] = [Vec::new(), Vec::new()];
    for (id, row) in (0_u64..).zip(instances.iter(scene)) {
        let own = own[row.shape.index()];
        let entry = TlasEntry::place(scene, row.shape, own, id, &row.place(), center);
        if entry.is_unbounded() {
            unbounded.push(entry);
        } else {
            bounded.push(entry);
        }
    }
    TlasEntries {
        bounded,
        unbounded,
        center,
    }
}

/// Returns the object-space box of each shape. `mesh_bounds` returns the box of a mesh's
/// BLAS, if the mesh has one.
pub(super) fn own_bounds(
    scene: &Tables,
    mesh_bounds: impl Fn(usize) -> Option<Aabb32>,
) -> Vec<Aabb32> {
    let shapes = scene.shapes.rows.iter().enumerate();
    let own = shapes.map(|(i, shape)| match shape {
        Shape::Mesh(id) => mesh_bounds(id.index()).unwrap_or(Aabb32::EMPTY),
        _ => {
            let shape = ShapeId(i as u32);
            let bounds = shape_bounds(scene, shape);
            // The operands of a CSG solid have spaces of their own, which count as well.
            let bounds = bounds.filter(|_| scene.conditioning_of(shape).norm() <= MAX_CONDITION);
            // A box beyond f32 is not cut off, because a transform may make it smaller.
            let bounds = bounds.filter(|b| b.max_abs() < f64::from(f32::MAX));
            bounds.map_or(Aabb32::EVERYTHING, |b| b.outward())
        }
    });
    own.collect()
}
