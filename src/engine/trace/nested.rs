//! Streams through nested trees: the trees of the scene's shared nodes, entered level by level
//! by the rays that reach them.
//!
//! A level's rays are the world's, transformed by the matrix composed along the path as in
//! [`crate::scene::Instances`]. They only cull: at a leaf an entry is made, and tested with
//! the world rays, so hits have the bits of a flat world.
//!
//! Levels are reused. The recursion is as deep as the graph, at most
//! [`crate::scene::MAX_DEPTH`].

use super::query::Query;
use super::ray_stream::StreamRays;
use super::scratch::TraceScratch;
use super::solids::StreamPackets;
use super::stream::{Stream, StreamScratch, TestedInstance, for_each_bit, limit};
use crate::accel::{
    InstanceBvh, InstanceBvhs, InstanceEdge, NodeTrees, Padded, RayExtent, STREAM, StreamStack,
    TlasEntry, may_meet,
};
use crate::geom::Certainty;
use crate::math::lanes::Lanes;
use crate::math::{Aabb32, Affine};
use crate::scene::{Placement, Shape, Target};
use glam::DVec3;

/// The rays and stack of one level.
#[derive(Default)]
pub(super) struct Level {
    stream_rays: StreamRays,
    stack: StreamStack,
}

/// A node of the scene at the end of a path, the world at the end of the empty one.
struct PathNode {
    place: Placement,
    /// Id of the first instance below.
    first: u64,
}

/// The space of one tree's boxes: a node's about a centre.
struct Space<'a> {
    map: &'a Affine,
    center: DVec3,
}

/// The stream and the trees, shared by all levels.
struct Nested<'a, 'b> {
    stream: &'a Stream<'b>,
    bvhs: &'a InstanceBvhs,
}

impl Stream<'_> {
    /// Traces the `active` rays through a nested world.
    pub fn trace_nested<L: Lanes, const S: usize, C: Certainty, Q: Query<L::Single>>(
        &self,
        bvhs: &InstanceBvhs,
        active: u64,
        queries: &mut [Q; STREAM],
        walk: &mut StreamScratch,
        scratch: &mut TraceScratch,
    ) {
        let nested = Nested { stream: self, bvhs };
        let world = PathNode {
            place: Placement::WORLD,
            first: 0,
        };
        let solids = &mut self.packets::<L, S>(scratch);
        nested.unbounded::<L, S, C, Q>(&world, &bvhs.roots, active, queries, solids);
        for bvh in bvhs.root_trees() {
            let mut set = 0;
            for_each_bit(active, |i| set |= u64::from(limit(&queries[i]) >= 0.0) << i);
            nested.trace_bvh::<L, S, C, Q>(&world, bvh, set, queries, (solids, walk));
        }
    }
}

impl Nested<'_, '_> {
    /// Follows an edge: returns the placement and the id of the first instance there.
    #[inline(always)]
    fn through(&self, above: &PathNode, edge: &InstanceEdge) -> (Placement, u64) {
        let place = above.place.through(&self.stream.world.scene, edge.edge);
        (place, above.first + edge.before)
    }

    /// Tests the unbounded shapes below a node.
    #[inline(never)]
    fn unbounded<L: Lanes, const S: usize, C: Certainty, Q: Query<L::Single>>(
        &self,
        at: &PathNode,
        trees: &NodeTrees,
        set: u64,
        queries: &mut [Q; STREAM],
        solids: &mut StreamPackets<L, S>,
    ) {
        for edge in &trees.unbounded {
            let (place, first) = self.through(at, edge);
            match edge.edge.target {
                Target::Node(node) => {
                    let (child, trees) = (PathNode { place, first }, self.bvhs.node(node));
                    self.unbounded::<L, S, C, Q>(&child, trees, set, queries, solids);
                }
                Target::Shape(shape) => {
                    let own = self.bvhs.own[shape.index()];
                    let entry = TlasEntry::place(
                        &self.stream.world.scene,
                        shape,
                        own,
                        first,
                        &place,
                        self.stream.world.center,
                    );
                    let map = Some(&place.object_from_world);
                    solids.meet::<C, Q>(&entry, map, set, queries);
                }
            }
        }
    }

    /// Traces one tree over a node's children.
    #[inline(never)]
    fn trace_bvh<L: Lanes, const S: usize, C: Certainty, Q: Query<L::Single>>(
        &self,
        at: &PathNode,
        bvh: &InstanceBvh,
        set: u64,
        queries: &mut [Q; STREAM],
        (solids, walk): (&mut StreamPackets<L, S>, &mut StreamScratch),
    ) {
        let edges = &bvh.edges;
        let mut level = walk.levels.pop().unwrap_or_default();
        let space = Space {
            map: &at.place.object_from_world,
            center: bvh.center,
        };
        let padded = bvh.padded(space.map, &self.extent(&space, set));
        if let Padded::Slabs(bounds) = padded {
            level.load(self.stream, &space, set, &bounds);
            let Level { stream_rays, stack } = &mut *level;
            for_each_bit(set, |i| stream_rays.boxes.limit[i] = limit(&queries[i]));
            bvh.tree.walk_stream::<true>(
                &mut stream_rays.boxes,
                set,
                stack,
                |_| (),
                |boxes, first, count, mut set| {
                    let mut done = 0;
                    for edge in &edges[first..first + count] {
                        self.trace_edge::<L, S, C, Q>(at, edge, set, queries, (solids, walk));
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
        if let Padded::Whole(bounds) = padded {
            let mut met = 0;
            for_each_bit(set, |i| {
                let (org, dir) = self.stream.ray_in(&space, i);
                // An f32 limit at its end stands for any t.
                let limit = match limit(&queries[i]) {
                    f32::MAX.. => f64::INFINITY,
                    limit => f64::from(limit),
                };
                let within = [f64::from(self.stream.t_min(i)), limit];
                met |= u64::from(may_meet(&bounds, org, dir, within)) << i;
            });
            let mut set = met;
            for edge in edges {
                if set == 0 {
                    break;
                }
                self.trace_edge::<L, S, C, Q>(at, edge, set, queries, (solids, walk));
                for_each_bit(set, |i| set &= !(u64::from(limit(&queries[i]) < 0.0) << i));
            }
        }
        walk.levels.push(level);
    }

    /// Tests one child of a node: another node, or a shape.
    #[inline(never)]
    fn trace_edge<L: Lanes, const S: usize, C: Certainty, Q: Query<L::Single>>(
        &self,
        at: &PathNode,
        edge: &InstanceEdge,
        set: u64,
        queries: &mut [Q; STREAM],
        (solids, walk): (&mut StreamPackets<L, S>, &mut StreamScratch),
    ) {
        let (place, first) = self.through(at, edge);
        match edge.edge.target {
            Target::Node(_) => {
                let (child, bvh) = (PathNode { place, first }, self.bvhs.below(edge));
                self.trace_bvh::<L, S, C, Q>(&child, bvh, set, queries, (solids, walk));
            }
            Target::Shape(shape) => {
                let own = self.bvhs.own[shape.index()];
                let entry = TlasEntry::place(
                    &self.stream.world.scene,
                    shape,
                    own,
                    first,
                    &place,
                    self.stream.world.center,
                );
                let map = Some(&place.object_from_world);
                let Shape::Mesh(id) = entry.shape else {
                    return solids.meet::<C, Q>(&entry, map, set, queries);
                };
                let met = TestedInstance { entry: &entry, map };
                let StreamScratch { object, mesh, .. } = walk;
                let walk = (object, mesh);
                self.stream.placed_mesh::<L::Single, C, Q>(
                    met,
                    id,
                    set,
                    queries,
                    walk,
                    solids.scratch,
                );
            }
        }
    }
}

impl Nested<'_, '_> {
    /// Returns the extent of rays in a tree's space.
    #[inline(never)]
    fn extent(&self, space: &Space, set: u64) -> RayExtent {
        let Nested { stream, bvhs } = self;
        let largest = |v: [f64; 3]| v[0].abs().max(v[1].abs()).max(v[2].abs());
        let mut extent = RayExtent {
            org: 0.0,
            dir: [f64::INFINITY, 0.0],
            world_org: 0.0,
            world_dir: 0.0,
            world: bvhs.extent(),
        };
        for_each_bit(set, |i| {
            let (world_org, world_dir) = (largest(stream.org(i)), largest(stream.dir(i)));
            let (org, dir) = stream.ray_in(space, i);
            let dir = largest(dir);
            extent.world_org = extent.world_org.max(world_org);
            extent.world_dir = extent.world_dir.max(world_dir);
            extent.org = extent.org.max(largest(org));
            extent.world = extent.world.max(world_org);
            extent.dir = [extent.dir[0].min(dir), extent.dir[1].max(dir)];
        });
        extent
    }
}

impl Stream<'_> {
    /// Returns the origin and direction of a ray in a tree's space.
    #[inline(always)]
    fn ray_in(&self, space: &Space, i: usize) -> ([f64; 3], [f64; 3]) {
        let Space { map, center } = space;
        let org = DVec3::from_array(map.point(self.org(i))) - *center;
        (org.to_array(), map.vector(self.dir(i)))
    }
}

impl Level {
    /// Loads the rays in a tree's space, for boxes within `bounds`.
    #[inline(never)]
    fn load(&mut self, stream: &Stream, space: &Space, set: u64, bounds: &Aabb32) {
        let ray = |i: usize| {
            let (org, dir) = stream.ray_in(space, i);
            (org, dir, stream.t_min(i))
        };
        self.stream_rays.load(set, ray, bounds, false);
    }
}
