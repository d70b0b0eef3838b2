//! Streams through nested trees: one tree for each shared node of the scene, entered level by
//! level by the rays that reach it.
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
    InstanceBvh, InstanceBvhs, InstanceEdge, RayExtent, STREAM, StreamStack, TlasEntry,
};
use crate::geom::Certainty;
use crate::math::lanes::Lanes;
use crate::scene::{Placement, Shape, Target};

/// The rays and stack of one level.
#[derive(Default)]
pub(super) struct Level {
    stream_rays: StreamRays,
    stack: StreamStack,
}

/// A node of the scene at the end of a path.
struct PathNode<'a> {
    bvh: &'a InstanceBvh,
    place: Placement,
    /// Id of the first instance below.
    first: u64,
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
            bvh: &bvhs.roots,
            place: Placement::WORLD,
            first: 0,
        };
        let solids = &mut self.packets::<L, S>(scratch);
        nested.unbounded::<L, S, C, Q>(&world, active, queries, solids);
        let mut set = 0;
        for_each_bit(active, |i| set |= u64::from(limit(&queries[i]) >= 0.0) << i);
        nested.trace_bvh::<L, S, C, Q>(&world, set, queries, (solids, walk));
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
        set: u64,
        queries: &mut [Q; STREAM],
        solids: &mut StreamPackets<L, S>,
    ) {
        for edge in &at.bvh.unbounded {
            let (place, first) = self.through(at, edge);
            match edge.edge.target {
                Target::Node(node) => {
                    if let Some(bvh) = self.bvhs.node(node) {
                        let child = PathNode { bvh, place, first };
                        self.unbounded::<L, S, C, Q>(&child, set, queries, solids);
                    }
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

    /// Traces the tree over a node's children.
    #[inline(never)]
    fn trace_bvh<L: Lanes, const S: usize, C: Certainty, Q: Query<L::Single>>(
        &self,
        at: &PathNode,
        set: u64,
        queries: &mut [Q; STREAM],
        (solids, walk): (&mut StreamPackets<L, S>, &mut StreamScratch),
    ) {
        let edges = &at.bvh.edges;
        let mut level = walk.levels.pop().unwrap_or_default();
        if level.load(self, at, set) {
            let Level { stream_rays, stack } = &mut *level;
            for_each_bit(set, |i| stream_rays.boxes.limit[i] = limit(&queries[i]));
            let tree = &at.bvh.tree;
            tree.walk_stream::<true>(
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
        } else {
            let mut set = set;
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
            Target::Node(node) => {
                if let Some(bvh) = self.bvhs.node(node) {
                    let child = PathNode { bvh, place, first };
                    self.trace_bvh::<L, S, C, Q>(&child, set, queries, (solids, walk));
                }
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

impl Level {
    /// Loads the rays in a node's space. Returns whether its boxes can be padded for them (X9).
    #[inline(never)]
    fn load(&mut self, nested: &Nested, at: &PathNode, set: u64) -> bool {
        let Nested { stream, bvhs } = nested;
        let map = &at.place.object_from_world;
        let largest = |v: [f64; 3]| v[0].abs().max(v[1].abs()).max(v[2].abs());
        let mut reach = RayExtent {
            org: 0.0,
            dir: [f64::INFINITY, 0.0],
            world_org: 0.0,
            world_dir: 0.0,
            world: bvhs.extent(),
        };
        for_each_bit(set, |i| {
            let org = stream.org(i);
            let dir = largest(map.vector(stream.dir(i)));
            reach.world_org = reach.world_org.max(largest(org));
            reach.world_dir = reach.world_dir.max(largest(stream.dir(i)));
            reach.org = reach.org.max(largest(map.point(org)));
            reach.world = reach.world.max(largest(org));
            reach.dir = [reach.dir[0].min(dir), reach.dir[1].max(dir)];
        });
        let Some(bounds) = at.bvh.padded(map, &reach) else {
            return false;
        };
        let ray = |i: usize| {
            (
                map.point(stream.org(i)),
                map.vector(stream.dir(i)),
                stream.t_min(i),
            )
        };
        self.stream_rays.load(set, ray, &bounds, false);
        true
    }
}
