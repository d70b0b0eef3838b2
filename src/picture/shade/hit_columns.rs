//! Columns of a batch's closest hits.

use crate::accel::World;
use crate::plan::{Kernels, Precision};
use crate::shade::columns::STEP;
use crate::shade::ray_queue::{BATCH, RayQueue};
use crate::trace::{Depths, HitId, Hits, Ids, TraceScratch, closest};
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;

/// The closest hits of a batch of rays; a ray without has the instance of [`HitId::NONE`].
pub(super) struct HitColumns<'b> {
    pub t: ArenaVec<'b, f64>,
    pub instance: ArenaVec<'b, u64>,
    pub primitive: ArenaVec<'b, u32>,
}

impl<'b> HitColumns<'b> {
    pub fn new(arena: &'b Bump) -> HitColumns<'b> {
        HitColumns {
            t: ArenaVec::with_capacity_in(BATCH + STEP, arena),
            instance: ArenaVec::with_capacity_in(BATCH + STEP, arena),
            primitive: ArenaVec::with_capacity_in(BATCH + STEP, arena),
        }
    }

    /// Makes columns that take no memory before they are used.
    pub fn empty(arena: &'b Bump) -> HitColumns<'b> {
        HitColumns {
            t: ArenaVec::new_in(arena),
            instance: ArenaVec::new_in(arena),
            primitive: ArenaVec::new_in(arena),
        }
    }

    /// Traces all rays of a queue. What is shaded starts from the t of lanes in every exact
    /// precision, so that pictures do not depend on which it is.
    pub fn closest(
        &mut self,
        (world, kernels): (&World, &Kernels),
        rays: &mut RayQueue,
        trace: &mut TraceScratch,
    ) {
        let lanes = &Kernels {
            precision: match kernels.precision {
                Precision::Exact => Precision::Guarded,
                other => other,
            },
            ..*kernels
        };
        self.closest_of((world, lanes), rays, trace);
    }

    /// Traces all rays of a queue, with the t of the precision.
    pub fn closest_of(
        &mut self,
        (world, kernels): (&World, &Kernels),
        rays: &mut RayQueue,
        trace: &mut TraceScratch,
    ) {
        let count = rays.len();
        let batch = rays.padded_rays(0);
        self.t.resize(batch.len(), 0.0);
        self.instance.resize(batch.len(), HitId::NONE.instance);
        self.primitive.resize(batch.len(), HitId::NONE.primitive);
        let hits = &mut Hits {
            t: Depths::Double(&mut self.t),
            id: Ids {
                instance: &mut self.instance,
                primitive: &mut self.primitive,
            },
        };
        closest(world, kernels, &batch, hits, trace);
        rays.truncate(count);
    }
}
