//! Quadrature of CSG solids with known figures.

use super::*;
use lanecast_model::geom::implicit::torus;

fn fine() -> Goal {
    Goal {
        relative: 1e-6,
        ..Goal::default()
    }
}

fn is_found(found: &Volume, volume: f64, area: f64) {
    assert_eq!(found.method, Method::Quadrature, "{found:?}");
    assert!(!found.is_rough, "{found:?}");
    let (dv, da) = ((found.volume - volume).abs(), (found.area - area).abs());
    assert!(
        dv <= found.volume_error,
        "{found:?}, volume {volume}, off {dv:e}"
    );
    assert!(da <= found.area_error, "{found:?}, area {area}, off {da:e}");
}

fn of(operator: Operator, build: impl FnOnce(&mut SceneBuilder) -> Vec<ShapeId>) -> Volume {
    measured_to(&fine(), |scene| {
        let operands: Vec<Operand> = build(scene).into_iter().map(Operand::shape).collect();
        scene.csg("", operator, &operands)
    })
}

#[test]
fn a_lens_of_two_balls() {
    let found = of(Operator::Intersection, |s| {
        [DVec3::ZERO, DVec3::new(0.6, 0.0, 0.8)]
            .map(|c| s.sphere("", ball(c, 1.0)))
            .into()
    });
    is_found(&found, 5.0 * PI / 12.0, 2.0 * PI);
    let centroid = DVec3::from_array(found.centroid.unwrap());
    let off = (centroid - DVec3::new(0.3, 0.0, 0.4)).length();
    assert!(off <= found.centroid_error && off < 1e-5, "{found:?}");
}

/// Steinmetz' solids of two and three cylinders.
#[test]
fn cylinders_across_each_other() {
    let rods = |axes: &[DVec3]| {
        of(Operator::Intersection, |s| {
            axes.iter().map(|axis| s.cylinder("", rod(*axis))).collect()
        })
    };
    is_found(&rods(&[DVec3::X, DVec3::Y]), 16.0 / 3.0, 16.0);
    // Turned against the axes that lines run along.
    let (x, y) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(-0.48, 0.8, 0.36));
    is_found(&rods(&[x, y]), 16.0 / 3.0, 16.0);
    let three = 8.0 * (2.0 - 2.0_f64.sqrt());
    is_found(&rods(&DVec3::AXES), three, 3.0 * three);
}

#[test]
fn a_box_with_a_bore() {
    let found = of(Operator::Difference, |s| {
        let min = DVec3::splat(-1.0);
        let block = s.cuboid("", Cuboid { min, max: -min });
        let bore = Cylinder {
            radius: 0.5,
            ..rod(DVec3::Y)
        };
        vec![block, s.cylinder("", bore)]
    });
    is_found(&found, 8.0 - PI * 0.5, 24.0 - PI * 0.5 + 2.0 * PI);
    // About y: of the block 8 · (2² + 2²)/12, of the bore V r²/2.
    let [xx, _, zz, ..] = found.spread.unwrap();
    let wanted = 16.0 / 3.0 - PI * 0.5 * 0.125;
    assert!(
        (xx + zz - wanted).abs() <= 2.0 * found.spread_error + 1e-12,
        "{found:?}"
    );
    assert!(found.spread_error < 1e-4, "{found:?}");
}

/// vol(A) + vol(B) = vol(A ∪ B) + vol(A ∩ B), of a torus and a tilted cylinder.
#[test]
fn volumes_of_union_and_intersection_sum_up() {
    let parts = |s: &mut SceneBuilder| {
        let ring = s.implicit("", torus::tape_of(1.0, 0.4), false, None);
        let rod = Cylinder {
            base: DVec3::new(-0.2, -0.8, 0.1),
            top: DVec3::new(1.2, 0.9, 0.5),
            radius: 0.5,
            open: false,
        };
        vec![ring, s.cylinder("", rod)]
    };
    let [either, both] = [Operator::Union, Operator::Intersection].map(|op| of(op, parts));
    let height = DVec3::new(1.4, 1.7, 0.4).length();
    let wanted = 2.0 * PI * PI * 0.16 + PI * 0.25 * height;
    let off = (either.volume + both.volume - wanted).abs();
    assert!(
        off <= either.volume_error + both.volume_error,
        "{either:?} {both:?} {off:e}"
    );
    assert!(off <= 3e-6 * wanted, "{off:e}");
}
