//! Beams: rays of one origin or one direction that pass the wide trees as one volume.
//!
//! Beams are pinhole and orthographic camera rays, and shadow rays from a point light or
//! towards a directional one. A beam is a fixed number of consecutive rays at any lane
//! width. Rays that share neither origin nor direction, or that do not advance along one
//! axis, are traced as streams, and so is a mesh of which a beam covers too many blocks.
//!
//! Triangles are tested by edge functions that the rays of a beam share, at a third of the
//! cost of the watertight test. t is then computed by the steps of all kernels, so kernels
//! that agree on the triangle agree on t. In `guarded` edge functions have error bounds
//! (docs/numerics/beams.md), and undecided rays are deferred to a stream.

mod axis_cull;
mod block;
mod commit;
mod deferred;
mod fast;
mod guarded;
mod item_lists;
mod leaf;
mod local_frame;
mod mesh;
mod parallel;
mod rays;

use super::leaf::Tester;
use super::query::{Found, Query, next_up};
use super::rays::{Rays, Vectors, load_f32};
use super::scratch::TraceScratch;
use super::solids::Packets;
use super::stream::{Stream, StreamScratch};
use crate::accel::{STREAM, TlasEntry, WideStack, World};
use crate::geom::Certainty;
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask};
use crate::scene::{MeshId, Shape};
use axis_cull::AxisCull;
use deferred::DeferredRays;
use glam::DVec3;
use mesh::MeshTraversal;
use rays::{Beam, Parallel, Pinhole, RelativeBox};

/// Number of rays of a beam.
pub const BEAM: usize = 64;

/// Expected number of a mesh's blocks that a beam covers, above which the mesh is traced
/// as a stream: each block is then hit by few of the rays.
const WIDE_BEAM: f32 = 96.0;

/// The traversal of a world by one beam, `S` groups of as many rays as there are lanes.
pub(super) struct BeamTraversal<'a, L: Lanes, const S: usize> {
    world: &'a World,
    rays: &'a Rays<'a>,
    first: usize,
    /// Origin and direction of the first live ray; all live rays share one of them.
    org: [f64; 3],
    dir: [f64; 3],
    /// World space.
    beam: &'a mut Beam<L, S>,
    /// The beam in the space of a placed mesh.
    spare: &'a mut Beam<L, S>,
    /// The rays as packets, for single primitives.
    packets: &'a mut Packets<L, S>,
    scratch: &'a mut TraceScratch,
    /// Rays that the traversal of some mesh has left undecided.
    deferred: u64,
}

/// Stacks and streams of wide and nested trees, reused from beam to beam.
#[derive(Default)]
pub(super) struct BeamScratch {
    top: WideStack,
    mesh: WideStack,
    pub streams: StreamScratch,
    /// Empty between batches.
    pub deferred: DeferredRays,
}

/// Beams of one batch, reused from beam to beam.
pub(super) struct BeamBuffers<L: Lanes, const S: usize> {
    world: Beam<L, S>,
    object: Beam<L, S>,
    packets: Packets<L, S>,
}

impl<L: Lanes, const S: usize> Default for BeamBuffers<L, S> {
    fn default() -> Self {
        BeamBuffers {
            world: Beam::empty(),
            object: Beam::empty(),
            packets: Packets::none(),
        }
    }
}

impl<'a, L: Lanes, const S: usize> BeamTraversal<'a, L, S> {
    /// Loads the rays from row `first` on. `None` if they share neither origin nor
    /// direction, do not start at t = 0, or do not advance along one axis.
    #[inline(always)]
    pub fn new(
        world: &'a World,
        rays: &'a Rays<'a>,
        first: usize,
        beams: &'a mut BeamBuffers<L, S>,
        scratch: &'a mut TraceScratch,
    ) -> Option<Self> {
        let end = first + BEAM;
        let (t_min, t_max) = (&rays.t_min[first..end], &rays.t_max[first..end]);
        let is_alive = |i: usize| t_max[i] > 0.0;
        let leader = (0..BEAM).find(|i| is_alive(*i))?;
        let org = rays.org.at(first + leader);
        let dir = rays.dir.at(first + leader);
        let mut from_start = true;
        for i in 0..BEAM {
            from_start &= (t_min[i] == 0.0) | !is_alive(i);
        }
        if !from_start {
            return None;
        }
        let is_one = |vectors: &Vectors| match vectors {
            Vectors::Single(x) => all_like(x, first, leader, t_max),
            Vectors::Double(x) => all_like(x, first, leader, t_max),
        };
        let one_origin = is_one(&rays.org);
        if !one_origin && !is_one(&rays.dir) {
            return None;
        }
        let at = |s: usize| first + s * L::COUNT;
        let dirs = |s: usize| rays.dir.lanes(at(s));
        let mut alive = [L::Mask::splat(false); S];
        for (s, alive) in alive.iter_mut().enumerate() {
            *alive = Self::alive(rays, at(s));
        }
        let bounds = &world.wide()?.tlas.bounds;
        let BeamBuffers {
            world: beam,
            object: spare,
            packets,
        } = beams;
        packets.clear();
        let taken = if one_origin {
            let org = DVec3::from_array(org) - world.center;
            beam.load_pinhole(org.to_array(), dirs, &alive, &alive, bounds)
        } else {
            let center = Vec3::splat(world.center.to_array());
            let orgs = |s: usize| rays.org.lanes(at(s)) - center;
            beam.load_parallel(orgs, dir, &alive, &alive, bounds)
        };
        taken.then_some(BeamTraversal {
            world,
            rays,
            first,
            org,
            dir,
            beam,
            spare,
            packets,
            scratch,
            deferred: 0,
        })
    }

    /// Returns the rays of a group that are not padding.
    #[inline(always)]
    fn alive(rays: &Rays, first: usize) -> L::Mask {
        load_f32::<L>(&rays.t_max[first..]).gt(L::zero())
    }

    /// Returns the rays of each group that may hit a box.
    #[inline(always)]
    fn reach_box(&self, min: [f32; 3], max: [f32; 3]) -> [L::Mask; S] {
        let beam = &*self.beam;
        let mut active = [L::Mask::splat(false); S];
        if beam.parallel {
            let relative = RelativeBox::new::<Parallel, L, S>(beam, min, max);
            for (s, active) in active.iter_mut().enumerate() {
                *active = beam.reach_box::<Parallel>(s, &relative);
            }
        } else {
            let relative = RelativeBox::new::<Pinhole, L, S>(beam, min, max);
            for (s, active) in active.iter_mut().enumerate() {
                *active = beam.reach_box::<Pinhole>(s, &relative);
            }
        }
        active
    }

    /// Traces the beam through the world. Returns the undecided rays, to be traced as a
    /// stream.
    #[inline(always)]
    pub fn trace<C: Certainty, Q: Query<L>>(
        mut self,
        queries: &mut [Q; S],
        walk: &mut BeamScratch,
    ) -> u64 {
        let world = self.world;
        if !world.unbounded.is_empty() {
            for (s, query) in queries.iter_mut().enumerate() {
                let packet = self.packets.get(s, self.rays, self.first, world);
                Tester::<L, C>::new(world, packet, self.scratch).unbounded(query);
            }
        }
        let BeamScratch {
            top: stack,
            mesh: mesh_stack,
            streams,
            ..
        } = walk;
        for (entry, id) in world.unbounded_meshes() {
            let asking = |query: &Q| query.limit().ge(L::zero());
            let active = queries.each_ref().map(asking);
            self.as_stream::<C, Q>(entry, id, &active, queries, streams);
        }
        for (s, query) in queries.iter().enumerate() {
            self.beam.limit_t::<C, Q>(s, query.limit());
        }
        let Some(levels) = world.wide() else {
            return 0;
        };
        if let [only] = &world.entries[..] {
            self.entry::<C, Q>(only, queries, mesh_stack, streams);
            return self.deferred_rays::<C>();
        }
        let top = &levels.tlas;
        let frustum = self.beam.frustum;
        top.walk_frustum(
            &frustum,
            self.beam.deepest(),
            stack,
            |_| (),
            |_, _, (first, count), _| {
                for entry in &world.entries[first..first + count] {
                    self.entry::<C, Q>(entry, queries, mesh_stack, streams);
                }
                self.beam.deepest()
            },
        );
        self.deferred_rays::<C>()
    }

    #[inline(always)]
    fn deferred_rays<C: Certainty>(&self) -> u64 {
        if C::GUARDED { self.deferred } else { 0 }
    }

    /// Tests one entry of the TLAS.
    #[inline(always)]
    fn entry<C: Certainty, Q: Query<L>>(
        &mut self,
        entry: &TlasEntry,
        queries: &mut [Q; S],
        stack: &mut WideStack,
        streams: &mut StreamScratch,
    ) {
        match entry.shape {
            Shape::Mesh(id) => {
                let (world, rays, first) = (self.world, self.rays, self.first);
                let through = |inside: MeshTraversal<L, S>, queries: &mut [Q; S]| {
                    inside.trace_any::<C, Q>(world, rays, first, queries, stack)
                };
                if entry.placed {
                    self.placed_mesh::<C, Q>(entry, id, queries, streams, through);
                } else {
                    self.mesh_in_world::<C, Q>(entry, id, queries, streams, through);
                }
            }
            _ => self.solid::<C, Q>(entry, queries),
        }
    }

    /// Tests a single primitive or CSG solid, packet by packet.
    #[inline(always)]
    fn solid<C: Certainty, Q: Query<L>>(&mut self, entry: &TlasEntry, queries: &mut [Q; S]) {
        let mut active = self.reach_box(entry.bounds.min, entry.bounds.max);
        if !entry.placed {
            self.pass_by(entry.shape, &mut active);
        }
        for (s, query) in queries.iter_mut().enumerate() {
            if active[s].any() {
                let packet = self.packets.get(s, self.rays, self.first, self.world);
                Tester::<L, C>::new(self.world, packet, self.scratch)
                    .solid(entry, active[s], query);
                self.beam.limit_t::<C, Q>(s, query.limit());
            }
        }
    }

    /// Removes the rays that pass by the axis of a cylinder or cone in world space.
    #[inline(always)]
    fn pass_by(&self, shape: Shape, active: &mut [L::Mask; S]) {
        let scene = &self.world.scene;
        let row = match shape {
            Shape::Cylinder(id) => scene.cylinders.upright(id),
            Shape::Cone(id) => scene.cones.upright(id),
            _ => return,
        };
        if active.iter().all(|lanes| lanes.none()) {
            return;
        }
        let org = DVec3::from_array(self.org);
        let around = AxisCull::new(self.beam, row, org);
        for (s, active) in active.iter_mut().enumerate() {
            *active = *active & !around.passes(self.beam, s);
        }
    }

    /// Traces a mesh in world space; `through` tests its triangles.
    #[inline(always)]
    fn mesh_in_world<C: Certainty, Q: Query<L>>(
        &mut self,
        entry: &TlasEntry,
        id: MeshId,
        queries: &mut [Q; S],
        streams: &mut StreamScratch,
        through: impl FnOnce(MeshTraversal<L, S>, &mut [Q; S]) -> [L::Mask; S],
    ) {
        let Some(mesh) = self.world.wide_mesh(id) else {
            return;
        };
        if self.beam.blocks_across(mesh) > WIDE_BEAM {
            let active = self.reach_box(entry.bounds.min, entry.bounds.max);
            self.as_stream::<C, Q>(entry, id, &active, queries, streams);
        } else {
            let inside = MeshTraversal::new(entry, id, mesh, self.beam);
            let deferred = through(inside, queries);
            self.defer::<C>(&deferred);
        }
        if self.world.entries.len() == 1 {
            return;
        }
        for (s, query) in queries.iter().enumerate() {
            self.beam.limit_t::<C, Q>(s, query.limit());
        }
    }

    /// Traces a placed mesh by a beam of the same rays in its space.
    #[inline(never)]
    fn placed_mesh<C: Certainty, Q: Query<L>>(
        &mut self,
        entry: &TlasEntry,
        id: MeshId,
        queries: &mut [Q; S],
        streams: &mut StreamScratch,
        through: impl FnOnce(MeshTraversal<L, S>, &mut [Q; S]) -> [L::Mask; S],
    ) {
        let Some(mesh) = self.world.wide_mesh(id) else {
            return;
        };
        let active = self.reach_box(entry.bounds.min, entry.bounds.max);
        if active.iter().all(|lanes| lanes.none()) {
            return;
        }
        let map = self.world.object_from_world(entry.instance);
        let center = self.world.scene.meshes.center[id.index()];
        let (beam, bounds) = (&mut *self.spare, &mesh.tree.bounds);
        let at = |s: usize| self.first + s * L::COUNT;
        let all = std::array::from_fn(|s| Self::alive(self.rays, at(s)));
        let taken = if self.beam.parallel {
            let orgs =
                |s: usize| map.points(self.rays.org.lanes(at(s))) - Vec3::splat(center.to_array());
            beam.load_parallel(orgs, map.vector(self.dir), &all, &active, bounds)
        } else {
            let dirs = |s: usize| map.vectors(self.rays.dir.lanes(at(s)));
            let org = DVec3::from_array(map.point(self.org)) - center;
            beam.load_pinhole(org.to_array(), dirs, &all, &active, bounds)
        };
        if !taken || beam.blocks_across(mesh) > WIDE_BEAM {
            self.as_stream::<C, Q>(entry, id, &active, queries, streams);
            return;
        }
        let asleep = -L::from_f32(1.0);
        for (s, query) in queries.iter().enumerate() {
            beam.limit_t::<C, Q>(s, L::select(active[s], query.limit(), asleep));
        }
        let inside = MeshTraversal::new(entry, id, mesh, beam);
        let deferred = through(inside, queries);
        self.defer::<C>(&deferred);
        for (s, query) in queries.iter().enumerate() {
            self.beam.limit_t::<C, Q>(s, query.limit());
        }
    }

    /// Marks rays as deferred.
    #[inline(always)]
    fn defer<C: Certainty>(&mut self, rays: &[L::Mask; S]) {
        if C::GUARDED {
            for (s, rays) in rays.iter().enumerate() {
                self.deferred |= u64::from(rays.bits()) << (s * L::COUNT);
            }
        }
    }

    /// Traces a mesh as a stream: its rays do not form a beam in its space, are too far
    /// apart, or the mesh has no bounds.
    #[inline(never)]
    fn as_stream<C: Certainty, Q: Query<L>>(
        &mut self,
        entry: &TlasEntry,
        id: MeshId,
        active: &[L::Mask; S],
        queries: &mut [Q; S],
        streams: &mut StreamScratch,
    ) {
        for begin in (0..BEAM).step_by(STREAM) {
            let mut set = 0;
            let mut nearest: [_; STREAM] = std::array::from_fn(|i| {
                let (s, lane) = ((begin + i) / L::COUNT, (begin + i) % L::COUNT);
                set |= u64::from(active[s].bits() >> lane & 1) << i;
                let limit = queries[s].limit().lane(lane);
                // Just beyond the ray's limit, so that its own query settles ties.
                let limit = if Q::ANY { limit } else { next_up(limit) };
                Q::together(<L::Single as Lanes>::splat(limit))
            });
            let stream = Stream {
                world: self.world,
                rays: self.rays,
                first: self.first + begin,
            };
            let scratch = &mut *self.scratch;
            stream.mesh_alone::<L::Single, C, _>(entry, id, set, &mut nearest, streams, scratch);
            for (i, query) in nearest.iter().enumerate() {
                let Some((at, id)) = query.found(0) else {
                    continue;
                };
                let (s, lane) = ((begin + i) / L::COUNT, (begin + i) % L::COUNT);
                if !queries[s].try_commit(lane, at, id) {
                    let packet = self.rays.packet(self.first + s * L::COUNT, self.world);
                    let here = L::Mask::from_bits(1 << lane);
                    Tester::<L, C>::new(self.world, &packet, self.scratch).decide(
                        here,
                        id,
                        &mut queries[s],
                    );
                }
            }
        }
    }
}

/// Whether all live rays have the same point or vector as `leader`.
#[inline(always)]
fn all_like<X: Copy + PartialEq>(
    columns: &[&[X]; 3],
    first: usize,
    leader: usize,
    t_max: &[f32],
) -> bool {
    let [x, y, z] = columns.map(|column| &column[first..first + BEAM]);
    let like = [x[leader], y[leader], z[leader]];
    let mut all = true;
    for i in 0..BEAM {
        let same = (x[i] == like[0]) & (y[i] == like[1]) & (z[i] == like[2]);
        all &= same | !(t_max[i] > 0.0);
    }
    all
}
