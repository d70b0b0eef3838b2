//! One ray at a time: a wide node's children, or a block's triangles, in lanes.
//!
//! What incoherent rays want. The lanes only sort out: whatever passes goes to
//! the same one-lane test as a packet's lane, so the answers are the same bits.

use super::leaf::{Everything, Features, Tester};
use super::packet::Packet;
use super::query::{HitId, Query};
use crate::accel::{Block, Entry, Slabs, WideStack, World};
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

/// Everything in the world, against one ray.
#[inline(always)]
pub(super) fn trace_ray<L, C, F, Q>(
    world: &World,
    packet: &Packet<L>,
    query: &mut Q,
    scratch: &mut WideScratch,
) where
    L: Lanes,
    C: Certainty,
    F: Features,
    Q: Query<L>,
{
    let tester = Tester::<L, C, F>::new(world, packet);
    if F::SOLIDS {
        tester.unbounded(query);
    }
    let Some(forest) = world.wide() else { return };
    let top = &forest.top;
    let ray = SingleRay::new(packet, &top.bounds);
    let WideScratch {
        top: top_stack,
        mesh: stack,
    } = scratch;
    top.walk_ray(
        &ray.slabs,
        ray.t_min,
        limit(query),
        top_stack,
        |first, count, _| {
            for entry in &world.entries[first..first + count] {
                match entry.shape {
                    Shape::Mesh(mesh) => {
                        if F::MESHES {
                            trace_mesh::<L, C, Q>(world, packet, entry, mesh, query, stack);
                        }
                    }
                    _ => {
                        if F::SOLIDS {
                            let active = packet.ray.t_min.lt(query.limit());
                            tester.solid(entry, active, query);
                        }
                    }
                }
            }
            limit(query)
        },
    );
}

/// A mesh through its own tree. Not generic over the scene's features: they
/// matter above, and each instance costs build time.
#[inline(never)]
pub(super) fn trace_mesh<L, C, Q>(
    world: &World,
    packet: &Packet<L>,
    entry: &Entry,
    id: MeshId,
    query: &mut Q,
    stack: &mut WideStack,
) where
    L: Lanes,
    C: Certainty,
    Q: Query<L>,
{
    let tester = Tester::<L, C, Everything>::new(world, packet);
    let Some(mesh) = tester.world.wide_mesh(id) else {
        return;
    };
    let active = tester.packet.ray.t_min.lt(query.limit());
    let (window, active) = tester.window(entry, active, query.limit());
    if active.none() {
        return;
    }
    let object = tester.mesh_packet(entry, id);
    let ray = SingleRay::new(&object, &mesh.tree.bounds);
    mesh.tree.walk_ray(
        &ray.slabs,
        ray.t_min,
        limit(query),
        stack,
        |first, count, _| {
            for block in &mesh.blocks[first..first + count] {
                let mut bits = if C::DOUBTS_ALL {
                    u32::MAX
                } else {
                    ray.may_meet(block, size_of::<L::Scalar>() == 8, limit(query))
                };
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
                    let active = L::Mask::splat(true);
                    tester.triangle(&object, &window, &block.corners(slot), id, active, query);
                }
            }
            limit(query)
        },
    );
}

/// The query's limit, not rounded down.
#[inline(always)]
fn limit<L: Lanes, Q: Query<L>>(query: &Q) -> f32 {
    let limit = query.limit().lane(0).to_f64();
    if size_of::<L::Scalar>() == 8 {
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
    fn new<L: Lanes>(packet: &Packet<L>, bounds: &Aabb32) -> SingleRay {
        let narrow = |v: &Vec3<L::Double>| {
            Vec3::new(v.x.lane(0) as f32, v.y.lane(0) as f32, v.z.lane(0) as f32)
        };
        let (org, dir) = (narrow(&packet.org), narrow(&packet.dir));
        let t_min = packet.ray.t_min.lane(0).to_f64();
        let t_min = if size_of::<L::Scalar>() == 8 {
            round_down(t_min)
        } else {
            t_min as f32
        };
        let splat = |v: Vec3<f32>| {
            Vec3::new(
                Register::splat(v.x),
                Register::splat(v.y),
                Register::splat(v.z),
            )
        };
        let reach = [org.x, org.y, org.z]
            .into_iter()
            .enumerate()
            .fold(0.0_f32, |reach, (k, o)| {
                reach
                    .max((bounds.min[k] - o).abs())
                    .max((bounds.max[k] - o).abs())
                    .max(o.abs())
            });
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
        let corners: [Vec3<Register>; 3] = block.corner.each_ref().map(|c| {
            Vec3::new(
                Register::load(&c[0]),
                Register::load(&c[1]),
                Register::load(&c[2]),
            )
        });
        if exact {
            triangle::may_meet_each(&corners, &self.ray, self.misplaced).bits()
        } else {
            let met = triangle::meet_each(&corners, &self.ray, Mask::splat(true));
            (met.hit & met.t.le(Register::splat(limit))).bits()
        }
    }
}
