//! Tiles: the rays of one origin or of one direction, as a volume through the
//! wide trees.
//!
//! Pinhole and orthographic rays, shadow rays traced from a point light or
//! toward a directional one. A tile is a fixed number of consecutive rays,
//! whatever the lanes; a tile that does not fit (rays that share neither, or go
//! against each other) is left to other kernels.
//!
//! In f32 triangles are decided by edge functions that the tile's rays share,
//! three times as cheap as the watertight test; t is then computed by the
//! watertight test's own steps, once per ray, so that kernels which agree on the
//! triangle agree on t. In f64 the edge functions only sort out, with a margin, and the
//! watertight test decides.

mod block;
mod bundle;
mod items;
mod parallel;
mod settle;

use super::batch::Rays;
use super::leaf::{Everything, Features, Tester};
use super::packet::Packet;
use super::query::{HitId, Query};
use super::stream::{Stream, StreamScratch};
use crate::accel::{Entry, STREAM, WideMesh, WideNode, WideStack, World, prefetch};
use crate::geom::Certainty;
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::scene::{MeshId, Shape};
use block::{Aim, Edges};
use bundle::{Bundle, Parallel, Pinhole, Projection, RelativeBox, is_exact};
use glam::DVec3;
use settle::{Found, settle};
use std::cell::Cell;

/// Rays per tile.
pub const TILE: usize = 64;

/// No triangle.
const NOTHING: u32 = u32::MAX;

pub(super) struct Tile<'a, L: Lanes, const S: usize> {
    world: &'a World<'a>,
    rays: &'a Rays<'a>,
    first: usize,
    /// Of the first ray alive: what all have in common is either.
    org: [f64; 3],
    dir: [f64; 3],
    /// World space.
    bundle: &'a mut Bundle<L, S>,
    /// For spaces of other meshes.
    spare: &'a mut Bundle<L, S>,
}

/// Scratch of one thread, reused from tile to tile.
#[derive(Default)]
pub(super) struct TileScratch {
    top: WideStack,
    mesh: WideStack,
    pub streams: StreamScratch,
}

thread_local! {
    static SCRATCH: Cell<Option<Box<TileScratch>>> = const { Cell::new(None) };
}

/// Lends this thread's scratch: making one takes as long as some hundred rays.
pub(super) fn with_scratch(run: impl FnOnce(&mut TileScratch)) {
    let mut scratch = SCRATCH.take().unwrap_or_default();
    run(&mut scratch);
    SCRATCH.set(Some(scratch));
}

/// Places for bundles, reused from tile to tile.
pub(super) struct Bundles<L: Lanes, const S: usize> {
    world: Bundle<L, S>,
    object: Bundle<L, S>,
}

impl<L: Lanes, const S: usize> Default for Bundles<L, S> {
    fn default() -> Self {
        Bundles {
            world: Bundle::empty(),
            object: Bundle::empty(),
        }
    }
}

/// What a mesh's walk carries along.
struct InMesh<'a, L: Lanes, const S: usize> {
    entry: &'a Entry,
    id: MeshId,
    mesh: &'a WideMesh,
    bundle: &'a mut Bundle<L, S>,
    /// By group: place of the nearest triangle so far, as block · WIDE + slot,
    /// carried in lanes.
    places: [L; S],
    /// By group: rays some hit of which was not clearly within its triangle's
    /// box.
    doubts: [u32; S],
}

impl<'a, L: Lanes, const S: usize> Tile<'a, L, S> {
    /// `None` where the rays share neither origin nor direction, do not start at
    /// t = 0, or do not advance along one axis.
    #[inline(always)]
    pub fn of(
        world: &'a World<'a>,
        rays: &'a Rays<'a>,
        first: usize,
        bundles: &'a mut Bundles<L, S>,
    ) -> Option<Self> {
        let end = first + TILE;
        let (t_min, t_max) = (&rays.t_min[first..end], &rays.t_max[first..end]);
        let is_alive = |i: usize| t_max[i] > 0.0;
        let leader = (0..TILE).find(|i| is_alive(*i))?;
        let org = rays.start(first + leader);
        let dir = rays.dir.map(|column| column[first + leader]);
        let mut from_start = true;
        for i in 0..TILE {
            from_start &= (t_min[i] == 0.0) | !is_alive(i);
        }
        if !from_start {
            return None;
        }
        let mut one_origin = true;
        if rays.origin.is_none() {
            let x = &rays.org[0][first..end];
            let y = &rays.org[1][first..end];
            let z = &rays.org[2][first..end];
            for i in 0..TILE {
                let here = (x[i] == org[0]) & (y[i] == org[1]) & (z[i] == org[2]);
                one_origin &= here | !is_alive(i);
            }
        }
        if !one_origin {
            let x = &rays.dir[0][first..end];
            let y = &rays.dir[1][first..end];
            let z = &rays.dir[2][first..end];
            let mut one_direction = true;
            for i in 0..TILE {
                let same = (x[i] == dir[0]) & (y[i] == dir[1]) & (z[i] == dir[2]);
                one_direction &= same | !is_alive(i);
            }
            if !one_direction {
                return None;
            }
        }
        let at = |s: usize| first + s * L::COUNT;
        let dirs = |s: usize| {
            let dir = |k: usize| super::batch::load_f32::<L>(&rays.dir[k][at(s)..]);
            Vec3::new(dir(0), dir(1), dir(2))
        };
        let alive: [L::Mask; S] = std::array::from_fn(|s| Self::alive(rays, at(s)));
        let bounds = &world.wide()?.top.bounds;
        let Bundles {
            world: bundle,
            object: spare,
        } = bundles;
        let dir = dir.map(f64::from);
        let taken = if one_origin {
            bundle.take_in(org, dirs, &alive, &alive, bounds)
        } else {
            let orgs = |s: usize| Self::starts(rays, at(s));
            bundle.take_in_parallel(orgs, dir, &alive, &alive, bounds)
        };
        taken.then_some(Tile {
            world,
            rays,
            first,
            org,
            dir,
            bundle,
            spare,
        })
    }

    /// The rays of a group that are no padding.
    #[inline(always)]
    fn alive(rays: &Rays, first: usize) -> L::Mask {
        super::batch::load_f32::<L>(&rays.t_max[first..]).gt(L::zero())
    }

    /// Where the rays of a group start that do not start at one point.
    #[inline(always)]
    fn starts(rays: &Rays, first: usize) -> Vec3<L::Double> {
        let org = |k: usize| L::Double::load(&rays.org[k][first..]);
        Vec3::new(org(0), org(1), org(2))
    }

    /// The rays of each group that may meet a box.
    #[inline(always)]
    fn reach_box(&self, min: [f32; 3], max: [f32; 3]) -> [L::Mask; S] {
        let bundle = &*self.bundle;
        let mut active = [L::Mask::splat(false); S];
        if bundle.parallel {
            let relative = RelativeBox::new::<Parallel, L, S>(bundle, min, max);
            for (s, active) in active.iter_mut().enumerate() {
                *active = bundle.reach_box::<Parallel>(s, &relative);
            }
        } else {
            let relative = RelativeBox::new::<Pinhole, L, S>(bundle, min, max);
            for (s, active) in active.iter_mut().enumerate() {
                *active = bundle.reach_box::<Pinhole>(s, &relative);
            }
        }
        active
    }

    #[inline(always)]
    fn packet(&self, s: usize) -> Packet<L> {
        self.rays.packet(self.first + s * L::COUNT, self.world)
    }

    /// Everything in the world.
    #[inline(always)]
    pub fn trace<C: Certainty, F: Features, Q: Query<L>>(
        mut self,
        queries: &mut [Q; S],
        scratch: &mut TileScratch,
    ) {
        let world = self.world;
        if F::SOLIDS && !world.unbounded.is_empty() {
            for (s, query) in queries.iter_mut().enumerate() {
                let packet = self.packet(s);
                Tester::<L, C, F>::new(world, &packet).unbounded(query);
            }
        }
        for (s, query) in queries.iter().enumerate() {
            self.bundle.limit_t::<C, Q>(s, query.limit());
        }
        let Some(forest) = world.wide() else { return };
        let top = &forest.top;
        let frustum = self.bundle.frustum;
        let TileScratch {
            top: stack,
            mesh: mesh_stack,
            streams,
        } = scratch;
        top.walk_frustum(
            &frustum,
            self.bundle.deepest(),
            stack,
            |_| (),
            |_, _, (first, count), _| {
                for entry in &world.entries[first..first + count] {
                    self.entry::<C, F, Q>(entry, queries, mesh_stack, streams);
                }
                self.bundle.deepest()
            },
        );
    }

    #[inline(always)]
    fn entry<C: Certainty, F: Features, Q: Query<L>>(
        &mut self,
        entry: &Entry,
        queries: &mut [Q; S],
        stack: &mut WideStack,
        streams: &mut StreamScratch,
    ) {
        match entry.shape {
            Shape::Mesh(id) => {
                if !F::MESHES {
                    return;
                }
                let (world, rays, first) = (self.world, self.rays, self.first);
                let through = |inside: InMesh<L, S>, queries: &mut [Q; S]| {
                    inside.trace_any::<C, Q>(world, rays, first, queries, stack);
                };
                if F::TRANSFORMS && entry.placed {
                    self.placed_mesh::<C, Q>(entry, id, queries, streams, through);
                } else {
                    self.mesh_in_world::<C, Q>(entry, id, queries, through);
                }
            }
            _ => {
                if F::SOLIDS {
                    self.solid::<C, F, Q>(entry, queries);
                }
            }
        }
    }

    #[inline(always)]
    fn solid<C: Certainty, F: Features, Q: Query<L>>(
        &mut self,
        entry: &Entry,
        queries: &mut [Q; S],
    ) {
        let active = self.reach_box(entry.bounds.min, entry.bounds.max);
        for (s, query) in queries.iter_mut().enumerate() {
            if active[s].any() {
                let packet = self.packet(s);
                Tester::<L, C, F>::new(self.world, &packet).solid(entry, active[s], query);
                self.bundle.limit_t::<C, Q>(s, query.limit());
            }
        }
    }

    /// A mesh in world space; `through` meets its triangles.
    #[inline(always)]
    fn mesh_in_world<C: Certainty, Q: Query<L>>(
        &mut self,
        entry: &Entry,
        id: MeshId,
        queries: &mut [Q; S],
        through: impl FnOnce(InMesh<L, S>, &mut [Q; S]),
    ) {
        let Some(mesh) = self.world.wide_mesh(id) else {
            return;
        };
        let inside = InMesh {
            entry,
            id,
            mesh,
            bundle: self.bundle,
            places: [nowhere(); S],
            doubts: [0; S],
        };
        through(inside, queries);
        for (s, query) in queries.iter().enumerate() {
            self.bundle.limit_t::<C, Q>(s, query.limit());
        }
    }

    /// A mesh in a space of its own: the same rays there, as a bundle anew.
    #[inline(never)]
    fn placed_mesh<C: Certainty, Q: Query<L>>(
        &mut self,
        entry: &Entry,
        id: MeshId,
        queries: &mut [Q; S],
        streams: &mut StreamScratch,
        through: impl FnOnce(InMesh<L, S>, &mut [Q; S]),
    ) {
        let Some(mesh) = self.world.wide_mesh(id) else {
            return;
        };
        let active = self.reach_box(entry.bounds.min, entry.bounds.max);
        if active.iter().all(|lanes| lanes.none()) {
            return;
        }
        let map = self.world.object_from_world(entry.appearance);
        let center = self.world.scene.meshes.center[id.index()];
        let dirs = |s: usize| {
            let d = &self.bundle.groups[s].dir;
            let dir = map.vectors(Vec3::new(d.x.widen(), d.y.widen(), d.z.widen()));
            Vec3::new(L::narrow(dir.x), L::narrow(dir.y), L::narrow(dir.z))
        };
        let (bundle, bounds) = (&mut *self.spare, &mesh.tree.bounds);
        let taken = if self.bundle.parallel {
            let at = |s: usize| self.first + s * L::COUNT;
            let orgs = |s: usize| {
                let org = Self::starts(self.rays, at(s));
                map.points(org) - Vec3::splat(center.to_array())
            };
            let all = std::array::from_fn(|s| Self::alive(self.rays, at(s)));
            bundle.take_in_parallel(orgs, map.vector(self.dir), &all, &active, bounds)
        } else {
            // Stand-ins among them.
            let all = [L::Mask::splat(true); S];
            let org = DVec3::from_array(map.point(self.org)) - center;
            bundle.take_in(org.to_array(), dirs, &all, &active, bounds)
        };
        if !taken {
            self.as_stream::<C, Q>(entry, id, &active, queries, streams);
            return;
        }
        let asleep = -L::from_f32(1.0);
        for (s, query) in queries.iter().enumerate() {
            bundle.limit_t::<C, Q>(s, L::select(active[s], query.limit(), asleep));
        }
        let inside = InMesh {
            entry,
            id,
            mesh,
            bundle,
            places: [nowhere(); S],
            doubts: [0; S],
        };
        through(inside, queries);
        for (s, query) in queries.iter().enumerate() {
            self.bundle.limit_t::<C, Q>(s, query.limit());
        }
    }

    /// A mesh in whose space the rays do not advance together.
    #[cold]
    fn as_stream<C: Certainty, Q: Query<L>>(
        &self,
        entry: &Entry,
        id: MeshId,
        active: &[L::Mask; S],
        queries: &mut [Q; S],
        streams: &mut StreamScratch,
    ) {
        use super::query::Closest;
        for begin in (0..TILE).step_by(STREAM) {
            let mut set = 0;
            let mut nearest: [_; STREAM] = std::array::from_fn(|i| {
                let (s, lane) = ((begin + i) / L::COUNT, (begin + i) % L::COUNT);
                set |= u64::from(active[s].bits() >> lane & 1) << i;
                // Just beyond the ray's own: ties are for that query to settle.
                let limit = next_up(queries[s].limit().lane(lane));
                Closest::<L::Single, C>::new(<L::Single as Lanes>::splat(limit))
            });
            let stream = Stream {
                world: self.world,
                rays: self.rays,
                first: self.first + begin,
            };
            stream.placed_alone::<L::Single, C, _>(entry, id, set, &mut nearest, streams);
            for (i, found) in nearest.iter().enumerate() {
                if found.id(0) != HitId::NONE {
                    let (s, lane) = ((begin + i) / L::COUNT, (begin + i) % L::COUNT);
                    queries[s].settle(lane, found.t(0), found.id(0));
                }
            }
        }
    }
}

impl<L: Lanes, const S: usize> InMesh<'_, L, S> {
    #[inline(always)]
    fn trace_any<C: Certainty, Q: Query<L>>(
        self,
        world: &World,
        rays: &Rays,
        start: usize,
        queries: &mut [Q; S],
        stack: &mut WideStack,
    ) {
        if self.bundle.parallel {
            self.trace::<Parallel, C, Q>(world, rays, start, queries, stack);
        } else {
            self.trace::<Pinhole, C, Q>(world, rays, start, queries, stack);
        }
    }

    /// Not generic over the scene's features: they matter above, and each
    /// instance costs build time.
    #[inline(never)]
    fn trace<P: Projection, C: Certainty, Q: Query<L>>(
        mut self,
        world: &World,
        rays: &Rays,
        start: usize,
        queries: &mut [Q; S],
        stack: &mut WideStack,
    ) {
        let exact = is_exact::<L, C>();
        let frustum = self.bundle.frustum;
        let deepest = self.bundle.deepest();
        let mesh = self.mesh;
        let tree = &mesh.tree;
        if exact {
            let packet = |s: usize| rays.packet(start + s * L::COUNT, world);
            let packets: [Packet<L>; S] = std::array::from_fn(packet);
            let testers: [_; S] =
                std::array::from_fn(|s| Tester::<L, C, Everything>::new(world, &packets[s]));
            let objects: [Packet<L>; S] =
                std::array::from_fn(|s| testers[s].mesh_packet(self.entry, self.id));
            tree.walk_frustum(
                &frustum,
                deepest,
                stack,
                |block| prefetch(&mesh.blocks[block]),
                |node, place, (first, count), _| {
                    self.exact_leaf::<P, C, Q>(
                        node, place, first, count, &testers, &objects, queries,
                    );
                    self.bundle.deepest()
                },
            );
            return;
        }
        tree.walk_frustum(
            &frustum,
            deepest,
            stack,
            |block| prefetch(&mesh.blocks[block]),
            |node, place, (first, count), _| {
                self.fast_leaf::<P, Q>(node, place, first, count, queries);
                self.bundle.deepest()
            },
        );
        if !Q::ANY {
            self.settle_all::<P, C, Q>(world, rays, start, queries);
        }
    }

    /// From the nearest triangles' places to hits.
    #[inline(always)]
    fn settle_all<P: Projection, C: Certainty, Q: Query<L>>(
        &self,
        world: &World,
        rays: &Rays,
        start: usize,
        queries: &mut [Q; S],
    ) {
        for s in 0..S {
            let places = self.places[s];
            let mut bits = 0;
            for (lane, place) in places.to_array().as_ref().iter().enumerate() {
                bits |= u32::from(place.bits() as u32 != NOTHING) << lane;
            }
            if bits != 0 {
                let found = Found {
                    entry: self.entry,
                    id: self.id,
                    mesh: self.mesh,
                    places,
                    bits,
                };
                let group = &self.bundle.groups[s];
                let clear = !P::PARALLEL && (self.doubts[s] | group.oblique) & bits == 0;
                if clear && !self.entry.placed {
                    found.clear::<C, Q>(group.limit / group.along, &mut queries[s]);
                    continue;
                }
                let packet = || rays.packet(start + s * L::COUNT, world);
                let dir = group.dir;
                let org = if P::PARALLEL {
                    self.bundle.starts[s].org
                } else {
                    Vec3::splat(self.bundle.object_org)
                };
                settle::<L, C, Q>(&found, org, dir, packet, world, &mut queries[s]);
            }
        }
    }

    /// The rays of each group that may meet a box; whether any does.
    #[inline(always)]
    fn rays_in<P: Projection>(&self, (min, max): ([f32; 3], [f32; 3])) -> ([u32; S], bool) {
        let relative = RelativeBox::new::<P, L, S>(self.bundle, min, max);
        let mut rays = [0; S];
        let mut all = 0;
        for (s, rays) in rays.iter_mut().enumerate() {
            if self.bundle.groups[s].deepest >= 0.0 {
                *rays = self.bundle.reach_box::<P>(s, &relative).bits();
                all |= *rays;
            }
        }
        (rays, all != 0)
    }

    #[inline(always)]
    fn fast_leaf<P: Projection, Q: Query<L>>(
        &mut self,
        node: &WideNode,
        place: usize,
        first: usize,
        count: usize,
        queries: &mut [Q; S],
    ) {
        let (rays, any) = self.rays_in::<P>(node.child_box(place));
        if any {
            self.fast_blocks::<P, Q>(&rays, first, count, queries);
        }
    }

    #[inline(always)]
    fn fast_blocks<P: Projection, Q: Query<L>>(
        &mut self,
        rays: &[u32; S],
        first: usize,
        count: usize,
        queries: &mut [Q; S],
    ) {
        for number in first..first + count {
            let block = &self.mesh.blocks[number];
            let edges = Edges::new::<P, L, S>(
                block,
                self.bundle,
                if Q::ANY { Aim::Any } else { Aim::Closest },
            );
            if edges.live == 0 {
                continue;
            }
            for s in 0..S {
                let Bundle { groups, starts, .. } = &mut *self.bundle;
                let (group, starts) = (&mut groups[s], &starts[s]);
                if rays[s] == 0 || group.deepest < 0.0 {
                    continue;
                }
                let mut slots = edges.may_meet(group, false, 0.0);
                if slots == 0 {
                    continue;
                }
                let mut met = false;
                if rays[s].count_ones() < slots.count_ones() {
                    // Ray by ray, the triangles in lanes.
                    let mut bits = rays[s];
                    while bits != 0 {
                        let lane = bits.trailing_zeros() as usize;
                        bits &= bits - 1;
                        let at = |x: L| x.lane(lane).to_f64() as f32;
                        let limit = at(group.limit);
                        let line = (at(group.u), at(group.v));
                        let start = if P::PARALLEL { at(starts.depth) } else { 0.0 };
                        let (mut hits, depth, det) = if Q::ANY {
                            edges.triangles::<P, true>(line, start, limit)
                        } else {
                            edges.triangles::<P, false>(line, start, limit)
                        };
                        if hits == 0 {
                            continue;
                        }
                        met = true;
                        let mut limit = limit;
                        let mut best = self.places[s].lane(lane).bits() as u32;
                        let place = |slot: usize| (number * crate::accel::WIDE + slot) as u32;
                        if Q::ANY {
                            limit = -1.0;
                            best = place(hits.trailing_zeros() as usize);
                            hits = 0;
                        }
                        let (depth, clear) = if P::PARALLEL || Q::ANY {
                            (depth, 0)
                        } else {
                            edges.depths_of_ray(depth, det, line)
                        };
                        self.doubts[s] |= u32::from(hits & !clear != 0) << lane;
                        let depth = depth.to_array();
                        while hits != 0 {
                            let slot = hits.trailing_zeros() as usize;
                            hits &= hits - 1;
                            let z = depth[slot];
                            if nearer(z, limit, block.source[slot], best, self.mesh) {
                                limit = z;
                                best = place(slot);
                            }
                        }
                        let here = L::Mask::from_bits(1 << lane);
                        group.limit = L::select(here, L::from_f32(limit), group.limit);
                        let best = L::splat(L::Scalar::carrying(best));
                        self.places[s] = L::select(here, best, self.places[s]);
                    }
                } else {
                    // Triangle by triangle, the rays in lanes.
                    while slots != 0 {
                        let slot = slots.trailing_zeros() as usize;
                        slots &= slots - 1;
                        let (hit, depth, det) = if Q::ANY {
                            edges.rays::<P, L, true>(slot, group, starts)
                        } else {
                            edges.rays::<P, L, false>(slot, group, starts)
                        };
                        let bits = hit.bits();
                        if bits == 0 {
                            continue;
                        }
                        met = true;
                        let place = (number * crate::accel::WIDE + slot) as u32;
                        let place = L::splat(L::Scalar::carrying(place));
                        if Q::ANY {
                            let done = -L::from_f32(1.0);
                            group.limit = L::select(hit, done, group.limit);
                            self.places[s] = L::select(hit, place, self.places[s]);
                            continue;
                        }
                        let (z, clear) = if P::PARALLEL {
                            (depth, L::Mask::splat(false))
                        } else {
                            edges.depths(slot, depth, det, group)
                        };
                        let less = hit & z.lt(group.limit);
                        self.doubts[s] |= (hit & !clear).bits();
                        let mut tied = (hit & z.eq(group.limit)).bits();
                        group.limit = L::select(less, z, group.limit);
                        let before = self.places[s];
                        self.places[s] = L::select(less, place, before);
                        while tied != 0 {
                            let lane = tied.trailing_zeros() as usize;
                            tied &= tied - 1;
                            let best = before.lane(lane).bits() as u32;
                            if best != NOTHING && block.source[slot] < source(self.mesh, best) {
                                let here = L::Mask::from_bits(1 << lane);
                                self.places[s] = L::select(here, place, self.places[s]);
                            }
                        }
                    }
                }
                if met {
                    group.set_deepest();
                    if Q::ANY {
                        self.report(s, queries);
                    }
                }
            }
        }
    }

    /// Any-hit: tells the query which rays have been blocked, and by what.
    #[inline(always)]
    fn report<Q: Query<L>>(&mut self, s: usize, queries: &mut [Q; S]) {
        let mut bits = 0;
        let mut last = NOTHING;
        for (lane, place) in self.places[s].to_array().as_ref().iter().enumerate() {
            let place = place.bits() as u32;
            if place != NOTHING {
                bits |= 1 << lane;
                last = place;
            }
        }
        self.places[s] = nowhere();
        if last != NOTHING {
            let id = HitId {
                instance: self.entry.appearance,
                primitive: source(self.mesh, last),
            };
            queries[s].block(L::Mask::from_bits(bits), id);
        }
    }

    #[inline(always)]
    #[expect(clippy::too_many_arguments)]
    fn exact_leaf<P: Projection, C: Certainty, Q: Query<L>>(
        &mut self,
        node: &WideNode,
        place: usize,
        first: usize,
        count: usize,
        testers: &[Tester<L, C, Everything>; S],
        objects: &[Packet<L>; S],
        queries: &mut [Q; S],
    ) {
        let (rays, any) = self.rays_in::<P>(node.child_box(place));
        if any {
            self.exact_blocks::<P, C, Q>(&rays, first, count, testers, objects, queries);
        }
    }

    #[inline(always)]
    fn exact_blocks<P: Projection, C: Certainty, Q: Query<L>>(
        &mut self,
        rays: &[u32; S],
        first: usize,
        count: usize,
        testers: &[Tester<L, C, Everything>; S],
        objects: &[Packet<L>; S],
        queries: &mut [Q; S],
    ) {
        for number in first..first + count {
            let block = &self.mesh.blocks[number];
            let edges = Edges::new::<P, L, S>(block, self.bundle, Aim::Exact);
            if edges.live == 0 {
                continue;
            }
            for s in 0..S {
                if rays[s] == 0 || self.bundle.groups[s].deepest < 0.0 {
                    continue;
                }
                let mut slots = edges.may_meet(&self.bundle.groups[s], true, self.bundle.reach);
                let mut met = false;
                let active = L::Mask::from_bits(rays[s]);
                // The watertight test takes as long as a few rays here.
                if slots.count_ones() > 2 {
                    let group = &self.bundle.groups[s];
                    let (u, v) = (group.u.to_array(), group.v.to_array());
                    let (mut bits, mut some) = (rays[s], 0);
                    while bits != 0 {
                        let lane = bits.trailing_zeros() as usize;
                        bits &= bits - 1;
                        let at = |x: &L::Array| x.as_ref()[lane].to_f64() as f32;
                        some |= edges.may_meet_ray(at(&u), at(&v));
                    }
                    slots &= some;
                }
                while slots != 0 {
                    let slot = slots.trailing_zeros() as usize;
                    slots &= slots - 1;
                    if block.source[slot] == NOTHING {
                        break;
                    }
                    let id = HitId {
                        instance: self.entry.appearance,
                        primitive: block.source[slot],
                    };
                    let query = &mut queries[s];
                    let (window, _) = testers[s].window(self.entry, active, query.limit());
                    let corners = block.corners(slot);
                    met |= testers[s].triangle(&objects[s], &window, &corners, id, active, query);
                }
                if met {
                    let asleep = self.bundle.groups[s].limit.lt(L::zero());
                    let limit = L::select(asleep, -L::from_f32(1.0), queries[s].limit());
                    self.bundle.limit_t::<C, Q>(s, limit);
                }
            }
        }
    }
}

/// A place's triangle in source order.
#[inline(always)]
fn source(mesh: &WideMesh, place: u32) -> u32 {
    let wide = crate::accel::WIDE as u32;
    mesh.blocks[(place / wide) as usize].source[(place % wide) as usize]
}

/// Whether a triangle at depth z replaces the best so far: ties go to the lower
/// id, and a tie with the ray's own end is no hit.
#[inline(always)]
fn nearer(z: f32, limit: f32, id: u32, best: u32, mesh: &WideMesh) -> bool {
    z < limit || (z == limit && best != NOTHING && id < source(mesh, best))
}

/// The next number.
fn next_up<X: Scalar>(x: X) -> X {
    if size_of::<X>() == 8 {
        X::from_f64(x.to_f64().next_up())
    } else {
        X::from_f32((x.to_f64() as f32).next_up())
    }
}

/// [`NOTHING`] in every lane.
#[inline(always)]
fn nowhere<L: Lanes>() -> L {
    L::splat(L::Scalar::carrying(NOTHING))
}
