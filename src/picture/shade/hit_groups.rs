//! Hits of a wave in groups of one material and one surface, so that surfaces are evaluated and
//! shaded a whole step of adjoining rows at a time, whichever rays met them.

use super::columns::{STEP, each_lane};
use super::hit_buffer::HitBuffer;
use super::hits::evaluate_step;
use super::interaction::{InteractionPart, SurfaceKey};
use super::ray_queue::{BATCH, RayQueue};
use crate::accel::World;
use crate::plan::Precision;
use crate::scene::MaterialId;
use crate::trace::HitId;
use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;

/// Columns by which the hits of a wave are grouped, reused by every wave.
pub struct HitGroups<'b> {
    /// The group of each ray's hit, or [`NO_GROUP`].
    of_ray: ArenaVec<'b, u16>,
    groups: ArenaVec<'b, Group>,
    /// Groups by material, and those of a material as they were met.
    order: ArenaVec<'b, u16>,
    /// The last group with a key of each hash. Two keys of one hash that take turns make several
    /// groups of a key, which costs steps that are not full.
    last_of: ArenaVec<'b, u16>,
}

const NO_GROUP: u16 = u16::MAX;
const _: () = assert!(BATCH < NO_GROUP as usize);

/// Number of hashes: of forty surfaces, one pair has one hash.
const HASHES: usize = 1024;

/// Hits of one material and one surface.
#[derive(Clone, Copy)]
struct Group {
    /// One of the hits.
    id: HitId,
    key: SurfaceKey,
    hits: u32,
    /// Row of the hit buffer that the group's next hit gets.
    next: u32,
}

impl<'b> HitGroups<'b> {
    pub fn new(arena: &'b Bump) -> HitGroups<'b> {
        HitGroups {
            of_ray: ArenaVec::with_capacity_in(BATCH, arena),
            groups: ArenaVec::with_capacity_in(BATCH, arena),
            order: ArenaVec::with_capacity_in(BATCH, arena),
            last_of: ArenaVec::with_capacity_in(HASHES, arena),
        }
    }

    /// Evaluates the surfaces of the hits of a queue of at most [`BATCH`] rays into rows of
    /// adjoining materials, those without one last, and within a material of adjoining surfaces.
    pub(super) fn fill(
        &mut self,
        (world, precision): (&World, Precision),
        queue: &RayQueue,
        (t, instance, primitive): (&[f64], &[u64], &[u32]),
        buffer: &mut HitBuffer,
    ) {
        let rays = queue.len();
        self.find((world, rays), (instance, primitive));
        let hits = self.place();
        buffer.start(hits);
        for (ray, group) in self.of_ray.iter().enumerate() {
            if let Some(group) = self.groups.get_mut(usize::from(*group)) {
                let row = group.next as usize;
                group.next += 1;
                buffer.row[row] = ray as u32;
                buffer.material[row] = group.key.material;
            }
        }
        for group in &self.order {
            let group = &self.groups[usize::from(*group)];
            let interaction = InteractionPart::of(world, precision, group.id);
            let end = group.next;
            for first in (end - group.hits..end).step_by(STEP) {
                // Rows behind the group's are written here and again by the groups they belong
                // to, which come later.
                let rows = each_lane(|i| first + i as u32);
                let rays = each_lane(|i| buffer.row[rows[i].min(end - 1) as usize]);
                let count = ((end - first) as usize).min(STEP);
                let to = (&rows, count);
                evaluate_step(
                    (&interaction, 0),
                    (queue, &rays),
                    (t, primitive),
                    to,
                    buffer,
                );
            }
        }
        buffer.finish();
    }

    /// Finds the group of each hit.
    fn find(&mut self, (world, rays): (&World, usize), (instance, primitive): (&[u64], &[u32])) {
        self.of_ray.clear();
        self.groups.clear();
        self.last_of.clear();
        self.last_of.resize(HASHES, NO_GROUP);
        // The instance of the hit before, and its group, if all hits of it are of one.
        let mut before = (HitId::NONE.instance, NO_GROUP);
        for (instance, primitive) in instance.iter().zip(primitive).take(rays) {
            if *instance == HitId::NONE.instance {
                self.of_ray.push(NO_GROUP);
                continue;
            }
            if *instance == before.0 {
                self.groups[usize::from(before.1)].hits += 1;
                self.of_ray.push(before.1);
                continue;
            }
            let id = HitId {
                instance: *instance,
                primitive: *primitive,
            };
            let (key, only) = SurfaceKey::of(world, id);
            let last = &mut self.last_of[key.hash() % HASHES];
            let found = self.groups.get(usize::from(*last));
            if found.is_none_or(|group| group.key != key) {
                *last = self.groups.len() as u16;
                self.groups.push(Group {
                    id,
                    key,
                    hits: 0,
                    next: 0,
                });
            }
            self.groups[usize::from(*last)].hits += 1;
            self.of_ray.push(*last);
            if only {
                before = (id.instance, *last);
            }
        }
    }

    /// Gives each group its rows, and returns their number.
    fn place(&mut self) -> usize {
        self.order.clear();
        self.order.extend(0..self.groups.len() as u16);
        let groups = &mut self.groups;
        let material = |group: u16| {
            groups[usize::from(group)]
                .key
                .material
                .map(MaterialId::index)
        };
        self.order
            .sort_unstable_by_key(|group| (material(*group).unwrap_or(usize::MAX), *group));
        let mut first = 0;
        for group in &self.order {
            let group = &mut groups[usize::from(*group)];
            group.next = first;
            first += group.hits;
        }
        first as usize
    }
}
