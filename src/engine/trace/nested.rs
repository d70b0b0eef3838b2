//! Streams through nested trees: one for each shared node, entered level by
//! level with those rays that reach it.
//!
//! A node's rays are the world's, brought into its space by the matrix composed
//! along the path, as [`crate::scene::Instances`] composes it. They only find
//! the way: a leaf is an entry made on the spot, met by the world rays. So the
//! hits are those of a flat world, bit for bit.
//!
//! Levels take their room from a pool that grows once; recursion is as deep as
//! the graph, which [`crate::scene::MAX_DEPTH`] bounds.

use super::query::Query;
use super::ray_stream::StreamRays;
use super::solids::Lanewise;
use super::stream::{Met, Stream, StreamScratch, each, limit};
use crate::accel::{
    InstanceBvh, InstanceBvhs, InstanceEdge, RayExtent, STREAM, StreamStack, TlasEntry,
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
struct Spot<'a> {
    group: &'a InstanceBvh,
    place: Placement,
    /// Id of the first instance below.
    first: u64,
}

/// What all levels share.
struct Nested<'a, 'b> {
    stream: &'a Stream<'b>,
    groups: &'a InstanceBvhs,
}

impl Stream<'_> {
    /// Everything in a nested world. `active`: the rays that are still asking.
    pub fn trace_nested<L: Lanes, const S: usize, C: Certainty, Q: Query<L::Single>>(
        &self,
        groups: &InstanceBvhs,
        active: u64,
        queries: &mut [Q; STREAM],
        scratch: &mut StreamScratch,
    ) {
        let nested = Nested {
            stream: self,
            groups,
        };
        let world = Spot {
            group: &groups.roots,
            place: Placement::WORLD,
            first: 0,
        };
        let solids = &mut self.lanewise::<L, S>();
        nested.unbounded::<L, S, C, Q>(&world, active, queries, solids);
        let mut set = 0;
        each(active, |i| set |= u64::from(limit(&queries[i]) >= 0.0) << i);
        nested.group::<L, S, C, Q>(&world, set, queries, (solids, scratch));
    }
}

impl Nested<'_, '_> {
    /// Where a link leads: the place, and the id of the first instance there.
    #[inline(always)]
    fn through(&self, above: &Spot, link: &InstanceEdge) -> (Placement, u64) {
        let place = above.place.through(&self.stream.world.scene, link.edge);
        (place, above.first + link.before)
    }

    /// What has no bounds, below a node.
    #[inline(never)]
    fn unbounded<L: Lanes, const S: usize, C: Certainty, Q: Query<L::Single>>(
        &self,
        at: &Spot,
        set: u64,
        queries: &mut [Q; STREAM],
        solids: &mut Lanewise<L, S>,
    ) {
        for link in &at.group.unbounded {
            let (place, first) = self.through(at, link);
            match link.edge.target {
                Target::Node(node) => {
                    if let Some(group) = self.groups.node(node) {
                        let spot = Spot {
                            group,
                            place,
                            first,
                        };
                        self.unbounded::<L, S, C, Q>(&spot, set, queries, solids);
                    }
                }
                Target::Shape(shape) => {
                    let own = self.groups.own[shape.index()];
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

    /// What is bounded below a node, through its tree.
    #[inline(never)]
    fn group<L: Lanes, const S: usize, C: Certainty, Q: Query<L::Single>>(
        &self,
        at: &Spot,
        set: u64,
        queries: &mut [Q; STREAM],
        (solids, scratch): (&mut Lanewise<L, S>, &mut StreamScratch),
    ) {
        let links = &at.group.edges;
        let mut level = scratch.levels.pop().unwrap_or_default();
        if level.take_in(self, at, set) {
            let Level { stream_rays, stack } = &mut *level;
            each(set, |i| stream_rays.boxes.limit[i] = limit(&queries[i]));
            let tree = &at.group.tree;
            tree.walk_stream::<true>(
                &mut stream_rays.boxes,
                set,
                stack,
                |_| (),
                |boxes, first, count, mut set| {
                    let mut done = 0;
                    for link in &links[first..first + count] {
                        self.link::<L, S, C, Q>(at, link, set, queries, (solids, scratch));
                        each(set, |i| {
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
            for link in links {
                if set == 0 {
                    break;
                }
                self.link::<L, S, C, Q>(at, link, set, queries, (solids, scratch));
                each(set, |i| set &= !(u64::from(limit(&queries[i]) < 0.0) << i));
            }
        }
        scratch.levels.push(level);
    }

    #[inline(never)]
    fn link<L: Lanes, const S: usize, C: Certainty, Q: Query<L::Single>>(
        &self,
        at: &Spot,
        link: &InstanceEdge,
        set: u64,
        queries: &mut [Q; STREAM],
        (solids, scratch): (&mut Lanewise<L, S>, &mut StreamScratch),
    ) {
        let (place, first) = self.through(at, link);
        match link.edge.target {
            Target::Node(node) => {
                if let Some(group) = self.groups.node(node) {
                    let spot = Spot {
                        group,
                        place,
                        first,
                    };
                    self.group::<L, S, C, Q>(&spot, set, queries, (solids, scratch));
                }
            }
            Target::Shape(shape) => {
                let own = self.groups.own[shape.index()];
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
                let met = Met { entry: &entry, map };
                let StreamScratch { object, mesh, .. } = scratch;
                self.stream
                    .placed_mesh::<L::Single, C, Q>(met, id, set, queries, object, mesh);
            }
        }
    }
}

impl Level {
    /// Takes in the rays in a node's space; whether boxes can be met there.
    #[inline(never)]
    fn take_in(&mut self, nested: &Nested, at: &Spot, set: u64) -> bool {
        let Nested { stream, groups } = nested;
        let map = &at.place.object_from_world;
        let largest = |v: [f64; 3]| v[0].abs().max(v[1].abs()).max(v[2].abs());
        let mut reach = RayExtent {
            org: 0.0,
            dir: [f64::INFINITY, 0.0],
            world: groups.extent(),
        };
        each(set, |i| {
            let org = stream.org(i);
            let dir = largest(map.vector(stream.dir(i)));
            reach.org = reach.org.max(largest(map.point(org)));
            reach.world = reach.world.max(largest(org));
            reach.dir = [reach.dir[0].min(dir), reach.dir[1].max(dir)];
        });
        let Some(bounds) = at.group.padded(map, &reach) else {
            return false;
        };
        let ray = |i: usize| {
            (
                map.point(stream.org(i)),
                map.vector(stream.dir(i)),
                stream.t_min(i),
            )
        };
        self.stream_rays.take_in(set, ray, &bounds, false);
        true
    }
}
