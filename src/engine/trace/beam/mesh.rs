//! The traversal of one mesh by a beam, in the mesh's space.

use super::commit::{Found, commit};
use super::fast::Fast;
use super::guarded::{GuardedLeaf, ParallelEdges, PinholeEdges};
use super::rays::{Beam, Parallel, Pinhole, Projection, RelativeBox};
use crate::accel::{TlasEntry, WIDE, WideBlas, WideStack, World};
use crate::geom::Certainty;
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::scene::MeshId;
use crate::trace::query::Query;
use crate::trace::rays::Rays;

/// One mesh, and the beam with its closest hits so far.
pub(super) struct MeshTraversal<'a, L: Lanes, const S: usize> {
    pub(super) entry: &'a TlasEntry,
    pub(super) id: MeshId,
    pub(super) mesh: &'a WideBlas,
    pub(super) beam: &'a mut Beam<L, S>,
    /// By group.
    pub(super) nearest: [Nearest<L>; S],
}

/// The closest triangles so far of a group's rays.
#[derive(Clone, Copy)]
pub(super) struct Nearest<L> {
    /// Rays with a hit.
    pub met: u32,
    /// Place of the triangle, block · WIDE + slot, carried in lanes.
    pub places: L,
    /// Number of the triangle in source order, carried in lanes.
    pub sources: L,
    /// `fast`: rays with a hit that is not clearly within its triangle's box (B18).
    pub unclear: u32,
    /// `guarded`: deferred rays. They have no hit.
    pub deferred: u32,
    /// `guarded`: lower bound of the closest hit's depth, or of what it has to precede. The
    /// group's limit is the upper bound.
    pub least: L,
    /// `guarded`: the closest hit's depth as it is reported.
    pub depth: L,
}

impl<L: Lanes> Nearest<L> {
    /// No hits.
    #[inline(always)]
    pub fn none() -> Nearest<L> {
        Nearest {
            met: 0,
            places: L::zero(),
            sources: L::zero(),
            unclear: 0,
            deferred: 0,
            least: L::zero(),
            depth: L::zero(),
        }
    }

    /// Stores a triangle of block `number` as the closest one of some rays.
    #[inline(always)]
    pub fn take(&mut self, rays: L::Mask, number: usize, slot: usize, source: u32) {
        let carry = |x: u32| L::splat(L::Scalar::carrying(x));
        self.met |= rays.bits();
        let place = carry((number * WIDE + slot) as u32);
        self.places = L::select(rays, place, self.places);
        self.sources = L::select(rays, carry(source), self.sources);
    }

    /// Returns the number of one ray's triangle in source order.
    #[inline(always)]
    pub fn source(&self, lane: usize) -> Option<u32> {
        let source = self.sources.lane(lane).bits() as u32;
        (self.met >> lane & 1 != 0).then_some(source)
    }
}

impl<'a, L: Lanes, const S: usize> MeshTraversal<'a, L, S> {
    /// Starts a traversal without hits.
    #[inline(always)]
    pub fn new(
        entry: &'a TlasEntry,
        id: MeshId,
        mesh: &'a WideBlas,
        beam: &'a mut Beam<L, S>,
    ) -> Self {
        MeshTraversal {
            entry,
            id,
            mesh,
            beam,
            nearest: [Nearest::none(); S],
        }
    }

    /// Traces the mesh and returns the deferred rays.
    #[inline(always)]
    pub fn trace_any<C: Certainty, Q: Query<L>>(
        self,
        world: &World,
        rays: &Rays,
        start: usize,
        queries: &mut [Q; S],
        stack: &mut WideStack,
    ) -> [L::Mask; S] {
        if self.beam.parallel {
            self.trace::<Parallel, C, Q>(world, rays, start, queries, stack)
        } else {
            self.trace::<Pinhole, C, Q>(world, rays, start, queries, stack)
        }
    }

    #[inline(never)]
    fn trace<P: Projection, C: Certainty, Q: Query<L>>(
        mut self,
        world: &World,
        rays: &Rays,
        start: usize,
        queries: &mut [Q; S],
        stack: &mut WideStack,
    ) -> [L::Mask; S] {
        let none = [L::Mask::splat(false); S];
        let frustum = self.beam.frustum;
        let deepest = self.beam.deepest();
        let mesh = self.mesh;
        let tree = &mesh.tree;
        if C::GUARDED {
            self.start_guarded::<P, Q>(queries);
            tree.walk_frustum(
                &frustum,
                deepest,
                stack,
                |block| mesh.blocks.prefetch(block),
                |node, place, range, _| {
                    if P::PARALLEL {
                        self.leaf::<P, GuardedLeaf<ParallelEdges>, Q>(node, place, range, queries);
                    } else {
                        self.leaf::<P, GuardedLeaf<PinholeEdges>, Q>(node, place, range, queries);
                    }
                    self.beam.deepest()
                },
            );
            return self.commit_guarded::<P, Q>(queries);
        }
        tree.walk_frustum(
            &frustum,
            deepest,
            stack,
            |block| mesh.blocks.prefetch(block),
            |node, place, range, _| {
                self.leaf::<P, Fast<P>, Q>(node, place, range, queries);
                self.beam.deepest()
            },
        );
        if !Q::ANY {
            self.commit_all::<P, Q>(world, rays, start, queries);
        }
        none
    }

    /// Commits the closest triangles of `fast` to the queries.
    #[inline(always)]
    pub fn commit_all<P: Projection, Q: Query<L>>(
        &self,
        world: &World,
        rays: &Rays,
        start: usize,
        queries: &mut [Q; S],
    ) {
        for s in 0..S {
            let nearest = &self.nearest[s];
            let bits = nearest.met;
            if bits != 0 {
                let found = Found {
                    entry: self.entry,
                    id: self.id,
                    mesh: self.mesh,
                    nearest,
                };
                let group = &self.beam.groups[s];
                let clear = !P::PARALLEL && (nearest.unclear | group.oblique) & bits == 0;
                if clear && !self.entry.placed {
                    found.clear::<Q>(group.limit / group.along, &mut queries[s]);
                    continue;
                }
                let packet = || rays.packet(start + s * L::COUNT, world);
                let dir = group.dir;
                let org = if P::PARALLEL {
                    self.beam.starts[s].org
                } else {
                    Vec3::splat(self.beam.object_org)
                };
                commit::<L, Q>(&found, org, dir, packet, world, &mut queries[s]);
            }
        }
    }

    /// Returns the rays of each group that may hit a box, and whether there are any.
    #[inline(always)]
    pub fn rays_in<P: Projection>(&self, (min, max): ([f32; 3], [f32; 3])) -> ([u32; S], bool) {
        let relative = RelativeBox::new::<P, L, S>(self.beam, min, max);
        let mut rays = [0; S];
        let mut all = 0;
        for (s, rays) in rays.iter_mut().enumerate() {
            if self.beam.groups[s].deepest >= 0.0 {
                *rays = self.beam.reach_box::<P>(s, &relative).bits();
                all |= *rays;
            }
        }
        (rays, all != 0)
    }
}
