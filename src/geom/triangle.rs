//! Triangles: the watertight test of Woop, Benthin and Wald (JCGT 2013).
//!
//! Vertices are seen from the ray's origin and sheared along the ray; the three
//! edge functions are differences of products without FMA, so an edge shared by
//! two triangles has exactly opposite values in them: no ray slips between, and
//! a ray that meets the edge exactly meets both. Differs from the paper in that
//! lanes with different major axes run one after another, that both orientations
//! are met, and that there is no f64 retry (that is what certainty is for).
//! Callers bring corners into their [`canonical`] order.

use super::ray::{Meet, Ray};
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Mask, Scalar};

/// Corners in f32, about the mesh's centre.
pub type Corners = [[f32; 3]; 3];

/// The corners in an order of their own, whatever the winding: two triangles on
/// the same three points (scans have such) then give the same bits of t, and the
/// lower id wins, as in exact arithmetic. The kernel asks for no winding.
pub fn canonical(mut corners: Corners) -> Corners {
    corners.sort_unstable_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    corners
}

#[inline(always)]
pub fn meet<L: Lanes>(corners: &Corners, ray: &Ray<L>, active: L::Mask) -> Meet<L> {
    meet_each(&splat(corners), ray, active)
}

/// The same corners in every lane.
#[inline(always)]
pub fn splat<L: Lanes>(corners: &Corners) -> [Vec3<L>; 3] {
    let corner = |c: &[f32; 3]| Vec3::new(L::from_f32(c[0]), L::from_f32(c[1]), L::from_f32(c[2]));
    [
        corner(&corners[0]),
        corner(&corners[1]),
        corner(&corners[2]),
    ]
}

/// A triangle of its own in each lane; the same bits as [`meet`].
#[inline(always)]
pub fn meet_each<L: Lanes>(corners: &[Vec3<L>; 3], ray: &Ray<L>, active: L::Mask) -> Meet<L> {
    let mut hit = L::Mask::splat(false);
    let mut t = L::zero();
    for (k, lanes) in ray.shear.groups() {
        let one = Seen::by(corners, ray, k).meet(ray.shear.along, ray.t_min);
        let here = one.hit & lanes & active;
        t = L::select(here, one.t, t);
        hit = hit | here;
    }
    Meet::certain(hit, t)
}

/// Where each lane's ray meets its triangle's plane, by the very steps of
/// [`meet`], whether or not it passes inside. NaN or infinite where edge-on.
#[inline(always)]
pub fn depth_each<L: Lanes>(corners: &[Vec3<L>; 3], ray: &Ray<L>) -> L {
    let mut t = L::zero();
    for (k, lanes) in ray.shear.groups() {
        let seen = Seen::by(corners, ray, k);
        t = L::select(lanes, seen.t(seen.weights(), ray.shear.along), t);
    }
    t
}

/// A triangle as a ray sees it: relative to its origin, sheared along it.
#[derive(Clone, Copy)]
pub struct Seen<L> {
    /// By corner.
    pub x: [L; 3],
    pub y: [L; 3],
    /// Along the ray's axis.
    pub z: [L; 3],
}

impl<L: Lanes> Seen<L> {
    #[inline(always)]
    fn by(corners: &[Vec3<L>; 3], ray: &Ray<L>, k: usize) -> Seen<L> {
        let seen = |v: usize| ray.shear.apply(k, corners[v] - ray.org);
        let ((ax, ay, az), (bx, by, bz)) = (seen(0), seen(1));
        let (cx, cy, cz) = seen(2);
        Seen {
            x: [ax, bx, cx],
            y: [ay, by, cy],
            z: [az, bz, cz],
        }
    }

    /// Edge functions: barycentric weights, not yet divided by their sum.
    #[inline(always)]
    fn weights(&self) -> [L; 3] {
        let ([ax, bx, cx], [ay, by, cy]) = (self.x, self.y);
        [cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax]
    }

    #[inline(always)]
    fn t(&self, [u, v, w]: [L; 3], along: L) -> L {
        let det = u + v + w;
        (u * self.z[0] + v * self.z[1] + w * self.z[2]) / (det * along)
    }

    /// `along`: the ray's direction along its axis.
    #[inline(always)]
    pub fn meet(&self, along: L, t_min: L) -> Meet<L> {
        let zero = L::zero();
        let [u, v, w] = self.weights();
        let least = u.min(v).min(w);
        let most = u.max(v).max(w);
        let inside = least.ge(zero) | most.le(zero);
        if inside.none() {
            return Meet::certain(inside, zero);
        }
        let t = self.t([u, v, w], along);
        // det = 0 (edge-on, or no area) gives an infinite or NaN t: never a hit.
        let finite = t.abs().lt(L::splat(L::Scalar::INFINITY));
        Meet::certain(inside & finite & t.gt(t_min), t)
    }

    /// Lanes whose triangle the ray may meet in exact arithmetic, or at any
    /// better precision, where x and y are out of place by at most `misplaced`.
    ///
    /// With m the largest coordinate and e the misplacement, an edge function (a
    /// difference of two products) is wrong by at most 4em + 2e², and rounding
    /// adds less than em.
    #[inline(always)]
    pub fn may_meet(&self, misplaced: L) -> L::Mask {
        let [u, v, w] = self.weights();
        let e = misplaced;
        let largest = |x: L, y: L| x.abs().max(y.abs());
        let corner = |v: usize| largest(self.x[v], self.y[v]);
        let m = corner(0).max(corner(1)).max(corner(2));
        let margin = e * (m * L::from_f32(5.0) + e * L::from_f32(2.0));
        let least = u.min(v).min(w);
        let most = u.max(v).max(w);
        least.ge(-margin) | most.le(margin)
    }
}
