//! Testing primitives: from an entry of the world to hits in a query.
//!
//! The same functions serve the trees, the linear scan, the shadow cache and
//! the resolver, at every width, so all of them mean the same by a hit: the
//! kernel's answer, its t brought into the interval that the slabs give for the
//! primitive's own box and for its instance's (see [`crate::accel`]). Guarded,
//! a hit is that of exact arithmetic instead (see [`super::decide`]).

mod single;

use super::exact_fallback::KnownHits;
use super::packet::Packet;
use super::query::{HitId, Query};
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

/// The tracing of one packet against one world.
pub struct Tester<'w, L: Lanes, C> {
    pub world: &'w World,
    /// World space.
    pub packet: &'w Packet<L>,
    /// Of the instance that is being tested, where it is at hand.
    map: Option<&'w Affine>,
    certainty: PhantomData<C>,
}

impl<'w, L: Lanes, C: Certainty> Tester<'w, L, C> {
    #[inline(always)]
    pub fn new(world: &'w World, packet: &'w Packet<L>) -> Self {
        Tester {
            world,
            packet,
            map: None,
            certainty: PhantomData,
        }
    }

    /// For the one instance whose `object_from_world` this is.
    #[inline(always)]
    pub(super) fn with_map(self, map: Option<&'w Affine>) -> Self {
        Tester { map, ..self }
    }

    /// Meets everything in the world, through comparison structures. `scratch`: of the top
    /// structure, and of meshes'.
    pub fn trace<Q: Query<L>>(
        &self,
        levels: &BaselineAccelerator,
        query: &mut Q,
        [top, mesh]: &mut [AnyScratch<L>; 2],
        count: Count,
    ) {
        self.unbounded(query);
        for (entry, id) in self.world.unbounded_meshes() {
            if let Some(index) = &levels.blases[id.index()] {
                let active = self.packet.ray.t_min.lt(query.limit());
                self.mesh(entry, id, index, active, query, (mesh, count));
            }
        }
        levels.tlas.walk(
            &self.packet.slabs,
            self.packet.ray.t_min,
            query.limit(),
            top,
            count,
            &mut |first, number, active, _| {
                for entry in &self.world.entries[first..first + number] {
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

    /// The solids that stand outside the trees.
    #[inline(always)]
    pub(super) fn unbounded<Q: Query<L>>(&self, query: &mut Q) {
        for entry in self.world.unbounded_solids() {
            let active = self.packet.ray.t_min.lt(query.limit());
            self.solid(entry, active, query);
        }
    }

    /// Meets a mesh through its own comparison structure.
    fn mesh<Q: Query<L>>(
        &self,
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
        // Lanes outside the window may not wake up in the tree.
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

    /// Whether there was anything to offer to the query.
    #[inline(always)]
    pub(super) fn triangle<Q: Query<L>>(
        &self,
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
            doubted::<L, C>(meet, active, id)
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

    /// One primitive alone: what the shadow cache and the resolver test.
    #[inline(never)]
    pub fn single<Q: Query<L>>(&self, id: HitId, query: &mut Q) {
        let entry = self.world.entry_of(id.instance);
        let active = self.packet.ray.t_min.lt(query.limit());
        match entry.shape {
            Shape::Mesh(mesh) => {
                let (window, active) = self.window(&entry, active, query.limit());
                let object = self.mesh_packet(&entry, mesh);
                let mesh = self.world.scene.meshes.row(mesh);
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
        let (enter, exit) = self
            .packet
            .slabs
            .interval(entry.bounds.min, entry.bounds.max);
        let t_min = self.packet.ray.t_min;
        let reached = enter.max(t_min).le(exit.min(limit));
        (Window { enter, exit }, active & reached)
    }

    #[inline(always)]
    pub(super) fn object_packet(&self, entry: &TlasEntry, center: DVec3) -> Packet<L> {
        let look_up = || self.world.object_from_world(entry.instance);
        let map = self.map.copied().unwrap_or_else(look_up);
        self.packet.in_object(&map, center, &entry.own)
    }

    #[inline(always)]
    pub(super) fn mesh_packet(&self, entry: &TlasEntry, mesh: MeshId) -> Packet<L> {
        if entry.placed {
            self.object_packet(entry, self.world.scene.meshes.center[mesh.index()])
        } else {
            self.packet.for_tree(&entry.own)
        }
    }

    /// Hands hits to a guarded query, and has decided what is in doubt. What the
    /// boxes say of t is true of it anyway.
    #[inline(always)]
    fn offer_guarded<Q: Query<L>>(
        &self,
        meet: &Meet<L>,
        id: HitId,
        corners: Option<&triangle::Corners>,
        query: &mut Q,
    ) {
        let doubt = query.accept_sure(meet, id);
        let doubt = doubt | meet.unsure & query.limit().gt(self.packet.ray.t_min);
        if doubt.any() {
            // Only here by memory.
            let t = meet.t.to_array();
            let known = KnownHits {
                hits: meet.hit.bits(),
                t: t.as_ref(),
                corners,
            };
            self.decide_with(doubt, &known, id, query);
        }
    }

    /// Brings t into the boxes' intervals and hands the hits to the query; guarded,
    /// as they are.
    #[inline(always)]
    pub(super) fn offer<Q: Query<L>>(
        &self,
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
    /// Meets one shape that is no mesh.
    #[inline(never)]
    pub(super) fn solid<Q: Query<L>>(&self, entry: &TlasEntry, active: L::Mask, query: &mut Q) {
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
            let meet = doubted::<L, C>(meet, active, id);
            self.offer(&object, &window, &entry.own, meet, id, query);
        } else {
            if let (true, Shape::Implicit(row)) = (Q::ANY, entry.shape) {
                return self.is_blocked(self.packet, row, id, active, query);
            }
            let meet = self.certified(self.packet, entry, active, query);
            let meet = doubted::<L, C>(meet, active, id);
            self.offer(self.packet, &Window::all(), &entry.own, meet, id, query);
        }
    }
}

/// Takes back the answers that the certainty doubts by itself.
#[inline(always)]
pub(super) fn doubted<L: Lanes, C: Certainty>(
    meet: Meet<L>,
    active: L::Mask,
    id: HitId,
) -> Meet<L> {
    if !C::GUARDED {
        return meet;
    }
    let doubted = L::Mask::from_bits(C::doubts(id.instance, id.primitive)) & active;
    Meet {
        hit: meet.hit & !doubted,
        unsure: meet.unsure | doubted,
        ..meet
    }
}
