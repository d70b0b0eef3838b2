//! Rays without a common origin, as a stream: see [`crate::accel`]'s walk of
//! sets of rays. A node's children, or a block's triangles, are in lanes.
//!
//! What incoherent rays want. The lanes only sort out: whatever passes goes to
//! the same one-lane test as a packet's lane, so the answers are the same bits.

use super::batch::Rays;
use super::leaf::{Everything, Features, Tester};
use super::packet::Packet;
use super::query::{HitId, Query};
use crate::accel::{
    Block, Entry, STREAM, Slabs, StreamRay, StreamStack, WideMesh, World, prefetch,
};
use crate::geom::{Certainty, Ray, triangle};
use crate::math::lanes::{Lanes, Mask, Register, Scalar};
use crate::math::{Aabb32, Vec3, round_down, round_up};
use crate::scene::{MeshId, Shape};
use glam::DVec3;

/// Rays in one space, in f32 whatever their own precision: what only sorts out.
pub(super) struct Bunch {
    boxes: [StreamRay; STREAM],
    rays: [Ray<f32>; STREAM],
    /// By how much a corner, seen along the ray, may be out of place.
    misplaced: [f32; STREAM],
}

impl Default for Bunch {
    fn default() -> Bunch {
        let zero = Vec3::new(0.0, 0.0, 0.0);
        Bunch {
            boxes: [StreamRay::default(); STREAM],
            rays: [Ray::new(zero, zero, 0.0); STREAM],
            misplaced: [0.0; STREAM],
        }
    }
}

impl Bunch {
    #[inline(always)]
    fn put<L: Lanes>(
        &mut self,
        i: usize,
        org: [f64; 3],
        dir: [f64; 3],
        (t_min, limit): (f64, f32),
        bounds: &Aabb32,
    ) {
        let vector = |v: [f64; 3]| Vec3::new(v[0] as f32, v[1] as f32, v[2] as f32);
        let (org, dir) = (vector(org), vector(dir));
        let t_min = if L::is_double() {
            round_down(t_min)
        } else {
            t_min as f32
        };
        let reach = |k: usize, o: f32| {
            let (low, high) = (bounds.min[k] - o, bounds.max[k] - o);
            low.abs().max(high.abs()).max(o.abs())
        };
        let reach = reach(0, org.x).max(reach(1, org.y)).max(reach(2, org.z));
        self.boxes[i] = StreamRay::new(&Slabs::new(org, dir, bounds), t_min, limit);
        self.rays[i] = Ray::new(org, dir, t_min);
        // Origin and difference are rounded once each, the slopes three times,
        // their products with the depth and the sums once: less than half of
        // this.
        self.misplaced[i] = reach * (16.0 * 0.5 * f32::EPSILON);
    }

    /// Triangles of the block that a ray meets before its limit; where `exact`,
    /// those that it may meet as far as f32 can tell.
    #[inline(always)]
    fn may_meet(&self, i: usize, block: &Block, exact: bool, limit: f32) -> u32 {
        let corner = |v: usize| {
            let c = &block.corner[v];
            Vec3::new(
                Register::load(&c[0]),
                Register::load(&c[1]),
                Register::load(&c[2]),
            )
        };
        let corners = [corner(0), corner(1), corner(2)];
        let ray = self.rays[i].splat();
        if exact {
            triangle::may_meet_each(&corners, &ray, self.misplaced[i]).bits()
        } else {
            let met = triangle::meet_each(&corners, &ray, Mask::splat(true));
            (met.hit & met.t.le(Register::splat(limit))).bits()
        }
    }
}

/// Scratch of one thread, reused from stream to stream.
#[derive(Default)]
pub(super) struct StreamScratch {
    world: Bunch,
    object: Bunch,
    top: StreamStack,
    mesh: StreamStack,
}

/// The rays of one stream: [`STREAM`] rows from `first` on.
pub(super) struct Stream<'a> {
    pub world: &'a World<'a>,
    pub rays: &'a Rays<'a>,
    pub first: usize,
}

impl Stream<'_> {
    #[inline(always)]
    fn packet<L: Lanes>(&self, i: usize) -> Packet<L> {
        self.rays.packet(self.first + i, self.world)
    }

    #[inline(always)]
    fn org(&self, i: usize) -> [f64; 3] {
        let i = self.first + i;
        [
            self.rays.org[0][i],
            self.rays.org[1][i],
            self.rays.org[2][i],
        ]
    }

    #[inline(always)]
    fn dir(&self, i: usize) -> [f64; 3] {
        let i = self.first + i;
        [
            f64::from(self.rays.dir[0][i]),
            f64::from(self.rays.dir[1][i]),
            f64::from(self.rays.dir[2][i]),
        ]
    }

    #[inline(always)]
    fn t_min(&self, i: usize) -> f64 {
        f64::from(self.rays.t_min[self.first + i])
    }

    /// Everything in the world. `active`: the rays that are still asking.
    #[inline(always)]
    pub fn trace<L: Lanes, C: Certainty, F: Features, Q: Query<L>>(
        &self,
        active: u64,
        queries: &mut [Q; STREAM],
        scratch: &mut StreamScratch,
    ) {
        let world = self.world;
        if F::SOLIDS && !world.unbounded.is_empty() {
            each(active, |i| {
                let packet = self.packet::<L>(i);
                Tester::<L, C, F>::new(world, &packet).unbounded(&mut queries[i]);
            });
        }
        let Some(forest) = world.wide() else { return };
        let StreamScratch {
            world: bunch,
            object,
            top,
            mesh: stack,
        } = scratch;
        let mut open = 0;
        each(active, |i| {
            let limit = limit(&queries[i]);
            let range = (self.t_min(i), limit);
            bunch.put::<L>(i, self.org(i), self.dir(i), range, &forest.top.bounds);
            open |= u64::from(limit >= 0.0) << i;
        });
        let mut boxes = bunch.boxes;
        forest.top.walk_stream::<true>(
            &mut boxes,
            open,
            top,
            |_| (),
            |boxes, first, count, mut set| {
                let mut done = 0;
                for entry in &world.entries[first..first + count] {
                    match entry.shape {
                        Shape::Mesh(id) => {
                            if F::MESHES {
                                if F::TRANSFORMS && entry.placed {
                                    self.placed_mesh::<L, C, Q>(
                                        entry, id, set, queries, object, stack,
                                    );
                                } else {
                                    bunch.boxes = *boxes;
                                    self.in_mesh::<L, C, Q>(entry, id, set, queries, bunch, stack);
                                }
                            }
                        }
                        _ => {
                            if F::SOLIDS {
                                each(set, |i| {
                                    let packet = self.packet::<L>(i);
                                    let tester = Tester::<L, C, F>::new(world, &packet);
                                    let active = packet.ray.t_min.lt(queries[i].limit());
                                    tester.solid(entry, active, &mut queries[i]);
                                });
                            }
                        }
                    }
                    each(set, |i| {
                        boxes[i].limit = limit(&queries[i]);
                        done |= u64::from(boxes[i].limit < 0.0) << i;
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

    /// A mesh in a space of its own: the same rays there. Not generic over the
    /// scene's features: they matter above, and each instance costs build time.
    #[inline(never)]
    fn placed_mesh<L: Lanes, C: Certainty, Q: Query<L>>(
        &self,
        entry: &Entry,
        id: MeshId,
        set: u64,
        queries: &mut [Q; STREAM],
        bunch: &mut Bunch,
        stack: &mut StreamStack,
    ) {
        let world = self.world;
        let Some(mesh) = world.wide_mesh(id) else {
            return;
        };
        let map = world.object_from_world(entry.appearance);
        let center = world.scene.meshes.center[id.index()];
        each(set, |i| {
            let org = DVec3::from_array(map.point(self.org(i))) - center;
            let dir = map.vector(self.dir(i));
            let range = (self.t_min(i), limit(&queries[i]));
            bunch.put::<L>(i, org.to_array(), dir, range, &mesh.tree.bounds);
        });
        self.in_mesh::<L, C, Q>(entry, id, set, queries, bunch, stack);
    }

    /// A mesh through its own tree. `bunch`: the rays in its space.
    #[inline(never)]
    fn in_mesh<L: Lanes, C: Certainty, Q: Query<L>>(
        &self,
        entry: &Entry,
        id: MeshId,
        set: u64,
        queries: &mut [Q; STREAM],
        bunch: &mut Bunch,
        stack: &mut StreamStack,
    ) {
        let Some(mesh) = self.world.wide_mesh(id) else {
            return;
        };
        let mut boxes = bunch.boxes;
        let leaf = |boxes: &mut [StreamRay; STREAM], first: usize, count: usize, set: u64| {
            let mut done = 0;
            each(set, |i| {
                for block in &mesh.blocks[first..first + count] {
                    let bits = if C::DOUBTS_ALL {
                        u32::MAX
                    } else {
                        bunch.may_meet(i, block, L::is_double(), boxes[i].limit)
                    };
                    if bits != 0 {
                        let query = &mut queries[i];
                        self.offer::<L, C, Q>(i, entry, (id, mesh), block, bits, query);
                        boxes[i].limit = limit(query);
                        if Q::ANY && boxes[i].limit < 0.0 {
                            done |= 1 << i;
                            break;
                        }
                    }
                }
            });
            done
        };
        let expect = |block: usize| prefetch(&mesh.blocks[block]);
        if Q::ANY {
            mesh.tree
                .walk_stream::<false>(&mut boxes, set, stack, expect, leaf);
        } else {
            mesh.tree
                .walk_stream::<true>(&mut boxes, set, stack, expect, leaf);
        }
    }

    /// Tests some triangles of a block for good.
    #[inline(never)]
    fn offer<L: Lanes, C: Certainty, Q: Query<L>>(
        &self,
        i: usize,
        entry: &Entry,
        (id, _mesh): (MeshId, &WideMesh),
        block: &Block,
        mut bits: u32,
        query: &mut Q,
    ) {
        let packet = self.packet::<L>(i);
        let tester = Tester::<L, C, Everything>::new(self.world, &packet);
        let object = tester.mesh_packet(entry, id);
        let active = L::Mask::splat(true);
        let (window, active) = tester.window(entry, active, query.limit());
        while bits != 0 {
            let slot = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let Some(primitive) = block.source.get(slot).filter(|s| **s != u32::MAX) else {
                break;
            };
            let id = HitId {
                instance: entry.appearance,
                primitive: *primitive,
            };
            tester.triangle(&object, &window, &block.corners(slot), id, active, query);
        }
    }
}

/// Calls `f` for every member of a set, rising.
#[inline(always)]
fn each(mut set: u64, mut f: impl FnMut(usize)) {
    while set != 0 {
        let i = set.trailing_zeros() as usize % STREAM;
        set &= set - 1;
        f(i);
    }
}

/// The query's limit, not rounded down.
#[inline(always)]
fn limit<L: Lanes, Q: Query<L>>(query: &Q) -> f32 {
    let limit = query.limit().lane(0).to_f64();
    if L::is_double() {
        round_up(limit)
    } else {
        limit as f32
    }
}
