//! Kernels of single primitives, and the double pass of undecided lanes.

use super::Tester;
use crate::accel::TlasEntry;
use crate::geom::guarded::{self, ObjectRay};
use crate::geom::{Certainty, Meet, Ray, Scratch, by_solver};
use crate::math::lanes::{Lanes, Mask, Scalar, f64x8};
use crate::roots::Solver;
use crate::scene::{ImplicitId, Shape, Tables};
use crate::trace::certain_hits::CertainHits;
use crate::trace::double_pass::{DoublePass, SecondLook, look_again};
use crate::trace::packet::Packet;
use crate::trace::query::{HitId, Query, outward};
use glam::DVec3;

impl<L: Lanes, C: Certainty> Tester<'_, L, C> {
    /// Runs the kernel of a single primitive on rays in its space.
    #[inline(always)]
    fn meet(&mut self, object: &Packet<L>, entry: &TlasEntry, active: L::Mask) -> Meet<L> {
        if C::DOUBTS_ALL {
            return Meet::unsure(active);
        }
        let (scene, kernels) = (&self.world.scene, &mut self.scratch.kernels);
        if C::GUARDED {
            return scene.meet(entry.shape, extent(entry), &object.line(), active, kernels);
        }
        let met = scene.meet_fast(entry.shape, &object.line(), active, kernels);
        Meet {
            hit: met.hit & active,
            ..met
        }
    }
}

impl<L: Lanes, C: Certainty> Tester<'_, L, C> {
    /// Runs the kernel of a single primitive on all lanes.
    pub(in crate::trace) fn kernel(&mut self, entry: &TlasEntry) -> Meet<L> {
        let all = L::Mask::splat(true);
        if entry.placed {
            let object = self.object_packet(entry, DVec3::ZERO);
            self.meet(&object, entry, all)
        } else {
            let packet = self.packet;
            self.meet(packet, entry, all)
        }
    }

    /// Runs the kernel, and the double pass on undecided lanes. f32 rarely decides whether a
    /// ray hits the surface that it has just left; f64 rules out most of these hits. Any-hit
    /// rays that it certainly finds blocked are reported to the query.
    #[inline(always)]
    pub(super) fn certified<Q: Query<L>>(
        &mut self,
        object: &Packet<L>,
        entry: &TlasEntry,
        active: L::Mask,
        query: &mut Q,
    ) -> Meet<L> {
        let mut meet = self.meet(object, entry, active);
        let is_double = matches!(entry.shape, Shape::Implicit(_));
        if !C::GUARDED || C::DOUBTS_ALL || is_double || meet.unsure.none() {
            return meet;
        }
        let mut look = Primitive {
            scene: &self.world.scene,
            entry,
            kernels: &mut self.scratch.kernels,
            certain: (!Q::ANY).then(CertainHits::default),
        };
        let [may, must] = look_closer(&mut look, object, query.limit(), meet.unsure.bits());
        let must = L::Mask::from_bits(must);
        // Any-hit rays need no t.
        if Q::ANY && must.any() {
            let id = HitId {
                instance: entry.instance,
                primitive: 0,
            };
            query.block(must, id);
        }
        meet.unsure = meet.unsure & L::Mask::from_bits(may);
        if let Some(certain) = look.certain.filter(|certain| certain.hit & may != 0) {
            add_certain(
                (&self.world.scene, entry.shape),
                object,
                &certain,
                &mut meet,
            );
        }
        meet
    }
}

/// Adds the hits that the double pass is certain of, where the span tells their t.
#[cold]
#[inline(never)]
fn add_certain<L: Lanes>(
    shape: (&Tables, Shape),
    object: &Packet<L>,
    certain: &CertainHits,
    meet: &mut Meet<L>,
) {
    let (mut t, mut within) = (meet.t, meet.within);
    let mut found = 0;
    let rays = (object.org, object.dir, object.ray.t_min);
    certain.with_t(shape, rays, meet.unsure.bits(), |lane, at| {
        let [least, greatest] = outward::<L::Scalar>(certain.within[lane]);
        t = t.with_lane(lane, at);
        within = [
            within[0].with_lane(lane, least),
            within[1].with_lane(lane, greatest),
        ];
        found |= 1 << lane;
    });
    let found = L::Mask::from_bits(found);
    *meet = Meet {
        hit: meet.hit | found,
        t,
        within,
        unsure: meet.unsure & !found,
    };
}

/// [`look_again`], kept out of the common path.
#[cold]
#[inline(never)]
fn look_closer<L: Lanes>(
    look: &mut Primitive,
    object: &Packet<L>,
    limit: L,
    asked: u32,
) -> [u32; 2] {
    look_again(object, limit, asked, look)
}

/// The double pass of one primitive.
struct Primitive<'a> {
    scene: &'a Tables,
    entry: &'a TlasEntry,
    kernels: &'a mut Scratch,
    /// Hits, if they are asked for.
    certain: Option<CertainHits>,
}

impl SecondLook for Primitive<'_> {
    #[inline(never)]
    fn look<D: Lanes<Scalar = f64, Double = D>>(
        &mut self,
        pass: &DoublePass<D>,
        asked: u32,
        lanes: &[usize; f64x8::COUNT],
    ) -> [u32; 2] {
        let ray = Ray::<D>::new(pass.org, pass.dir, pass.t_min);
        let line = ObjectRay::new(&pass.org, &pass.dir, &ray);
        let asked = D::Mask::from_bits(asked);
        let extent = extent(self.entry);
        let meet = self
            .scene
            .meet_again(self.entry.shape, extent, &line, asked, self.kernels);
        let [from, to] = meet.within;
        if let Some(certain) = &mut self.certain {
            let hit = (meet.hit & !meet.unsure).bits();
            certain.take(hit, (meet.within, |_| 0), lanes);
        }
        let may = meet.hit & from.le(pass.limit) | meet.unsure;
        [may.bits(), (meet.hit & to.lt(pass.limit)).bits()]
    }
}

impl<L: Lanes, C: Certainty> Tester<'_, L, C> {
    /// Tests any-hit rays against a polynomial surface, without computing t.
    #[inline(never)]
    pub(super) fn is_blocked<Q: Query<L>>(
        &mut self,
        object: &Packet<L>,
        row: ImplicitId,
        id: HitId,
        active: L::Mask,
        query: &mut Q,
    ) {
        let world = self.world;
        let scene = &world.scene;
        let surface = &scene.implicits.row(row);
        if !C::GUARDED && scene.implicits.solver(row) != Solver::Auto {
            let limit = query.limit();
            let blocked = object.line().each_lane(active, |lane, line, t_min| {
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
            let (line, scratch) = (object.line(), &mut self.scratch.kernels.polynomial);
            (blocked, unsure) =
                guarded::implicit::blocked(surface, &line, query.limit(), active, scratch);
        }
        if C::GUARDED {
            let undecided = L::Mask::from_bits(C::doubts(id.instance, id.primitive)) & active;
            (blocked, unsure) = (blocked & !undecided, unsure | undecided);
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
        let implicit = Shape::Implicit(row);
        let meet = scene.meet_fast(implicit, &object.line(), unsure, &mut self.scratch.kernels);
        query.accept(meet.hit & meet.t.gt(object.ray.t_min), meet.t, id);
    }
}

/// Returns the longest side of a primitive's box.
fn extent(entry: &TlasEntry) -> f32 {
    let side = |k: usize| entry.own.max[k] - entry.own.min[k];
    side(0).max(side(1)).max(side(2))
}
