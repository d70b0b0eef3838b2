mod formulas;
mod solids;

use super::sampling::LEAST_EMPTY;
use super::*;
use lanecast_model::geom::{Cuboid, Cylinder, Quadric, Sphere};
use lanecast_model::scene::{Edge, Operand, Operator, SceneBuilder, ShapeId};
use lanecast_numerics::math::Affine;
use std::f64::consts::PI;

/// A coarser goal, for solids whose lines are decided in integers.
fn coarse() -> Goal {
    Goal {
        relative: 4e-3,
        ..Goal::default()
    }
}

fn measured(build: impl FnOnce(&mut SceneBuilder) -> ShapeId) -> Volume {
    measured_to(&Goal::default(), build)
}

fn measured_to(goal: &Goal, build: impl FnOnce(&mut SceneBuilder) -> ShapeId) -> Volume {
    let mut scene = SceneBuilder::default();
    let shape = build(&mut scene);
    scene.instance("", Edge::shape(shape));
    let scene = scene.finish().unwrap();
    let identity = Affine::IDENTITY;
    let placed = Placed::new(&scene, shape, &identity, &identity).unwrap();
    placed
        .measure(goal, &Progress::default())
        .and_then(|found| found.volume(&identity, 1.0))
        .unwrap()
}

/// Measured by random lines, whatever else would serve.
fn sampled(goal: &Goal, build: impl FnOnce(&mut SceneBuilder) -> ShapeId) -> Volume {
    let mut scene = SceneBuilder::default();
    let shape = build(&mut scene);
    scene.instance("", Edge::shape(shape));
    let scene = scene.finish().unwrap();
    let identity = Affine::IDENTITY;
    let placed = Placed::new(&scene, shape, &identity, &identity).unwrap();
    let found = placed.by_sampling(goal, &Progress::default()).unwrap();
    let measured = Measured {
        own: found.body,
        center: placed.bounds.center(),
        unit: placed.unit,
        lines: found.lines,
        is_rough: !found.is_fine,
    };
    measured.volume(&identity, 1.0).unwrap()
}

fn holds(found: &Volume, volume: f64, area: f64) {
    holds_to(&Goal::default(), found, volume, area);
}

fn holds_to(goal: &Goal, found: &Volume, volume: f64, area: f64) {
    let relative = 2.0 * goal.relative;
    let (dv, da) = ((found.volume - volume).abs(), (found.area - area).abs());
    // Three half-widths: one failure in a million cases.
    assert!(dv <= 3.0 * found.volume_error, "{found:?}, volume {volume}");
    assert!(da <= 3.0 * found.area_error, "{found:?}, area {area}");
    assert!(found.volume_error < relative * volume, "{found:?}");
    assert!(found.area_error < relative * area, "{found:?}");
}

fn ball(center: DVec3, radius: f64) -> Sphere {
    Sphere { center, radius }
}

fn rod(along: DVec3) -> Cylinder {
    Cylinder {
        base: -along * 3.0,
        top: along * 3.0,
        radius: 1.0,
        open: false,
    }
}

#[test]
fn volumes_are_those_of_formulas() {
    let center = DVec3::new(5.0, -2.0, 1.0);
    let found = sampled(&Goal::default(), |scene| {
        scene.sphere("", ball(center, 2.0))
    });
    holds(&found, 32.0 * PI / 3.0, 16.0 * PI);
    assert!((DVec3::from_array(found.centroid.unwrap()) - center).length() < 1e-2);

    let found = sampled(&Goal::default(), |scene| scene.cylinder("", rod(DVec3::Z)));
    holds(&found, 6.0 * PI, 14.0 * PI);

    // Unit spheres whose centres are one radius apart.
    let found = measured(|scene| {
        let a = scene.sphere("", ball(DVec3::ZERO, 1.0));
        let b = scene.sphere("", ball(DVec3::X, 1.0));
        let both = [Operand::shape(a), Operand::shape(b)];
        scene.csg("", Operator::Intersection, &both)
    });
    holds(&found, 5.0 * PI / 12.0, 2.0 * PI);

    let rods = |axes: &[DVec3]| {
        measured(|scene| {
            let all: Vec<_> = axes
                .iter()
                .map(|axis| Operand::shape(scene.cylinder("", rod(*axis))))
                .collect();
            scene.csg("", Operator::Intersection, &all)
        })
    };
    // Steinmetz solids: the area of the first is 16 r², that of the second three times
    // its volume.
    holds(&rods(&[DVec3::X, DVec3::Y]), 16.0 / 3.0, 16.0);
    let three = 8.0 * (2.0 - 2.0_f64.sqrt());
    holds(&rods(&DVec3::AXES), three, 3.0 * three);

    // A cube of side 2 with a bore through it.
    let found = measured(|scene| {
        let min = DVec3::splat(-1.0);
        let block = scene.cuboid("", Cuboid { min, max: -min });
        let bore = Cylinder {
            radius: 0.5,
            ..rod(DVec3::Y)
        };
        let bore = scene.cylinder("", bore);
        let parts = [Operand::shape(block), Operand::shape(bore)];
        scene.csg("", Operator::Difference, &parts)
    });
    holds(&found, 8.0 - PI * 0.5, 24.0 - PI * 0.5 + 2.0 * PI);
}

/// A measurement shared by a hundred parts contributes a hundred times its error.
#[test]
fn errors_of_equal_parts_are_one() {
    let one = Volume {
        volume_error: 3.0,
        method: Method::Sampling,
        ..Volume::default()
    };
    let sum = |numbers: [usize; 2], one| together(&numbers.map(|n| (n, one)));
    assert_eq!(sum([0, 0], one).unwrap().volume_error, 6.0);
    assert_eq!(sum([0, 1], one).unwrap().volume_error, 18.0_f64.sqrt());
    let known = Volume {
        method: Method::Divergence,
        ..one
    };
    assert_eq!(sum([0, 1], known).unwrap().volume_error, 6.0);
    let large = Volume {
        volume: 1e308,
        ..Volume::default()
    };
    assert_eq!(sum([0, 1], large), None);
}

/// Radii from the least to the greatest whose cubes f64 holds, and beyond.
#[test]
fn balls_of_any_size() {
    let found = |radius: f64, scale: f64| {
        let mut scene = SceneBuilder::default();
        let shape = scene.sphere("", ball(DVec3::ZERO, radius));
        scene.instance("", Edge::shape(shape));
        let scene = scene.finish().unwrap();
        let identity = Affine::IDENTITY;
        let placed = Placed::new(&scene, shape, &identity, &identity).unwrap();
        let found = placed.measure(&coarse(), &Progress::default());
        let map = Affine::new(
            [0, 1, 2].map(|k| (DVec3::AXES[k] * scale).to_array()),
            [0.0; 3],
        );
        found.unwrap().volume(&map, scale)
    };
    for (radius, scale) in [
        (2e-102, 1.0),
        (1e102, 1.0),
        (1e120, 1e-120),
        (1e-140, 1e130),
    ] {
        let size: f64 = radius * scale;
        let (volume, area) = (4.0 / 3.0 * PI * size * size * size, 4.0 * PI * size * size);
        holds_to(&coarse(), &found(radius, scale).unwrap(), volume, area);
    }
    for (radius, scale) in [(1e-130, 1.0), (1e-170, 1.0), (1e130, 1.0), (1.0, 1e-110)] {
        assert_eq!(found(radius, scale), None, "{radius}");
    }
}

/// The error includes the rounding of the chords.
#[test]
fn a_plate_thinner_than_roundings() {
    let min = DVec3::new(-0.5, -0.5, 0.0);
    for thin in [1e-20, 1e-14, 1e-9] {
        let max = DVec3::new(0.5, 0.5, thin);
        let found = sampled(&coarse(), |scene| scene.cuboid("", Cuboid { min, max }));
        let off = (found.volume - thin).abs();
        assert!(off <= 3.0 * found.volume_error, "{found:?}");
        assert!(
            (found.area - 2.0).abs() <= 3.0 * found.area_error,
            "{found:?}"
        );
    }
}

/// Spheres that touch in a point: no line hits anything, and the measurement ends
/// early. It goes on if the remaining lines may still reach the goal.
#[test]
fn what_is_empty_ends_early() {
    let found = measured(|scene| {
        let centers = [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0)];
        let balls = centers.map(|c| Operand::shape(scene.sphere("", ball(c, 1.0))));
        scene.csg("", Operator::Intersection, &balls)
    });
    assert!(found.lines <= LEAST_EMPTY && found.is_rough, "{found:?}");
    assert_eq!((found.volume, found.area), (0.0, 0.0));
    assert!(found.volume_error > 0.0 && found.area_error > 0.0);

    let ends = |relative, lines| {
        let goal = Goal {
            relative,
            ..Goal::default()
        };
        goal.is_beyond(lines)
    };
    assert!(ends(5e-4, 1 << 18) && ends(0.1, 1 << 18));
    assert!(!ends(5e-4, 1 << 17) && !ends(0.5, 1 << 18));
}

/// Coefficients whose squares overflow or underflow f64.
#[test]
fn balls_of_any_coefficients() {
    for power in [-1000, -520, 510, 1000] {
        let e = libm::ldexp(1.0, power);
        let coefficients = [e, e, e, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -e];
        let ball = |scene: &mut SceneBuilder| scene.quadric("", Quadric { coefficients });
        holds_to(
            &coarse(),
            &sampled(&coarse(), ball),
            4.0 / 3.0 * PI,
            4.0 * PI,
        );
        holds_to(
            &coarse(),
            &measured_to(&coarse(), ball),
            4.0 / 3.0 * PI,
            4.0 * PI,
        );
    }
}
