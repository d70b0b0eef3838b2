//! Buffers of a path tracer.

use super::cache::{CacheColumns, Missed};
use super::first_met::FirstMet;
use super::layers::{LayerPlan, LayerSlots};
use super::record::PathVertex;
use super::shadows::LightRays;
use super::state::{PathKinds, Paths};
use super::textured::Passing;
use crate::shade::hit_buffer::HitBuffer;
use crate::shade::hit_columns::HitColumns;
use crate::shade::hit_groups::HitGroups;
use crate::shade::ray_queue::{BATCH, RayQueue};
use crate::trace::TraceScratch;
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;

/// Buffers of a path tracer: columns in the worker's arena, allocated once per tile and reused
/// by every wave, and the worker's scratch for queries.
pub struct PathScratch<'b> {
    pub(super) waves: [Paths<'b>; 2],
    pub(super) hits: HitColumns<'b>,
    pub(super) buffer: HitBuffer<'b>,
    pub(super) groups: HitGroups<'b>,
    pub(super) lights: LightRays<'b>,
    pub(super) cached: CacheColumns<'b>,
    pub(super) passing: Passing<'b>,
    pub(super) layers: Option<LayerSlots<'b>>,
    /// What the tile's pixels meet first.
    pub(super) first_met: Option<&'b mut [FirstMet]>,
    /// The path that is traced alone, for `verify`.
    pub(super) record: Option<Vec<PathVertex>>,
    pub(super) trace: &'b mut TraceScratch,
}

impl<'b> PathScratch<'b> {
    pub fn new(arena: &'b Bump, trace: &'b mut TraceScratch, kinds: PathKinds) -> PathScratch<'b> {
        let mut buffer = HitBuffer::with_capacity(BATCH, arena);
        buffer.wants_lift = kinds.smooth;
        buffer.wants_places = kinds.textures;
        PathScratch {
            waves: std::array::from_fn(|_| Paths::new(arena, kinds)),
            hits: HitColumns::new(arena),
            buffer,
            groups: HitGroups::new(arena),
            lights: LightRays::new(arena),
            cached: CacheColumns::new(arena),
            passing: Passing::new(arena),
            layers: None,
            first_met: None,
            record: None,
            trace,
        }
    }

    /// Keeps layers of light of a tile's pixels from now on.
    pub fn keep_layers(&mut self, pixels: usize, plan: &LayerPlan, arena: &'b Bump) {
        let (layers, has_guides) = (plan.count(), plan.guides().is_some());
        let trails = || ArenaVec::with_capacity_in(BATCH, arena);
        self.waves
            .iter_mut()
            .for_each(|wave| wave.trails = Some(trails()));
        self.lights.keys = Some(ArenaVec::with_capacity_in(BATCH, arena));
        if has_guides {
            let guiding = || ArenaVec::with_capacity_in(BATCH, arena);
            self.waves
                .iter_mut()
                .for_each(|wave| wave.guiding = Some(guiding()));
        }
        self.layers = Some(LayerSlots::new(pixels, layers, arena));
    }

    /// Keeps what a tile's pixels meet first from now on.
    pub fn keep_first_met(&mut self, pixels: usize, arena: &'b Bump) {
        let open = || ArenaVec::with_capacity_in(BATCH, arena);
        self.waves
            .iter_mut()
            .for_each(|wave| wave.open = Some(open()));
        self.first_met = Some(arena.alloc_slice_fill_copy(pixels, FirstMet::NOTHING));
    }

    /// Empties what is kept beside the slots, before a sample.
    pub fn clear_outputs(&mut self) {
        if let Some(layers) = &mut self.layers {
            layers.clear();
        }
        if let Some(met) = &mut self.first_met {
            met.fill(FirstMet::NOTHING);
        }
    }

    /// Returns the layers of the last sample, if they are kept.
    pub fn layers(&self) -> Option<&LayerSlots<'b>> {
        self.layers.as_ref()
    }

    /// Returns what each pixel's last sample met first, if it is kept.
    pub fn first_met(&self) -> Option<&[FirstMet]> {
        self.first_met.as_deref()
    }

    /// Returns the emptied queue to fill with at most [`BATCH`] camera rays, one a pixel, and
    /// the column for the keys of their pixels.
    pub fn camera_rays(&mut self) -> (&mut RayQueue<'b>, &mut ArenaVec<'b, u32>) {
        let first = &mut self.waves[0];
        first.clear();
        (&mut first.rays, &mut first.key)
    }

    /// Lists the film's rows of the camera rays that are queued.
    pub fn queued(&self) -> &[u32] {
        &self.waves[0].rays.pixel
    }

    /// Takes the points that the last paths found without a record of the cache.
    pub fn take_missed(&mut self) -> Vec<Missed> {
        let missed = self.cached.missed.to_vec();
        self.cached.missed.clear();
        missed
    }

    /// Asks how far the camera rays of the next batches reach.
    pub fn ask_reach(&mut self) {
        let arena = self.cached.missed.bump();
        self.cached.reach = Some(ArenaVec::with_capacity_in(BATCH, arena));
    }

    /// Lists the t of the last batch's first hits; infinite where a ray met nothing.
    pub fn reach(&self) -> &[f64] {
        self.cached.reach.as_deref().unwrap_or_default()
    }

    /// Begins a record of the next path, which is traced alone.
    pub fn start_record(&mut self) {
        self.record = Some(Vec::new());
    }

    /// Ends a record.
    pub fn take_record(&mut self) -> Vec<PathVertex> {
        self.record.take().unwrap_or_default()
    }
}
