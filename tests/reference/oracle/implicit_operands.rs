//! Polynomial surfaces as operands of CSG, beside the primitives that they equal.

use super::implicits::{NONE, X, ball, depths, implicit, torus};
use super::quadrics::hyperboloid;
use super::*;
use crate::common::property;
use lanecast::internals::reference::Crossing;
use proptest::prelude::*;

/// Two unit balls as operands: a sphere, and the same as a polynomial.
fn with_ball(operator: Operator, kind: usize, other: usize, swap: bool) -> (Scene, Instances) {
    scene_of(|b| {
        let one = match kind {
            0 => b.sphere(
                "",
                Sphere {
                    center: DVec3::ZERO,
                    radius: 1.0,
                },
            ),
            1 => {
                let mut coefficients = [0.0; 10];
                coefficients[..3].fill(1.0);
                coefficients[9] = -1.0;
                b.quadric("", Quadric { coefficients })
            }
            _ => implicit(ball)(b),
        };
        let others: [Maker; 5] = [
            |b| implicit(torus)(b),
            |b| {
                b.sphere(
                    "",
                    Sphere {
                        center: DVec3::ZERO,
                        radius: 1.0,
                    },
                )
            },
            |b| {
                b.sphere(
                    "",
                    Sphere {
                        center: v(0.5, 0.0, 0.0),
                        radius: 1.25,
                    },
                )
            },
            hyperboloid,
            |b| implicit(ball)(b),
        ];
        let other = others[other](b);
        let operands = if swap { [other, one] } else { [one, other] };
        let csg = b.csg("", operator, &operands.map(Operand::shape));
        b.instance("", Edge::shape(csg));
    })
}

/// Where t is, which surface, and a normal to twelve digits.
fn equal(a: &[Crossing], b: &[Crossing]) -> bool {
    let close = |(a, b): (&Crossing, &Crossing)| {
        let off = DVec3::from_array(a.normal) - DVec3::from_array(b.normal);
        a.t == b.t && a.primitive == b.primitive && off.length() < 1e-7
    };
    a.len() == b.len() && a.iter().zip(b).all(close)
}

const OPERATORS: [Operator; 4] = [
    Operator::Union,
    Operator::Intersection,
    Operator::Difference,
    Operator::Xor,
];

#[test]
fn operands_by_hand() {
    // The torus reaches from 1 to 2, and so touches the unit ball from outside.
    let org = [-5.0, 0.0, 0.0];
    let all = |operator, swap| {
        let (scene, all) = with_ball(operator, 2, 0, swap);
        let reference = Reference::new(&scene, &all).unwrap();
        let found = reference.crossings(org, X, 0, 0);
        found.iter().map(|c| c.t).collect::<Vec<f64>>()
    };
    assert_eq!(all(Operator::Union, false), [3.0, 7.0]);
    assert_eq!(all(Operator::Intersection, false), NONE);
    assert_eq!(all(Operator::Difference, false), [4.0, 6.0]);
    assert_eq!(all(Operator::Difference, true), [3.0, 4.0, 6.0, 7.0]);
    // What touches from within is no boundary.
    let (scene, all) = with_ball(Operator::Difference, 2, 2, true);
    let reference = Reference::new(&scene, &all).unwrap();
    let at = |y: f64| reference.crossings([-5.0, y, 0.0], X, 0, 0).len();
    assert_eq!((at(1.0), at(1.0_f64.next_down()), at(0.0)), (2, 4, 2));
    // Two rings side by side are one body where they touch.
    let rings = |b: &mut SceneBuilder| {
        let ring = implicit(torus)(b);
        let aside = b.transform(DAffine3::from_translation(v(4.0, 0.0, 0.0)).into());
        let operands = [Operand::shape(ring), Operand::shape(ring).transform(aside)];
        b.csg("", Operator::Union, &operands)
    };
    assert_eq!(depths(rings, org, X), [3.0, 4.0, 6.0, 8.0, 10.0, 11.0]);
    // Of one and the same, nothing is left.
    for kind in 0..3 {
        for other in [1, 4] {
            let (scene, all) = with_ball(Operator::Difference, kind, other, false);
            let reference = Reference::new(&scene, &all).unwrap();
            assert_eq!(reference.nearest([-5.0, 0.3, 0.1], X, INF), None);
        }
    }
}

/// Short, so that answers meet; or any.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        (-16..16_i32).prop_map(|n| f64::from(n) / 8.0),
        -2.0..2.0_f64
    ]
}

fn vector() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(number())
}

proptest! {
    #![proptest_config(property(300))]

    /// A ball is a ball: alone and in every CSG solid.
    #[test]
    fn a_ball_by_its_polynomial_is_the_sphere(
        org in vector(), to in vector(), other in 0..5_usize, swap in any::<bool>(),
    ) {
        let dir: [f64; 3] = std::array::from_fn(|k| to[k] - org[k]);
        for operator in OPERATORS {
            let [sphere, quadric, polynomial] = [0, 1, 2].map(|kind| {
                let (scene, all) = with_ball(operator, kind, other, swap);
                let reference = Reference::new(&scene, &all).unwrap();
                let brute = Reference::brute_force(&scene, &all).unwrap();
                assert_eq!(reference.nearest(org, dir, INF), brute.nearest(org, dir, INF));
                reference.crossings(org, dir, 0, 0)
            });
            prop_assert!(equal(&sphere, &polynomial), "{sphere:?} {polynomial:?}");
            prop_assert!(equal(&quadric, &polynomial), "{quadric:?} {polynomial:?}");
        }
    }
}
