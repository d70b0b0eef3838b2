//! A triangle in exact arithmetic, for what f64 cannot settle.
//!
//! The object ray and the vertices are dyadic numbers (an integer times a power
//! of two), and Möller and Trumbore's determinants only add and multiply, so
//! integers of any length hold them exactly. A shared edge has opposite signs in
//! its two neighbours: a ray through it meets one of them at least.

use super::approx::Approx;
use num_bigint::{BigInt, Sign};
use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

/// `integer` · 2^`power`.
#[derive(Clone, Debug)]
pub struct Dyadic {
    integer: BigInt,
    power: i64,
}

/// t as a fraction; the denominator is positive.
#[derive(Clone, Debug)]
pub struct Fraction {
    top: Dyadic,
    bottom: Dyadic,
}

type Vector = [Dyadic; 3];

/// Where the ray (its whole line) meets the triangle. Edges belong to it; seen
/// exactly edge-on it is not met. All numbers finite.
pub fn triangle(org: [f64; 3], dir: [f64; 3], corners: [[f64; 3]; 3]) -> Option<Fraction> {
    let [a, b, c] = corners.map(vector);
    let (org, dir) = (vector(org), vector(dir));
    let (ab, ac, s) = (minus(&b, &a), minus(&c, &a), minus(&org, &a));
    let p = cross(&dir, &ac);
    let det = dot(&ab, &p);
    let q = cross(&s, &ab);
    let (u, v) = (dot(&s, &p), dot(&dir, &q));
    let w = &(&det - &u) - &v;
    let top = dot(&ac, &q);
    let sign = det.sign();
    if sign == Sign::NoSign {
        return None;
    }
    let inside = [u, v, w]
        .iter()
        .all(|x| x.sign() == sign || x.sign() == Sign::NoSign);
    let (top, bottom) = match sign {
        Sign::Minus => (-top, -det),
        _ => (top, det),
    };
    inside.then_some(Fraction { top, bottom })
}

impl Fraction {
    pub fn compare(&self, other: &Fraction) -> Ordering {
        (&(&self.top * &other.bottom) - &(&other.top * &self.bottom)).order()
    }

    /// Infinity is above all; NaN too.
    pub fn compare_number(&self, x: f64) -> Ordering {
        if !x.is_finite() {
            return if x < 0.0 {
                Ordering::Greater
            } else {
                Ordering::Less
            };
        }
        (&self.top - &(&Dyadic::from(x) * &self.bottom)).order()
    }

    pub fn approx(&self) -> Approx {
        // Enough bits of the quotient for f64, truncated.
        let (top, bottom) = (&self.top.integer, &self.bottom.integer);
        let shift = 66 + bottom.bits() as i64 - top.bits() as i64;
        let quotient = if shift >= 0 {
            (top << shift) / bottom
        } else {
            top / (bottom << -shift)
        };
        let magnitude = quotient
            .iter_u64_digits()
            .rev()
            .fold(0.0, |sum, digit| sum * 2.0_f64.powi(64) + digit as f64);
        let power = self.top.power - self.bottom.power - shift;
        let power = power.clamp(-5000, 5000) as i32;
        let value = libm::scalbn(magnitude, power);
        Approx {
            value: match quotient.sign() {
                Sign::Minus => -value,
                _ => value,
            },
            error: value * 4.0 * f64::EPSILON + f64::MIN_POSITIVE,
        }
    }
}

impl Dyadic {
    /// The integer with a power no higher than its own.
    fn at_power(&self, power: i64) -> BigInt {
        &self.integer << (self.power - power)
    }

    fn sign(&self) -> Sign {
        self.integer.sign()
    }

    fn order(&self) -> Ordering {
        match self.sign() {
            Sign::Minus => Ordering::Less,
            Sign::NoSign => Ordering::Equal,
            Sign::Plus => Ordering::Greater,
        }
    }
}

/// Of a finite number.
impl From<f64> for Dyadic {
    fn from(x: f64) -> Dyadic {
        let bits = x.to_bits();
        let exponent = (bits >> 52 & 0x7ff) as i64;
        let fraction = bits & ((1 << 52) - 1);
        // Subnormals have no hidden bit, and the exponent of the least normal.
        let magnitude = if exponent == 0 {
            fraction
        } else {
            fraction | 1 << 52
        };
        let integer = BigInt::from(magnitude);
        Dyadic {
            integer: if x < 0.0 { -integer } else { integer },
            power: exponent.max(1) - 1075,
        }
    }
}

impl Add for &Dyadic {
    type Output = Dyadic;
    fn add(self, o: &Dyadic) -> Dyadic {
        let power = self.power.min(o.power);
        Dyadic {
            integer: self.at_power(power) + o.at_power(power),
            power,
        }
    }
}

impl Neg for Dyadic {
    type Output = Dyadic;
    fn neg(self) -> Dyadic {
        Dyadic {
            integer: -self.integer,
            power: self.power,
        }
    }
}

impl Sub for &Dyadic {
    type Output = Dyadic;
    fn sub(self, o: &Dyadic) -> Dyadic {
        self + &-o.clone()
    }
}

impl Mul for &Dyadic {
    type Output = Dyadic;
    fn mul(self, o: &Dyadic) -> Dyadic {
        Dyadic {
            integer: &self.integer * &o.integer,
            power: self.power + o.power,
        }
    }
}

fn vector(v: [f64; 3]) -> Vector {
    v.map(Dyadic::from)
}

fn minus(a: &Vector, b: &Vector) -> Vector {
    std::array::from_fn(|k| &a[k] - &b[k])
}

fn dot(a: &Vector, b: &Vector) -> Dyadic {
    &(&(&a[0] * &b[0]) + &(&a[1] * &b[1])) + &(&a[2] * &b[2])
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        &(&a[i] * &b[j]) - &(&a[j] * &b[i])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Numbers of all sizes, with many bits or few.
    fn number() -> impl Strategy<Value = f64> {
        (-1.0..1.0_f64, -40..40_i32, any::<bool>()).prop_map(|(x, power, short)| {
            let x = if short { f64::from(x as f32) } else { x };
            x * 2.0_f64.powi(power)
        })
    }

    fn encloses(a: Approx, exact: &Dyadic) -> bool {
        let above = &Dyadic::from(a.value) + &Dyadic::from(a.error);
        let below = &Dyadic::from(a.value) - &Dyadic::from(a.error);
        (&above - exact).order().is_ge() && (exact - &below).order().is_ge()
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            failure_persistence: None,
            ..ProptestConfig::with_cases(20_000)
        })]

        /// The error bounds hold, and the bounds of the enclosure too.
        #[test]
        fn errors_are_bounds(a in number(), b in number(), c in number(), d in number()) {
            let [x, y, z, w] = [a, b, c, d].map(Approx::exact);
            let approx = (x * y - z * w) * (x + z) - w;
            let [x, y, z, w] = [a, b, c, d].map(Dyadic::from);
            let exact = &(&(&(&x * &y) - &(&z * &w)) * &(&x + &z)) - &w;
            prop_assert!(encloses(approx, &exact), "{approx:?}");
            prop_assert!((&exact - &Dyadic::from(approx.lo())).order().is_ge());
            prop_assert!((&Dyadic::from(approx.hi()) - &exact).order().is_ge());
            // A quotient, multiplied out again; a root, squared.
            let q = approx / Approx::exact(b);
            if q.error.is_finite() {
                let (lo, hi) = (&Dyadic::from(q.lo()) * &y, &Dyadic::from(q.hi()) * &y);
                let (lo, hi) = if b > 0.0 { (lo, hi) } else { (hi, lo) };
                prop_assert!((&exact - &lo).order().is_ge() && (&hi - &exact).order().is_ge());
            }
            let root = approx.sqrt();
            let square = |x: f64| &Dyadic::from(x) * &Dyadic::from(x);
            if exact.order().is_gt() {
                prop_assert!((&square(root.hi()) - &exact).order().is_ge());
                prop_assert!((&exact - &square(root.lo().max(0.0))).order().is_ge());
            }
        }

        #[test]
        fn fractions_become_numbers(a in number(), b in number()) {
            prop_assume!(b != 0.0);
            let sign = b.signum();
            let f = Fraction { top: Dyadic::from(a * sign), bottom: Dyadic::from(b * sign) };
            let t = f.approx();
            prop_assert!((t.value - a / b).abs() <= t.error + (a / b).abs() * 1e-16);
            prop_assert!(f.compare_number(t.lo()).is_ge() && f.compare_number(t.hi()).is_le());
        }
    }
}
