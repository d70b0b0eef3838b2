//! Test that clipped regions contain every point at which kernels report hits.

use super::*;
use crate::accel::slabs::Slabs;
use crate::geom::Ray;
use crate::geom::triangle::{canonical, meet};
use crate::math::Vec3;
use crate::math::lanes::{Lanes, Scalar};
use proptest::prelude::*;

fn box_of(corners: &Corners) -> Aabb32 {
    corners
        .iter()
        .fold(Aabb32::EMPTY, |b, p| b.union(&Aabb32 { min: *p, max: *p }))
}

/// Returns the point at which the kernel reports a hit, moved into the triangle's box.
fn reported<L: Lanes<Scalar = T>, T: Scalar>(
    corners: &Corners,
    org: [f32; 3],
    dir: [f32; 3],
) -> Option<[f64; 3]> {
    let own = box_of(corners);
    let [org, dir] = [org, dir].map(|v| Vec3::splat(v.map(L::Scalar::from_f32)));
    let ray = Ray::<L>::new(org, dir, L::zero());
    let slabs = Slabs::new(org, dir, &own);
    let met = meet(corners, &ray, L::zero().le(L::zero()));
    let (enter, exit) = slabs.interval(own.min, own.max);
    if crate::math::lanes::Mask::none(met.hit & enter.le(exit)) {
        return None;
    }
    let t = met.t.max(enter).min(exit).lane(0).to_f64();
    let at = |k: usize| org.axis(k).lane(0).to_f64() + t * dir.axis(k).lane(0).to_f64();
    Some(std::array::from_fn(|k| {
        at(k).clamp(f64::from(own.min[k]), f64::from(own.max[k]))
    }))
}

fn check(corners: &Corners, p: [f64; 3]) {
    let Some(triangle) = Clipped::new(corners, KdClip::Plane, box_of(corners).widened().max_abs())
    else {
        return;
    };
    let cell = Aabb32 {
        min: p.map(round_down),
        max: p.map(round_up),
    };
    let region = triangle.region(&cell);
    assert!(region.is_some(), "{corners:?} {p:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, ..ProptestConfig::default() })]

    /// The margin is wide enough at both precisions, also for rays along the plane.
    #[test]
    fn regions_hold_where_hits_are_said_to_lie(
        points in proptest::array::uniform3(proptest::array::uniform3(-1.0_f32..1.0)),
        thin in 0_i32..12,
        far in -1_i32..4,
        weights in proptest::array::uniform4(-1.0_f64..1.0),
        tilt in -10_i32..0,
    ) {
        let [a, b, mut c] = points.map(|p| DVec3::from_array(p.map(f64::from)));
        c = a + (b - a) * 0.3 + (c - a) * f64::powi(4.0, -thin);
        let corners = [a, b, c].map(|p| p.to_array().map(|x| x as f32));
        let corners = canonical(corners);
        let inside = |u: f64, v: f64| {
            let (u, v) = (u.abs(), v.abs());
            let sum = u + v + 1.0;
            (a + b * u + c * v) / sum
        };
        let at = inside(weights[0], weights[1]);
        let along = (b - a) * weights[2] + (c - a) * weights[3];
        let off = (b - a).cross(c - a).normalize_or_zero() * f64::powi(8.0, tilt);
        let org = at + (along + off * along.length()) * f64::powi(4.0, far);
        let narrow = |v: DVec3| v.to_array().map(|x| x as f32);
        let (org, dir) = (narrow(org), narrow(at - org));
        let reach = org.iter().chain(corners.as_flattened()).fold(0.0, |m, x| x.abs().max(m));
        let extent = f64::from(corners.as_flattened().iter().fold(0.0, |m, x| x.abs().max(m)));
        if f64::from(reach) <= 16.0 * extent
            && let Some(p) = reported::<f32, f32>(&corners, org, dir)
        {
            check(&corners, p);
        }
        if let Some(p) = reported::<f64, f64>(&corners, org, dir) {
            check(&corners, p);
        }
    }
}
