//! Bounds of Bernstein coefficients against fractions.

use super::*;
use crate::geom::Tape;
use crate::geom::tape::{Arithmetic, Builder};
use crate::math::Aabb;
use glam::DVec3;
use num_rational::BigRational;
use proptest::prelude::*;

fn fraction(x: f64) -> BigRational {
    BigRational::from_float(x).expect("a finite number")
}

/// Polynomials in s: coordinates are o + (start + s·width)·d.
struct Line {
    at: [BigRational; 3],
    by: [BigRational; 3],
}

impl Arithmetic for Line {
    type Value = Vec<BigRational>;

    fn coordinate(&self, axis: usize) -> Self::Value {
        vec![self.at[axis].clone(), self.by[axis].clone()]
    }

    fn constant(&self, value: f64) -> Self::Value {
        vec![fraction(value)]
    }

    fn sum(&self, a: &Self::Value, b: &Self::Value) -> Self::Value {
        let term = |of: &Self::Value, i| of.get(i).cloned().unwrap_or_else(|| fraction(0.0));
        let most = a.len().max(b.len());
        (0..most).map(|i| term(a, i) + term(b, i)).collect()
    }

    fn difference(&self, a: &Self::Value, b: &Self::Value) -> Self::Value {
        self.sum(a, &self.product(b, &vec![fraction(-1.0)]))
    }

    fn product(&self, a: &Self::Value, b: &Self::Value) -> Self::Value {
        let mut product = vec![fraction(0.0); a.len() + b.len() - 1];
        for (i, a) in a.iter().enumerate() {
            for (j, b) in b.iter().enumerate() {
                product[i + j] += a * b;
            }
        }
        product
    }
}

/// A sum of products of sums: (a x + b y + c z + d)ⁿ, and a few other terms.
fn tape(n: u32, c: &[f64]) -> Tape {
    let mut b = Builder::default();
    let axes = [0, 1, 2].map(|axis| b.coordinate(axis));
    let mut sum = b.constant(c[0]);
    for some in c[1..].chunks_exact(4) {
        let mut form = b.constant(some[3]);
        for (axis, factor) in axes.iter().zip(some) {
            let factor = b.constant(*factor);
            let term = b.product(factor, *axis);
            form = b.sum(form, term);
        }
        let power = b.power(form, n);
        sum = b.sum(sum, power);
    }
    b.finish(sum)
}

fn binomial(n: usize, k: usize) -> f64 {
    (0..k).fold(1.0, |c, i| c * (n - i) as f64 / (i + 1) as f64)
}

fn check<const N: usize>(
    tape: &Tape,
    scale: f64,
    (org, dir, [t_min, start, width]): ([f64; 3], [f64; 3], [f64; 3]),
) -> Result<(), TestCaseError> {
    // A ray that leaves its surface's region before it enters is asked about nowhere.
    if width < 0.0 {
        return Ok(());
    }
    let n = N - 1;
    let bounds = Aabb::new(DVec3::splat(-scale), DVec3::splat(scale));
    let Some(dense) = Dense::expand(tape, Some(bounds)) else {
        return Ok(());
    };
    let rays = Rays {
        org: Vec3::<f64>::splat(org),
        dir: Vec3::splat(dir),
        t_min,
        limit: start + width,
    };
    let lane = <f64 as Lanes>::Mask::splat(true);
    let part = (start, width);
    let formed = expanded::<f64, N>(&dense, &rays, part, lane, &mut Expanded::default());
    let Some((segment, known)) = formed else {
        return Ok(());
    };
    // Others are in doubt.
    let is_sound = segment.scaled.iter().all(|d| d.is_finite()) && segment.error.is_finite();
    if !known.any() || !is_sound {
        return Ok(());
    }
    for x in [org, dir, [0.0, start, width]].as_flattened() {
        prop_assert!(x.is_finite(), "{org:?} {dir:?} {start} {width}");
    }
    let line = Line {
        at: [0, 1, 2].map(|k| fraction(org[k]) + fraction(start) * fraction(dir[k])),
        by: dir.map(|d| fraction(d) * fraction(width)),
    };
    let mut powers = tape.evaluate(&line);
    powers.resize(N, fraction(0.0));
    for j in 0..N {
        let mut exact = fraction(0.0);
        for (i, c) in powers.iter().enumerate().take(j + 1) {
            exact += c * fraction(binomial(j, i)) / fraction(binomial(n, i));
        }
        let b = fraction(segment.scaled[j]) / fraction(binomial(n, j));
        let bound = if j == 0 { segment.first } else { segment.error };
        prop_assert!(bound >= 0.0, "{bound}");
        let (error, bound) = (b - exact, fraction(bound));
        prop_assert!(error <= bound && -error <= bound, "{j}");
    }
    Ok(())
}

/// Numbers that are none, or hardly, among others.
fn odd() -> impl Strategy<Value = f64> {
    let numbers = [
        0.0,
        -0.0,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::MAX,
        f64::MIN_POSITIVE,
        5e-324,
        1e-200,
        1e200,
        1.0,
        -0.75,
        2.5,
    ];
    prop::sample::select(numbers.to_vec())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn coefficients_are_off_by_no_more_than_magnitudes_say(
        n in 2..5_u32,
        c in prop::collection::vec(-3.0..3.0_f64, 1 + 4 * 3),
        scale in -20..20_i32,
        org in prop::array::uniform3(-1.0..1.0_f64),
        dir in prop::array::uniform3(-1.0..1.0_f64),
        far in prop::sample::select(vec![0.5, 1.0, 4.0, 12.0, 1e3, 1e6, 1e12]),
        begins in any::<bool>(),
        at in [0.0..2.0_f64, 0.0..2.0],
    ) {
        let tape = tape(n, &c);
        let scale = f64::powi(2.0, scale);
        let org = org.map(|x| x * scale * far);
        let start = if begins { 0.0 } else { at[0] * scale * far };
        let t_min = if begins { 0.0 } else { start / 2.0 };
        let part = [t_min, start, at[1] * scale];
        match n {
            2 => check::<3>(&tape, scale, (org, dir, part))?,
            3 => check::<4>(&tape, scale, (org, dir, part))?,
            _ => check::<5>(&tape, scale, (org, dir, part))?,
        }
    }
    /// Certain lanes are right; as a rule there are none.
    #[test]
    fn what_is_no_number_is_not_known(
        n in 2..5_u32,
        c in prop::collection::vec(-3.0..3.0_f64, 1 + 4 * 3),
        org in prop::array::uniform3(odd()),
        dir in prop::array::uniform3(odd()),
        part in prop::array::uniform3(odd()),
    ) {
        let tape = tape(n, &c);
        match n {
            2 => check::<3>(&tape, 2.0, (org, dir, part))?,
            3 => check::<4>(&tape, 2.0, (org, dir, part))?,
            _ => check::<5>(&tape, 2.0, (org, dir, part))?,
        }
    }
}
