//! Hits of a beam: t of the closest triangles by the steps that all kernels share.

use super::mesh::Nearest;
use crate::accel::{TlasEntry, WIDE, WideBlas, World};
use crate::geom::{Meet, Ray, triangle};
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask, Scalar};
use crate::scene::MeshId;
use crate::trace::leaf::{mesh_packet, window};
use crate::trace::packet::Packet;
use crate::trace::query::Query;

/// Closest triangles of a group in one instance of a mesh.
pub(super) struct Found<'a, L: Lanes> {
    pub entry: &'a TlasEntry,
    pub id: MeshId,
    pub mesh: &'a WideBlas,
    pub nearest: &'a Nearest<L>,
}

impl<L: Lanes> Found<'_, L> {
    /// Returns the numbers of the triangles in source order.
    #[inline(always)]
    fn primitives(&self) -> L::Ids {
        let mut primitives = L::ids(0);
        let sources = self.nearest.sources.to_array();
        for (to, source) in primitives.as_mut().iter_mut().zip(sources.as_ref()) {
            *to = source.bits() as u32;
        }
        primitives
    }

    /// Offers hits whose t is that of all kernels and lies in their boxes' intervals: see
    /// [`commit`].
    #[inline(always)]
    pub fn clear<Q: Query<L>>(&self, t: L, query: &mut Q) {
        let primitives = self.primitives();
        let hit = L::Mask::from_bits(self.nearest.met);
        let hit = hit & t.gt(L::zero()) & t.le(query.limit());
        query.accept_each(hit, t, self.entry.instance, &primitives);
    }
}

impl<L: Lanes> Found<'_, L> {
    /// Computes t of every hit by the steps that all kernels share (T6).
    #[inline(never)]
    pub fn depths(&self, org: Vec3<L>, dir: Vec3<L>) -> L {
        triangle::depth_each(&gather(self), &Ray::new(org, dir, L::zero()))
    }

    /// Offers hits that certainly precede the queries' closest hits.
    #[inline(always)]
    pub fn accept_sure<Q: Query<L>>(&self, meet: &Meet<L>, query: &mut Q) {
        query.accept_each_sure(meet, self.entry.instance, &self.primitives());
    }
}

/// Gathers the corners of the rays' triangles, one triangle at a time for all its rays.
#[inline(always)]
fn gather<L: Lanes>(found: &Found<L>) -> [Vec3<L>; 3] {
    let mut corners = [Vec3::splat([L::Scalar::from_f32(0.0); 3]); 3];
    let all = found.nearest.places;
    let places = all.to_array();
    let mut left = found.nearest.met;
    while left != 0 {
        let lane = left.trailing_zeros() as usize;
        let place = places.as_ref()[lane];
        // Places are carried as bits; some are NaN, which equals nothing.
        let here = all.eq(L::splat(place)) | L::Mask::from_bits(1 << lane);
        left &= !here.bits();
        let place = place.bits() as u32 as usize;
        let block = found.mesh.blocks.get(place / WIDE);
        for (to, from) in corners.iter_mut().zip(block.corners(place % WIDE)) {
            to.x = L::select(here, L::from_f32(from[0]), to.x);
            to.y = L::select(here, L::from_f32(from[1]), to.y);
            to.z = L::select(here, L::from_f32(from[2]), to.z);
        }
    }
    corners
}

/// Returns the triangles' boxes.
#[inline(always)]
fn around<L: Lanes>(corners: &[Vec3<L>; 3]) -> [[L; 3]; 2] {
    let [a, b, c] = corners;
    let lower = |k: usize| a.axis(k).min(b.axis(k)).min(c.axis(k));
    let upper = |k: usize| a.axis(k).max(b.axis(k)).max(c.axis(k));
    [
        [lower(0), lower(1), lower(2)],
        [upper(0), upper(1), upper(2)],
    ]
}

/// Offers the hits to the query. `org`, `dir`: the rays in the mesh's space; `packet` makes
/// the packet in world space, which is rarely needed.
///
/// By definition a hit's t lies in the padded interval of its triangle's box (X5). In world
/// space the pad is 32 roundings of a reach that is at least `size` below. If a point lies
/// within 16 roundings of the box, evaluated with an error of 6, its t lies in the interval
/// despite the interval's own rounding (X6, B18), so it need not be clamped.
#[inline(never)]
pub(super) fn commit<L: Lanes, Q: Query<L>>(
    found: &Found<L>,
    org: Vec3<L>,
    dir: Vec3<L>,
    packet: impl FnOnce() -> Packet<L>,
    world: &World,
    query: &mut Q,
) {
    let (corners, primitives) = (gather(found), found.primitives());
    let [min, max] = around(&corners);
    let ray = Ray::new(org, dir, L::zero());
    let t = triangle::depth_each(&corners, &ray);
    let hit = L::Mask::from_bits(found.nearest.met);
    let rounding = L::splat(L::Scalar::UNIT_ROUNDOFF) * L::from_f32(16.0);
    let inside = |k: usize| {
        let (org, dir) = (org.axis(k), dir.axis(k));
        let size = org.abs().max((max[k] - org).abs());
        let (point, slack) = (org + t * dir, size * rounding);
        point.ge(min[k] - slack) & point.le(max[k] + slack)
    };
    let clear = inside(0) & inside(1) & inside(2);
    let t = if found.entry.placed || (hit & !clear).any() {
        let packet = packet();
        let (window, _) = window(&packet, found.entry, hit, query.limit());
        let object = mesh_packet((world, &packet, None), found.entry, found.id);
        let (enter, exit) = object.slabs.interval_each(min, max);
        t.max(enter.max(window.enter)).min(exit.min(window.exit))
    } else {
        t
    };
    let hit = hit & t.gt(L::zero()) & t.le(query.limit());
    query.accept_each(hit, t, found.entry.instance, &primitives);
}
