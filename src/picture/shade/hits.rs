//! Surfaces of a batch's hits: hits of one primitive are collected and evaluated a step at a
//! time.

use super::columns::{STEP, each_lane, gather};
use super::hit_buffer::HitBuffer;
use super::interaction::InteractionPart;
use super::ray_queue::RayQueue;
use crate::accel::World;
use crate::math::Vec3;
use crate::plan::Precision;
use crate::trace::HitId;
use std::ops::Range;

/// Evaluates the surfaces of a batch's hits, up to [`STEP`] hits of one interaction at a
/// time.
pub(super) fn fill_hit_buffer(
    (world, precision): (&World, Precision),
    (queue, rays): (&RayQueue, Range<usize>),
    (t, instance, primitive): (&[f64], &[u64], &[u32]),
    buffer: &mut HitBuffer,
) {
    let met = |row: &usize| instance[*row] != HitId::NONE.instance;
    buffer.start((0..rays.len()).filter(met).count());
    let mut open: [Option<PendingHits>; OPEN_SITES] = [const { None }; OPEN_SITES];
    let mut oldest = 0;
    for (hit, row) in (0..rays.len()).filter(met).enumerate() {
        let id = HitId {
            instance: instance[row],
            primitive: primitive[row],
        };
        let has =
            |pending: &Option<PendingHits>| pending.as_ref().is_some_and(|b| b.interaction.has(id));
        let at = open.iter().position(has).unwrap_or_else(|| {
            let interaction = InteractionPart::of(world, precision, id);
            if let Some(pending) = open[oldest].replace(PendingHits::new(interaction)) {
                pending.flush(queue, rays.start, (t, primitive), buffer);
            }
            oldest = (oldest + 1) % OPEN_SITES;
            (oldest + OPEN_SITES - 1) % OPEN_SITES
        });
        let Some(pending) = &mut open[at] else {
            continue;
        };
        buffer.row[hit] = (rays.start + row) as u32;
        buffer.material[hit] = pending.interaction.material(id.primitive);
        pending.hits[pending.len] = hit as u32;
        pending.len += 1;
        if pending.len == STEP {
            pending.flush(queue, rays.start, (t, primitive), buffer);
            pending.len = 0;
        }
    }
    for pending in open.iter().flatten() {
        pending.flush(queue, rays.start, (t, primitive), buffer);
    }
    buffer.finish();
}

/// Number of sites whose hits are collected at the same time.
const OPEN_SITES: usize = 4;

/// Hits of one interaction, collected until they fill a step.
struct PendingHits<'w> {
    interaction: InteractionPart<'w>,
    hits: [u32; STEP],
    len: usize,
}

impl<'w> PendingHits<'w> {
    fn new(interaction: InteractionPart<'w>) -> PendingHits<'w> {
        PendingHits {
            interaction,
            hits: [0; STEP],
            len: 0,
        }
    }

    /// Evaluates the collected hits. `t` and `primitive` hold the rays from `first` on.
    fn flush(
        &self,
        queue: &RayQueue,
        first: usize,
        (t, primitive): (&[f64], &[u32]),
        buffer: &mut HitBuffer,
    ) {
        let Some(last) = self.len.checked_sub(1) else {
            return;
        };
        let hits: [u32; STEP] = std::array::from_fn(|i| self.hits[i.min(last)]);
        let rays = hits.map(|hit| buffer.row[hit as usize]);
        evaluate_step(
            (&self.interaction, first),
            (queue, &rays),
            (t, primitive),
            (&hits, self.len),
            buffer,
        );
    }
}

/// Evaluates the surfaces of a step of an interaction's hits into rows of the buffer; `count` of
/// the rays are not repeated. `t` and `primitive` hold the rays from `first` on.
#[inline(never)]
pub(super) fn evaluate_step(
    (interaction, first): (&InteractionPart, usize),
    (queue, rays): (&RayQueue, &[u32; STEP]),
    (t, primitive): (&[f64], &[u32]),
    (hits, count): (&[u32; STEP], usize),
    buffer: &mut HitBuffer,
) {
    let (org, dir) = queue.gather(rays);
    let rows = each_lane(|i| rays[i] - first as u32);
    let primitives = each_lane(|i| primitive[rows[i] as usize]);
    let t = gather(t, &rows);
    let surfaces = interaction.surfaces((org, dir), t, &primitives);
    buffer.set(hits, &surfaces, dir);
    if buffer.wants_lift {
        // Of other surfaces too: a step before may have written these rows.
        let lift = match interaction.is_smooth() {
            true => interaction.lift(&surfaces, &primitives),
            false => Vec3::splat([0.0; 3]),
        };
        buffer.lift.scatter(hits, lift);
    }
    if buffer.wants_places
        && let Some(places) = interaction.places(&surfaces, &primitives)
    {
        for (hit, place) in hits.iter().zip(places).take(count) {
            buffer.places[*hit as usize] = place;
        }
    }
    if buffer.wants_spots
        && let Some(spots) = interaction.spots(&surfaces, &primitives)
    {
        for (hit, spot) in hits.iter().zip(spots).take(count) {
            buffer.spots[*hit as usize] = spot;
        }
    }
}
