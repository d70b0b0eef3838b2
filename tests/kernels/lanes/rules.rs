//! The rules of `math::lanes`, operation by operation, and affine maps of lanes.

use super::Wild;
use crate::common::{Random, campaign};
use lanecast::internals::math::lanes::*;
use lanecast::internals::math::{Affine, Vec3};

/// Object rays: a transform of f64 lanes is the scalar transform of each.
#[test]
fn transforms_of_lanes_are_those_of_points() {
    let mut random = Random(3);
    for _ in 0..campaign(20_000) {
        let numbers = |random: &mut Random| random.numbers().to_array();
        let linear = [(); 3].map(|()| numbers(&mut random));
        let map = Affine::new(linear, numbers(&mut random));
        let points: [[f64; 3]; 16] = std::array::from_fn(|_| numbers(&mut random));
        let column = |k: usize| f64x16::load(&points.map(|p| p[k]));
        let packed = Vec3::new(column(0), column(1), column(2));
        let (moved, turned) = (map.points(packed), map.vectors(packed));
        for (i, p) in points.iter().enumerate() {
            for k in 0..3 {
                same(moved.axis(k).lane(i), map.point(*p)[k]);
                same(turned.axis(k).lane(i), map.vector(*p)[k]);
            }
        }
    }
}

/// Equal bits, or both NaN (whose payloads may differ).
fn same(a: f64, b: f64) {
    assert!(
        a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan(),
        "{a} {b}"
    );
}

/// The rules of math::lanes, operation by operation, on every pair of a table.
fn rules<L>(fuses: bool)
where
    L: Lanes,
    L::Scalar: Lanes<Scalar = L::Scalar>,
{
    let mut random = Random(11);
    let mut table: Vec<f64> = (0..40).map(|_| random.number()).collect();
    table.extend([
        0.0,
        -0.0,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        1.0,
        3.0,
    ]);
    let same = |wide: L, one: L::Scalar, what: &str| {
        for lane in 0..L::COUNT {
            let (a, b) = (wide.lane(lane), one);
            let nan = a.to_f64().is_nan() && b.to_f64().is_nan();
            assert!(nan || a.bits() == b.bits(), "{what}: {a:?} {b:?}");
        }
    };
    let agree = |wide: L::Mask, one: <L::Scalar as Lanes>::Mask, what: &str| {
        let all = if one.any() {
            (1_u64 << L::COUNT) - 1
        } else {
            0
        };
        assert_eq!(u64::from(wide.bits()), all, "{what}");
    };
    for x in &table {
        for y in &table {
            let (a, b) = (
                <L::Scalar as Scalar>::from_f64(*x),
                <L::Scalar as Scalar>::from_f64(*y),
            );
            let (wa, wb) = (L::splat(a), L::splat(b));
            let (x, y) = (a.to_f64(), b.to_f64());
            same(wa + wb, a + b, "+");
            same(wa - wb, a - b, "-");
            same(wa * wb, a * b, "*");
            same(wa / wb, a / b, "/");
            same(-wa, -a, "negation");
            same(wa.abs(), a.abs(), "abs");
            same(Lanes::sqrt(wa), Lanes::sqrt(a), "sqrt");
            same(Lanes::min(wa, wb), Lanes::min(a, b), "min");
            same(Lanes::max(wa, wb), Lanes::max(a, b), "max");
            same(wa.mul_add(wb, wa), Lanes::mul_add(a, b, a), "mul_add");
            agree(wa.lt(wb), a.lt(b), "<");
            agree(wa.le(wb), a.le(b), "<=");
            agree(wa.gt(wb), a.gt(b), ">");
            agree(wa.ge(wb), a.ge(b), ">=");
            agree(wa.eq(wb), a.eq(b), "==");
            // The NaN rule, spelled out.
            let rule = if x < y { a } else { b };
            if x.is_nan() || y.is_nan() {
                same(Lanes::min(wa, wb), rule, "min of NaN");
            }
            // Exact, so the same with and without FMA.
            let ordinary = |x: f64| (1e-9..1e9).contains(&x.abs());
            if ordinary(x) && ordinary(y) {
                let lost = match L::is_double() {
                    true => x.mul_add(y, -(x * y)),
                    false => x * y - (a * b).to_f64(),
                };
                let lost = <L::Scalar as Scalar>::from_f64(lost);
                same(wa.product_error(wb, wa * wb), lost, "what a product lost");
            }
            let rounded = L::narrow(wa.widen());
            same(rounded, a, "widen and narrow");
        }
    }
    // Each lane by itself, to nearest, where it stands.
    for power in (-1080..=1020).step_by(15).chain(-155..-140) {
        let number = |i: usize| (1.0 + 0.013 * i as f64) * libm::ldexp(1.0 / 3.0, power);
        let wide: Vec<f64> = (0..L::COUNT)
            .map(|i| [1.0, -1.0][i % 2] * number(i))
            .collect();
        let narrow = L::narrow(<L::Double as Lanes>::load(&wide));
        for (lane, wide) in wide.iter().enumerate() {
            let expected = <L::Scalar as Scalar>::from_f64(*wide);
            let found = narrow.lane(lane);
            assert_eq!(found.bits(), expected.bits(), "{wide} in lane {lane}");
        }
    }
    // (1 + u)² − (1 + 2u) is u² fused and 0 rounded twice.
    let u = L::Scalar::UNIT_ROUNDOFF.to_f64() * 2.0;
    let x = L::from_f64(1.0 + u);
    let fused = x.mul_add(x, -L::from_f64(1.0 + 2.0 * u));
    let expected = if fuses { u * u } else { 0.0 };
    assert_eq!(fused.lane(0).to_f64(), expected, "the FMA rule");
    for bits in [0_u32, 1, 0b1010, 0xffff, 0x8001] {
        let mask = L::Mask::from_bits(bits);
        let kept = bits & ((1_u64 << L::COUNT) - 1) as u32;
        assert_eq!(mask.bits(), kept);
        assert_eq!((!mask).bits(), !bits & ((1_u64 << L::COUNT) - 1) as u32);
        assert_eq!(mask.any(), kept != 0);
        let chosen = L::select(mask, L::from_f64(1.0), L::from_f64(2.0));
        for lane in 0..L::COUNT {
            let one = bits >> lane & 1 != 0;
            assert_eq!(chosen.lane(lane).to_f64(), if one { 1.0 } else { 2.0 });
        }
    }
}

#[test]
fn the_rules_hold_at_every_width() {
    let hardware = cfg!(target_feature = "fma");
    rules::<f32>(hardware);
    rules::<f32x4>(hardware);
    rules::<f32x8>(hardware);
    rules::<f32x16>(hardware);
    // f64 never fuses: `exact` must not depend on the machine.
    rules::<f64>(false);
    rules::<f64x4>(false);
    rules::<f64x8>(false);
    rules::<f64x16>(false);
}
