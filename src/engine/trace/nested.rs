//! Streams through nested trees: one for each shared node, entered level by
//! level with those rays that reach it.
//!
//! A node's rays are the world's, brought into its space by the matrix composed
//! along the path, as [`crate::scene::Instances`] composes it. They only find
//! the way: a leaf is an entry made on the node_on_path, met by the world rays. So the
//! hits are those of a flat world, bit for bit.
//!
//! Levels take their room from a pool that grows once; recursion is as deep as
//! the graph, which [`crate::scene::MAX_DEPTH`] bounds.

use super::query::Query;
use super::ray_stream::StreamRays;
use super::scratch::TraceScratch;
use super::solids::StreamPackets;
use super::stream::{Stream, StreamScratch, TestedInstance, for_each_bit, limit};
use crate::accel::{
    InstanceBvh, InstanceBvhs, InstanceEdge, Reach, STREAM, StreamStack, TlasEntry,
};
use crate::geom::Certainty;
use crate::math::lanes::Lanes;
use crate::scene::{Placement, Shape, Target};

/// Room for one node that is being walked.
#[derive(Default)]
pub(super) struct Level {
    stream_rays: StreamRays,
    stack: StreamStack,
}

/// A node on some path.
struct PathNode<'a> {
    bvh: &'a InstanceBvh,
    place: Placement,
    /// Id of the first instance below.
    first: u64,
}

/// What all levels share.
struct Nested<'a, 'b> {
    stream: &'a Stream<'b>,
    bvhs: &'a InstanceBvhs,
}

impl Stream<'_> {
    /// Everything in a nested world. `active`: the rays that are still asking.
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
    /// Where a edge leads: the place, and the id of the first instance there.
    #[inline(always)]
    fn through(&self, above: &PathNode, edge: &InstanceEdge) -> (Placement, u64) {
        let place = above.place.through(&self.stream.world.scene, edge.edge);
        (place, above.first + edge.before)
    }

    /// What has no bounds, below a node.
    #[inline(never)]
    fn unbounded<L: Lanes, const S: usize, C: Certainty, Q: Query<L::Single>>(
        &self,
        at: &PathNode,
        set: u64,
        queries: &mut [Q; STREAM],
        solids: &mut StreamPackets<L, S>,
    ) {
        for edge in &at.bvh.open {
            let (place, first) = self.through(at, edge);
            match edge.edge.target {
                Target::Node(node) => {
                    if let Some(bvh) = self.bvhs.node(node) {
                        let node_on_path = PathNode { bvh, place, first };
                        self.unbounded::<L, S, C, Q>(&node_on_path, set, queries, solids);
                    }
                }
                Target::Shape(shape) => {
                    let own = self.bvhs.own[shape.index()];
                    let entry = TlasEntry::of(
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

    /// What is bounded below a node, through its tree.
    #[inline(never)]
    fn trace_bvh<L: Lanes, const S: usize, C: Certainty, Q: Query<L::Single>>(
        &self,
        at: &PathNode,
        set: u64,
        queries: &mut [Q; STREAM],
        (solids, walk): (&mut StreamPackets<L, S>, &mut StreamScratch),
    ) {
        let edges = &at.bvh.links;
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
                    let node_on_path = PathNode { bvh, place, first };
                    self.trace_bvh::<L, S, C, Q>(&node_on_path, set, queries, (solids, walk));
                }
            }
            Target::Shape(shape) => {
                let own = self.bvhs.own[shape.index()];
                let entry = TlasEntry::of(
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
    /// Takes in the rays in a node's space; whether boxes can be met there.
    #[inline(never)]
    fn load(&mut self, nested: &Nested, at: &PathNode, set: u64) -> bool {
        let Nested { stream, bvhs } = nested;
        let map = &at.place.object_from_world;
        let largest = |v: [f64; 3]| v[0].abs().max(v[1].abs()).max(v[2].abs());
        let mut reach = Reach {
            org: 0.0,
            dir: [f64::INFINITY, 0.0],
            world: bvhs.reach(),
        };
        for_each_bit(set, |i| {
            let org = stream.org(i);
            let dir = largest(map.vector(stream.dir(i)));
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
