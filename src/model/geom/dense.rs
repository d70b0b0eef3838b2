//! Polynomials in x, y, z of degree 4 at most, multiplied out: what rays that begin at one
//! point have in common, they then have as numbers.
//!
//! About a point o, f(o + t d) is Σ tᵏ hₖ(d), with forms hₖ of degree k whose coefficients
//! depend on o alone. Taking forms at d costs a fifth of what f costs at as many points as
//! its degree asks for. A tape keeps f factored, which is shorter above degree 4, and
//! the only way that is exact: coefficients here are rounded.

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
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// The highest one.
pub const DEGREE: usize = 4;

/// Coefficients of that degree.
pub const MOST: usize = 35;

/// A polynomial of degree 2, 3 or 4, that of xⁱ yʲ zᵏ at [`place`].
#[derive(Clone, Debug)]
pub struct Dense {
    degree: usize,
    coefficients: [f64; MOST],
    /// Without signs.
    magnitudes: [f64; MOST],
    /// Origins are expanded about whose coordinates are no larger.
    pub near: f64,
    /// Rays that begin on the surface, too, had better be met by this.
    pub everywhere: bool,
    /// Of no other polynomial.
    number: u64,
}

/// Fewer steps than these are taken sooner than forms.
const SHORT: usize = 8;

/// Up to so many steps a tape is taken sooner than an expansion that only one ray needs.
const SHORT_ALONE: usize = 12;

/// Origins are no farther than so many times the surface's size, in degree 2, 3 and 4: f's
/// magnitude on the way is then less than 2^16 times what it is on the surface, (2·7 + 2)⁴.
const NEAR: [f64; 3] = [127.0, 19.0, 7.0];

/// Surfaces lie no farther from the coordinates' origin than this many times their extent:
/// a tape like (x − 10⁶)² loses nothing of what is multiplied out.
const ASIDE: f64 = 2.0;

/// Powers of 2 between which coefficients lie, and the surface's size, and what rays are
/// met with by this: nothing then leaves f64, and what underflows is nothing beside the
/// roundings of magnitudes at [`FLOOR`].
const COEFFICIENTS: i32 = 200;
const SIZES: i32 = 40;
pub const RANGE: f64 = (1_u64 << 60) as f64;

/// No coordinate's magnitude is taken for less.
pub const FLOOR: f64 = 1.0 / RANGE;

/// Terms that cancel when a tape is multiplied out may be so many times as large as those
/// that are left.
const CANCELLED: f64 = 64.0;

/// Roundings of f's magnitude at points that are rounded themselves: n of coordinates and
/// as many of terms, and more. Times [`crate::math::bounds::LEAVING`], which it is a unit
/// of, that is ten times [`Dense::roundings`] of degree 3.
const BLUR: f64 = 8.0;

impl Dense {
    /// Of surfaces for which it is known to pay. `bounds`: of the surface.
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
            number: 0,
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
        static NUMBERS: AtomicU64 = AtomicU64::new(1);
        dense.number = NUMBERS.fetch_add(1, Relaxed);
        Some(dense)
    }

    /// How many roundings of its magnitude at the far end a Bernstein coefficient of
    /// f along a ray may be off by: 2 of a coefficient, 5n of an expansion, 5n of forms, 3n
    /// of the way to where the ray comes in, n of the length's powers, n + 2 of the change
    /// of basis.
    pub fn roundings(&self) -> f64 {
        15.0 * self.degree as f64 + 4.0
    }

    /// Σ |a| xⁱ yʲ zᵏ, of magnitudes.
    #[inline(always)]
    pub fn magnitude<D: Lanes<Scalar = f64>>(&self, size: Vec3<D>) -> D {
        horner::value(self.degree, &|i| D::from_f64(self.magnitudes[i]), size)
    }

    /// The same of degree N − 1, which is known.
    #[inline(always)]
    pub fn magnitude_in<D: Lanes<Scalar = f64>, const N: usize>(&self, size: Vec3<D>) -> D {
        horner::value(N - 1, &|i| D::from_f64(self.magnitudes[i]), size)
    }

    /// f and its gradient.
    #[inline(always)]
    pub fn values_at<D: Lanes<Scalar = f64>>(&self, p: Vec3<D>) -> (D, Vec3<D>) {
        horner::gradient(self.degree, &|i| D::from_f64(self.coefficients[i]), p)
    }

    /// What f may be off by at points that are rounded themselves, if rays that begin there
    /// are met by this.
    #[inline(always)]
    pub fn blur_at<D: Lanes<Scalar = f64>>(&self, p: Vec3<D>) -> D {
        let size = p.abs();
        let floor = D::from_f64(FLOOR);
        let size = Vec3::new(size.x.max(floor), size.y.max(floor), size.z.max(floor));
        self.magnitude(size) * D::from_f64(BLUR * UNIT)
    }

    /// The coefficients of f(base + p), of which there are `M`.
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

/// By repeated division by x − x₀, and then by y − y₀ and z − z₀.
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

/// Of each axis, which coefficient is added to which.
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

/// Powers of x, y, z: one of an axis, and those of the others.
const fn on(axis: usize, power: usize, p: usize, q: usize) -> [usize; 3] {
    match axis {
        0 => [power, p, q],
        1 => [p, power, q],
        _ => [p, q, power],
    }
}

/// Where the coefficient of xⁱ yʲ zᵏ is, in degree n: as [`horner`] takes them.
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

/// hₖ(d), k = 0 … N − 1, of f about a point: coefficients in degree N − 1, which is no more
/// than [`DEGREE`].
#[inline(always)]
pub fn taylor_forms<D: Lanes<Scalar = f64>, const N: usize>(
    c: &impl Fn(usize) -> D,
    dir: Vec3<D>,
) -> [D; N] {
    // What is larger is built, too, and never asked.
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
        // Of xᵏ⁻ᵐ a form of degree m in y and z.
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

/// The order in which forms take coefficients.
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

/// The last expansion about a point that all rays had in common.
#[derive(Clone, Debug)]
pub struct Expanded {
    number: u64,
    base: [f64; 3],
    coefficients: [f64; MOST],
}

impl Default for Expanded {
    fn default() -> Expanded {
        Expanded {
            number: 0,
            base: [0.0; 3],
            coefficients: [0.0; MOST],
        }
    }
}

impl Expanded {
    #[inline(always)]
    pub fn coefficients_about(&mut self, dense: &Dense, base: [f64; 3]) -> &[f64; MOST] {
        if self.number != dense.number || self.base != base {
            self.renew(dense, base);
        }
        &self.coefficients
    }

    #[inline(never)]
    fn renew(&mut self, dense: &Dense, base: [f64; 3]) {
        (self.number, self.base) = (dense.number, base);
        let at = Vec3::<f64>::splat(base);
        match dense.degree {
            2 => self.coefficients[..10].copy_from_slice(&dense.expanded_about::<f64, 10>(at)),
            3 => self.coefficients[..20].copy_from_slice(&dense.expanded_about::<f64, 20>(at)),
            _ => self.coefficients = dense.expanded_about(at),
        }
    }
}

/// m · 2^power.
#[derive(Clone)]
struct Whole {
    m: BigInt,
    power: i64,
}

/// Bits that a coefficient may have on the way.
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

    /// To a little more than half a unit in the last place. `None`: out of range.
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

/// Of xⁱ yʲ zᵏ by i, j and k. `None`: too large.
type Expansion = Option<BTreeMap<[usize; 3], Whole>>;

/// Multiplies out, exactly.
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
    // What cancels is no term: degrees of a tape may be more than the polynomial's.
    if new.m.sign() == Sign::NoSign {
        sum.remove(&powers);
    } else {
        sum.insert(powers, new);
    }
    Some(())
}

#[cfg(test)]
mod tests;
