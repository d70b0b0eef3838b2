//! One ray at a time: a wide node's children, or a block's triangles, in lanes.
//!
//! What incoherent rays want. The lanes only sort out: whatever passes goes to
//! the same one-lane test as a packet's lane, so the answers are the same bits.

use super::leaf::{Everything, Features, Tester};
use super::packet::Packet;
use super::query::{HitId, Query};
use crate::accel::{Block, Entry, Slabs, WideStack, World, prefetch};
use crate::geom::{Certainty, Ray, triangle};
use crate::math::lanes::{Lanes, Mask, Register, Scalar};
use crate::math::{Aabb32, Vec3, round_down, round_up};
use crate::scene::{MeshId, Shape};

/// Scratch of one thread, reused from ray to ray.
#[derive(Default)]
pub(super) struct WideScratch {
    pub top: WideStack,
    pub mesh: WideStack,
}

/// A ray in world space; what only hits and solids need of it is worked out
/// when they do.
pub(super) struct OneRay<'w, L: Lanes> {
    world: &'w World<'w>,
    pub org: [f64; 3],
    pub dir: [f64; 3],
    pub t_min: L::Scalar,
    packet: Option<Packet<L>>,
}

impl<'w, L: Lanes> OneRay<'w, L> {
    #[inline(always)]
    pub fn new(world: &'w World<'w>, org: [f64; 3], dir: [f64; 3], t_min: L::Scalar) -> Self {
        OneRay {
            world,
            org,
            dir,
            t_min,
            packet: None,
        }
    }

    #[inline(always)]
    pub fn packet(&mut self) -> &Packet<L> {
        let OneRay {
            world,
            org,
            dir,
            t_min,
            packet,
        } = self;
        packet.get_or_insert_with(|| {
            Packet::new(
                Vec3::splat(*org),
                Vec3::splat(*dir),
                L::splat(*t_min),
                &world.bounds,
            )
        })
    }
}

/// Everything in the world, against one ray.
#[inline(always)]
pub(super) fn trace_ray<L, C, F, Q>(one: &mut OneRay<L>, query: &mut Q, scratch: &mut WideScratch)
where
    L: Lanes,
    C: Certainty,
    F: Features,
    Q: Query<L>,
{
    let world = one.world;
    if F::SOLIDS && !world.unbounded.is_empty() {
        Tester::<L, C, F>::new(world, one.packet()).unbounded(query);
    }
    let Some(forest) = world.wide() else { return };
    let bounds = &forest.top.bounds;
    let ray = SingleRay::new(one.org, one.dir, one.t_min.to_f64(), bounds, L::is_double());
    let WideScratch {
        top: top_stack,
        mesh: stack,
    } = scratch;
    forest.top.walk_ray::<false>(
        &ray.slabs,
        ray.t_min,
        limit(query),
        top_stack,
        |_| (),
        |first, count, _| {
            for entry in &world.entries[first..first + count] {
                match entry.shape {
                    Shape::Mesh(mesh) => {
                        if F::MESHES {
                            if F::TRANSFORMS && entry.placed {
                                placed_mesh::<L, C, Q>(one, entry, mesh, query, stack);
                            } else {
                                own_mesh::<L, C, Q>(one, &ray, entry, mesh, query, stack);
                            }
                        }
                    }
                    _ => {
                        if F::SOLIDS {
                            let active = L::splat(one.t_min).lt(query.limit());
                            let tester = Tester::<L, C, F>::new(world, one.packet());
                            tester.solid(entry, active, query);
                        }
                    }
                }
            }
            limit(query)
        },
    );
}

/// A mesh in world space.
#[inline(never)]
fn own_mesh<L, C, Q>(
    one: &mut OneRay<L>,
    ray: &SingleRay,
    entry: &Entry,
    id: MeshId,
    query: &mut Q,
    stack: &mut WideStack,
) where
    L: Lanes,
    C: Certainty,
    Q: Query<L>,
{
    in_mesh::<L, C, Q>(one, ray, entry, id, query, stack);
}

/// A mesh through its own tree, in a space of its own. Not generic over the
/// scene's features: they matter above, and each instance costs build time.
#[inline(never)]
pub(super) fn placed_mesh<L, C, Q>(
    one: &mut OneRay<L>,
    entry: &Entry,
    id: MeshId,
    query: &mut Q,
    stack: &mut WideStack,
) where
    L: Lanes,
    C: Certainty,
    Q: Query<L>,
{
    let world = one.world;
    let Some(mesh) = world.wide_mesh(id) else {
        return;
    };
    let map = world.object_from_world(entry.appearance);
    let center = world.scene.meshes.center[id.index()].to_array();
    let point = map.point(one.org);
    let org = [
        point[0] - center[0],
        point[1] - center[1],
        point[2] - center[2],
    ];
    let dir = map.vector(one.dir);
    let t_min = one.t_min.to_f64();
    let ray = SingleRay::new(org, dir, t_min, &mesh.tree.bounds, L::is_double());
    in_mesh::<L, C, Q>(one, &ray, entry, id, query, stack);
}

#[inline(always)]
fn in_mesh<L, C, Q>(
    one: &mut OneRay<L>,
    ray: &SingleRay,
    entry: &Entry,
    id: MeshId,
    query: &mut Q,
    stack: &mut WideStack,
) where
    L: Lanes,
    C: Certainty,
    Q: Query<L>,
{
    let world = one.world;
    let Some(mesh) = world.wide_mesh(id) else {
        return;
    };
    let mut found = Found::<L> { object: None };
    let start = limit(query);
    let visit = |first: usize, count: usize, _: f32| {
        for block in &mesh.blocks[first..first + count] {
            let mut bits = if C::DOUBTS_ALL {
                u32::MAX
            } else {
                ray.may_meet(block, L::is_double(), limit(query))
            };
            while bits != 0 {
                let slot = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let Some(primitive) = block.source.get(slot).filter(|s| **s != u32::MAX) else {
                    break;
                };
                let id_of = HitId {
                    instance: entry.appearance,
                    primitive: *primitive,
                };
                found.offer::<C, Q>(one, entry, id, &block.corners(slot), id_of, query);
            }
        }
        limit(query)
    };
    mesh.tree.walk_ray::<true>(
        &ray.slabs,
        ray.t_min,
        start,
        stack,
        |block| prefetch(&mesh.blocks[block]),
        visit,
    );
}

/// What testing a triangle for good needs, from the first such triangle on.
struct Found<L: Lanes> {
    object: Option<Packet<L>>,
}

impl<L: Lanes> Found<L> {
    #[inline(never)]
    fn offer<C: Certainty, Q: Query<L>>(
        &mut self,
        one: &mut OneRay<L>,
        entry: &Entry,
        id: MeshId,
        corners: &triangle::Corners,
        hit: HitId,
        query: &mut Q,
    ) {
        let world = one.world;
        let tester = Tester::<L, C, Everything>::new(world, one.packet());
        let object = self
            .object
            .get_or_insert_with(|| tester.mesh_packet(entry, id));
        let active = L::Mask::splat(true);
        let (window, active) = tester.window(entry, active, query.limit());
        tester.triangle(object, &window, corners, hit, active, query);
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

/// A ray in f32, whatever its own precision, for what only sorts out.
struct SingleRay {
    ray: Ray<Register>,
    slabs: Slabs<f32>,
    t_min: f32,
    /// By how much a corner, seen along the ray, may be out of place.
    misplaced: f32,
}

impl SingleRay {
    #[inline(always)]
    fn new(org: [f64; 3], dir: [f64; 3], t_min: f64, bounds: &Aabb32, double: bool) -> SingleRay {
        let [x, y, z] = org;
        let org = Vec3::new(x as f32, y as f32, z as f32);
        let [x, y, z] = dir;
        let dir = Vec3::new(x as f32, y as f32, z as f32);
        let t_min = if double {
            round_down(t_min)
        } else {
            t_min as f32
        };
        let reach = |k: usize, o: f32| {
            (bounds.min[k] - o)
                .abs()
                .max((bounds.max[k] - o).abs())
                .max(o.abs())
        };
        let reach = reach(0, org.x).max(reach(1, org.y)).max(reach(2, org.z));
        let splat = |v: Vec3<f32>| {
            Vec3::new(
                Register::splat(v.x),
                Register::splat(v.y),
                Register::splat(v.z),
            )
        };
        SingleRay {
            ray: Ray::new(splat(org), splat(dir), Register::splat(t_min)),
            slabs: Slabs::new(org, dir, bounds),
            t_min,
            // Origin and difference are rounded once each, the slopes three
            // times, their products with the depth and the sums once: less than
            // half of this.
            misplaced: reach * (16.0 * 0.5 * f32::EPSILON),
        }
    }

    /// Triangles of the block that the ray meets before `limit`; where `exact`,
    /// those that it may meet as far as f32 can tell.
    #[inline(always)]
    fn may_meet(&self, block: &Block, exact: bool, limit: f32) -> u32 {
        let corner = |v: usize| {
            let c = &block.corner[v];
            Vec3::new(
                Register::load(&c[0]),
                Register::load(&c[1]),
                Register::load(&c[2]),
            )
        };
        let corners = [corner(0), corner(1), corner(2)];
        if exact {
            triangle::may_meet_each(&corners, &self.ray, self.misplaced).bits()
        } else {
            let met = triangle::meet_each(&corners, &self.ray, Mask::splat(true));
            (met.hit & met.t.le(Register::splat(limit))).bits()
        }
    }
}
