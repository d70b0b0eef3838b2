//! Surfaces of which images say that they are not there, for rays that take no random numbers:
//! rays pass where less than half of a surface is there.

use super::hit_buffer::HitBuffer;
use super::hit_columns::HitColumns;
use super::hits::fill_hit_buffer;
use super::ray_queue::RayQueue;
use super::textures::{Footprint, Place, colored};
use crate::accel::World;
use crate::plan::Kernels;
use crate::scene::{Alpha, MaterialId, Tables};
use crate::trace::{HitId, RayKind, TraceScratch};
use bumpalo::Bump;
use glam::DVec3;
use std::ops::Range;

/// Rays pass no more surfaces than this.
const MOST_PASSED: usize = 256;

/// Columns of a batch's closest hits.
pub(super) struct HitSlices<'a> {
    pub t: &'a mut [f64],
    pub instance: &'a mut [u64],
    pub primitive: &'a mut [u32],
}

/// Rays behind surfaces that are not there, by row of their batch, and what they meet.
pub(super) struct Passing<'b> {
    rays: RayQueue<'b>,
    hits: HitColumns<'b>,
    /// Surfaces on the way to a light.
    buffer: HitBuffer<'b>,
}

impl<'b> Passing<'b> {
    /// Makes columns that take no memory before they are used.
    pub fn new(arena: &'b Bump) -> Passing<'b> {
        Passing {
            rays: RayQueue::with_capacity(0, arena),
            hits: HitColumns::empty(arena),
            buffer: HitBuffer::with_capacity(0, arena),
        }
    }

    fn trace(&mut self, (world, kernels): (&World, &Kernels), trace: &mut TraceScratch) {
        self.hits
            .closest_of((world, kernels), &mut self.rays, trace);
    }
}

/// Says whether some material's alpha varies.
pub(super) fn has_cutouts(scene: &Tables) -> bool {
    let mut rows = scene.textures.iter();
    rows.any(|row| row.texturing.alpha != Alpha::Opaque)
}

/// Brings rays of a batch to the first surfaces that are there, at least by half.
pub(super) fn pass_cutouts(
    (world, kernels): (&World, &Kernels),
    (queue, batch): (&mut RayQueue, Range<usize>),
    hits: &mut HitSlices,
    (passing, buffer, trace): (&mut Passing, &mut HitBuffer, &mut TraceScratch),
) {
    passing.rays.truncate(0);
    for round in 0..MOST_PASSED {
        if round > 0 {
            passing.trace((world, kernels), trace);
            for i in 0..passing.rays.len() {
                let row = passing.rays.pixel[i] as usize;
                queue.set_org(batch.start + row, passing.rays.org(i));
                hits.t[row] = passing.hits.t[i];
                hits.instance[row] = passing.hits.instance[i];
                hits.primitive[row] = passing.hits.primitive[i];
            }
        }
        let (rays, count) = match round {
            0 => ((&*queue, batch.clone()), batch.len()),
            _ => ((&passing.rays, 0..passing.rays.len()), passing.rays.len()),
        };
        let found: (&[f64], &[u64], &[u32]) = match round {
            0 => (&*hits.t, &*hits.instance, &*hits.primitive),
            _ => (
                &passing.hits.t,
                &passing.hits.instance,
                &passing.hits.primitive,
            ),
        };
        fill_hit_buffer((world, kernels.precision), rays, found, buffer);
        for hit in 0..buffer.len() {
            if is_there(&world.scene, buffer.material[hit], &buffer.places[hit]) {
                continue;
            }
            let at = buffer.row[hit] as usize;
            let row = match round {
                0 => at - batch.start,
                _ => passing.rays.pixel[at] as usize,
            };
            let dir = DVec3::from_array(queue.dir(batch.start + row));
            let org = buffer.surface(hit).leave(dir);
            let kind = RayKind::Refraction;
            let rays = &mut passing.rays;
            rays.push(org, dir, f32::INFINITY, row as u32, [1.0; 3], kind);
        }
        if round > 0 {
            passing.rays.drop_first(count);
        }
        if passing.rays.is_empty() {
            break;
        }
    }
}

/// Finds the rays to lights that nothing blocks but surfaces that are not there.
pub(super) fn unblock(
    (world, kernels): (&World, &Kernels),
    (rays, blocked): (&RayQueue, &mut [bool]),
    passing: &mut Passing,
    trace: &mut TraceScratch,
) {
    passing.buffer.wants_places = true;
    passing.rays.truncate(0);
    for i in (0..blocked.len()).filter(|i| blocked[*i]) {
        let [org, dir] = [rays.org(i), rays.dir(i)].map(DVec3::from_array);
        let queue = &mut passing.rays;
        queue.push(org, dir, rays.t_max[i], i as u32, [1.0; 3], rays.kind[i]);
    }
    for _ in 0..MOST_PASSED {
        let count = passing.rays.len();
        if count == 0 {
            break;
        }
        passing.trace((world, kernels), trace);
        for i in (0..count).filter(|i| passing.hits.instance[*i] == HitId::NONE.instance) {
            blocked[passing.rays.pixel[i] as usize] = false;
        }
        fill_hit_buffer(
            (world, kernels.precision),
            (&passing.rays, 0..count),
            (
                &passing.hits.t,
                &passing.hits.instance,
                &passing.hits.primitive,
            ),
            &mut passing.buffer,
        );
        for hit in 0..passing.buffer.len() {
            let buffer = &passing.buffer;
            if is_there(&world.scene, buffer.material[hit], &buffer.places[hit]) {
                continue;
            }
            let at = buffer.row[hit] as usize;
            let queue = &mut passing.rays;
            let (row, kind) = (queue.pixel[at], queue.kind[at]);
            let dir = DVec3::from_array(queue.dir(at));
            let org = buffer.surface(hit).leave(dir);
            let end = (f64::from(queue.t_max[at]) - passing.hits.t[at]) as f32;
            match end > 0.0 {
                true => queue.push(org, dir, end, row, [1.0; 3], kind),
                false => blocked[row as usize] = false,
            }
        }
        passing.rays.drop_first(count);
    }
}

/// Says whether at least half of a surface is there.
fn is_there(scene: &Tables, material: Option<MaterialId>, place: &Place) -> bool {
    let row = material.and_then(|id| Some((id, scene.textures.of(id)?)));
    let Some((id, row)) = row else {
        return true;
    };
    let opacity = scene.materials.rows[id.index()].layers.opacity;
    let least = match row.texturing.alpha {
        Alpha::Opaque => return true,
        Alpha::Mask(_) if opacity < 0.5 => return false,
        Alpha::Mask(cutoff) => cutoff,
        Alpha::Blend => 0.5 / opacity,
    };
    let [.., alpha] = colored(scene, &row, [0.0; 3], (place, Footprint::POINT));
    alpha >= least
}
