//! Bounding boxes of quadrics: every ellipsoid has one, and no other quadric.

use crate::common::property;
use glam::DVec3;
use lanecast::internals::geom::Quadric;
use lanecast::internals::geom::exact::{self, Line};
use lanecast::internals::math::length;
use proptest::prelude::*;

/// Σ ((x − c)·uₖ / rₖ)² ≤ 1, multiplied out and rounded.
fn ellipsoid(center: DVec3, radii: DVec3, turn: glam::DQuat) -> Quadric {
    let axes = DVec3::AXES.map(|axis| turn * axis);
    let mut m = [[0.0; 3]; 3];
    for (i, row) in m.iter_mut().enumerate() {
        for (j, at) in row.iter_mut().enumerate() {
            *at = (0..3)
                .map(|k| axes[k][i] * axes[k][j] / (radii[k] * radii[k]))
                .sum();
        }
    }
    let c = center.to_array();
    let mc: [f64; 3] = std::array::from_fn(|i| (0..3).map(|j| m[i][j] * c[j]).sum());
    let constant = (0..3).map(|i| mc[i] * c[i]).sum::<f64>() - 1.0;
    Quadric {
        coefficients: [
            m[0][0],
            m[1][1],
            m[2][2],
            2.0 * m[0][1],
            2.0 * m[0][2],
            2.0 * m[1][2],
            -2.0 * mc[0],
            -2.0 * mc[1],
            -2.0 * mc[2],
            constant,
        ],
    }
}

proptest! {
    #![proptest_config(property(256))]

    /// The box around a turned ellipsoid: row k of the turn, times the radii, is
    /// how far it reaches along axis k.
    #[test]
    fn the_box_of_an_ellipsoid_holds_it_tightly(
        center in [-5.0..5.0, -5.0..5.0, -5.0..5.0],
        radii in [0.5..2.0, 0.5..2.0, 0.5..2.0],
        axis in [-1.0..1.0, -1.0..1.0, 0.1..1.0],
        angle in -3.0..3.0,
        by in -20..20,
    ) {
        let turn = glam::DQuat::from_axis_angle(DVec3::from_array(axis).normalize(), angle);
        let (center, radii) = (DVec3::from_array(center), DVec3::from_array(radii));
        let mut row = ellipsoid(center, radii, turn);
        row.coefficients = row.coefficients.map(|x| x * 2.0_f64.powi(by));
        let bounds = row.bounds().expect("it is bounded");
        let axes = DVec3::AXES.map(|axis| turn * axis);
        for k in 0..3 {
            let reach = DVec3::from_array(axes.map(|a| a[k])) * radii;
            let reach = length(reach);
            let room = 1e-8 * (reach + center[k].abs());
            prop_assert!((bounds.max[k] - (center[k] + reach)).abs() < room);
            prop_assert!((bounds.min[k] - (center[k] - reach)).abs() < room);
        }
        // A line in a face of the box, through where the solid is next to it.
        for k in 0..3 {
            let to: DVec3 = axes.iter().zip(radii.to_array()).map(|(a, r)| *a * (a[k] * r * r)).sum();
            let touch = center + to / to[k].sqrt();
            for at in [bounds.max[k], bounds.min[k]] {
                let mut org = if at == bounds.max[k] { touch } else { 2.0 * center - touch };
                org[k] = at;
                let dir = DVec3::AXES[(k + 1) % 3].to_array();
                let line = Line { org: org.to_array(), dir };
                let inside = exact::span(&exact::Solid::Quadric(row), &line);
                prop_assert!(inside.ends[0].is_none(), "{row:?}, {bounds:?}, {line:?}");
            }
        }
    }
}

#[test]
fn only_ellipsoids_have_bounds() {
    let of = |coefficients: [f64; 10]| Quadric { coefficients }.bounds();
    let ball = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0];
    let bounds = of(ball).expect("a ball");
    assert!(
        bounds.max.x >= 1.0 && bounds.max.x < 1.0 + 1e-12,
        "{bounds:?}"
    );
    assert!(bounds.min.z <= -1.0, "{bounds:?}");
    let changed = |k: usize, x: f64| {
        let mut row = ball;
        row[k] = x;
        row
    };
    // A hyperboloid, a cylinder, a saddle's, a pair of planes; its outside.
    for row in [
        changed(0, -1.0),
        changed(2, 0.0),
        changed(3, 2.0),
        changed(4, -3.0),
    ] {
        assert_eq!(of(row), None, "{row:?}");
    }
    assert_eq!(of(ball.map(|x| -x)), None);
    // Nothing at all is in it; and at the ends of the format.
    assert!(of(changed(9, 1.0)).is_some());
    assert!(of(ball.map(|x| x * 1e-300)).is_some());
    assert!(of(ball.map(|x| x * 1e300)).is_some());
    assert!(of(changed(9, -1e300)).is_some_and(|b| b.max.x >= 1e150));
    assert_eq!(of(changed(9, -f64::MAX)), None);
}
