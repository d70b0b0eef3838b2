//! Sums of three do not depend on their order, and t of a triangle neither on the order of the
//! axes nor on which corner is first.

use super::Turn;
use crate::common::property;
use lanecast::internals::geom::Ray;
use lanecast::internals::geom::triangle::{Corners, canonical, depth_each, splat};
use lanecast::internals::math::Vec3;
use lanecast::internals::math::lanes::{Lanes, Scalar, odd_sum, unordered_sum};
use proptest::prelude::*;

const ORDERS: [[usize; 3]; 6] = [
    [0, 1, 2],
    [0, 2, 1],
    [1, 0, 2],
    [1, 2, 0],
    [2, 0, 1],
    [2, 1, 0],
];

/// In any order the same bits; with odd_sum also with all signs changed.
fn check_sums<L: Lanes>(numbers: [L::Scalar; 3]) {
    let bits = |x: L| x.lane(0).bits();
    let of = |order: [usize; 3]| order.map(|k| L::splat(numbers[k]));
    let [x, y, z] = of(ORDERS[0]);
    let (even, odd) = (unordered_sum(x, y, z), odd_sum(x, y, z));
    for [x, y, z] in ORDERS.map(of) {
        assert_eq!(bits(unordered_sum(x, y, z)), bits(even));
        assert_eq!(bits(odd_sum(x, y, z)), bits(odd));
        // A sum that is zero has no sign.
        let zero = L::zero();
        assert_eq!(bits(zero - odd_sum(-x, -y, -z)), bits(zero + odd));
    }
}

/// As the kernels call it.
fn depth<L: Lanes>(corners: Corners, org: [f64; 3], dir: [f64; 3]) -> f64 {
    let lanes = |v: [f64; 3]| Vec3::<L>::splat(v.map(L::Scalar::from_f64));
    let ray = Ray::new(lanes(org), lanes(dir), L::zero());
    depth_each(&splat::<L>(&canonical(corners)), &ray)
        .lane(0)
        .to_f64()
}

fn turned(turn: &Turn, corners: Corners) -> Corners {
    corners.map(|p| turn.of_each(p.map(f64::from)).map(|x| x as f32))
}

fn number() -> impl Strategy<Value = f32> {
    // A few digits make equal sides, the others long sums.
    prop_oneof![(-8..8_i8).prop_map(f32::from), -10.0..10.0_f32]
}

proptest! {
    #![proptest_config(property(3000))]

    #[test]
    fn sums_have_no_order(numbers in prop::array::uniform3(number())) {
        check_sums::<f32>(numbers);
        check_sums::<f64>(numbers.map(f64::from));
    }

    #[test]
    fn a_triangle_is_as_deep_however_it_is_turned_and_named(
        corners in prop::array::uniform3(prop::array::uniform3(number())),
        org in prop::array::uniform3(-20.0..20.0_f64),
        dir in prop::array::uniform3(-1.0..1.0_f64),
    ) {
        let size = |p: [f32; 3]| p.map(|x| f64::from(x).abs()).iter().sum::<f64>();
        let side = |i: usize, j: usize| {
            size([0, 1, 2].map(|k| corners[i][k] - corners[j][k]))
        };
        let all_like = |[a, b, c]: [f64; 3]| (a - b).abs() + (b - c).abs() < 1e-4 * a;
        let [a, b, c] = corners.map(size);
        prop_assume!(!all_like([side(0, 1), side(1, 2), side(2, 0)]) || !all_like([a, b, c]));
        let expected = [depth::<f32>(corners, org, dir), depth::<f64>(corners, org, dir)];
        // Edge-on there is no t.
        prop_assume!(expected.iter().all(|t| t.is_finite()));
        for turn in super::all_turns().iter().chain([&Turn::NONE]) {
            let (org, dir) = (turn.of_each(org), turn.of_each(dir));
            for order in ORDERS {
                let corners = turned(turn, order.map(|v| corners[v]));
                let found = [depth::<f32>(corners, org, dir), depth::<f64>(corners, org, dir)];
                prop_assert_eq!(found, expected, "{:?}, {:?}", turn, order);
            }
        }
    }
}

#[test]
fn sums_lose_no_nan() {
    for order in ORDERS {
        let [x, y, z] = order.map(|k| [f64::NAN, 1.0, f64::INFINITY][k]);
        assert!(unordered_sum(x, y, z).is_nan() && odd_sum(x, y, z).is_nan());
    }
}
