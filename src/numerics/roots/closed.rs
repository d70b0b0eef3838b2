//! Closed forms to degree 4: the quadratic formula without cancellation (Kahan's
//! discriminant), Cardano and Viète, Ferrari.
//!
//! They are evaluated in f64 with their known errors: where roots are close together,
//! relative errors reach the square, cube or fourth root of the unit roundoff, and counts
//! may be wrong. The refinement polishes and proves the candidates. A root that a formula
//! misses is missing from the answer. Tolerances choose candidates and decide nothing
//! (lemma Z13, docs/numerics/roots.md).

use super::answer::Proof;
use super::certify_candidates::{Candidate, Line};

/// The highest degree with a formula.
pub const MOST: usize = 4;

/// Finds candidates by a formula; the proof is always [`Proof::Open`].
pub fn candidates(line: &Line) -> (Vec<Candidate>, Proof) {
    let mut found = match line.c[..] {
        [c, b] => vec![-c / b],
        [c, b, a] => quadratic(a, b, c),
        [d, c, b, a] => cubic(a, b, c, d),
        [e, d, c, b, a] => quartic(a, b, c, d, e),
        _ => Vec::new(),
    };
    found.retain(|x| x.is_finite());
    let polished = found.iter().map(|x| Candidate::At(polished(&line.c, *x)));
    (polished.collect(), Proof::Open)
}

/// Applies a few steps of Newton's method, as long as they reduce |p|.
fn polished(c: &[f64], start: f64) -> f64 {
    let (mut x, mut size) = (start, f64::INFINITY);
    for _ in 0..6 {
        let (mut y, mut d) = (0.0, 0.0);
        for c in c.iter().rev() {
            d = x * d + y;
            y = x * y + c;
        }
        if y.abs() >= size || d == 0.0 {
            break;
        }
        size = y.abs();
        x -= y / d;
    }
    x
}

/// Returns b² − 4ac, corrected by the rounding errors of both products.
fn discriminant(a: f64, b: f64, c: f64) -> f64 {
    let error = |x: f64, y: f64, product: f64| x.mul_add(y, -product);
    let (p, q) = (b * b, 4.0 * a * c);
    (p - q) + (error(b, b, p) - error(4.0 * a, c, q))
}

fn quadratic(a: f64, b: f64, c: f64) -> Vec<f64> {
    let d = discriminant(a, b, c);
    // A tangent that rounding has lifted off the axis remains a candidate. Lemma Z13,
    // docs/numerics/roots.md.
    let touches = d.abs() <= 8.0 * f64::EPSILON * (b * b);
    if a == 0.0 {
        return vec![-c / b];
    }
    if d < 0.0 {
        return if touches {
            vec![-b / (2.0 * a)]
        } else {
            Vec::new()
        };
    }
    let q = -0.5 * (b + d.sqrt().copysign(b));
    if q == 0.0 {
        return vec![0.0];
    }
    vec![q / a, c / q]
}

fn cubic(a: f64, b: f64, c: f64, d: f64) -> Vec<f64> {
    // x = y − b/3a: y³ + 3 p y + 2 q.
    let (b, c, d) = (b / a, c / a, d / a);
    let shift = b / 3.0;
    let p = c / 3.0 - shift * shift;
    let q = shift * shift * shift - 0.5 * shift * c + 0.5 * d;
    let delta = q * q + p * p * p;
    // Lemma Z13, docs/numerics/roots.md.
    let noise = 64.0 * f64::EPSILON * (q * q).max(p.abs() * p * p);
    if delta > noise {
        // One real root, from the cube root that does not cancel.
        let u = -libm::cbrt(q + delta.sqrt().copysign(q));
        let y = if u == 0.0 { 0.0 } else { u - p / u };
        return vec![y - shift];
    }
    let r = (-p).max(0.0).sqrt();
    if r == 0.0 {
        return vec![-shift];
    }
    let third = libm::acos((-q / (r * r * r)).clamp(-1.0, 1.0)) / 3.0;
    let turn = 2.0 * std::f64::consts::FRAC_PI_3;
    (0..3)
        .map(|i| 2.0 * r * libm::cos(third + turn * f64::from(i)) - shift)
        .collect()
}

fn quartic(a: f64, b: f64, c: f64, d: f64, e: f64) -> Vec<f64> {
    // x = y − b/4a: y⁴ + p y² + q y + r.
    let (b, c, d, e) = (b / a, c / a, d / a, e / a);
    let h = 0.25 * b;
    let p = c - 6.0 * h * h;
    let q = d - 2.0 * c * h + 8.0 * h * h * h;
    let r = e - d * h + c * h * h - 3.0 * h * h * h * h;
    let scale = p.abs() + q.abs() + r.abs();
    // Lemma Z13, docs/numerics/roots.md.
    if q.abs() <= 4.0 * f64::EPSILON * (d.abs() + (c * h).abs() + scale) {
        // Biquadratic: solve in y². A y² that rounding has made slightly negative counts
        // as 0.
        let roots = quadratic(1.0, p, r).into_iter();
        let floor = -64.0 * f64::EPSILON * scale;
        let both = roots.filter(|z| *z >= floor).flat_map(|z| {
            let y = z.max(0.0).sqrt();
            [y - h, -y - h]
        });
        return both.collect();
    }
    // 2m is the square of a coefficient of Ferrari's factors:
    // 8 m³ + 8 p m² + (2 p² − 8 r) m − q² = 0.
    let resolvent = cubic(8.0, 8.0 * p, 2.0 * p * p - 8.0 * r, -q * q);
    let m = resolvent.into_iter().fold(0.0, f64::max);
    if m <= 0.0 {
        return Vec::new();
    }
    let w = (2.0 * m).sqrt();
    let mut roots = Vec::new();
    for w in [w, -w] {
        // y² + w y + (p/2 + m − q / 2w).
        let both = quadratic(1.0, w, 0.5 * p + m - 0.5 * q / w);
        roots.extend(both.into_iter().map(|y| y - h));
    }
    roots
}
