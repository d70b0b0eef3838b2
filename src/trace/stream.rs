//! Rays without a common origin, as a stream: see [`crate::accel`]'s walk of
//! sets of rays. A node's children, or a block's triangles, are in lanes.
//!
//! What incoherent rays want. The lanes only sort out: whatever passes goes to
//! the same one-lane test as a packet's lane, so the answers are the same bits.

use super::leaf::{Everything, Features, Tester};
use super::nested::Level;
use super::packet::Packet;
use super::query::{HitId, Query};
use super::rays::Rays;
use super::solids::{Lanewise, Packets};
use crate::accel::{Block, Entry, STREAM, Slabs, StreamRays, StreamStack, World, prefetch};
use crate::geom::triangle::{Seen, plane_normal, plane_ratio};
use crate::geom::{Certainty, Ray};
use crate::math::lanes::{Lanes, Mask, Register, Scalar, max, min};
use crate::math::{Aabb32, Affine, Vec3, round_up};
use crate::scene::{MeshId, Shape};
use glam::DVec3;

/// Rays in one space, in f32 whatever their own precision, in columns: what only
/// sorts out.
#[derive(Default)]
pub(super) struct Bunch {
    pub boxes: StreamRays,
    sight: Sight,
}

/// What triangles are met with.
struct Sight {
    org: [Column; 3],
    /// The shear of each ray, and its axis.
    shear: [Column; 3],
    axis: [u8; STREAM],
    /// t_min as a depth along the axis, in the ray's sense; rounded down.
    begin: Column,
    /// By how much a corner, seen along the ray, may be out of place.
    misplaced: Column,
}

#[derive(Clone, Copy)]
#[repr(align(64))]
struct Column([f32; STREAM]);

impl Default for Sight {
    fn default() -> Sight {
        let none = Column::default();
        Sight {
            org: [none; 3],
            shear: [none; 3],
            axis: [0; STREAM],
            begin: none,
            misplaced: none,
        }
    }
}

impl Default for Column {
    fn default() -> Column {
        Column([0.0; STREAM])
    }
}

impl Bunch {
    /// Takes in all rays. `ray`: origin, direction and t_min of a row.
    #[inline(always)]
    pub fn take_in(
        &mut self,
        set: u64,
        ray: impl Fn(usize) -> ([f64; 3], [f64; 3], f32),
        bounds: &Aabb32,
    ) {
        let mut columns = [Column::default(); 7];
        each(set, |i| {
            let (org, dir, t_min) = ray(i);
            for k in 0..3 {
                columns[k].0[i] = org[k] as f32;
                columns[3 + k].0[i] = dir[k] as f32;
            }
            columns[6].0[i] = t_min;
        });
        for first in (0..STREAM).step_by(<Register as Lanes>::COUNT) {
            if (set >> first) & ((1 << <Register as Lanes>::COUNT) - 1) == 0 {
                continue;
            }
            let load = |column: usize| Register::load(&columns[column].0[first..]);
            let org = Vec3::new(load(0), load(1), load(2));
            let dir = Vec3::new(load(3), load(4), load(5));
            let t_min = load(6);
            let ray = Ray::new(org, dir, t_min);
            self.boxes.put(first, &Slabs::new(org, dir, bounds), t_min);
            let reach = |k: usize| {
                let o = org.axis(k);
                let low = Register::splat(bounds.min[k]) - o;
                let high = Register::splat(bounds.max[k]) - o;
                max(max(low.abs(), high.abs()), o.abs())
            };
            let reach = max(max(reach(0), reach(1)), reach(2));
            // Origin and difference are rounded once each, the slopes three
            // times, their products with the depth and the sums once: less than
            // half of this.
            let misplaced = reach * Register::splat(16.0 * 0.5 * f32::EPSILON);
            let shear = &ray.shear;
            let begin = t_min * shear.along.abs();
            let store = |column: &mut Column, x: Register| x.store(&mut column.0[first..]);
            let sight = &mut self.sight;
            for k in 0..3 {
                store(&mut sight.org[k], org.axis(k));
            }
            store(&mut sight.shear[0], shear.x);
            store(&mut sight.shear[1], shear.y);
            store(&mut sight.shear[2], shear.along);
            let lanes = shear.lanes.map(Mask::bits);
            for lane in 0..<Register as Lanes>::COUNT {
                let is = |k: usize| (lanes[k] >> lane & 1) as u8;
                sight.axis[first + lane] = is(1) | is(2) << 1;
            }
            store(
                &mut sight.begin,
                begin - begin.abs() * Register::splat(SLACK),
            );
            store(&mut sight.misplaced, misplaced);
        }
    }
}

impl Sight {
    /// Triangles of the block that a ray may meet before its limit, as far as f32
    /// can tell; and of these, unless `exact`, those that every test in f32 says it
    /// meets.
    #[inline(always)]
    fn may_meet(&self, i: usize, block: &Block, exact: bool, limit: f32) -> [u32; 2] {
        // The steps of `Shear::apply`, along the one axis that this ray has.
        let splat = |column: &Column| Register::splat(column.0[i]);
        let k = usize::from(self.axis[i]) % 3;
        let (a, b) = ((k + 1) % 3, (k + 2) % 3);
        let org = (
            splat(&self.org[a]),
            splat(&self.org[b]),
            splat(&self.org[k]),
        );
        let (shear_x, shear_y) = (splat(&self.shear[0]), splat(&self.shear[1]));
        let raw = |v: usize| {
            let at = |axis: usize| Register::load(&block.corner[v][axis]);
            [at(a), at(b), at(k)]
        };
        let corner = |v: usize| {
            let [x, y, z] = raw(v);
            [x - org.0, y - org.1, z - org.2]
        };
        let corners = [corner(0), corner(1), corner(2)];
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = corners;
        let (x, y) = (
            |x: Register, z: Register| shear_x.mul_add(z, x),
            |y: Register, z: Register| shear_y.mul_add(z, y),
        );
        let seen = Seen {
            x: [x(ax, az), x(bx, bz), x(cx, cz)],
            y: [y(ay, az), y(by, bz), y(cy, cz)],
            z: [az, bz, cz],
        };
        if exact {
            return [seen.may_meet(splat(&self.misplaced)).bits(), 0];
        }
        let (inside, _) = seen.inside();
        let minus = |p: [Register; 3], q: [Register; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
        // What `plane_depth` divides, t in its plane and the corners' least, is
        // compared as products here: depths in the ray's sense.
        let normal = plane_normal(minus(raw(2), raw(1)), minus(raw(0), raw(2)));
        let [above, det] = plane_ratio(corners, normal, [shear_x, shear_y]);
        let along = self.shear[2].0[i];
        let sense = Register::splat(1.0_f32.copysign(along));
        let above = above * sense;
        let above = <Register as Lanes>::select(det.lt(Register::zero()), -above, above);
        let begin = splat(&self.begin);
        let (az, bz, cz) = (az * sense, bz * sense, cz * sense);
        let (least, most) = (min(min(az, bz), cz), max(max(az, bz), cz));
        // Without area, as the places that fill a block up.
        let none = Lanes::eq(above, Register::zero()) | Lanes::eq(det, Register::zero());
        let begun = Lanes::gt(above, begin * det.abs()) | Lanes::gt(least, begin);
        // The hit is then moved into its triangle's box, and may come before the
        // limit: that is for the test for good, unless the whole triangle lies
        // between the ray's ends.
        let end = limit * along.abs();
        let pad = splat(&self.misplaced) * Register::splat(4.0);
        let before = Lanes::le(least - pad, Register::splat(end * (1.0 + SLACK)));
        let inside = inside & !none;
        let within = Lanes::gt(
            least - pad,
            begin + begin.abs() * Register::splat(2.0 * SLACK),
        ) & Lanes::lt(most + pad, Register::splat(end * (1.0 - SLACK)));
        [(inside & begun & before).bits(), (inside & within).bits()]
    }
}

/// More than what a depth is wrong by, relative to itself, that takes four
/// roundings.
const SLACK: f32 = 4.0 * f32::EPSILON;

/// Scratch of one thread, reused from stream to stream.
#[derive(Default)]
pub(super) struct StreamScratch {
    world: Bunch,
    pub object: Bunch,
    top: StreamStack,
    pub mesh: StreamStack,
    /// Of nested worlds: levels that are not in use.
    pub levels: Vec<Box<Level>>,
}

/// What is being tested: an entry, and its `object_from_world` where that is at
/// hand.
#[derive(Clone, Copy)]
pub(super) struct Met<'a> {
    pub entry: &'a Entry,
    pub map: Option<&'a Affine>,
}

impl<'a> Met<'a> {
    pub fn new(entry: &'a Entry) -> Met<'a> {
        Met { entry, map: None }
    }
}

/// The rays of one stream: [`STREAM`] rows from `first` on.
pub(super) struct Stream<'a> {
    pub world: &'a World<'a>,
    pub rays: &'a Rays<'a>,
    pub first: usize,
}

impl Stream<'_> {
    /// The rays as packets.
    pub fn lanewise<L: Lanes, const S: usize>(&self) -> Lanewise<'_, L, S> {
        Lanewise {
            world: self.world,
            rays: self.rays,
            first: self.first,
            packets: Packets::none(),
        }
    }

    #[inline(always)]
    fn packet<L: Lanes>(&self, i: usize) -> Packet<L> {
        self.rays.packet(self.first + i, self.world)
    }

    #[inline(always)]
    pub fn org(&self, i: usize) -> [f64; 3] {
        self.rays.org.at(self.first + i)
    }

    #[inline(always)]
    pub fn dir(&self, i: usize) -> [f64; 3] {
        let i = self.first + i;
        [
            f64::from(self.rays.dir[0][i]),
            f64::from(self.rays.dir[1][i]),
            f64::from(self.rays.dir[2][i]),
        ]
    }

    #[inline(always)]
    pub fn t_min(&self, i: usize) -> f32 {
        self.rays.t_min[self.first + i]
    }

    /// Everything in the world. `active`: the rays that are still asking.
    #[inline(always)]
    pub fn trace<L: Lanes, const S: usize, C: Certainty, F: Features, Q: Query<L::Single>>(
        &self,
        active: u64,
        queries: &mut [Q; STREAM],
        scratch: &mut StreamScratch,
    ) {
        let world = self.world;
        let mut solids = self.lanewise::<L, S>();
        if F::SOLIDS {
            for entry in &world.unbounded {
                solids.meet::<C, Q>(entry, None, active, queries);
            }
        }
        let Some(forest) = world.wide() else { return };
        let StreamScratch {
            world: bunch,
            object,
            top,
            mesh: stack,
            ..
        } = scratch;
        let ray = |i: usize| (self.org(i), self.dir(i), self.t_min(i));
        bunch.take_in(active, ray, &forest.top.bounds);
        let mut open = 0;
        each(active, |i| {
            let limit = limit(&queries[i]);
            bunch.boxes.limit[i] = limit;
            open |= u64::from(limit >= 0.0) << i;
        });
        let mut boxes = bunch.boxes.clone();
        forest.top.walk_stream::<true>(
            &mut boxes,
            open,
            top,
            |_| (),
            |boxes, first, count, mut set| {
                let mut done = 0;
                for entry in &world.entries[first..first + count] {
                    let met = Met::new(entry);
                    match entry.shape {
                        Shape::Mesh(id) => {
                            if F::MESHES {
                                if F::TRANSFORMS && entry.placed {
                                    self.placed_mesh::<L::Single, C, Q>(
                                        met, id, set, queries, object, stack,
                                    );
                                } else {
                                    bunch.boxes.limit = boxes.limit;
                                    self.in_mesh::<L::Single, C, Q>(
                                        met, id, set, queries, bunch, stack,
                                    );
                                }
                            }
                        }
                        _ => {
                            if F::SOLIDS {
                                solids.meet::<C, Q>(entry, None, set, queries);
                            }
                        }
                    }
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
    }

    /// A mesh in a space of its own: the same rays there. Not generic over the
    /// scene's features: they matter above, and each instance costs build time.
    #[inline(never)]
    pub fn placed_mesh<L: Lanes, C: Certainty, Q: Query<L>>(
        &self,
        met: Met,
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
        let look_up = || world.object_from_world(met.entry.appearance);
        let map = met.map.copied().unwrap_or_else(look_up);
        let met = Met {
            map: Some(&map),
            ..met
        };
        let center = world.scene.meshes.center[id.index()];
        let ray = |i: usize| {
            let org = DVec3::from_array(map.point(self.org(i))) - center;
            (org.to_array(), map.vector(self.dir(i)), self.t_min(i))
        };
        bunch.take_in(set, ray, &mesh.tree.bounds);
        each(set, |i| bunch.boxes.limit[i] = limit(&queries[i]));
        self.in_mesh::<L, C, Q>(met, id, set, queries, bunch, stack);
    }

    /// A mesh, for rays that meet everything else otherwise.
    pub fn mesh_alone<L: Lanes, C: Certainty, Q: Query<L>>(
        &self,
        entry: &Entry,
        id: MeshId,
        set: u64,
        queries: &mut [Q; STREAM],
        scratch: &mut StreamScratch,
    ) {
        let StreamScratch { object, mesh, .. } = scratch;
        let (met, stack) = (Met::new(entry), mesh);
        if entry.placed {
            return self.placed_mesh::<L, C, Q>(met, id, set, queries, object, stack);
        }
        let Some(mesh) = self.world.wide_mesh(id) else {
            return;
        };
        let ray = |i: usize| (self.org(i), self.dir(i), self.t_min(i));
        object.take_in(set, ray, &mesh.tree.bounds);
        each(set, |i| object.boxes.limit[i] = limit(&queries[i]));
        self.in_mesh::<L, C, Q>(met, id, set, queries, object, stack);
    }

    /// A mesh through its own tree. `bunch`: the rays in its space.
    #[inline(never)]
    fn in_mesh<L: Lanes, C: Certainty, Q: Query<L>>(
        &self,
        met: Met,
        id: MeshId,
        set: u64,
        queries: &mut [Q; STREAM],
        bunch: &mut Bunch,
        stack: &mut StreamStack,
    ) {
        let Some(mesh) = self.world.wide_mesh(id) else {
            return;
        };
        let Bunch { boxes, sight } = bunch;
        let leaf = |boxes: &mut StreamRays, first: usize, count: usize, set: u64| {
            let mut done = 0;
            for block in &mesh.blocks[first..first + count] {
                // Sorting out all rays first keeps hits, which nobody can
                // predict, out of a loop that the processor looks ahead in.
                let (mut bits, mut some) = ([0; STREAM], 0);
                let (mut sure, mut sures) = ([0; STREAM], 0);
                each(set & !done, |i| {
                    let sighted = if C::DOUBTS_ALL {
                        [u32::MAX, 0]
                    } else {
                        sight.may_meet(i, block, L::is_double(), boxes.limit[i])
                    };
                    bits[i] = sighted[0];
                    some |= u64::from(bits[i] != 0) << i;
                    if Q::ANY && !C::GUARDED {
                        sure[i] = sighted[1];
                        sures |= u64::from(sure[i] != 0) << i;
                    }
                });
                each(sures, |i| {
                    let slot = sure[i].trailing_zeros() as usize;
                    let id = HitId {
                        instance: met.entry.appearance,
                        primitive: block.source[slot],
                    };
                    queries[i].block(L::Mask::splat(true), id);
                    boxes.limit[i] = -1.0;
                });
                done |= sures;
                each(some & !sures, |i| {
                    let query = &mut queries[i];
                    self.offer::<L, C, Q>(i, met, id, block, bits[i], query);
                    boxes.limit[i] = limit(query);
                    done |= u64::from(Q::ANY && boxes.limit[i] < 0.0) << i;
                });
            }
            done
        };
        let expect = |block: usize| prefetch(&mesh.blocks[block]);
        if Q::ANY {
            mesh.tree
                .walk_stream::<false>(boxes, set, stack, expect, leaf);
        } else {
            mesh.tree
                .walk_stream::<true>(boxes, set, stack, expect, leaf);
        }
    }

    /// Tests some triangles of a block for good.
    #[inline(never)]
    fn offer<L: Lanes, C: Certainty, Q: Query<L>>(
        &self,
        i: usize,
        Met { entry, map }: Met,
        id: MeshId,
        block: &Block,
        mut bits: u32,
        query: &mut Q,
    ) {
        let packet = self.packet::<L>(i);
        let tester = Tester::<L, C, Everything>::new(self.world, &packet).with_map(map);
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
pub(super) fn each(mut set: u64, mut f: impl FnMut(usize)) {
    while set != 0 {
        let i = set.trailing_zeros() as usize % STREAM;
        set &= set - 1;
        f(i);
    }
}

/// The query's limit, not rounded down.
#[inline(always)]
pub(super) fn limit<L: Lanes, Q: Query<L>>(query: &Q) -> f32 {
    let limit = query.limit().lane(0).to_f64();
    if L::is_double() {
        round_up(limit)
    } else {
        limit as f32
    }
}
