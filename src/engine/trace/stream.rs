//! Streams: incoherent rays that share the fetching of nodes and blocks
//! ([`crate::accel::WideBvh::walk_stream`]), with a node's children or a block's triangles in
//! lanes.
//!
//! The lanes only cull. Remaining triangles go to the same one-lane test as a packet's lane,
//! so the answers have the same bits.

use super::leaf::{Tester, Window};
use super::nested::Level;
use super::query::{HitId, Query};
use super::ray_stream::{BlockPlanes, StreamRays};
use super::rays::Rays;
use super::scratch::TraceScratch;
use super::solids::{Packets, StreamPackets};
use crate::accel::{Block, BoxRays, STREAM, StreamStack, TlasEntry, UNUSED, World};
use crate::geom::Certainty;
use crate::math::Affine;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::scene::{MeshId, Shape};
use glam::DVec3;

/// Rays and stacks of streams, reused from stream to stream.
#[derive(Default)]
pub(super) struct StreamScratch {
    world: StreamRays,
    pub object: StreamRays,
    top: StreamStack,
    pub mesh: StreamStack,
    /// Nested worlds: levels that are not in use.
    pub levels: Vec<Box<Level>>,
}

/// An entry that is being tested, with its `object_from_world` where that is at hand.
#[derive(Clone, Copy)]
pub(super) struct TestedInstance<'a> {
    pub entry: &'a TlasEntry,
    pub map: Option<&'a Affine>,
}

impl<'a> TestedInstance<'a> {
    pub fn new(entry: &'a TlasEntry) -> TestedInstance<'a> {
        TestedInstance { entry, map: None }
    }
}

/// The rays of one stream: [`STREAM`] rows from `first` on.
pub(super) struct Stream<'a> {
    pub world: &'a World,
    pub rays: &'a Rays<'a>,
    pub first: usize,
}

impl Stream<'_> {
    /// Returns the rays as packets for tests of single primitives.
    pub fn packets<'s, L: Lanes, const S: usize>(
        &'s self,
        scratch: &'s mut TraceScratch,
    ) -> StreamPackets<'s, L, S> {
        StreamPackets {
            world: self.world,
            rays: self.rays,
            first: self.first,
            packets: Packets::none(),
            scratch,
        }
    }

    #[inline(always)]
    pub fn org(&self, i: usize) -> [f64; 3] {
        self.rays.org.at(self.first + i)
    }

    #[inline(always)]
    pub fn dir(&self, i: usize) -> [f64; 3] {
        self.rays.dir.at(self.first + i)
    }

    #[inline(always)]
    pub fn t_min(&self, i: usize) -> f32 {
        self.rays.t_min[self.first + i]
    }

    /// Traces the `active` rays through a flat world.
    #[inline(always)]
    pub fn trace<L: Lanes, const S: usize, C: Certainty, Q: Query<L::Single>>(
        &self,
        active: u64,
        queries: &mut [Q; STREAM],
        walk: &mut StreamScratch,
        scratch: &mut TraceScratch,
    ) {
        let world = self.world;
        let mut solids = self.packets::<L, S>(scratch);
        for entry in world.unbounded_solids() {
            solids.meet::<C, Q>(entry, None, active, queries);
        }
        for (entry, id) in world.unbounded_meshes() {
            self.mesh_alone::<L::Single, C, Q>(entry, id, active, queries, walk, solids.scratch);
        }
        let Some(levels) = world.wide() else { return };
        // The box of a single primitive is not worth testing, unless the primitive is
        // expensive.
        if let [only] = &world.entries[..]
            && !matches!(only.shape, Shape::Mesh(_) | Shape::Csg(_))
        {
            let mut open = 0;
            for_each_bit(active, |i| {
                open |= u64::from(limit(&queries[i]) >= 0.0) << i;
            });
            return solids.meet::<C, Q>(only, None, open, queries);
        }
        let StreamScratch {
            world: stream_rays,
            object,
            top,
            mesh: stack,
            ..
        } = walk;
        let ray = |i: usize| {
            let org = DVec3::from_array(self.org(i)) - world.center;
            (org.to_array(), self.dir(i), self.t_min(i))
        };
        stream_rays.load(active, ray, &levels.tlas.bounds, true);
        let mut open = 0;
        for_each_bit(active, |i| {
            let limit = limit(&queries[i]);
            stream_rays.boxes.limit[i] = limit;
            open |= u64::from(limit >= 0.0) << i;
        });
        let mut boxes = stream_rays.boxes.clone();
        levels.tlas.walk_stream::<true>(
            &mut boxes,
            open,
            top,
            |_| (),
            |boxes, first, count, mut set| {
                let mut done = 0;
                for entry in &world.entries[first..first + count] {
                    let met = TestedInstance::new(entry);
                    match entry.shape {
                        Shape::Mesh(id) => {
                            if entry.placed {
                                let walk = (&mut *object, &mut *stack);
                                self.placed_mesh::<L::Single, C, Q>(
                                    met,
                                    id,
                                    set,
                                    queries,
                                    walk,
                                    solids.scratch,
                                );
                            } else {
                                stream_rays.boxes.limit = boxes.limit;
                                let walk = (&mut *stream_rays, &mut *stack);
                                self.in_mesh::<L::Single, C, Q>(
                                    met,
                                    id,
                                    set,
                                    queries,
                                    walk,
                                    solids.scratch,
                                );
                            }
                        }
                        _ => solids.meet::<C, Q>(entry, None, set, queries),
                    }
                    for_each_bit(set, |i| {
                        boxes.limit[i] = limit(&queries[i]);
                        done |= u64::from(boxes.limit[i] < 0.0) << i;
                    });
                    set &= !done;
                    if set == 0 {
                        break;
                    }
                }
                done
            },
        );
    }

    /// Traces a placed mesh with the rays in its space.
    #[inline(never)]
    pub fn placed_mesh<L: Lanes, C: Certainty, Q: Query<L>>(
        &self,
        met: TestedInstance,
        id: MeshId,
        set: u64,
        queries: &mut [Q; STREAM],
        (stream_rays, stack): (&mut StreamRays, &mut StreamStack),
        scratch: &mut TraceScratch,
    ) {
        let world = self.world;
        let Some(mesh) = world.wide_mesh(id) else {
            return;
        };
        let look_up = || world.object_from_world(met.entry.instance);
        let map = met.map.copied().unwrap_or_else(look_up);
        let met = TestedInstance {
            map: Some(&map),
            ..met
        };
        let center = world.scene.meshes.center[id.index()];
        let ray = |i: usize| {
            let org = DVec3::from_array(map.point(self.org(i))) - center;
            (org.to_array(), map.vector(self.dir(i)), self.t_min(i))
        };
        stream_rays.load(set, ray, &mesh.tree.bounds, true);
        for_each_bit(set, |i| stream_rays.boxes.limit[i] = limit(&queries[i]));
        self.in_mesh::<L, C, Q>(met, id, set, queries, (stream_rays, stack), scratch);
    }

    /// Traces a single mesh, for rays that are traced otherwise through the rest of the world.
    pub fn mesh_alone<L: Lanes, C: Certainty, Q: Query<L>>(
        &self,
        entry: &TlasEntry,
        id: MeshId,
        set: u64,
        queries: &mut [Q; STREAM],
        walk: &mut StreamScratch,
        scratch: &mut TraceScratch,
    ) {
        let StreamScratch { object, mesh, .. } = walk;
        let (met, stack) = (TestedInstance::new(entry), mesh);
        if entry.placed {
            return self.placed_mesh::<L, C, Q>(met, id, set, queries, (object, stack), scratch);
        }
        let Some(mesh) = self.world.wide_mesh(id) else {
            return;
        };
        let ray = |i: usize| (self.org(i), self.dir(i), self.t_min(i));
        object.load(set, ray, &mesh.tree.bounds, true);
        for_each_bit(set, |i| object.boxes.limit[i] = limit(&queries[i]));
        self.in_mesh::<L, C, Q>(met, id, set, queries, (object, stack), scratch);
    }

    /// Traces a mesh's tree; `stream_rays` are the rays in its space.
    #[inline(never)]
    fn in_mesh<L: Lanes, C: Certainty, Q: Query<L>>(
        &self,
        met: TestedInstance,
        id: MeshId,
        set: u64,
        queries: &mut [Q; STREAM],
        (stream_rays, stack): (&mut StreamRays, &mut StreamStack),
        scratch: &mut TraceScratch,
    ) {
        let Some(mesh) = self.world.wide_mesh(id) else {
            return;
        };
        let StreamRays {
            boxes,
            triangle_rays,
        } = stream_rays;
        // Sets of triangles by ray, valid for the rays in `some` and `sures`.
        let (mut bits, mut sure) = ([0; STREAM], [0; STREAM]);
        let leaf = |boxes: &mut BoxRays, first: usize, count: usize, set: u64| {
            let mut done = 0;
            for number in first..first + count {
                let block = mesh.blocks.get(number);
                // All rays are culled first: hits are unpredictable branches, and are kept
                // out of this loop.
                let planes = BlockPlanes::new(block, C::GUARDED);
                let (mut some, mut sures) = (0, 0);
                for_each_bit(set & !done, |i| {
                    let sighted = if C::DOUBTS_ALL {
                        [u32::MAX, 0]
                    } else if C::GUARDED {
                        triangle_rays.may_meet(i, &planes, boxes.limit[i])
                    } else {
                        triangle_rays.meets(i, &planes, boxes.limit[i])
                    };
                    bits[i] = sighted[0];
                    some |= u64::from(bits[i] != 0) << i;
                    if Q::ANY {
                        sure[i] = sighted[1];
                        sures |= u64::from(sure[i] != 0) << i;
                    }
                });
                for_each_bit(sures, |i| {
                    let slot = sure[i].trailing_zeros() as usize;
                    let id = HitId {
                        instance: met.entry.instance,
                        primitive: block.source(slot),
                    };
                    queries[i].block(L::Mask::splat(true), id);
                    boxes.limit[i] = -1.0;
                });
                done |= sures;
                for_each_bit(some & !sures, |i| {
                    let query = &mut queries[i];
                    self.offer::<L, C, Q>(i, met, id, (block, bits[i]), query, scratch);
                    boxes.limit[i] = limit(query);
                    done |= u64::from(Q::ANY && boxes.limit[i] < 0.0) << i;
                });
            }
            done
        };
        let expect = |block: usize| mesh.blocks.prefetch(block);
        if Q::ANY {
            mesh.tree
                .walk_stream::<false>(boxes, set, stack, expect, leaf);
        } else {
            mesh.tree
                .walk_stream::<true>(boxes, set, stack, expect, leaf);
        }
    }

    /// Tests one ray against triangles of a block that passed the culling.
    #[inline(never)]
    fn offer<L: Lanes, C: Certainty, Q: Query<L>>(
        &self,
        i: usize,
        TestedInstance { entry, map }: TestedInstance,
        id: MeshId,
        (block, mut bits): (Block, u32),
        query: &mut Q,
        scratch: &mut TraceScratch,
    ) {
        // Guarded hits do not depend on boxes.
        let packet = if C::GUARDED {
            self.rays.open_packet::<L>(self.first + i)
        } else {
            self.rays.packet::<L>(self.first + i, self.world)
        };
        let mut tester = Tester::<L, C>::new(self.world, &packet, scratch).with_map(map);
        let object = tester.mesh_packet(entry, id);
        let active = L::Mask::splat(true);
        let (window, active) = if C::GUARDED {
            (Window::all(), active)
        } else {
            tester.window(entry, active, query.limit())
        };
        while bits != 0 {
            let slot = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let Some(primitive) = block.sources().get(slot).filter(|s| **s != UNUSED) else {
                break;
            };
            let id = HitId {
                instance: entry.instance,
                primitive: *primitive,
            };
            tester.triangle(&object, &window, &block.corners(slot), id, active, query);
        }
    }
}

/// Calls `f` for every bit of a set, in rising order.
#[inline(always)]
pub(super) fn for_each_bit(mut set: u64, mut f: impl FnMut(usize)) {
    while set != 0 {
        let i = set.trailing_zeros() as usize % STREAM;
        set &= set - 1;
        f(i);
    }
}

/// Returns the limit of a query of one ray.
#[inline(always)]
pub(super) fn limit<L: Lanes, Q: Query<L>>(query: &Q) -> f32 {
    query.limit().lane(0).to_f64() as f32
}
