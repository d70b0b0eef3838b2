//! The kernels of single primitives, and a closer look at what they leave open.

use super::Tester;
use crate::accel::Entry;
use crate::geom::exact::{Line, Solid, first_beyond};
use crate::geom::guarded::{self, ObjectRay};
use crate::geom::{
    Certainty, Meet, Ray, by_solver, cone, cuboid, ellipsoid, half_space, polygon, quadric, sphere,
};
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::roots::Solver;
use crate::scene::{ImplicitId, Shape, Tables};
use crate::trace::few::{Few, Look, look_again};
use crate::trace::packet::Packet;
use crate::trace::query::{HitId, Query};
use glam::DVec3;

impl<L: Lanes, C: Certainty> Tester<'_, L, C> {
    /// The kernel of a single primitive.
    #[inline(always)]
    fn meet(&self, object: &Packet<L>, entry: &Entry, active: L::Mask) -> Meet<L> {
        if C::DOUBTS_ALL {
            return Meet::unsure(active);
        }
        if C::GUARDED {
            return meet_guarded(&self.world.scene, entry, &object.line(), active);
        }
        let (ray, scene) = (&object.ray, &self.world.scene);
        let t_min = ray.t_min;
        let met = match entry.shape {
            Shape::HalfSpace(id) => {
                half_space::span(&[scene.half_spaces.row(id)], ray).first_beyond(t_min)
            }
            Shape::Sphere(id) => sphere::span(&scene.spheres.row(id), ray).first_beyond(t_min),
            Shape::Ellipsoid(id) => {
                ellipsoid::span(&scene.ellipsoids.row(id), ray).first_beyond(t_min)
            }
            Shape::Cylinder(id) => frustum(scene.cylinders.upright(id), object),
            Shape::Cone(id) => frustum(scene.cones.upright(id), object),
            Shape::Cuboid(id) => cuboid::span(&scene.cuboids.row(id), ray).first_beyond(t_min),
            Shape::Polyhedron(id) => {
                half_space::span(scene.polyhedra.planes(id), ray).first_beyond(t_min)
            }
            Shape::Quadric(id) => quadric::span(&scene.quadrics.row(id), ray)
                .0
                .first_beyond(t_min),
            Shape::Polygon(id) => polygon::meet(&scene.polygons.row(id), ray, active),
            Shape::Implicit(id) => implicit_certainly(scene, id, object, active),
            Shape::LevelSet(id) => {
                guarded::level_set::meet(&scene.level_sets.row(id), &object.line(), active)
            }
            Shape::Mesh(_) | Shape::Combination(_) => {
                Meet::certain(L::Mask::splat(false), L::zero())
            }
        };
        Meet {
            hit: met.hit & active,
            ..met
        }
    }
}

impl<L: Lanes, C: Certainty> Tester<'_, L, C> {
    /// What the kernel of a single primitive says of every lane.
    pub(in crate::trace) fn kernel(&self, entry: &Entry) -> Meet<L> {
        let all = L::Mask::splat(true);
        if entry.placed {
            self.meet(&self.object_packet(entry, DVec3::ZERO), entry, all)
        } else {
            self.meet(self.packet, entry, all)
        }
    }

    /// What the kernel of a single primitive says. Lanes of f32 hardly know whether a
    /// ray meets what it has just left; those of f64 do, and rule out the most. What they are
    /// certain is in the way of any-hit rays blocks these.
    #[inline(always)]
    pub(super) fn settled<Q: Query<L>>(
        &self,
        object: &Packet<L>,
        entry: &Entry,
        active: L::Mask,
        query: &mut Q,
    ) -> Meet<L> {
        let mut meet = self.meet(object, entry, active);
        let is_double = matches!(entry.shape, Shape::Implicit(_));
        if !C::GUARDED || C::DOUBTS_ALL || is_double || meet.unsure.none() {
            return meet;
        }
        let scene = &self.world.scene;
        let [may, must] = look_closer(scene, entry, object, query.limit(), meet.unsure.bits());
        let must = L::Mask::from_bits(must);
        // Where does not matter.
        if Q::ANY && must.any() {
            let id = HitId {
                instance: entry.appearance,
                primitive: 0,
            };
            query.block(must, id);
        }
        meet.unsure = meet.unsure & L::Mask::from_bits(may);
        meet
    }
}

/// [`look_again`], apart from what most rays take.
#[cold]
#[inline(never)]
fn look_closer<L: Lanes>(
    scene: &Tables,
    entry: &Entry,
    object: &Packet<L>,
    limit: L,
    asked: u32,
) -> [u32; 2] {
    look_again(object, limit, asked, &Primitive { scene, entry })
}

/// One primitive, seen in its space.
struct Primitive<'a> {
    scene: &'a Tables,
    entry: &'a Entry,
}

impl Look for Primitive<'_> {
    #[inline(never)]
    fn look<D: Lanes<Scalar = f64, Double = D>>(&self, few: &Few<D>, asked: u32) -> [u32; 2] {
        let ray = Ray::<D>::new(few.org, few.dir, few.t_min);
        let line = ObjectRay::new(&few.org, &few.dir, &ray);
        let asked = D::Mask::from_bits(asked);
        let meet = match self.entry.shape {
            Shape::Polygon(id) => {
                let polygon = &self.scene.polygons.row(id);
                guarded::polygon::meet_again(polygon, extent(self.entry), &line, asked)
            }
            _ => meet_guarded(self.scene, self.entry, &line, asked),
        };
        let [from, to] = meet.within;
        let may = meet.hit & from.le(few.limit) | meet.unsure;
        [may.bits(), (meet.hit & to.lt(few.limit)).bits()]
    }
}

impl<L: Lanes, C: Certainty> Tester<'_, L, C> {
    /// Whether a polynomial surface is in the way: where does not matter.
    #[inline(never)]
    pub(super) fn is_blocked<Q: Query<L>>(
        &self,
        object: &Packet<L>,
        row: ImplicitId,
        id: HitId,
        active: L::Mask,
        query: &mut Q,
    ) {
        let scene = &self.world.scene;
        let surface = &scene.implicits.row(row);
        if !C::GUARDED && scene.implicits.solver(row) != Solver::Auto {
            let limit = query.limit();
            let blocked = each_lane::<L>(object, active, |lane, line, t_min| {
                let between = [t_min, limit.lane(lane).to_f64()];
                by_solver::exists(surface, scene.implicits.solver(row), line, between)
            });
            if blocked.any() {
                query.block(blocked, id);
            }
            return;
        }
        let none = L::Mask::splat(false);
        let (mut blocked, mut unsure) = (none, active);
        if !C::DOUBTS_ALL {
            (blocked, unsure) =
                guarded::implicit::blocked(surface, &object.line(), query.limit(), active);
        }
        if C::GUARDED {
            let doubted = L::Mask::from_bits(C::doubts(id.instance, id.primitive)) & active;
            (blocked, unsure) = (blocked & !doubted, unsure | doubted);
        }
        if blocked.any() {
            query.block(blocked, id);
        }
        if unsure.none() {
            return;
        }
        if C::GUARDED {
            return self.decide(unsure, id, query);
        }
        let meet = implicit_certainly(scene, row, object, unsure);
        query.accept(meet.hit & meet.t.gt(object.ray.t_min), meet.t, id);
    }
}

/// The longest side of a primitive's box.
fn extent(entry: &Entry) -> f32 {
    let side = |k: usize| entry.own.max[k] - entry.own.min[k];
    side(0).max(side(1)).max(side(2))
}

/// [`Tester::meet`] with error bounds.
#[inline(always)]
fn meet_guarded<L: Lanes>(
    scene: &Tables,
    entry: &Entry,
    object: &ObjectRay<L>,
    active: L::Mask,
) -> Meet<L> {
    match entry.shape {
        Shape::HalfSpace(id) => {
            guarded::half_space::meet(&scene.half_spaces.row(id), object, active)
        }
        Shape::Sphere(id) => guarded::sphere::meet_sphere(&scene.spheres.row(id), object, active),
        Shape::Ellipsoid(id) => {
            guarded::sphere::meet_ellipsoid(&scene.ellipsoids.row(id), object, active)
        }
        Shape::Cylinder(id) => {
            guarded::cone::meet_cylinder(scene.cylinders.upright(id), object, active)
        }
        Shape::Cone(id) => guarded::cone::meet(scene.cones.upright(id), object, active),
        Shape::Cuboid(id) => guarded::cuboid::meet(&scene.cuboids.row(id), object, active),
        Shape::Polyhedron(id) => {
            let (planes, corner) = (scene.polyhedra.planes(id), scene.polyhedra.points(id)[0]);
            guarded::half_space::meet_polyhedron(planes, corner, object, active)
        }
        Shape::Polygon(id) => {
            guarded::polygon::meet(&scene.polygons.row(id), extent(entry), object, active)
        }
        Shape::Quadric(id) => guarded::quadric::meet(&scene.quadrics.row(id), object, active),
        Shape::Implicit(id) => guarded::implicit::meet(&scene.implicits.row(id), object, active),
        Shape::LevelSet(id) => guarded::level_set::meet(&scene.level_sets.row(id), object, active),
        Shape::Mesh(_) | Shape::Combination(_) => Meet::certain(L::Mask::splat(false), L::zero()),
    }
}

/// A surface of any degree, for those who know no doubt: by the solver that its row names,
/// or else what f64 leaves open is decided exactly.
#[inline(never)]
fn implicit_certainly<L: Lanes>(
    scene: &Tables,
    id: ImplicitId,
    object: &Packet<L>,
    active: L::Mask,
) -> Meet<L> {
    let row = &scene.implicits.row(id);
    let solver = scene.implicits.solver(id);
    if solver != Solver::Auto {
        let mut t = L::zero();
        let hit = each_lane(object, active, |lane, line, t_min| {
            let first = by_solver::first(row, solver, line, [t_min, f64::INFINITY]);
            if let Some(at) = first {
                t = t.with_lane(lane, L::Scalar::from_f64(at));
            }
            first.is_some()
        });
        return Meet::certain(hit, t);
    }
    let meet = guarded::implicit::meet(row, &object.line(), active);
    let mut t = meet.t;
    let decided = each_lane(object, meet.unsure, |lane, (org, dir), t_min| {
        let root = first_beyond(&Solid::Implicit(*row), &Line { org, dir }, t_min);
        if let Some(root) = &root {
            t = t.with_lane(lane, L::Scalar::from_f64(root.t.value));
        }
        root.is_some()
    });
    Meet::certain(meet.hit | decided, t)
}

/// Asks about some lanes one by one: the lane, its line and its t_min.
#[inline(always)]
fn each_lane<L: Lanes>(
    object: &Packet<L>,
    lanes: L::Mask,
    mut ask: impl FnMut(usize, ([f64; 3], [f64; 3]), f64) -> bool,
) -> L::Mask {
    let (mut bits, mut met) = (lanes.bits(), 0);
    while bits != 0 {
        let lane = bits.trailing_zeros() as usize;
        bits &= bits - 1;
        let t_min = object.ray.t_min.lane(lane).to_f64();
        met |= u32::from(ask(lane, object.lane(lane), t_min)) << lane;
    }
    L::Mask::from_bits(met)
}

#[inline(always)]
fn frustum<L: Lanes>(row: &cone::Upright, object: &Packet<L>) -> Meet<L> {
    if row.open {
        cone::meet_side(row, &object.ray)
    } else {
        cone::span(row, &object.ray).first_beyond(object.ray.t_min)
    }
}
