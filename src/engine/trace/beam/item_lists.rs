//! Beams that go through their list of an item buffer instead of the trees, with the tests
//! of the tree walk.

use super::fast::Fast;
use super::guarded::{GuardedLeaf, PinholeEdges};
use super::mesh::MeshTraversal;
use super::rays::Pinhole;
use super::{BEAM, BeamTraversal};
use crate::accel::{BoxRows, ItemBoxes, TlasEntry, World};
use crate::geom::Certainty;
use crate::math::lanes::{Lanes, Mask};
use crate::scene::Shape;
use crate::trace::item_buffer::{Item, ItemBuffer};
use crate::trace::leaf::Tester;
use crate::trace::query::Query;
use crate::trace::rays::Rays;
use crate::trace::stream::StreamScratch;

impl<'a, L: Lanes, const S: usize> BeamTraversal<'a, L, S> {
    /// Returns the beam's list in the buffer, if it has one.
    pub fn list<'i>(&self, items: &'i ItemBuffer, tile: usize) -> Option<&'i [Item]> {
        if self.beam.parallel {
            return None;
        }
        let rows = self.first..self.first + BEAM;
        let is_alive = |i: usize| self.rays.t_max[rows.start + i] > 0.0;
        let leader = (0..BEAM).find(|i| is_alive(*i))?;
        let mut dirs = [[0.0; BEAM]; 3];
        for i in 0..BEAM {
            let ray = if is_alive(i) { i } else { leader };
            let dir = self.rays.dir.at(rows.start + ray);
            for (column, x) in dirs.iter_mut().zip(dir) {
                column[i] = x as f32;
            }
        }
        items.list(tile, self.org, [&dirs[0], &dirs[1], &dirs[2]])
    }

    /// Traces the beam through its list. Returns the undecided rays.
    #[inline(never)]
    pub fn trace_items<C: Certainty, Q: Query<L>>(
        mut self,
        items: &[Item],
        boxes: &ItemBoxes,
        queries: &mut [Q; S],
        streams: &mut StreamScratch,
    ) -> u64 {
        let world = self.world;
        if !world.unbounded.is_empty() {
            for (s, query) in queries.iter_mut().enumerate() {
                let packet = self.packets.get(s, self.rays, self.first, world);
                Tester::<L, C>::new(world, packet, self.scratch).unbounded(query);
            }
        }
        for (s, query) in queries.iter().enumerate() {
            self.beam.limit_t::<C, Q>(s, query.limit());
        }
        for run in items.chunk_by(|a, b| a.entry == b.entry) {
            let entry = &world.entries[run[0].entry as usize];
            self.listed::<C, Q>(entry, run, boxes, queries, streams);
        }
        self.deferred_rays::<C>()
    }

    /// Tests the items of one entry.
    #[inline(always)]
    fn listed<C: Certainty, Q: Query<L>>(
        &mut self,
        entry: &TlasEntry,
        run: &[Item],
        boxes: &ItemBoxes,
        queries: &mut [Q; S],
        streams: &mut StreamScratch,
    ) {
        let Shape::Mesh(id) = entry.shape else {
            self.solid::<C, Q>(entry, queries);
            return;
        };
        let Some(boxes) = &boxes.meshes[id.index()] else {
            return;
        };
        let (world, rays, first) = (self.world, self.rays, self.first);
        let through = |inside: MeshTraversal<L, S>, queries: &mut [Q; S]| {
            inside.trace_items::<C, Q>(world, rays, first, run, boxes, queries)
        };
        if entry.placed {
            self.placed_mesh::<C, Q>(entry, id, queries, streams, through);
        } else {
            self.mesh_in_world::<C, Q>(entry, id, queries, streams, through);
        }
    }
}

impl<L: Lanes, const S: usize> MeshTraversal<'_, L, S> {
    /// Tests the blocks of the list, in the order of their nearest depth.
    #[inline(never)]
    fn trace_items<C: Certainty, Q: Query<L>>(
        mut self,
        world: &World,
        rays: &Rays,
        start: usize,
        items: &[Item],
        boxes: &BoxRows,
        queries: &mut [Q; S],
    ) -> [L::Mask; S] {
        let mesh = self.mesh;
        let guarded = C::GUARDED;
        if guarded {
            self.start_guarded::<Pinhole, Q>(queries);
        }
        for (number, item) in items.iter().enumerate() {
            if let Some(item) = items.get(number + 2) {
                mesh.blocks.prefetch(item.block as usize);
            }
            let block = item.block as usize;
            let (rays, any) = self.rays_in::<Pinhole>(boxes.get(block));
            if any && guarded {
                self.blocks::<GuardedLeaf<PinholeEdges>, Q>(&rays, block, 1, queries);
            } else if any {
                self.blocks::<Fast<Pinhole>, Q>(&rays, block, 1, queries);
            }
        }
        if guarded {
            return self.commit_guarded::<Pinhole, Q>(queries);
        }
        self.commit_all::<Pinhole, Q>(world, rays, start, queries);
        [L::Mask::splat(false); S]
    }
}
