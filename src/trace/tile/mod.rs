//! Tiles: the rays of one origin, as a volume through the wide trees.
//!
//! Pinhole rays, and shadow rays traced from a point light. A tile is a fixed
//! number of consecutive rays, whatever the lanes; a tile that does not fit
//! (rays of several origins, or against each other) is left to other kernels.
//!
//! In f32 triangles are decided by edge functions from the shared origin, three
//! times as cheap as the watertight test; t is then computed by the watertight
//! test's own steps, once per ray, so that kernels which agree on the triangle
//! agree on t. In f64 the edge functions only sort out, with a margin, and the
//! watertight test decides.

mod block;
mod bundle;
mod settle;

use super::batch::Rays;
use super::leaf::{Everything, Features, Tester};
use super::packet::Packet;
use super::query::{HitId, Query};
use super::stream::{Stream, StreamScratch};
use crate::accel::{Entry, STREAM, WideMesh, WideNode, WideStack, World, prefetch};
use crate::geom::Certainty;
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask, Scalar, max};
use crate::scene::{MeshId, Shape};
use block::Edges;
use bundle::{Bundle, RelativeBox};
use glam::DVec3;
use settle::{Found, settle};

/// Rays per tile.
pub const TILE: usize = 64;

/// No triangle.
const NOTHING: u32 = u32::MAX;

pub(super) struct Tile<'a, L: Lanes, const S: usize> {
    world: &'a World<'a>,
    rays: &'a Rays<'a>,
    first: usize,
    org: [f64; 3],
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
}

impl<'a, L: Lanes, const S: usize> Tile<'a, L, S> {
    /// `None` where the rays are not of one origin, do not start there, or do
    /// not advance along one axis.
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
        let mut same = true;
        for i in 0..TILE {
            same &= (t_min[i] == 0.0) | !is_alive(i);
        }
        if rays.origin.is_none() {
            let x = &rays.org[0][first..end];
            let y = &rays.org[1][first..end];
            let z = &rays.org[2][first..end];
            for i in 0..TILE {
                let here = (x[i] == org[0]) & (y[i] == org[1]) & (z[i] == org[2]);
                same &= here | !is_alive(i);
            }
        }
        if !same {
            return None;
        }
        let at = |s: usize| first + s * L::COUNT;
        let dirs = |s: usize| {
            let dir = |k: usize| super::batch::load_f32::<L>(&rays.dir[k][at(s)..]);
            Vec3::new(dir(0), dir(1), dir(2))
        };
        let alive: [L::Mask; S] = std::array::from_fn(|s| {
            super::batch::load_f32::<L>(&rays.t_max[at(s)..]).gt(L::zero())
        });
        let bounds = &world.wide()?.top.bounds;
        let Bundles {
            world: bundle,
            object: spare,
        } = bundles;
        bundle.take_in(org, dirs, &alive, bounds).then_some(Tile {
            world,
            rays,
            first,
            org,
            bundle,
            spare,
        })
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
            self.bundle.limit_t(s, query.limit());
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
        let (min, max) = (entry.bounds.min, entry.bounds.max);
        let relative = RelativeBox::new(&self.bundle.frustum, min, max);
        match entry.shape {
            Shape::Mesh(id) => {
                if !F::MESHES {
                    return;
                }
                if F::TRANSFORMS && entry.placed {
                    self.placed_mesh::<C, Q>(entry, id, &relative, queries, stack, streams);
                } else if let Some(mesh) = self.world.wide_mesh(id) {
                    let Tile {
                        world, rays, first, ..
                    } = self;
                    let inside = InMesh {
                        entry,
                        id,
                        mesh,
                        bundle: self.bundle,
                        places: [nowhere(); S],
                    };
                    inside.trace::<C, Q>(world, rays, *first, queries, stack);
                    for (s, query) in queries.iter().enumerate() {
                        self.bundle.limit_t(s, query.limit());
                    }
                }
            }
            _ => {
                if !F::SOLIDS {
                    return;
                }
                for (s, query) in queries.iter_mut().enumerate() {
                    let active = self.bundle.reach_box(s, &relative);
                    if active.any() {
                        let packet = self.packet(s);
                        Tester::<L, C, F>::new(self.world, &packet).solid(entry, active, query);
                        self.bundle.limit_t(s, query.limit());
                    }
                }
            }
        }
    }

    /// A mesh in a space of its own: the same rays there, as a bundle anew.
    #[inline(never)]
    fn placed_mesh<C: Certainty, Q: Query<L>>(
        &mut self,
        entry: &Entry,
        id: MeshId,
        relative: &RelativeBox,
        queries: &mut [Q; S],
        stack: &mut WideStack,
        streams: &mut StreamScratch,
    ) {
        let Some(mesh) = self.world.wide_mesh(id) else {
            return;
        };
        let active: [L::Mask; S] = std::array::from_fn(|s| self.bundle.reach_box(s, relative));
        if active.iter().all(|lanes| lanes.none()) {
            return;
        }
        let map = self.world.object_from_world(entry.appearance);
        let center = self.world.scene.meshes.center[id.index()];
        let org = DVec3::from_array(map.point(self.org)) - center;
        let dirs = |s: usize| {
            let d = &self.bundle.groups[s].dir;
            let dir = map.vectors(Vec3::new(d.x.widen(), d.y.widen(), d.z.widen()));
            Vec3::new(L::narrow(dir.x), L::narrow(dir.y), L::narrow(dir.z))
        };
        let bundle = &mut *self.spare;
        if !bundle.take_in(org.to_array(), dirs, &active, &mesh.tree.bounds) {
            self.as_stream::<C, Q>(entry, id, &active, queries, streams);
            return;
        }
        let asleep = -L::from_f32(1.0);
        for (s, query) in queries.iter().enumerate() {
            bundle.limit_t(s, L::select(active[s], query.limit(), asleep));
        }
        let inside = InMesh {
            entry,
            id,
            mesh,
            bundle,
            places: [nowhere(); S],
        };
        inside.trace::<C, Q>(self.world, self.rays, self.first, queries, stack);
        for (s, query) in queries.iter().enumerate() {
            self.bundle.limit_t(s, query.limit());
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
    /// Not generic over the scene's features: they matter above, and each
    /// instance costs build time.
    #[inline(never)]
    fn trace<C: Certainty, Q: Query<L>>(
        mut self,
        world: &World,
        rays: &Rays,
        start: usize,
        queries: &mut [Q; S],
        stack: &mut WideStack,
    ) {
        let exact = C::GUARDED || size_of::<L::Scalar>() == 8;
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
                    self.exact_leaf(node, place, first, count, &testers, &objects, queries);
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
                self.fast_leaf(node, place, first, count, queries);
                self.bundle.deepest()
            },
        );
        if Q::ANY {
            return;
        }
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
                let packet = || rays.packet(start + s * L::COUNT, world);
                let dir = self.bundle.groups[s].dir;
                let org = self.bundle.object_org;
                settle::<L, C, Q>(
                    &found,
                    Vec3::splat(org),
                    dir,
                    packet,
                    world,
                    &mut queries[s],
                );
            }
        }
    }

    /// The rays of each group that may meet the leaf's box; whether any does.
    #[inline(always)]
    fn rays_at(&self, node: &WideNode, place: usize) -> ([u32; S], bool) {
        let (min, max) = node.child_box(place);
        let relative = RelativeBox::new(&self.bundle.frustum, min, max);
        let mut rays = [0; S];
        let mut all = 0;
        for (s, rays) in rays.iter_mut().enumerate() {
            if self.bundle.groups[s].deepest >= 0.0 {
                *rays = self.bundle.reach_box(s, &relative).bits();
                all |= *rays;
            }
        }
        (rays, all != 0)
    }

    #[inline(always)]
    fn fast_leaf<Q: Query<L>>(
        &mut self,
        node: &WideNode,
        place: usize,
        first: usize,
        count: usize,
        queries: &mut [Q; S],
    ) {
        let (rays, any) = self.rays_at(node, place);
        if !any {
            return;
        }
        for number in first..first + count {
            let block = &self.mesh.blocks[number];
            let edges = Edges::new(block, self.bundle, false);
            if edges.live == 0 {
                continue;
            }
            for s in 0..S {
                let group = &mut self.bundle.groups[s];
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
                        let (u, v) = (at(group.u), at(group.v));
                        let (hits, depth, det) = if Q::ANY {
                            edges.triangles::<true>(u, v, limit)
                        } else {
                            edges.triangles::<false>(u, v, limit)
                        };
                        if hits == 0 {
                            continue;
                        }
                        met = true;
                        let (depth, det) = (depth.to_array(), det.to_array());
                        let mut limit = limit;
                        let mut hits = hits;
                        let mut best = self.places[s].lane(lane).bits() as u32;
                        while hits != 0 {
                            let slot = hits.trailing_zeros() as usize;
                            hits &= hits - 1;
                            // Not nearer than the triangle: else a limit could rule
                            // it out that it would lower.
                            let z = (depth[slot] / det[slot]).max(edges.nearest[slot]);
                            if nearer(z, limit, block.source[slot], best, self.mesh) {
                                limit = z;
                                best = (number * crate::accel::WIDE + slot) as u32;
                            }
                        }
                        if Q::ANY {
                            limit = -1.0;
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
                            edges.rays::<L, true>(slot, group)
                        } else {
                            edges.rays::<L, false>(slot, group)
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
                        let z = max(depth / det, L::from_f32(edges.nearest[slot]));
                        let less = hit & z.lt(group.limit);
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
    fn exact_leaf<C: Certainty, Q: Query<L>>(
        &mut self,
        node: &WideNode,
        place: usize,
        first: usize,
        count: usize,
        testers: &[Tester<L, C, Everything>; S],
        objects: &[Packet<L>; S],
        queries: &mut [Q; S],
    ) {
        let (rays, any) = self.rays_at(node, place);
        if !any {
            return;
        }
        for number in first..first + count {
            let block = &self.mesh.blocks[number];
            let edges = Edges::new(block, self.bundle, true);
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
                    let group = &mut self.bundle.groups[s];
                    let asleep = group.limit.lt(L::zero());
                    let limit = queries[s].limit() * group.along;
                    group.limit = L::select(asleep, group.limit, limit);
                    group.set_deepest();
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
