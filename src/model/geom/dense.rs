//! Polynomials in x, y, z of degree 4 at most, expanded into monomials, so that rays of one origin
//! can share a Taylor form about it.
//!
//! About a point o, f(o + t d) is Σ tᵏ hₖ(d), with forms hₖ of degree k whose coefficients depend
//! on o alone. Evaluating the forms at d costs a fifth of evaluating f at as many points as its
//! degree requires. A tape keeps f factored, which is shorter above degree 4, and it is exact,
//! whereas the coefficients here are rounded.

mod horner;

use super::tape::{Arithmetic, Tape};
use crate::geom::implicit::magnitude_at;
use crate::math::Aabb;
use crate::math::Vec3;
use crate::math::bounds::UNIT;
use crate::math::int::decoded;
use crate::math::lanes::Lanes;
use num_bigint::{BigInt, Sign};
use std::collections::BTreeMap;

/// The highest degree.
pub const DEGREE: usize = 4;

/// The number of coefficients of a polynomial of that degree.
pub const MOST: usize = 35;

/// A polynomial of degree 2, 3 or 4; the coefficient of xⁱ yʲ zᵏ stands at [`place`].
#[derive(Clone, Debug)]
pub struct Dense {
    degree: usize,
    coefficients: [f64; MOST],
    /// The magnitudes of the coefficients.
    magnitudes: [f64; MOST],
    /// The largest coordinate of an origin about which f is expanded (F8,
    /// docs/numerics/polynomials.md).
    pub near: f64,
    /// Whether the Taylor form pays for a single ray, too, as for rays that begin on the surface.
    pub everywhere: bool,
}

/// A tape of fewer fused steps is evaluated faster than its Taylor form.
const SHORT: usize = 8;

/// A tape of up to so many fused steps is evaluated faster than it is expanded for one ray.
const SHORT_ALONE: usize = 12;

/// The largest distance of an origin relative to the surface's size, for degrees 2, 3 and 4 (F8,
/// docs/numerics/polynomials.md): the magnitude of f on the way is then less than 2¹⁶ = (2·7 + 2)⁴
/// times that on the surface.
const NEAR: [f64; 3] = [127.0, 19.0, 7.0];

/// The largest coordinate of a surface relative to its extent: expanding a tape such as (x − 10⁶)²
/// would cancel.
const ASIDE: f64 = 2.0;

/// The exponents of 2 that bound coefficients and the surface's size, and the largest coordinate
/// and direction of rays: nothing then overflows, and underflow is nothing beside the roundings of
/// magnitudes at [`FLOOR`] (F9, docs/numerics/polynomials.md).
const COEFFICIENTS: i32 = 200;
const SIZES: i32 = 40;
pub const RANGE: f64 = (1_u64 << 60) as f64;

/// The least magnitude of a coordinate that bounds take (F9, docs/numerics/polynomials.md).
pub const FLOOR: f64 = 1.0 / RANGE;

/// The most that the magnitude of the tape may exceed that of its expansion: terms that cancel.
const CANCELLED: f64 = 64.0;

/// Roundings of the magnitude of f at rounded points: n of coordinates, n of terms, and more (F17,
/// docs/numerics/polynomials.md). In units of [`crate::math::bounds::LEAVING`], with which it is
/// multiplied; the product is ten times [`Dense::roundings`] of degree 3.
const BLUR: f64 = 8.0;

impl Dense {
    /// Expands the tape of a surface with these bounds; `None` if that does not pay or is not
    /// accurate.
    pub fn expand(tape: &Tape, bounds: Option<Aabb>) -> Option<Dense> {
        let steps = tape.fused().0.len();
        let (size, extent) = (bounds?.max_abs(), bounds?.extent().max_element());
        let sizes = f64::powi(2.0, -SIZES)..f64::powi(2.0, SIZES);
        let is_about_origin = size <= ASIDE * extent;
        if tape.degree() > DEGREE as u32
            || steps < SHORT
            || !sizes.contains(&size)
            || !is_about_origin
        {
            return None;
        }
        let degree = tape.degree().max(2) as usize;
        let mut dense = Dense {
            degree,
            coefficients: [0.0; MOST],
            magnitudes: [0.0; MOST],
            near: NEAR[degree - 2] * size,
            everywhere: degree < 4 && steps > SHORT_ALONE,
        };
        for ([i, j, k], exact) in tape.evaluate(&Expanding)? {
            let coefficient = exact.rounded()?;
            dense.coefficients[place(degree, [i, j, k])] = coefficient;
            dense.magnitudes[place(degree, [i, j, k])] = coefficient.abs();
        }
        let corner = Vec3::<f64>::splat([size; 3]);
        if magnitude_at(tape, corner) > CANCELLED * dense.magnitude(corner) {
            return None;
        }
        Some(dense)
    }

    /// Returns how many roundings of its magnitude at the far end a Bernstein coefficient of f
    /// along a ray may be off by (F6, docs/numerics/polynomials.md): 2 of a coefficient, 5n of the
    /// expansion, 5n of the forms, 3n of the shift to the beginning, n of the length's powers, n +
    /// 2 of the change of basis.
    pub fn roundings(&self) -> f64 {
        15.0 * self.degree as f64 + 4.0
    }

    /// Returns Σ |a| xⁱ yʲ zᵏ at coordinates' magnitudes.
    #[inline(always)]
    pub fn magnitude<D: Lanes<Scalar = f64>>(&self, size: Vec3<D>) -> D {
        horner::value(self.degree, &|i| D::from_f64(self.magnitudes[i]), size)
    }

    /// Returns [`magnitude`](Self::magnitude) for a known degree N − 1.
    #[inline(always)]
    pub fn magnitude_in<D: Lanes<Scalar = f64>, const N: usize>(&self, size: Vec3<D>) -> D {
        horner::value(N - 1, &|i| D::from_f64(self.magnitudes[i]), size)
    }

    /// Returns f and its gradient.
    #[inline(always)]
    pub fn values_at<D: Lanes<Scalar = f64>>(&self, p: Vec3<D>) -> (D, Vec3<D>) {
        horner::gradient(self.degree, &|i| D::from_f64(self.coefficients[i]), p)
    }

    /// Bounds the error of f at rounded points from which rays are met by this form (F17,
    /// docs/numerics/polynomials.md).
    #[inline(always)]
    pub fn blur_at<D: Lanes<Scalar = f64>>(&self, p: Vec3<D>) -> D {
        let size = p.abs();
        let floor = D::from_f64(FLOOR);
        let size = Vec3::new(size.x.max(floor), size.y.max(floor), size.z.max(floor));
        self.magnitude(size) * D::from_f64(BLUR * UNIT)
    }

    /// Returns the `M` coefficients of f(base + p).
    #[inline(always)]
    pub fn expanded_about<D: Lanes<Scalar = f64>, const M: usize>(&self, base: Vec3<D>) -> [D; M] {
        let mut c = [D::zero(); M];
        for (to, from) in c.iter_mut().zip(&self.coefficients) {
            *to = D::from_f64(*from);
        }
        match M {
            10 => shift(&mut c, base, const { &shifts::<5>(2) }),
            20 => shift(&mut c, base, const { &shifts::<15>(3) }),
            _ => shift(&mut c, base, const { &shifts::<35>(4) }),
        }
        c
    }
}

/// Shifts by repeated synthetic division by x − x₀, then by y − y₀ and z − z₀.
#[inline(always)]
fn shift<D: Lanes, const M: usize, const COUNT: usize>(
    c: &mut [D; M],
    base: Vec3<D>,
    table: &[[(u8, u8); COUNT]; 3],
) {
    for (axis, table) in table.iter().enumerate() {
        let by = base.axis(axis);
        for (to, from) in table {
            let (to, from) = (usize::from(*to), usize::from(*from));
            c[to] = c[to] + by * c[from];
        }
    }
}

/// Returns for each axis which coefficient is added to which.
const fn shifts<const COUNT: usize>(n: usize) -> [[(u8, u8); COUNT]; 3] {
    let mut all = [[(0, 0); COUNT]; 3];
    let mut axis = 0;
    while axis < 3 {
        let (mut at, mut p) = (0, 0);
        while p <= n {
            let mut q = 0;
            while p + q <= n {
                let most = n - p - q;
                let mut round = 0;
                while round < most {
                    let mut power = most;
                    while power > round {
                        power -= 1;
                        let to = place(n, on(axis, power, p, q)) as u8;
                        let from = place(n, on(axis, power + 1, p, q)) as u8;
                        all[axis][at] = (to, from);
                        at += 1;
                    }
                    round += 1;
                }
                q += 1;
            }
            p += 1;
        }
        axis += 1;
    }
    all
}

/// Returns the powers of x, y, z, given the power of an axis and those of the other two.
const fn on(axis: usize, power: usize, p: usize, q: usize) -> [usize; 3] {
    match axis {
        0 => [power, p, q],
        1 => [p, power, q],
        _ => [p, q, power],
    }
}

/// Returns the place of the coefficient of xⁱ yʲ zᵏ in degree n, in the order of [`horner`].
pub const fn place(n: usize, [i, j, k]: [usize; 3]) -> usize {
    let (mut at, mut row) = (k, 0);
    while row < i {
        at += (n - row + 1) * (n - row + 2) / 2;
        row += 1;
    }
    let mut column = 0;
    while column < j {
        at += n - i - column + 1;
        column += 1;
    }
    at
}

/// Evaluates the forms hₖ(d), k = 0 … N − 1, of f about a point, from the coefficients in degree N
/// − 1 ≤ [`DEGREE`].
#[inline(always)]
pub fn taylor_forms<D: Lanes<Scalar = f64>, const N: usize>(
    c: &impl Fn(usize) -> D,
    dir: Vec3<D>,
) -> [D; N] {
    // Larger N are instantiated, too, but never called.
    let order = const { &taylor_order(if N - 1 < DEGREE { N - 1 } else { DEGREE }) };
    let mut powers = [dir.z; N];
    for k in 2..N {
        powers[k] = powers[k - 1] * dir.z;
    }
    let mut all = [c(0); N];
    let mut at = 0;
    let mut next = || {
        at += 1;
        c(usize::from(order[at - 1]))
    };
    for (k, form) in all.iter_mut().enumerate().skip(1) {
        // The factor of xᵏ⁻ᵐ is a form of degree m in y and z.
        *form = next();
        for m in 1..=k {
            let mut inner = next();
            for power in &powers[1..=m] {
                inner = inner * dir.y + next() * *power;
            }
            *form = *form * dir.x + inner;
        }
    }
    all
}

/// Returns the order in which [`taylor_forms`] takes the coefficients.
const fn taylor_order(n: usize) -> [u8; MOST] {
    let mut order = [0; MOST];
    let (mut at, mut k) = (0, 1);
    while k <= n {
        let mut m = 0;
        while m <= k {
            let mut of_z = 0;
            while of_z <= m {
                order[at] = place(n, [k - m, m - of_z, of_z]) as u8;
                at += 1;
                of_z += 1;
            }
            m += 1;
        }
        k += 1;
    }
    order
}

/// The latest expansion about a point that all rays shared.
#[derive(Clone, Debug)]
pub struct Expanded {
    /// The polynomial: its degree, 0 for none, and its coefficients.
    degree: usize,
    of: [f64; MOST],
    base: [f64; 3],
    coefficients: [f64; MOST],
}

impl Default for Expanded {
    fn default() -> Expanded {
        Expanded {
            degree: 0,
            of: [0.0; MOST],
            base: [0.0; 3],
            coefficients: [0.0; MOST],
        }
    }
}

impl Expanded {
    #[inline(always)]
    pub fn coefficients_about(&mut self, dense: &Dense, base: [f64; 3]) -> &[f64; MOST] {
        if self.base != base || self.degree != dense.degree || self.of != dense.coefficients {
            self.renew(dense, base);
        }
        &self.coefficients
    }

    #[inline(never)]
    fn renew(&mut self, dense: &Dense, base: [f64; 3]) {
        (self.degree, self.of, self.base) = (dense.degree, dense.coefficients, base);
        let at = Vec3::<f64>::splat(base);
        match dense.degree {
            2 => self.coefficients[..10].copy_from_slice(&dense.expanded_about::<f64, 10>(at)),
            3 => self.coefficients[..20].copy_from_slice(&dense.expanded_about::<f64, 20>(at)),
            _ => self.coefficients = dense.expanded_about(at),
        }
    }
}

/// The exact number m · 2^power.
#[derive(Clone)]
struct Whole {
    m: BigInt,
    power: i64,
}

/// The most bits of a coefficient during the expansion.
const BITS: u64 = 4096;

impl Whole {
    fn decode(value: f64) -> Whole {
        let (m, power) = decoded(value);
        let m = BigInt::from(m);
        Whole {
            m: if value < 0.0 { -m } else { m },
            power: i64::from(power),
        }
    }

    fn plus(&self, other: &Whole) -> Option<Whole> {
        let power = self.power.min(other.power);
        let up = |x: &Whole| {
            let by = u64::try_from(x.power - power).ok()?;
            (by <= BITS).then(|| &x.m << by)
        };
        Whole {
            m: up(self)? + up(other)?,
            power,
        }
        .kept()
    }

    fn times(&self, other: &Whole) -> Option<Whole> {
        Whole {
            m: &self.m * &other.m,
            power: self.power + other.power,
        }
        .kept()
    }

    fn kept(self) -> Option<Whole> {
        (self.m.bits() <= BITS).then_some(self)
    }

    /// Rounds with an error of little more than half a unit in the last place; `None` if out of
    /// range.
    fn rounded(&self) -> Option<f64> {
        if self.m.sign() == Sign::NoSign {
            return Some(0.0);
        }
        let more = self.m.bits().saturating_sub(62);
        let power = i32::try_from(self.power + more as i64).ok()?;
        let (least, most) = (-COEFFICIENTS - 62, COEFFICIENTS);
        let top = i64::try_from(&self.m >> more).ok()?;
        let value = top as f64 * f64::powi(2.0, power.clamp(least, most));
        let range = f64::powi(2.0, -COEFFICIENTS)..f64::powi(2.0, COEFFICIENTS);
        (power.clamp(least, most) == power && range.contains(&value.abs())).then_some(value)
    }
}

/// Coefficients of xⁱ yʲ zᵏ by i, j and k; `None` if they are too large.
type Expansion = Option<BTreeMap<[usize; 3], Whole>>;

/// Exact expansion of a tape.
struct Expanding;

impl Arithmetic for Expanding {
    type Value = Expansion;

    fn coordinate(&self, axis: usize) -> Expansion {
        let mut powers = [0; 3];
        powers[axis] = 1;
        Some(BTreeMap::from([(powers, Whole::decode(1.0))]))
    }

    fn constant(&self, value: f64) -> Expansion {
        value
            .is_finite()
            .then(|| BTreeMap::from([([0; 3], Whole::decode(value))]))
    }

    fn sum(&self, a: &Expansion, b: &Expansion) -> Expansion {
        let mut sum = a.clone()?;
        for (powers, term) in b.as_ref()? {
            add(&mut sum, *powers, term)?;
        }
        Some(sum)
    }

    fn difference(&self, a: &Expansion, b: &Expansion) -> Expansion {
        let less = self.scaled(b, -1.0);
        self.sum(a, &less)
    }

    fn product(&self, a: &Expansion, b: &Expansion) -> Expansion {
        let mut sum = BTreeMap::new();
        for (p, c) in a.as_ref()? {
            for (q, d) in b.as_ref()? {
                add(&mut sum, [0, 1, 2].map(|k| p[k] + q[k]), &c.times(d)?)?;
            }
        }
        Some(sum)
    }
}

fn add(sum: &mut BTreeMap<[usize; 3], Whole>, powers: [usize; 3], term: &Whole) -> Option<()> {
    let new = match sum.get(&powers) {
        Some(old) => old.plus(term)?,
        None => term.clone(),
    };
    // A coefficient that cancels is removed, because a tape's degree may exceed the polynomial's.
    if new.m.sign() == Sign::NoSign {
        sum.remove(&powers);
    } else {
        sum.insert(powers, new);
    }
    Some(())
}

#[cfg(test)]
mod tests;
