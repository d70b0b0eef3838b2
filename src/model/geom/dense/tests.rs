//! Compares values, gradients and expansions with fractions.

use super::*;
use crate::geom::tape::Builder;
use glam::DVec3;
use num_rational::BigRational;
use proptest::prelude::*;

fn fraction(x: f64) -> BigRational {
    BigRational::from_float(x).expect("a finite number")
}

/// Makes the tape of a polynomial with the given coefficients.
fn tape(n: usize, coefficients: &[f64]) -> Tape {
    let mut b = Builder::default();
    let [x, y, z] = [0, 1, 2].map(|axis| b.coordinate(axis));
    let mut sum = b.constant(0.0);
    for (i, j, k) in powers(n) {
        let factor = b.constant(coefficients[place(n, [i, j, k])]);
        let [x, y, z] = [(x, i), (y, j), (z, k)].map(|(v, power)| b.power(v, power as u32));
        let product = b.product(x, y);
        let product = b.product(product, z);
        let term = b.product(product, factor);
        sum = b.sum(sum, term);
    }
    b.finish(sum)
}

fn powers(n: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    let all = move |i| (0..=n - i).flat_map(move |j| (0..=n - i - j).map(move |k| (i, j, k)));
    (0..=n).flat_map(all)
}

fn dense(n: usize, coefficients: &[f64]) -> Dense {
    let bounds = Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
    Dense::expand(&tape(n, coefficients), Some(bounds)).expect("an ordinary polynomial")
}

/// Evaluates Σ c xⁱ yʲ zᵏ by fractions.
fn exact(n: usize, c: impl Fn([usize; 3]) -> BigRational, p: &[BigRational; 3]) -> BigRational {
    let mut sum = fraction(0.0);
    for (i, j, k) in powers(n) {
        let mut term = c([i, j, k]);
        for (x, power) in p.iter().zip([i, j, k]) {
            for _ in 0..power {
                term *= x;
            }
        }
        sum += term;
    }
    sum
}

#[test]
fn places_are_all_of_them_once() {
    for n in 2..=4 {
        let mut all: Vec<usize> = powers(n).map(|(i, j, k)| place(n, [i, j, k])).collect();
        assert!(all.is_sorted());
        all.dedup();
        assert_eq!(all.len(), [10, 20, 35][n - 2]);
    }
}

#[test]
fn what_does_not_pay_or_leaves_the_range_is_left_to_tapes() {
    let ones = [1.0; MOST];
    let of = |tape: &Tape, size: f64| {
        let bounds = Aabb::new(DVec3::splat(-size), DVec3::splat(size));
        Dense::expand(tape, Some(bounds)).is_some()
    };
    assert!(of(&tape(3, &ones), 1.0));
    assert!(!of(&tape(3, &ones), 1e-13));
    assert!(!of(&tape(3, &ones), 1e13));
    assert!(Dense::expand(&tape(3, &ones), None).is_none());
    let far = DVec3::new(1e6, 0.0, 0.0);
    let aside = Aabb::new(far - 1.0, far + 1.0);
    assert!(Dense::expand(&tape(3, &ones), Some(aside)).is_none());
    let mut large = ones;
    large[3] = 1e61;
    assert!(!of(&tape(3, &large), 1.0));
    let mut small = ones;
    small[3] = 1e-61;
    assert!(!of(&tape(3, &small), 1.0));
    // (x − 10⁶)² − (x − 10⁶)(x − 10⁶ − 1) + …: the squares cancel.
    let mut b = Builder::default();
    let [x, y, z] = [0, 1, 2].map(|axis| b.coordinate(axis));
    let [far, farther] = [1e6, 1e6 + 1.0].map(|c| b.constant(c));
    let [a, c] = [b.difference(x, far), b.difference(x, farther)];
    let [aa, ac] = [b.product(a, a), b.product(a, c)];
    let mut sum = b.difference(aa, ac);
    for v in [y, z] {
        let square = b.product(v, v);
        let cube = b.product(square, v);
        sum = b.sum(sum, cube);
    }
    assert!(!of(&b.finish(sum), 1.0));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn values_gradients_and_expansions_are_those_of_the_polynomial(
        n in 2..5_usize,
        coefficients in prop::collection::vec(-3.0..3.0_f64, MOST),
        p in prop::array::uniform3(-2.0..2.0_f64),
        q in prop::array::uniform3(-2.0..2.0_f64),
    ) {
        let own = dense(n, &coefficients);
        let unit = 0.5 * f64::EPSILON;
        let c = |powers: [usize; 3]| fraction(coefficients[place(n, powers)]);
        let at = p.map(fraction);
        let (value, gradient) = own.values_at::<f64>(Vec3::splat(p));
        let sizes = Vec3::<f64>::splat(p).abs();
        let near = |value: f64, expected: BigRational, size: f64| {
            let bound = fraction(size * unit * own.roundings());
            let error = fraction(value) - expected;
            prop_assert!(error <= bound && -error <= bound, "{value}");
            Ok(())
        };
        near(value, exact(n, c, &at), own.magnitude(sizes))?;
        // The values of magnitudes, and their derivatives.
        let (_, steep) = Dense { coefficients: own.magnitudes, ..own.clone() }.values_at(sizes);
        for axis in 0..3 {
            let by = |mut powers: [usize; 3]| {
                if powers.iter().sum::<usize>() == n {
                    return fraction(0.0);
                }
                powers[axis] += 1;
                c(powers) * fraction(powers[axis] as f64)
            };
            near(gradient.axis(axis), exact(n, by, &at), steep.axis(axis))?;
        }
        // f about p, at q.
        let mut expanded = Expanded::default();
        let expanded = expanded.coefficients_about(&own, p);
        let moved = horner::value(n, &|i| expanded[i], Vec3::<f64>::splat(q));
        let there = [0, 1, 2].map(|k| fraction(p[k]) + fraction(q[k]));
        let size = sizes + Vec3::<f64>::splat(q).abs();
        near(moved, exact(n, c, &there), own.magnitude(size))?;
        // The same by Taylor forms.
        let sum = match n {
            2 => taylor_forms::<f64, 3>(&|i| expanded[i], Vec3::splat(q)).iter().sum(),
            3 => taylor_forms::<f64, 4>(&|i| expanded[i], Vec3::splat(q)).iter().sum(),
            _ => taylor_forms::<f64, 5>(&|i| expanded[i], Vec3::splat(q)).iter().sum::<f64>(),
        };
        near(sum, exact(n, c, &there), own.magnitude(size))?;
    }
}
