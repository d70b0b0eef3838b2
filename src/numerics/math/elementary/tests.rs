//! Bounds of the errors, edges, and equal bits at every width.

use super::*;
use crate::math::lanes::{f32x4, f32x8, f32x16};

/// Returns the error of `got` in units in the last place of the f32 next to `exact`.
fn units(got: f32, exact: f64) -> f64 {
    let nearest = exact as f32;
    if got.to_bits() == nearest.to_bits() || got == nearest {
        return if exact.is_finite() && nearest.is_finite() {
            (f64::from(got) - exact).abs() / unit_of(exact)
        } else {
            0.0
        };
    }
    (f64::from(got) - exact).abs() / unit_of(exact)
}

/// The distance of f32 numbers around x, that of subnormal numbers at the least.
fn unit_of(x: f64) -> f64 {
    let exponent = libm::ilogb(x.abs().max(f64::from(f32::MIN_POSITIVE)));
    libm::ldexp(1.0, exponent - 23)
}

/// The worst error over `steps` arguments from `from` to `to`, evenly spaced.
fn worst(from: f32, to: f32, steps: u32, of: impl Fn(f32) -> f64) -> f64 {
    (0..=steps).fold(0.0, |worst: f64, i| {
        let at = f64::from(i) / f64::from(steps);
        worst.max(of(
            (f64::from(from) * (1.0 - at) + f64::from(to) * at) as f32
        ))
    })
}

/// The worst error over positive numbers of all exponents, their negatives with
/// `signs`.
fn worst_of_all(signs: bool, of: impl Fn(f32) -> f64) -> f64 {
    let mut worst = 0.0_f64;
    for i in 0..1_000_000_u32 {
        let x = f32::from_bits((i.wrapping_mul(2_654_435_769)) >> 1);
        if x.is_finite() {
            worst = worst.max(of(x));
            if signs {
                worst = worst.max(of(-x));
            }
        }
    }
    worst
}

#[test]
fn sine_and_cosine_of_turns_are_within_their_bound() {
    // libm's own argument 2π·u is rounded: reduce the turn exactly first.
    let exact = |u: f32| {
        let u = f64::from(u);
        let quarter = (u * 4.0).round();
        let (s, c) = libm::sincos((u - quarter * 0.25) * std::f64::consts::TAU);
        match (quarter as i64).rem_euclid(4) {
            0 => (s, c),
            1 => (c, -s),
            2 => (-s, -c),
            _ => (-c, s),
        }
    };
    let of = |u: f32| {
        let ((s, c), (es, ec)) = (sin_cos_turns(u), exact(u));
        units(s, es).max(units(c, ec))
    };
    let worst_error = worst(-2.0, 2.0, 2_000_000, of)
        .max(worst(0.0, 1.0, 2_000_000, of))
        .max(worst(0.0, 1e-6, 1000, of));
    assert!(worst_error < 1.7, "{worst_error}");
    let quarters = [0.0_f32, 0.25, 0.5, 0.75, 1.0].map(sin_cos_turns);
    let expected = [
        (0.0_f32, 1.0_f32),
        (1.0, 0.0),
        (0.0, -1.0),
        (-1.0, 0.0),
        (0.0, 1.0),
    ];
    assert_eq!(quarters, expected);
}

#[test]
fn exponentials_are_within_their_bound() {
    let of = |x: f32| units(exp(x), libm::exp(f64::from(x)));
    let worst = worst(-104.0, 88.7, 3_000_000, of).max(worst(-1.0, 1.0, 1_000_000, of));
    assert!(worst < 1.1, "{worst}");
    let edges = [
        f32::NEG_INFINITY,
        -200.0,
        -0.0,
        89.0,
        f32::INFINITY,
        f32::MAX,
    ];
    let expected = [0.0, 0.0, 1.0, f32::INFINITY, f32::INFINITY, f32::INFINITY];
    assert_eq!(edges.map(exp), expected);
    assert!(exp(f32::NAN).is_nan());
}

#[test]
fn logarithms_are_within_their_bound() {
    let of = |x: f32| units(ln(x), libm::log(f64::from(x)));
    let worst = worst_of_all(false, |x| if x > 0.0 { of(x) } else { 0.0 })
        .max(worst(0.5, 2.0, 2_000_000, of))
        .max(of(f32::from_bits(1)));
    assert!(worst < 1.0, "{worst}");
    let edges = [0.0, -0.0, -1.0, f32::NEG_INFINITY].map(ln::<f32>);
    assert_eq!(edges, [f32::NEG_INFINITY; 4]);
    assert_eq!(ln(1.0_f32), 0.0);
    assert_eq!(ln(f32::INFINITY), f32::INFINITY);
    assert!(ln(f32::NAN).is_nan());
}

#[test]
fn powers_are_within_their_bound() {
    let mut worst = 0.0_f64;
    let of = |x: f32, y: f32| {
        let exact = libm::pow(f64::from(x), f64::from(y));
        // Rounding to infinity is right where the result is beyond the range.
        if exact as f32 == pow(x, y) && (exact as f32).is_infinite() {
            0.0
        } else {
            units(pow(x, y), exact)
        }
    };
    for i in 0..1_000_000_u32 {
        let bits = i.wrapping_mul(2_654_435_769);
        let x = f32::from_bits(bits % 0x7f80_0000);
        for y in [2.4, 1.0 / 2.4, -0.7, 100.0, 0.01, -1.0, 1e-3] {
            worst = worst.max(of(x, y));
        }
        let u = (i as f32 + 1.0) / 1_000_001.0;
        for y in [2.4, 1.0 / 2.2, 1000.0, 1e6, -30.0] {
            worst = worst.max(of(u, y));
        }
    }
    assert!(worst < 0.502, "{worst}");
    let infinity = f32::INFINITY;
    for (x, y, expected) in [
        (0.0, 0.0, 1.0),
        (0.0, 1e-30, 0.0),
        (0.0, -2.0, infinity),
        (-3.0, 2.0, 0.0),
        (infinity, 0.01, infinity),
        (infinity, -1.0, 0.0),
        (infinity, 0.0, 1.0),
        (1.0, infinity, 1.0),
        (1.0, f32::MAX, 1.0),
        (7.0, 0.0, 1.0),
        (0.5, infinity, 0.0),
    ] {
        let got = pow(x, y);
        assert!(got == expected, "{x}^{y}: {got}");
    }
    assert!(pow(f32::NAN, 2.0).is_nan() && pow(2.0, f32::NAN).is_nan());
}

#[test]
fn arc_cosines_are_within_their_bound() {
    let of = |x: f32| units(acos(x), libm::acos(f64::from(x)));
    let worst = worst(-1.0, 1.0, 4_000_000, of)
        .max(worst(0.999, 1.0, 20_000, of))
        .max(worst(-1e-6, 1e-6, 1000, of));
    assert!(worst < 1.6, "{worst}");
    assert_eq!(acos(1.0_f32), 0.0);
    assert_eq!(acos(1.5_f32), 0.0);
    assert_eq!(acos(-1.0_f32), std::f32::consts::PI);
    assert_eq!(acos(-7.0_f32), std::f32::consts::PI);
}

#[test]
fn angles_of_directions_are_within_their_bound() {
    // libm heeds the sign of zero.
    let of = |y: f32, x: f32| units(atan2(y, x), libm::atan2(f64::from(y) + 0.0, f64::from(x)));
    let by_turns = worst(-1.0, 1.0, 4_000_000, |u| {
        let (s, c) = sin_cos_turns(u);
        of(s, c)
    });
    let by_size = [1.0, -1.0, 1e-38, f32::MAX, 3e-45, -f32::MAX]
        .map(|x| worst_of_all(true, |y| of(y, x).max(of(x, y))));
    let worst = by_size.iter().fold(by_turns, |a, b| a.max(*b));
    assert!(worst < 1.7, "{worst} {by_turns} {by_size:?}");
    let (pi, infinity) = (std::f32::consts::PI, f32::INFINITY);
    for (y, x, expected) in [
        (0.0, 0.0, 0.0),
        (-0.0, -1.0, pi),
        (0.0, 1.0, 0.0),
        (1.0, 0.0, pi / 2.0),
        (-1.0, 0.0, -pi / 2.0),
        (infinity, infinity, pi / 4.0),
        (infinity, 1.0, pi / 2.0),
        (-1.0, -1.0, -0.75 * pi),
    ] {
        let got = atan2(y, x);
        assert!(got == expected, "{y} {x}: {got} {expected}");
    }
}

/// Lanes of one width have the bits of single numbers.
fn agrees<L: Lanes<Scalar = f32>>() {
    let numbers: Vec<f32> = (0..4096_u32)
        .map(|i| f32::from_bits(i.wrapping_mul(2_654_435_769)))
        .chain([0.0, -0.0, 1.0, -1.0, 0.5, f32::INFINITY, f32::NAN, 1e-40])
        .collect();
    let same = |wide: L, lane: usize, one: f32, what: &str| {
        let got = wide.lane(lane);
        let nan = got.is_nan() && one.is_nan();
        assert!(nan || got.to_bits() == one.to_bits(), "{what}: {got} {one}");
    };
    for at in numbers.windows(L::COUNT + 1) {
        let (x, y) = (L::load(at), L::load(&at[1..]));
        let (sin, cos) = sin_cos_turns(x);
        let unit = L::load(&at.iter().map(|x| x % 1.0).collect::<Vec<_>>());
        for i in 0..L::COUNT {
            let (a, b) = (at[i], at[i + 1]);
            if a.abs() < 2e6 {
                same(sin, i, sin_cos_turns(a).0, "sin");
                same(cos, i, sin_cos_turns(a).1, "cos");
            }
            same(exp(x), i, exp(a), "exp");
            same(ln(x), i, ln(a), "ln");
            same(pow(x, y), i, pow(a, b), "pow");
            same(acos(unit), i, acos(a % 1.0), "acos");
            same(atan2(x, y), i, atan2(a, b), "atan2");
        }
    }
}

#[test]
fn every_width_has_the_bits_of_one_lane() {
    agrees::<f32x4>();
    agrees::<f32x8>();
    agrees::<f32x16>();
}

/// `cargo test --release -p lanecast-numerics -- --ignored --nocapture time_of_functions`
#[test]
#[ignore = "prints times"]
fn time_of_functions() {
    fn best(name: &str, of: impl Fn(f32x8) -> f32x8) {
        let numbers: Vec<f32> = (0..2400).map(|i| (i as f32 + 0.5) / 2400.0).collect();
        let numbers: Vec<f32x8> = numbers.chunks(8).map(<f32x8 as Lanes>::load).collect();
        let mut best = f64::INFINITY;
        // The best of short runs, which others on the machine do not interrupt.
        for _ in 0..3000 {
            let start = std::time::Instant::now();
            for x in &numbers {
                std::hint::black_box(of(*x));
            }
            let time = start.elapsed().as_secs_f64() * 1e9;
            best = best.min(time / numbers.len() as f64);
        }
        println!("{name}: {best:.1} ns for eight lanes");
    }
    best("sin_cos_turns", |x| {
        let (sin, cos) = sin_cos_turns(x);
        sin + cos
    });
    best("exp", exp);
    best("ln", ln);
    best("pow", |x| pow(x, f32x8::splat(2.4)));
    best("acos", acos);
    best("atan2", |x| atan2(x, f32x8::splat(0.5)));
}
