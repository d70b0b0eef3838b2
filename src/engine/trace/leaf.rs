//! Tests of primitives: from an entry of the world to hits in a query.
//!
//! The same functions serve trees, linear scan, shadow cache and exact fallback at every
//! width, so all of them agree on a hit. In `fast` it is the kernel's, with t clamped to the
//! intervals of the primitive's and the instance's box (X5). In `guarded` it is that of exact
//! arithmetic ([`super::exact_fallback`]).

mod single;

use super::exact_fallback::KnownHits;
use super::packet::Packet;
use super::query::{HitId, Query};
use super::scratch::TraceScratch;
use crate::accel::{
    AnyScratch, BaselineAccelerator, BaselineBlas, Count, TlasEntry, World, corner_bounds,
};
use crate::geom::{Certainty, Meet, triangle};
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::math::{Aabb32, Affine};
use crate::scene::{MeshId, Shape};
use glam::DVec3;
use std::marker::PhantomData;

/// The interval of t that an instance's world box leaves to each lane.
#[derive(Clone, Copy)]
pub(super) struct Window<L: Lanes> {
    pub enter: L,
    pub exit: L,
}

impl<L: Lanes> Window<L> {
    #[inline(always)]
    pub fn all() -> Window<L> {
        let infinity = L::splat(L::Scalar::INFINITY);
        Window {
            enter: -infinity,
            exit: infinity,
        }
    }
}

/// Tests of one packet against the primitives of one world.
pub struct Tester<'w, L: Lanes, C> {
    pub world: &'w World,
    /// World space.
    pub packet: &'w Packet<L>,
    pub(super) scratch: &'w mut TraceScratch,
    /// `object_from_world` of the instance under test, where it is at hand.
    map: Option<&'w Affine>,
    certainty: PhantomData<C>,
}

impl<'w, L: Lanes, C: Certainty> Tester<'w, L, C> {
    #[inline(always)]
    pub fn new(world: &'w World, packet: &'w Packet<L>, scratch: &'w mut TraceScratch) -> Self {
        Tester {
            world,
            packet,
            scratch,
            map: None,
            certainty: PhantomData,
        }
    }

    /// Sets the `object_from_world` of the one instance that will be tested.
    #[inline(always)]
    pub(super) fn with_map(self, map: Option<&'w Affine>) -> Self {
        Tester { map, ..self }
    }

    /// Traces the packet through comparison structures, with scratch of the top level and of
    /// meshes.
    pub fn trace<Q: Query<L>>(
        &mut self,
        levels: &BaselineAccelerator,
        query: &mut Q,
        [top, mesh]: &mut [AnyScratch<L>; 2],
        count: Count,
    ) {
        let (world, packet) = (self.world, self.packet);
        self.unbounded(query);
        for (entry, id) in world.unbounded_meshes() {
            if let Some(index) = &levels.blases[id.index()] {
                let active = packet.ray.t_min.lt(query.limit());
                self.mesh(entry, id, index, active, query, (mesh, count));
            }
        }
        levels.tlas.walk(
            &packet.slabs,
            packet.ray.t_min,
            query.limit(),
            top,
            count,
            &mut |first, number, active, _| {
                for entry in &world.entries[first..first + number] {
                    match entry.shape {
                        Shape::Mesh(id) => {
                            if let Some(index) = &levels.blases[id.index()] {
                                self.mesh(entry, id, index, active, query, (mesh, count));
                            }
                        }
                        _ => {
                            count.test(active, 1);
                            self.solid(entry, active, query);
                        }
                    }
                }
                query.limit()
            },
        );
    }

    /// Tests the unbounded solids, which no tree contains.
    #[inline(always)]
    pub(super) fn unbounded<Q: Query<L>>(&mut self, query: &mut Q) {
        let world = self.world;
        for entry in world.unbounded_solids() {
            let active = self.packet.ray.t_min.lt(query.limit());
            self.solid(entry, active, query);
        }
    }

    /// Traces a mesh through its comparison structure.
    fn mesh<Q: Query<L>>(
        &mut self,
        entry: &TlasEntry,
        mesh: MeshId,
        of: &BaselineBlas,
        active: L::Mask,
        query: &mut Q,
        (scratch, count): (&mut AnyScratch<L>, Count),
    ) {
        let (window, active) = self.window(entry, active, query.limit());
        if active.none() {
            return;
        }
        let object = self.mesh_packet(entry, mesh);
        // Lanes outside the window must stay inactive in the tree.
        let asleep = -L::splat(L::Scalar::INFINITY);
        let limit = L::select(active, query.limit(), asleep);
        of.index.walk(
            &object.slabs,
            object.ray.t_min,
            limit,
            scratch,
            count,
            &mut |first, number, active, _| {
                count.test(active, number);
                for slot in first..first + number {
                    let corners = &of.corners[slot];
                    let id = HitId {
                        instance: entry.instance,
                        primitive: of.source[slot],
                    };
                    self.triangle(&object, &window, corners, id, active, query);
                }
                L::select(query.limit().le(limit), query.limit(), asleep)
            },
        );
    }

    /// Tests one triangle. Returns whether it was hit or undecided in any lane.
    #[inline(always)]
    pub(super) fn triangle<Q: Query<L>>(
        &mut self,
        object: &Packet<L>,
        window: &Window<L>,
        corners: &triangle::Corners,
        id: HitId,
        active: L::Mask,
        query: &mut Q,
    ) -> bool {
        let meet = if C::DOUBTS_ALL {
            Meet::unsure(active)
        } else if C::GUARDED {
            let meet = triangle::meet_guarded(corners, &object.ray, active);
            mark_undecided::<L, C>(meet, active, id)
        } else {
            triangle::meet(corners, &object.ray, active)
        };
        let some = (meet.hit | meet.unsure).any();
        if some && C::GUARDED {
            self.offer_guarded(&meet, id, Some(corners), query);
        } else if some {
            self.offer(object, window, &corner_bounds(corners), meet, id, query);
        }
        some
    }

    /// Tests one primitive by its id, for the shadow cache and for temporal bounds.
    #[inline(never)]
    pub fn single<Q: Query<L>>(&mut self, id: HitId, query: &mut Q) {
        let world = self.world;
        let entry = world.entry_of(id.instance);
        let active = self.packet.ray.t_min.lt(query.limit());
        match entry.shape {
            Shape::Mesh(mesh) => {
                let (window, active) = self.window(&entry, active, query.limit());
                let object = self.mesh_packet(&entry, mesh);
                let mesh = world.scene.meshes.row(mesh);
                let corners = triangle::canonical(mesh.corners(id.primitive as usize));
                self.triangle(&object, &window, &corners, id, active, query);
            }
            _ => self.solid(&entry, active, query),
        }
    }

    #[inline(always)]
    pub(super) fn window(
        &self,
        entry: &TlasEntry,
        active: L::Mask,
        limit: L,
    ) -> (Window<L>, L::Mask) {
        window(self.packet, entry, active, limit)
    }

    #[inline(always)]
    pub(super) fn object_packet(&self, entry: &TlasEntry, center: DVec3) -> Packet<L> {
        object_packet((self.world, self.packet, self.map), entry, center)
    }

    #[inline(always)]
    pub(super) fn mesh_packet(&self, entry: &TlasEntry, mesh: MeshId) -> Packet<L> {
        mesh_packet((self.world, self.packet, self.map), entry, mesh)
    }

    /// Offers hits to a guarded query, and decides undecided lanes by the exact fallback. No
    /// clamping to boxes is needed, since boxes contain the exact t.
    #[inline(always)]
    fn offer_guarded<Q: Query<L>>(
        &mut self,
        meet: &Meet<L>,
        id: HitId,
        corners: Option<&triangle::Corners>,
        query: &mut Q,
    ) {
        let open = query.accept_sure(meet, id);
        let open = open | meet.unsure & query.limit().gt(self.packet.ray.t_min);
        if open.any() {
            // Stored to memory only here.
            let t = meet.t.to_array();
            // A hit that a test doubts may be certain to the kernel.
            let is_doubted = C::DOUBTS_ALL || C::doubts(id.instance, id.primitive) != 0;
            let unsure = if is_doubted { 0 } else { meet.unsure.bits() };
            let known = KnownHits {
                hits: meet.hit.bits(),
                open: unsure & !meet.hit.bits(),
                t: t.as_ref(),
                corners,
            };
            self.decide_with(open, &known, id, query);
        }
    }

    /// Offers hits to the query; in `fast` with t clamped to the boxes' intervals (X5).
    #[inline(always)]
    pub(super) fn offer<Q: Query<L>>(
        &mut self,
        object: &Packet<L>,
        window: &Window<L>,
        own: &Aabb32,
        meet: Meet<L>,
        id: HitId,
        query: &mut Q,
    ) {
        if C::GUARDED {
            if (meet.hit | meet.unsure).any() {
                self.offer_guarded(&meet, id, None, query);
            }
        } else if meet.hit.any() {
            let t_min = object.ray.t_min;
            let (enter, exit) = object.slabs.interval(own.min, own.max);
            let enter = enter.max(window.enter);
            let exit = exit.min(window.exit);
            let hit = meet.hit & enter.le(exit);
            let t = meet.t.max(enter).min(exit);
            let hit = hit & t.gt(t_min) & t.le(query.limit());
            query.accept(hit, t, id);
        }
    }
}

impl<L: Lanes, C: Certainty> Tester<'_, L, C> {
    /// Tests one shape other than a mesh.
    #[inline(never)]
    pub(super) fn solid<Q: Query<L>>(&mut self, entry: &TlasEntry, active: L::Mask, query: &mut Q) {
        if let Shape::Csg(id) = entry.shape {
            return self.csg(entry, id, active, query);
        }
        let id = HitId {
            instance: entry.instance,
            primitive: 0,
        };
        if entry.placed {
            let (window, active) = self.window(entry, active, query.limit());
            if active.none() {
                return;
            }
            let object = self.object_packet(entry, DVec3::ZERO);
            if let (true, Shape::Implicit(row)) = (Q::ANY, entry.shape) {
                return self.is_blocked(&object, row, id, active, query);
            }
            let meet = self.certified(&object, entry, active, query);
            let meet = mark_undecided::<L, C>(meet, active, id);
            self.offer(&object, &window, &entry.own, meet, id, query);
        } else {
            let packet = self.packet;
            if let (true, Shape::Implicit(row)) = (Q::ANY, entry.shape) {
                return self.is_blocked(packet, row, id, active, query);
            }
            let meet = self.certified(packet, entry, active, query);
            let meet = mark_undecided::<L, C>(meet, active, id);
            self.offer(packet, &Window::all(), &entry.own, meet, id, query);
        }
    }
}

/// Intersects the packet with an instance's world box: the interval of t, and the active
/// lanes that reach it.
#[inline(always)]
pub(super) fn window<L: Lanes>(
    packet: &Packet<L>,
    entry: &TlasEntry,
    active: L::Mask,
    limit: L,
) -> (Window<L>, L::Mask) {
    let (enter, exit) = packet.slabs.interval(entry.bounds.min, entry.bounds.max);
    let reached = enter.max(packet.ray.t_min).le(exit.min(limit));
    (Window { enter, exit }, active & reached)
}

/// A world, a world-space packet, and the `object_from_world` of the one instance that is
/// tested, where it is at hand.
type PacketIn<'a, L> = (&'a World, &'a Packet<L>, Option<&'a Affine>);

/// Brings a packet into the space of an instance that has a transform.
#[inline(always)]
fn object_packet<L: Lanes>(
    (world, packet, map): PacketIn<L>,
    entry: &TlasEntry,
    center: DVec3,
) -> Packet<L> {
    let look_up = || world.object_from_world(entry.instance);
    let map = map.copied().unwrap_or_else(look_up);
    packet.in_object(&map, center, &entry.own)
}

/// Brings a packet into the space of an instance of a mesh.
#[inline(always)]
pub(super) fn mesh_packet<L: Lanes>(
    (world, packet, map): PacketIn<L>,
    entry: &TlasEntry,
    mesh: MeshId,
) -> Packet<L> {
    if entry.placed {
        let center = world.scene.meshes.center[mesh.index()];
        object_packet((world, packet, map), entry, center)
    } else {
        packet.for_tree(&entry.own)
    }
}

/// Marks the lanes that a test certainty declares undecided.
#[inline(always)]
pub(super) fn mark_undecided<L: Lanes, C: Certainty>(
    meet: Meet<L>,
    active: L::Mask,
    id: HitId,
) -> Meet<L> {
    if !C::GUARDED {
        return meet;
    }
    let undecided = L::Mask::from_bits(C::doubts(id.instance, id.primitive)) & active;
    Meet {
        hit: meet.hit & !undecided,
        unsure: meet.unsure | undecided,
        ..meet
    }
}
