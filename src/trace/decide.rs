//! Decisions that error bounds leave open: one ray and one primitive at a time,
//! on the numbers that define them.
//!
//! Triangles are met, and their t's compared, exactly. Other primitives still
//! are as f64 has them.

use super::leaf::{Everything, Tester, resolve_one};
use super::query::{Depth, HitId, Query, Rival};
use crate::accel::{Entry, World};
use crate::geom::triangle::exact::{self, Pair, meet_exact};
use crate::geom::{Certainty, Ray, triangle};
use crate::math::Vec3;
use crate::math::bounds::Bounded;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::scene::{MeshId, Shape};
use glam::DVec3;
use std::cmp::Ordering;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Pairs that were decided here, by any thread.
static DECIDED: AtomicU64 = AtomicU64::new(0);

/// How many (ray, primitive) pairs this process has had decided by exact
/// arithmetic so far.
pub fn decided() -> u64 {
    DECIDED.load(Relaxed)
}

/// A ray's numbers, and a primitive's, that decide about the two.
enum Case {
    Triangle(Pair),
    /// Where they meet.
    Solid(Option<f64>),
}

/// Where a ray meets a primitive.
enum Crossing<'a> {
    Triangle(exact::Crossing<'a>),
    Solid(f64),
}

/// A world ray.
#[derive(Clone, Copy)]
struct WorldRay {
    org: [f64; 3],
    dir: [f64; 3],
    t_min: f64,
}

impl<L: Lanes, C: Certainty> Tester<'_, L, C, Everything> {
    /// Decides about one primitive for some lanes, and hands what comes first to
    /// the query.
    #[cold]
    #[inline(never)]
    pub fn decide<Q: Query<L>>(&self, lanes: L::Mask, id: HitId, query: &mut Q) {
        let mut bits = lanes.bits();
        DECIDED.fetch_add(u64::from(bits.count_ones()), Relaxed);
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            self.decide_one(lane, id, query);
        }
    }

    fn decide_one<Q: Query<L>>(&self, lane: usize, id: HitId, query: &mut Q) {
        let (org, dir) = self.packet.lane(lane);
        let t_min = self.packet.ray.t_min.lane(lane).to_f64();
        let ray = WorldRay { org, dir, t_min };
        let Some(rival) = query.rival(lane) else {
            return;
        };
        let case = Case::of(self.world, &ray, id);
        let Some(crossing) = case.crossing(t_min) else {
            return;
        };
        let first = match rival {
            Rival::End(end) => crossing.order_with(end).is_lt(),
            Rival::Hit(best) => match Case::of(self.world, &ray, best).crossing(t_min) {
                Some(other) => crossing.order(&other).then(id.cmp(&best)).is_lt(),
                None => true,
            },
        };
        if first {
            let at = crossing.depth::<L::Single>();
            query.take(lane, at, id);
        }
    }
}

impl Case {
    fn of(world: &World, ray: &WorldRay, id: HitId) -> Case {
        let entry = world.entry_of(id.instance);
        let Shape::Mesh(mesh) = entry.shape else {
            let t = resolve_one(world, (ray.org, ray.dir), ray.t_min, id);
            return Case::Solid(t);
        };
        let (org, dir) = in_mesh(world, ray, &entry, mesh);
        let corners = world.scene.meshes.row(mesh);
        let corners = triangle::canonical(corners.corners(id.primitive as usize));
        Case::Triangle(Pair { org, dir, corners })
    }

    /// Beyond the ray's t_min.
    fn crossing(&self, t_min: f64) -> Option<Crossing<'_>> {
        match self {
            Case::Solid(t) => t.map(Crossing::Solid),
            Case::Triangle(pair) => {
                let crossing = meet_exact(pair)?;
                let beyond = crossing.order_with(t_min).is_gt();
                beyond.then_some(Crossing::Triangle(crossing))
            }
        }
    }
}

impl Crossing<'_> {
    fn order(&self, other: &Crossing) -> Ordering {
        match (self, other) {
            (Crossing::Triangle(a), Crossing::Triangle(b)) => a.order(b),
            (a, Crossing::Solid(t)) => a.order_with(*t),
            (Crossing::Solid(t), b) => b.order_with(*t).reverse(),
        }
    }

    fn order_with(&self, x: f64) -> Ordering {
        match self {
            Crossing::Triangle(crossing) => crossing.order_with(x),
            Crossing::Solid(t) => t.total_cmp(&x),
        }
    }

    /// Its t as kernels of one lane report it.
    fn depth<L: Lanes>(&self) -> Depth {
        let crossing = match self {
            Crossing::Solid(t) => return Depth::of(*t),
            Crossing::Triangle(crossing) => crossing,
        };
        let Bounded { value, error } = crossing.t;
        let within = if error <= value.abs() * 1e-6 {
            [(value - error).next_down(), (value + error).next_up()]
        } else {
            let t = crossing.rounded();
            [t.next_down(), t.next_up()]
        };
        let lanes = |v: [f64; 3]| {
            let [x, y, z] = v.map(|x| L::splat(L::Scalar::from_f64(x)));
            Vec3::new(x, y, z)
        };
        let Pair { org, dir, corners } = crossing.pair;
        let ray = Ray::new(lanes(*org), lanes(*dir), L::zero());
        let t = triangle::depth_each(&triangle::splat(corners), &ray);
        let t = t.lane(0).to_f64();
        let t = if t.is_finite() { t } else { crossing.rounded() };
        Depth { t, within }
    }
}

/// The ray that a mesh's vertices are met by: the same steps as
/// [`Packet::in_object`](super::packet::Packet::in_object), lane for lane.
fn in_mesh(world: &World, ray: &WorldRay, entry: &Entry, mesh: MeshId) -> ([f64; 3], [f64; 3]) {
    if !entry.placed {
        return (ray.org, ray.dir);
    }
    let map = world.object_from_world(entry.appearance);
    let center = world.scene.meshes.center[mesh.index()];
    let org = DVec3::from_array(map.point(ray.org)) - center;
    (org.to_array(), map.vector(ray.dir))
}
